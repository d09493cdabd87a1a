"""What does not fit is refused before the work begins, and a long run is announced."""

import shutil
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from railsim import InputError, load_scenario, room, simulate, simulation
from railsim.errors import Noticed
from railsim.room import available_memory, check_disk, check_memory


def test_what_fits_is_let_through(tmp_path: Path):
    check_disk(1.0, tmp_path / "not" / "there", "a file", "nothing")
    check_memory(1.0, "a table", "nothing")
    assert available_memory() is None or available_memory() > 1e6  # type: ignore[operator]


def test_what_does_not_fit_says_how_much_there_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=2e9))
    with pytest.raises(InputError, match=r"a file takes up to 3 GB; the disk of '.*' has 2 GB free; make it short"):
        check_disk(3e9, tmp_path / "x", "a file", "make it short")
    monkeypatch.setattr(room, "available_memory", lambda: 50e6)
    with pytest.raises(InputError, match="a table takes about 60 MB of memory, of which 50 MB are free; make it short"):
        check_memory(60e6, "a table", "make it short")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"duration": 2e6, "speed.speed": 1e-3}, "the sensors give takes about"),
        ({"duration": 2e6, "speed.speed": 1e-3, "sensors": [], "output_rate": 100e3}, "the disk of"),
    ],
)
def test_endless_runs_are_refused_at_once(changes: dict[str, object], line: str, tmp_path: Path):
    scenario = load_scenario("smooth", changes)
    began = time.monotonic()
    with pytest.raises(InputError, match=line):
        simulation.check_measured(scenario)
        simulate(scenario, "compiled", tmp_path / "truth")
    assert time.monotonic() - began < 20.0
    assert list(tmp_path.iterdir()) == []


def test_a_long_run_is_announced_by_what_its_first_seconds_made(monkeypatch: pytest.MonkeyPatch):
    now = iter([0.0, 1.0, 3.0, 4.0])
    monkeypatch.setattr(room.time, "monotonic", lambda: next(now))
    ahead = room.Forecast(10_000)
    ahead.update(1)
    with pytest.warns(Noticed, match="about 8.3 hours"):
        ahead.update(0)
    ahead.update(1)
