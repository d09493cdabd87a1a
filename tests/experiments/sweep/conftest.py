"""What the tests of sweeps share: a sweep of short runs, and an executor in this process."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from experiments.sweep.executors import Executor, Finished
from experiments.sweep.run import Done, run_sweep
from experiments.sweep.settings import read_sweep
from experiments.sweep.task import Task, perform

SWEEP = """
description: for a test
scenario: straight_erri_low
set:
  duration: 1.5
  start: 60
  output_rate: 256
  track_measured: false
  vehicle: class175
  sensors:
    - {kind: accelerometer, name: bogie, body: bogie, axes: [z], rate: 256, errors: industrial}
    - {kind: gyro, name: bogie, body: bogie, axes: [pitch], rate: 256, errors: industrial}
    - {kind: tachometer, name: wheelset1, body: wheelset1, rate: 64}
design:
  kind: grid
  keys:
    speed.speed: [25, 30, 35]
    vehicle.body_mass: [14000, 16000]
    estimators.plain.window: [0.8, 1.0]
estimators: [{name: speed_plain, label: plain, slowest: 20}]
seeds: [3, 1]
sensors:
  both: [bogie.*]
  all: ["*"]
  gyro: [bogie.rate_pitch]
"""
POINTS, RUNS, SETS, SEEDS = 12, 6, 3, 2

Sweeping = Callable[..., Done]


class Here:
    """Performs tasks in this process."""

    workers = 1

    def __init__(self, scratch: Path, keep_truth: bool = False) -> None:
        self._scratch, self._keep = scratch, keep_truth
        self.performed: list[int] = []

    def run(self, tasks: Sequence[Task]) -> Iterator[Finished]:
        """One after the other, the last first, to show that the order does not matter."""
        for task in reversed(tasks):
            self.performed.append(task.number)
            yield task, perform(task, str(self._scratch), self._keep)

    def close(self) -> None:
        """Nothing to let go of."""


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache of runs for this session."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def sweep_file(tmp_path: Path) -> Path:
    """The sweep as a file."""
    path = tmp_path / "mine.yaml"
    path.write_text(SWEEP)
    return path


@pytest.fixture
def sweeping(cache: Path, monkeypatch: pytest.MonkeyPatch) -> Sweeping:
    """Run a sweep's file into a folder with an executor (this process where none is given)."""
    monkeypatch.setenv("RAILSIM_CACHE", str(cache))

    def call(path: Path, folder: Path, executor: Callable[[Path], Executor] = Here) -> Done:
        return run_sweep(read_sweep(path), folder, executor)

    return call


@pytest.fixture(scope="session")
def whole(cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the sweep, run without interruption in this process; not to be changed."""
    folder = tmp_path_factory.mktemp("sweeps")
    path = folder / "mine.yaml"
    path.write_text(SWEEP)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(cache))
        run_sweep(read_sweep(path), folder / "out", Here)
    return folder / "out"
