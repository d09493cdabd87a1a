"""The faults change what they say and nothing else; the figure's claims follow from its table."""

import numpy as np
import pandas as pd
import pytest

from experiments.fault_injection.cases import gapped
from experiments.fault_injection.faults import Spoiler
from experiments.fault_injection.kinds import FAULTS
from experiments.fault_injection.runs import SUITE
from experiments.figures.inspection import Inspection
from railsim.measurements import TIME, Measurements
from railsim.sensors.suite import build_sensors, data_sheets


@pytest.fixture(scope="module")
def measured() -> Measurements:
    """Noise in the channels of the suite, 30 s at 20 m/s."""
    sensors = build_sensors(
        [{"errors": "mems"} | one if one["kind"] in ("accelerometer", "gyro") else one for one in SUITE]
    )
    rng = np.random.default_rng(1)
    frames: dict[float, pd.DataFrame] = {}
    for sensor in sensors:
        time = np.arange(0, 30, 1 / sensor.rate)
        frame = frames.setdefault(sensor.rate, pd.DataFrame({TIME: time}))
        for name in sensor.channels():
            frame[name] = rng.standard_normal(time.size) + (20.0 if "speed" in name else 0.1)
    return Measurements({"origin": "test", "vehicle": {}, "sensors": data_sheets(sensors)}, frames)


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_changes_its_channels_where_it_says(kind: str, measured: Measurements):
    spoiler = Spoiler(measured, np.random.default_rng(2))
    fault = FAULTS[kind](spoiler)
    spoilt = spoiler.result()
    assert fault.kind == ("offset" if kind == "gyro bias" else kind)
    if spoilt[measured.channels[0]].size != measured[measured.channels[0]].size or "time" in fault.channels[0]:
        return
    for name in measured:
        same = np.equal(spoilt[name], measured[name])
        time = measured.time(name)
        outside = (time < fault.start - 1e-9) | (time > fault.end + 1e-9)
        twin = name.split(".")[0] == fault.channels[0].split(".")[0] and kind == "tachometer"
        assert same.all() == (name not in fault.channels and not twin), name
        moved = kind == "repeated" and "put in" in fault.size  # all later rows are
        assert same[time < fault.start - 1e-9].all() if moved else same[outside].all()


def _table(**changes: float) -> pd.DataFrame:
    spoilt = {"fault": "spikes", "found": "spikes", "detected": 1.0, "named": 1.0, "placed": 1.0, "alarms": 0}
    scores = {"repaired over clean": 1.0, "spoilt over clean": 3.0, "repaired over gap": 1.0}
    scores |= {"lost": 0, "lost beside gap": 0}
    clean = {"fault": "none", "found": "nothing", "alarms": 0}
    gap = spoilt | {"fault": "null", "found": "null"}
    return pd.DataFrame([spoilt | scores | changes, gap | scores, clean] * 400)


@pytest.mark.parametrize(
    ("change", "failing"),
    [
        ({}, []),
        ({"detected": 0.0}, [0]),
        ({"named": 0.0}, [1, 4]),
        ({"repaired over clean": 1.2}, [4]),
        ({"lost": 1}, [7]),
    ],
)
def test_claims_follow_from_the_table(change: dict[str, float], failing: list[int]):
    claims = Inspection().check(_table(**change))
    assert [number for number, claim in enumerate(claims) if not claim.held] == failing


def test_a_false_alarm_breaks_its_claim():
    table = _table()
    table.loc[table["fault"] == "none", "alarms"] = 1
    assert [claim.held for claim in Inspection().check(table)][3] is False


@pytest.mark.parametrize("kind", ["null", "drop-out", "spikes"])
def test_gapped_leaves_out_what_the_fault_touched_and_nothing_else(kind: str, measured: Measurements):
    spoiler = Spoiler(measured, np.random.default_rng(3))
    fault = FAULTS[kind](spoiler)
    left = gapped(measured, spoiler.result())
    for name in measured:
        lost, time = np.isnan(left[name]), measured.time(name)
        np.testing.assert_array_equal(left[name][~lost], measured[name][~lost])
        inside = (time > fault.start - 1e-9) & (time < fault.end + 1e-9)
        assert not lost[~inside].any()
        assert not lost.any() or kind == "spikes" or lost[inside].all()
    assert sum(np.isnan(left[name]).any() for name in measured) >= 1


def test_the_picture_has_both_parts():
    assert len(Inspection().draw(_table()).axes) == 2
