"""A long record in sections: what they give is what the whole record gives, also where the run was stopped."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import ESTIMATORS, Estimate, Estimator
from experiments.runs import long_record
from experiments.runs.long_record import estimate_sections, in_sections, joined, sections_of
from railsim.measurements import Measurements
from railsim.recording import read_measurements, write_recording
from tests.estimators.track_rig import ride, wave

SECONDS, LENGTH, OVERLAP = 200.0, 60.0, 25.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """200 s at speeds that change, over waves of 12 m."""
    time = np.arange(round(SECONDS * 256)) / 256
    speed = 22.0 + 4.0 * np.sin(time / 20.0)
    measured = ride(speed, vertical=wave(12.0, 2e-3))
    folder = tmp_path_factory.mktemp("long") / "rec"
    rates = sorted({measured.rate(name) for name in measured})
    frames: dict[float, pd.DataFrame] = {}
    for rate in rates:
        names = [name for name in measured if measured.rate(name) == rate]
        columns = {"time [s]": measured.time(names[0])} | {name: measured[name] for name in names}
        frames[rate] = pd.DataFrame(columns)
    write_recording(folder, frames, measured.about)
    return folder


@pytest.fixture(autouse=True)
def short_sections(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_record, "LONGEST", 100.0)
    monkeypatch.setattr(long_record, "SECTION", LENGTH)
    monkeypatch.setattr(long_record, "OVERLAP", OVERLAP)


def by(name: str) -> Estimator:
    return ESTIMATORS.resolve(name).build({})


def test_sections_cover_the_record_without_a_gap(recording: Path):
    sections = sections_of(read_measurements(recording))
    assert [one.number for one in sections] == [0, 1, 2]
    assert sections[0].begin == 0.0 and sections[-1].end == np.inf
    assert all(a.end == b.begin for a, b in zip(sections, sections[1:], strict=False))


def test_only_long_records_of_estimators_that_look_nearby_are_cut(recording: Path, monkeypatch: pytest.MonkeyPatch):
    seen = read_measurements(recording)
    assert in_sections(by("alignment_vertical"), seen)
    assert not in_sections(by("suspension_spectral"), seen)
    monkeypatch.setattr(long_record, "LONGEST", 3600.0)
    assert not in_sections(by("alignment_vertical"), seen)


def test_sections_give_what_the_whole_record_gives(recording: Path, tmp_path: Path):
    seen, estimator = read_measurements(recording), by("alignment_vertical")
    whole = estimator.estimate(seen).series
    found = joined(estimate_sections(estimator, seen, tmp_path / "parts", recording))
    series = found.series
    assert list(series.columns) == list(whole.columns) and abs(len(series) - len(whole)) <= 1
    assert np.diff(series["s [m]"]) == pytest.approx(0.125) and (np.diff(series["time [s]"]) > 0.0).all()
    place = np.interp(series["time [s]"], whole["time [s]"], whole["s [m]"])
    assert np.abs(place - series["s [m]"]).max() <= 0.0625 + 1e-6  # m, half a row
    for name in ("vertical_d1 [m]", "vertical_d2 [m]"):
        expected = np.interp(series["time [s]"], whole["time [s]"], whole[name])
        known = np.isfinite(expected) & np.isfinite(series[name].to_numpy())
        assert known.mean() > 0.9
        difference = series[name].to_numpy()[known] - np.asarray(expected)[known]
        assert np.std(difference) < 0.02 * np.std(np.asarray(expected)[known])
    said = found.about["sections"]
    assert said["count"] == 3 and 0.0 < said["seams"]["vertical_d1 [m]"] < 2e-4


def test_rows_over_time_are_joined(recording: Path, tmp_path: Path):
    class Counted(Estimator, frozen=True):
        nearby = True

        def estimate(self, measurements: Measurements) -> Estimate:
            name = next(iter(measurements))
            time = measurements.time(name)
            events = [{"kind": "mark", "time [s]": float(one)} for one in np.arange(5.0, 200.0, 10.0)]
            inside = [one for one in events if time[0] <= one["time [s]"] <= time[-1]]
            frame = pd.DataFrame({"time [s]": time, "level [-]": measurements[name]})
            return Estimate("counted", frame, {"events": inside, "warnings": ["the same"]})

    seen = read_measurements(recording)
    found = joined(estimate_sections(Counted(), seen, tmp_path / "parts", recording))
    name = next(iter(seen))
    assert np.array_equal(found.series["time [s]"], seen.time(name))
    assert np.array_equal(found.series["level [-]"], seen[name])
    assert [one["time [s]"] for one in found.about["events"]] == np.arange(5.0, 200.0, 10.0).tolist()
    assert found.about["warnings"] == ["the same"] and found.about["sections"]["seams"] == {"level [-]": 0.0}


def test_an_interrupted_run_goes_on_and_gives_the_same(recording: Path, tmp_path: Path):
    seen, estimator = read_measurements(recording), by("alignment_vertical")
    joined(estimate_sections(estimator, seen, tmp_path / "whole", recording)).save(tmp_path / "a")
    done: list[str] = []

    def stop(line: str) -> None:
        done.append(line)
        if len(done) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        estimate_sections(estimator, seen, tmp_path / "parts", recording, stop)
    said: list[str] = []
    joined(estimate_sections(estimator, seen, tmp_path / "parts", recording, said.append)).save(tmp_path / "b")
    assert [line.endswith("done before") for line in said] == [True, True, False]
    for name in ("estimate.parquet", "about.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_sections_of_other_settings_are_not_taken(recording: Path, tmp_path: Path):
    seen = read_measurements(recording)
    estimate_sections(by("alignment_vertical"), seen, tmp_path / "parts", recording)
    said: list[str] = []
    other = ESTIMATORS.resolve("alignment_vertical").build({"slowest": 2.5})
    estimate_sections(other, seen, tmp_path / "parts", recording, said.append)
    assert not any("before" in line for line in said)


_PROGRAM = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # processes in the background are born deaf to it
from experiments.runs import long_record
long_record.LONGEST, long_record.SECTION, long_record.OVERLAP = 100.0, 60.0, 25.0
from experiments.cli import main


class Ended:
    "Standard error that ends the process by a signal once the first section is said to be done."

    def __init__(self, signal):
        self.signal, self.to = signal, sys.stderr

    def write(self, text):
        written = self.to.write(text)
        if "section 1 of 3: done" in text:
            self.to.flush()
            os.kill(os.getpid(), self.signal)
        return written

    def __getattr__(self, name):
        return getattr(self.to, name)


if len(sys.argv) > 3:
    sys.stderr = Ended(int(sys.argv[3]))
sys.exit(main(["estimate", "alignment_vertical", sys.argv[1], "--out", sys.argv[2]]))
"""


def command(recording: Path, out: Path, *ended: str) -> "subprocess.CompletedProcess[str]":
    """The command in a process of its own; `ended`: the signal that ends it after the first section."""
    words = [sys.executable, "-c", _PROGRAM, str(recording), str(out), *ended]
    return subprocess.run(words, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, timeout=120)


@pytest.fixture(scope="module")
def whole(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The estimate of a command that nobody ended."""
    out = tmp_path_factory.mktemp("whole") / "estimate"
    done = command(recording, out)
    assert "section 3 of 3: done" in done.stderr and done.returncode == 0
    return out


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_command_that_was_ended_goes_on(how: signal.Signals, recording: Path, whole: Path, tmp_path: Path):
    stopped = command(recording, tmp_path / "stopped", str(int(how)))
    assert how == signal.SIGKILL or "the same command goes on from there" in stopped.stderr
    assert stopped.returncode != 0 and not (tmp_path / "stopped").exists()
    assert (tmp_path / "stopped.sections" / "0000" / "section.json").is_file()
    again = command(recording, tmp_path / "stopped")
    assert "section 1 of 3: done before" in again.stderr and again.returncode == 0
    assert not (tmp_path / "stopped.sections").exists()
    table = (whole / "estimate.parquet").read_bytes()
    assert (tmp_path / "stopped" / "estimate.parquet").read_bytes() == table
