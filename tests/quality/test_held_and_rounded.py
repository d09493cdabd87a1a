"""Values of a slower sensor that are repeated, and stamps that are rounded: notes, not faults."""

import numpy as np
import pytest

from railsim.held import held_rows
from railsim.measurements import TIME, Measurements
from railsim.quality.inspection import inspect
from railsim.quality.interface import Finding, texts

RATE, LENGTH, SPEED = 100.0, 60.0, "gnss.speed [m/s]"


def receiver(outage: tuple[int, int] = (0, 0)) -> Measurements:
    """A receiver's speed of 1 Hz in a table of 100 Hz; one value for the seconds of the outage."""
    rng = np.random.default_rng(3)
    values = 20.0 + np.cumsum(rng.normal(0.0, 0.2, int(LENGTH)))
    values[outage[0] : outage[1]] = values[outage[0]]
    time = np.arange(round(LENGTH * RATE)) / RATE
    about = {"origin": "test", "vehicle": {}, "sensors": [{"name": "gnss", "kind": "gnss", "channels": [SPEED]}]}
    return Measurements(about, {RATE: {TIME: time, SPEED: np.repeat(values, round(RATE))}})


def rounded(decimals: int, rate: float, jitter: float = 0.0) -> Measurements:
    rng = np.random.default_rng(5)
    count = round(20.0 * rate)
    time = np.round(np.arange(count) / rate + jitter * rng.standard_normal(count), decimals)
    about = {"origin": "test", "vehicle": {}, "sensors": []}
    return Measurements(about, {rate: {TIME: time, "bogie.acceleration_z [m/s2]": 9.81 + rng.standard_normal(count)}})


def found(measured: Measurements) -> list[tuple[str, str]]:
    return [(one.kind, one.severity) for one in inspect(measured).findings]


def test_held_values_are_one_note() -> None:
    assert found(receiver()) == [("held", "note")]


def test_a_held_channel_that_stays_too_long_is_stuck_once() -> None:
    finding = next(one for one in inspect(receiver((20, 45))).findings if one.kind == "stuck")
    assert (finding.start, finding.end) == pytest.approx((20.0, 45.0), abs=1.01)
    assert found(receiver((20, 45))).count(("stuck", "fault")) == 1


def test_a_noisy_channel_is_not_held() -> None:
    rng = np.random.default_rng(7)
    assert held_rows(np.round(rng.standard_normal(5000), 1)) == 0
    assert held_rows(np.repeat(rng.standard_normal(50), 10)) == 10


@pytest.mark.parametrize(("decimals", "rate"), [(3, 128.0), (3, 256.0), (2, 40.0)])
def test_stamps_that_are_only_rounded_are_a_note(decimals: int, rate: float) -> None:
    assert ("rounded", "note") in found(rounded(decimals, rate))
    assert not any(kind == "clock" for kind, _ in found(rounded(decimals, rate)))


def test_stamps_that_jitter_beyond_their_rounding_are_a_fault() -> None:
    assert ("clock", "fault") in found(rounded(3, 128.0, jitter=1e-3))


def test_what_several_channels_show_alike_is_one_line() -> None:
    here = [Finding("drop-out", name, 1.0, 2.0, "4 samples are lost", "leave them out") for name in ("a", "b")]
    assert texts(here) == ["a, b: drop-out, t = 1.00 to 2.00 s: 4 samples are lost; leave them out"]
    apart = [here[0], Finding("drop-out", "b", 1.0, 2.5, "4 samples are lost", "leave them out")]
    assert len(texts(apart)) == 2
