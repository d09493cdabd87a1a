"""Clocks of several files tied by an event or by the correlation of their motions."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.signal import butter, sosfiltfilt

from experiments.cli import main
from railsim.errors import InputError
from railsim.field.map import Tie
from railsim.field.tying import Signal, by_event, by_motion
from railsim.recording import read_measurements

OFFSET = 37.2468  # s
MOTION = Tie.build({"kind": "motion", "channel": "a", "to": "b"})


def motion(seconds: float, seed: int = 1, band: tuple[float, float] = (0.3, 8.0)) -> Signal:
    """Random motion at 1 kHz, standard deviation 1."""
    time = np.arange(0.0, seconds, 1e-3)
    rough = np.random.default_rng(seed).standard_normal(time.size)
    smooth = sosfiltfilt(butter(4, band, "bandpass", fs=1000.0, output="sos"), rough)
    return Signal(time, smooth / smooth.std())


def sampled(
    of: Signal, rate: float, first: float, seconds: float, noise: float, seed: int, zero: float = 0.0
) -> Signal:
    """What a sensor reads from `first` on; its clock shows 0 at the time `zero`."""
    time = np.arange(first, first + seconds, 1.0 / rate)
    values = np.interp(time, of.time, of.values) + noise * np.random.default_rng(seed).standard_normal(time.size)
    return Signal(time - zero, values)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("rates", "noise"), [((100.0, 256.0), 0.1), ((256.0, 100.0), 0.5), ((50.0, 51.2), 0.3)])
def test_motion_tells_the_offset_within_what_is_stated(seed: int, rates: tuple[float, float], noise: float):
    truth = motion(300.0, seed)
    theirs = sampled(truth, rates[0], 5.0, 250.0, noise, seed + 50)
    mine = sampled(truth, rates[1], 40.0, 200.0, noise, seed + 90, zero=OFFSET)
    found = by_motion(mine, theirs, MOTION)
    assert found.deviation < 3e-3
    assert abs(found.seconds - OFFSET) < 4.0 * found.deviation + 1e-4


def test_the_stated_deviation_is_that_of_the_errors():
    truth = motion(160.0, 3)
    errors, stated = [], []
    for seed in range(12):
        theirs = sampled(truth, 100.0, 0.0, 150.0, 0.5, seed)
        mine = sampled(truth, 128.0, 10.0, 120.0, 0.5, seed + 40, zero=OFFSET)
        found = by_motion(mine, theirs, MOTION)
        errors.append(found.seconds - OFFSET)
        stated.append(found.deviation)
    ratio = np.sqrt(np.mean(np.square(errors))) / np.mean(stated)
    assert 0.4 < ratio < 2.0


def test_a_sensor_that_is_mounted_the_other_way_round_is_tied_too():
    truth = motion(150.0)
    mine = sampled(truth, 100.0, 20.0, 100.0, 0.1, 1, zero=OFFSET)
    found = by_motion(Signal(mine.time, -mine.values), sampled(truth, 100.0, 0.0, 140.0, 0.1, 2), MOTION)
    assert found.seconds == pytest.approx(OFFSET, abs=1e-3) and "opposite signs" in found.how


def test_other_motions_and_those_that_repeat_are_refused():
    with pytest.raises(InputError, match="are not alike"):
        by_motion(
            sampled(motion(120.0, 1), 50.0, 0.0, 110.0, 0.1, 1),
            sampled(motion(120.0, 2), 50.0, 0.0, 110.0, 0.1, 2),
            MOTION,
        )
    time = np.arange(0.0, 120.0, 0.01)
    wave = Signal(time, np.sin(2 * np.pi * time / 1.7))
    with pytest.raises(InputError, match="repeats itself"):
        by_motion(wave, Signal(time + 3.0, wave.values), MOTION)
    near = MOTION.but(largest=4.0)
    truth = motion(150.0)
    with pytest.raises(InputError, match="allow a larger offset"):
        by_motion(sampled(truth, 50.0, 30.0, 90.0, 0.1, 1, zero=OFFSET), sampled(truth, 50.0, 0.0, 140.0, 0.1, 2), near)


def test_a_knock_ties_two_clocks():
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 60.0, 1 / 200)
    knock = 30.0 * np.exp(-np.abs(time - 12.0) / 0.02)
    theirs = Signal(time, 9.81 + 0.3 * rng.standard_normal(time.size) + knock)
    late = np.arange(0.0, 50.0, 1 / 150)
    mine = Signal(late, 0.3 * rng.standard_normal(late.size) + 25.0 * np.exp(-np.abs(late - 4.5) / 0.02))
    found = by_event(mine, theirs)
    assert found.seconds == pytest.approx(7.5, abs=4 * found.deviation) and found.deviation < 0.02
    with pytest.raises(InputError, match="no event stands out"):
        by_event(Signal(late, rng.standard_normal(late.size)), theirs)


def write(folder: Path, tie: dict[str, Any] | None, shift: float = 0.0) -> list[str]:
    """Two files of one body, the second with a clock of its own; words of the command."""
    truth = motion(90.0, 8)
    first, second = sampled(truth, 100.0, 0.0, 80.0, 0.05, 1), sampled(truth, 64.0, 10.0, 60.0, 0.05, 2, zero=shift)
    pd.DataFrame({"t": first.time, "yaw": first.values}).to_csv(folder / "one.csv", index=False)
    pd.DataFrame({"t": second.time, "z": second.values}).to_csv(folder / "two.csv", index=False)
    time = {"kind": "seconds", "column": "t"}
    tables: list[dict[str, Any]] = [
        {"file": "one.csv", "time": time, "channels": {"bogie.rate_yaw [rad/s]": {"column": "yaw", "unit": "rad/s"}}},
        {"file": "two.csv", "time": time, "channels": {"body.rate_yaw [rad/s]": {"column": "z", "unit": "rad/s"}}},
    ]
    tables[1] |= {"tie": tie} if tie else {}
    mapped = {"origin": "two boxes", "vehicle": "class175", "tables": tables}
    (folder / "map.yaml").write_text(yaml.safe_dump(mapped, sort_keys=False))
    return ["import", str(folder), "--map", str(folder / "map.yaml"), "--out", str(folder / "rec")]


TIE = {"kind": "motion", "channel": "body.rate_yaw [rad/s]", "to": "bogie.rate_yaw [rad/s]"}


def test_import_ties_files_and_says_by_how_much(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(write(tmp_path, TIE, shift=-512.3)) == 0
    said = capsys.readouterr().out
    stated = re.search(
        r"clock of table 2 tied to that of table 1 by the correlation of motions.*: (\S+) s, standard", said
    )
    assert stated is not None and float(stated[1]) == pytest.approx(-512.3, abs=2e-3)
    assert "clocks of the files are one" not in said
    seen = read_measurements(tmp_path / "rec")
    one, two = "bogie.rate_yaw [rad/s]", "body.rate_yaw [rad/s]"
    alike = np.corrcoef(np.interp(seen.time(two), seen.time(one), seen[one]), seen[two])[0, 1]
    assert alike > 0.99
    assert any("tied to that of table 1" in text for text in seen.about["assumptions"])


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"channel": "bogie.rate_yaw [rad/s]"}, "is no channel of this table"),
        ({"to": "nothing [m]"}, "is a channel of no table before"),
        ({"kind": "event"}, "no event stands out"),
        ({"threshold": 0.9999}, "are not alike"),
        ({"kind": "guess"}, "tie.kind"),
    ],
)
def test_ties_that_cannot_be(changes: dict[str, Any], line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(write(tmp_path, TIE | changes)) == 2
    error = capsys.readouterr().err
    assert line in error and error.count("\n") == 1 and not (tmp_path / "rec").exists()
