"""Sweeps from end to end: resumed, on processes, on a cluster, with failures: the table is the same byte for byte."""

import errno
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock, Mock

import pytest

from experiments.scoring.speed import SpeedScorer
from experiments.sweep.executors import Cluster, Local, check_address
from experiments.sweep.report import write_report
from experiments.sweep.run import Interrupted
from experiments.sweep.store import TABLE
from experiments.sweep.table import read_table
from experiments.sweep.task import FAILED, OK, UNFIT
from railsim.errors import InputError, Noticed
from tests.experiments.conftest import ROOT
from tests.experiments.sweep.conftest import POINTS, RUNS, SEEDS, SETS, SWEEP, Here, Sweeping


def table_of(folder: Path) -> Any:
    """The table as a frame."""
    return read_table(folder / TABLE)


def same(folder: Path, other: Path) -> bool:
    return (folder / TABLE).read_bytes() == (other / TABLE).read_bytes()


def test_table_has_a_row_a_run_estimator_seed_and_score(whole: Path):
    frame = table_of(whole)
    assert list(frame.columns) == [
        "point", "run", "speed.speed", "vehicle.body_mass", "estimators.plain.window", "sensors", "estimator", "seed",
        "recording", "score", "unit", "value", "status", "message",
    ]  # fmt: skip
    keys = ["point", "sensors", "seed", "score", "unit"]
    assert not frame.duplicated(keys).any()
    assert len(frame.drop_duplicates(keys[:3])) == POINTS * SETS * SEEDS
    assert frame["point"].is_monotonic_increasing
    assert list(dict.fromkeys(frame["seed"])) == [3, 1]
    assert frame["run"].nunique() == RUNS
    errors = frame[(frame["score"] == "rms error") & (frame["unit"] == "km/h")]
    assert (errors["value"] > 0).all()
    both, everything = (errors[errors["sensors"] == name]["value"].to_numpy() for name in ("both", "all"))
    assert (both == everything).all(), "a sensor that is not used changes what another measures"
    assert errors["recording"].nunique() == 2 * RUNS * SEEDS
    unfit = frame[frame["sensors"] == "gyro"]
    assert set(unfit["status"]) == {UNFIT}
    assert set(unfit["message"]) == {
        "speed_plain needs channel 'bogie.acceleration_z [m/s2]'; add that sensor to the recording"
    }


def test_estimate_that_nothing_scores_is_a_row_that_is_ok_with_a_note(
    sweep_file: Path, tmp_path: Path, sweeping: Sweeping, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(SpeedScorer, "columns", ())
    sweeping(sweep_file, tmp_path / "out")
    frame = table_of(tmp_path / "out")
    rows = frame[frame["sensors"] == "all"]
    assert set(rows["status"]) == {OK}
    assert rows["score"].isna().all()
    assert rows["recording"].notna().all()
    assert all(message.startswith("nothing scores column 'speed [m/s]'") for message in rows["message"])
    assert "nothing scores column" in write_report(tmp_path / "out").read_text()


def test_nothing_of_the_truth_is_left(whole: Path, cache: Path):
    assert not (whole / "running").exists()
    assert [path for path in cache.iterdir() if path.is_dir()] == []


def test_two_processes_give_the_same_table(sweep_file: Path, tmp_path: Path, sweeping: Sweeping, whole: Path):
    done = sweeping(sweep_file, tmp_path / "out", lambda scratch: Local(2, scratch, False))
    assert done.performed == RUNS
    assert same(tmp_path / "out", whole)


def test_sweep_killed_three_times_goes_on_to_the_same_table(
    sweep_file: Path, tmp_path: Path, sweeping: Sweeping, whole: Path
):
    out, tasks = tmp_path / "out", tmp_path / "out" / "tasks"
    words = [sys.executable, "-m", "experiments.cli", "sweep", str(sweep_file), "--out", str(out), "--jobs", "1"]
    kept = 0
    for _ in range(3):
        child = subprocess.Popen(words, env={**os.environ, "PYTHONPATH": str(ROOT)}, stderr=subprocess.DEVNULL)
        wait_for(lambda child=child, kept=kept: len(list(tasks.glob("*.json"))) > kept or child.poll() is not None)
        child.send_signal(signal.SIGKILL)
        child.wait()
        assert not (out / TABLE).exists()
        time.sleep(1.5)  # its worker notices that the parent is gone
        assert kept < len(list(tasks.glob("*.json"))) < RUNS
        kept = len(list(tasks.glob("*.json")))
    (tasks / "000000.json").write_bytes(
        (tasks / "000000.json").read_bytes()[:50]
    )  # as a crash of the machine leaves it
    done = sweeping(sweep_file, out)
    assert done.performed == RUNS - kept + 1
    assert same(out, whole)
    assert sweeping(sweep_file, out).performed == 0


def test_cluster_gives_the_same_table_and_survives_the_loss_of_a_worker(
    sweep_file: Path, tmp_path: Path, sweeping: Sweeping, whole: Path, monkeypatch: pytest.MonkeyPatch
):
    pytest.importorskip("distributed")
    monkeypatch.setattr("experiments.sweep.executors.ANSWER", 60.0)  # the machine that tests may be busy
    out = tmp_path / "out"
    with cluster() as (address, processes):

        def kill() -> None:
            wait_for(lambda: any((out / "tasks").glob("*.json")))
            processes[0].kill()

        killer = threading.Thread(target=kill)
        killer.start()
        done = sweeping(sweep_file, out, lambda _: Cluster(address, False))
        killer.join()
    assert processes[0].poll() is not None
    assert done.performed == RUNS
    assert same(out, whole)


def test_scheduler_that_does_not_answer_or_has_no_workers(monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("experiments.sweep.executors.ANSWER", 0.5)
    with pytest.raises(InputError, match="no Dask scheduler answers at '127.0.0.1:9'"):
        Cluster("127.0.0.1:9", False)


@pytest.mark.parametrize(
    ("address", "line"),
    [
        ("", "give the scheduler as HOST:PORT"),
        ("nonsense", "give the scheduler as HOST:PORT"),
        ("127.0.0.1:99999", "give the scheduler as HOST:PORT"),
        ("http://127.0.0.1:8786", "give the scheduler as HOST:PORT"),
        ("host name:1", "no Dask scheduler answers"),
        ("127.0.0.1:9", "Connection refused"),
    ],
)
def test_an_address_of_no_scheduler_is_refused_at_once(address: str, line: str):
    began = time.monotonic()
    with pytest.raises(InputError, match=line):
        check_address(address, "start one")
    assert time.monotonic() - began < 5.0


def test_a_cluster_that_anybody_can_use_is_said(monkeypatch: pytest.MonkeyPatch):
    line = MagicMock()
    line.__enter__.return_value.getpeername.return_value = ("192.0.2.1", 8786)
    monkeypatch.setattr("experiments.sweep.executors.socket.create_connection", lambda *_: line)
    with pytest.warns(Noticed, match="is not protected"):
        check_address("tcp://far:8786", "start one")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_address("tls://far:8786", "start one")


@pytest.mark.parametrize(
    ("kind", "arguments"),
    [
        ("comm.CommClosedError", ("gone",)),
        ("client.FutureCancelledError", ("k", "gone")),
        ("KilledWorker", ("k", Mock(), 3)),
    ],
)
def test_lost_cluster_is_said_in_one_line(kind: str, arguments: tuple[Any, ...], monkeypatch: pytest.MonkeyPatch):
    distributed = pytest.importorskip("distributed")
    lost = Cluster.__new__(Cluster)
    lost._distributed, lost._client, lost.workers, lost._keep = distributed, Mock(), 1, False
    lost._client.submit.side_effect = attrgetter(kind)(distributed)(*arguments)
    monkeypatch.setattr(distributed, "as_completed", lambda **_: Mock())
    with pytest.raises(InputError, match="what is finished is kept: run again"):
        list(lost.run([Mock()]))


def test_failures_become_rows_and_the_rest_goes_on(sweep_file: Path, tmp_path: Path, sweeping: Sweeping):
    text = (
        SWEEP.replace("[25, 30, 35]", "[25, 999]")
        .replace("[0.8, 1.0]", "[0.25, 1.0]")
        .replace("slowest: 20", "slowest: 10")
    )
    sweep_file.write_text(text)
    sweeping(sweep_file, tmp_path / "out")
    frame = table_of(tmp_path / "out")
    bad = frame[frame["speed.speed"] == 999]
    assert set(bad["status"]) == {FAILED}
    assert len(bad) == 4 * SETS * SEEDS
    assert bad["message"].str.startswith("speed.speed: Input should be less than or equal to 120").all()
    short = frame[(frame["speed.speed"] == 25) & (frame["estimators.plain.window"] < 0.5) & (frame["sensors"] == "all")]
    assert set(short["status"]) == {FAILED}
    assert short["message"].str.contains("do not fit a window").all()
    good = frame[(frame["speed.speed"] == 25) & (frame["estimators.plain.window"] == 1.0) & (frame["sensors"] == "all")]
    assert set(good["status"]) == {OK}


def test_full_disk_ends_the_sweep(
    sweep_file: Path, tmp_path: Path, sweeping: Sweeping, whole: Path, monkeypatch: pytest.MonkeyPatch
):
    def full(*_: object) -> None:
        try:
            raise OSError(errno.ENOSPC, "No space left on device")
        except OSError:
            raise InputError("cannot write the truth: No space left on device; free some space") from None

    with monkeypatch.context() as patch:
        patch.setattr("railsim.simulation.build_run", full)
        with pytest.raises(InputError, match="No space left"):
            sweeping(sweep_file, tmp_path / "out")
    assert sweeping(sweep_file, tmp_path / "out").performed == RUNS
    assert same(tmp_path / "out", whole)


def test_folder_of_another_sweep_is_refused(sweep_file: Path, tmp_path: Path, sweeping: Sweeping, whole: Path):
    before = (whole / TABLE).read_bytes()
    sweep_file.write_text(SWEEP.replace("seeds: [3, 1]", "seeds: [3, 2]"))
    with pytest.raises(InputError, match="holds the results of another sweep; name another folder"):
        sweeping(sweep_file, whole)
    assert (whole / TABLE).read_bytes() == before
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="holds something that is not a sweep"):
        sweeping(sweep_file, tmp_path / "mine")


def test_results_of_another_program_are_not_mixed(
    sweep_file: Path, sweeping: Sweeping, whole: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("experiments.sweep.store.program_digest", lambda: "another")
    with pytest.raises(InputError, match="begun by another version of railsim"):
        sweeping(sweep_file, whole)


def test_interrupt_keeps_what_is_finished(sweep_file: Path, tmp_path: Path, sweeping: Sweeping, whole: Path):
    class Impatient(Here):
        def run(self, tasks):
            for number, found in enumerate(super().run(tasks)):
                if number == 2:
                    raise KeyboardInterrupt
                yield found

    with pytest.raises(Interrupted, match=f"interrupted; 2 of {RUNS} tasks are kept"):
        sweeping(sweep_file, tmp_path / "out", Impatient)
    assert sweeping(sweep_file, tmp_path / "out").performed == RUNS - 2
    assert same(tmp_path / "out", whole)


def test_kept_truth_is_not_simulated_again(
    sweep_file: Path, tmp_path: Path, sweeping: Sweeping, monkeypatch: pytest.MonkeyPatch
):
    sweep_file.write_text(SWEEP.replace("[25, 30, 35]", "[26]").replace("[14000, 16000]", "[14000]"))
    monkeypatch.setenv("RAILSIM_CACHE", str(tmp_path / "cache"))
    sweeping(sweep_file, tmp_path / "first", partial(Here, keep_truth=True))
    assert len([path for path in (tmp_path / "cache").iterdir() if path.is_dir()]) == 1
    monkeypatch.setattr("railsim.simulation.build_run", None)  # a simulation would fail
    sweep_file.write_text(sweep_file.read_text().replace("seeds: [3, 1]", "seeds: [4]"))
    sweeping(sweep_file, tmp_path / "second")
    assert set(table_of(tmp_path / "second")["status"]) == {OK, UNFIT}


def wait_for(condition, seconds: float = 120.0) -> None:
    """Until the condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.05)


def listens(address: str) -> bool:
    """Whether somebody takes connections there."""
    host, _, port = address.rpartition(":")
    with suppress(OSError), socket.create_connection((host, int(port)), 1.0):
        return True
    return False


@contextmanager
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """A Dask scheduler with two worker processes on loopback: address and workers."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    common: dict[str, Any] = {"env": environment, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    scheduler = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--no-dashboard"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", f"tcp://{address}", "--nthreads", "1", "--no-nanny"]
    started = [subprocess.Popen([*scheduler, "--port", address.rpartition(":")[2]], **common)]
    try:
        wait_for(lambda: listens(address))
        started += [subprocess.Popen([*worker, "--no-dashboard"], **common) for _ in range(2)]
        yield address, started[1:]
    finally:
        for process in started:
            process.kill()
            process.wait()
