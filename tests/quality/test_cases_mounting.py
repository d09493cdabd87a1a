"""Accelerometers beside gravity: unit, gravity taken off, upside down, tilted; short records; vibration is no noise."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from railsim import Recording
from railsim.constants import GRAVITY
from railsim.errors import InputError
from railsim.field.importing import import_file
from railsim.measurements import TIME, Measurements
from railsim.quality.inspection import inspect

RATE, LENGTH = 100.0, 40.0
FORCES = [f"body.acceleration_{axis} [m/s2]" for axis in "xyz"]
TURNS = [f"body.rate_{axis} [rad/s]" for axis in ("roll", "pitch", "yaw")]
GNSS = "gnss.speed [m/s]"
ERRORS = {"noise_density": 4e-3, "bias_std": 0.05, "bias_instability": 5e-4, "misalignment": 0.005}


def truth(seed: int = 1, braking: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, and specific force and turning rates in the body's axes, shapes (n,), (n, 3), (n, 3)."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(RATE * LENGTH)) / RATE
    force = rng.normal([0.0, 0.0, GRAVITY], [0.15, 0.25, 0.3], (time.size, 3))
    if braking:
        force[:, 0] += 0.5 * np.sin(2 * np.pi * time / 20.0)
    return time, force, rng.normal(0.0, [0.01, 0.02, 0.005], (time.size, 3))


def speed_of(time: np.ndarray) -> np.ndarray:
    """Whose change is that of `truth`."""
    return 20.0 + 0.5 * 20.0 / (2 * np.pi) * (1 - np.cos(2 * np.pi * time / 20.0))


def measured(force: np.ndarray, turns: np.ndarray | None = None, braking: bool = False) -> Measurements:
    """A box on the body, with a receiver where its speed changes."""
    time = np.arange(len(force)) / RATE
    frames: dict[float, Any] = {RATE: {TIME: time} | dict(zip(FORCES, force.T, strict=True))}
    sensors = [{"kind": "accelerometer", "name": "body", "body": "body", "channels": FORCES, "errors": ERRORS}]
    if turns is not None:
        frames[RATE] |= dict(zip(TURNS, turns.T, strict=True))
        sensors.append(
            {"kind": "gyro", "name": "body", "body": "body", "channels": TURNS, "errors": {"bias_std": 0.01}}
        )
    if braking:
        slow = np.arange(0.0, LENGTH)
        frames[1.0] = {TIME: slow, GNSS: speed_of(slow)}
        sensors.append({"kind": "gnss", "name": "gnss", "body": "body", "channels": [GNSS], "errors": {}})
    return Measurements({"origin": "test", "vehicle": {}, "sensors": sensors}, frames)


def kinds(done: Any) -> set[str]:
    return {one.kind for one in done.faults}


def test_as_it_should_be_is_nothing():
    assert inspect(measured(truth()[1])).findings == []


@pytest.mark.parametrize(("unit", "factor"), [("g", 9.80665), ("mg", 9.80665e-3), ("mm/s2", 1e-3), ("ft/s2", 0.3048)])
def test_another_unit_is_named_and_brought_to_si(unit: str, factor: float):
    force = truth()[1]
    done = inspect(measured(force / factor))
    assert kinds(done) == {"unit"}
    assert {one.channel for one in done.faults} == set(FORCES)
    assert f"state 'unit: {unit}' in the map" in done.faults[0].advice
    for name, values in zip(FORCES, force.T, strict=True):
        assert done.cleaned[name] == pytest.approx(values, rel=1e-9)


def test_the_vertical_axis_alone_tells_a_unit_and_a_missing_gravity():
    force = truth()[1]
    sensors = [{"kind": "accelerometer", "name": "body", "body": "body", "channels": FORCES[2:], "errors": ERRORS}]
    about = {"origin": "test", "vehicle": {}, "sensors": sensors}
    for values, kind in ((force[:, 2] / GRAVITY, "unit"), (force[:, 2] - GRAVITY, "no gravity")):
        table = {TIME: np.arange(len(force)) / RATE, FORCES[2]: values}
        assert kinds(inspect(Measurements(about, {RATE: table}))) == {kind}


def test_gravity_that_was_taken_off_is_named_and_not_made_up():
    force = truth()[1] - [0.0, 0.0, GRAVITY]
    record = measured(force)
    done = inspect(record)
    assert kinds(done) == {"no gravity"}
    for name in FORCES:
        np.testing.assert_array_equal(done.cleaned[name], record[name])


@pytest.mark.parametrize("braking", [False, True])
def test_upside_down(braking: bool):
    force = truth(braking=braking)[1] * [1.0, -1.0, -1.0]
    record = measured(force, braking=braking)
    done = inspect(record)
    assert kinds(done) == {"upside down"}
    assert re.search(r"rotation: \[-?(180.0|179.\d), -?0.\d, -?0.\d\]", done.faults[0].advice)
    assert "'sign: -1' for its three channels" in done.faults[0].advice
    if braking:
        assert done.cleaned[FORCES[2]].mean() == pytest.approx(GRAVITY, abs=0.02)
        assert done.cleaned[FORCES[0]] == pytest.approx(record[FORCES[0]], abs=0.1)
    else:
        np.testing.assert_array_equal(done.cleaned[FORCES[2]], record[FORCES[2]])


@pytest.mark.parametrize("mounted", [(0.0, -11.0, 0.0), (9.0, 0.0, 0.0), (6.0, 8.0, 0.0)])
def test_a_tilt_is_a_tilt_and_is_turned_back_with_its_gyro(mounted: tuple[float, float, float]):
    rotation = Rotation.from_euler("xyz", mounted, degrees=True)
    _, force, turns = truth()
    done = inspect(measured(rotation.inv().apply(force), rotation.inv().apply(turns)))
    assert kinds(done) == {"tilted"}
    assert "for this sensor and its gyro" in done.faults[0].advice
    for name, values in zip([*FORCES, *TURNS], np.hstack([force, turns]).T, strict=True):
        assert done.cleaned[name] == pytest.approx(values, abs=0.15 if name in FORCES else 0.01)
        assert done.cleaned[name].mean() == pytest.approx(values.mean(), abs=0.02)


def test_a_tilt_is_told_without_a_data_sheet():
    rotation = Rotation.from_euler("y", -20.0, degrees=True)
    record = measured(rotation.inv().apply(truth()[1]))
    sensors = [record.about["sensors"][0] | {"errors": {}}]
    bare = Measurements(
        record.about | {"sensors": sensors}, {RATE: {TIME: record.time(FORCES[0])} | {n: record[n] for n in FORCES}}
    )
    assert kinds(inspect(bare)) == {"tilted"}


@pytest.mark.parametrize("mounted", [(0.0, -90.0, 0.0), (90.0, 0.0, 0.0), (10.0, -70.0, 35.0), (180.0, 0.0, 60.0)])
def test_any_mounting_is_found_where_the_speed_changes(mounted: tuple[float, float, float]):
    rotation = Rotation.from_euler("xyz", mounted, degrees=True)
    _, force, turns = truth(braking=True)
    done = inspect(measured(rotation.inv().apply(force), rotation.inv().apply(turns), braking=True))
    assert kinds(done) <= {"turned", "upside down"} and len(done.faults) == 1
    for name, values in zip([*FORCES, *TURNS], np.hstack([force, turns]).T, strict=True):
        assert np.corrcoef(done.cleaned[name], values)[0, 1] > 0.98


def test_heading_by_curves():
    time, force, turns = truth()
    turns[:, 2] += 0.02 * np.sin(2 * np.pi * time / 30.0)
    force[:, 1] += 20.0 * 0.02 * np.sin(2 * np.pi * time / 30.0)
    rotation = Rotation.from_euler("xyz", (0.0, 0.0, 90.0), degrees=True) * Rotation.from_euler("x", 90.0, degrees=True)
    record = measured(rotation.inv().apply(force), rotation.inv().apply(turns), braking=True)
    frames = {RATE: {TIME: time} | {name: record[name] for name in [*FORCES, *TURNS]}}
    frames[1.0] = {TIME: np.arange(0.0, LENGTH), GNSS: np.full(40, 20.0)}
    done = inspect(Measurements(record.about, frames))
    assert np.corrcoef(done.cleaned[FORCES[1]], force[:, 1])[0, 1] > 0.95


def test_all_signs_turned_is_told_from_no_mounting_and_left():
    force = -truth(braking=True)[1]
    record = measured(force, braking=True)
    done = inspect(record)
    assert kinds(done) == {"upside down"}
    assert "'sign: -1'" in done.faults[0].advice
    np.testing.assert_array_equal(done.cleaned[FORCES[1]], record[FORCES[1]])
    assert inspect(measured(-force, braking=True)).faults == []


def test_upright_without_a_heading_is_left_as_it_is():
    force = Rotation.from_euler("xyz", (0.0, -90.0, 0.0), degrees=True).inv().apply(truth()[1])
    record = measured(force)
    done = inspect(record)
    assert kinds(done) == {"turned"}
    assert "rotation: [0.0, -90.0, 0.0]" in done.faults[0].advice
    assert "heading is not known" in done.faults[0].advice
    np.testing.assert_array_equal(done.cleaned[FORCES[0]], record[FORCES[0]])


def test_the_rotation_that_is_offered_works_in_a_map(tmp_path: Path):
    rotation = Rotation.from_euler("xyz", (4.0, -11.0, 0.0), degrees=True)
    time, force, _ = truth()
    rows = np.column_stack([time, rotation.inv().apply(force)])
    np.savetxt(tmp_path / "data.csv", rows, "%.6f", ",", header="t,x,y,z", comments="")
    channels = {name: {"column": axis, "unit": "m/s2"} for name, axis in zip(FORCES, "xyz", strict=True)}
    sensor: dict[str, Any] = {"kind": "accelerometer", "name": "body", "body": "body", "errors": "mems"}
    values = {"origin": "test", "vehicle": "manchester", "sensors": [sensor]}
    values["tables"] = [{"time": {"kind": "seconds", "column": "t"}, "channels": channels}]

    def imported() -> Measurements:
        (tmp_path / "map.yaml").write_text(yaml.safe_dump(values))
        import_file(tmp_path / "data.csv", tmp_path / "map.yaml", tmp_path / "out")
        return Recording.open(tmp_path / "out").measurements

    advice = inspect(imported()).faults[0].advice
    sensor["rotation"] = yaml.safe_load("{" + advice.partition("'")[2].partition("'")[0] + "}")["rotation"]
    again = imported()
    assert inspect(again).faults == []
    assert again[FORCES[2]].mean() == pytest.approx(force[:, 2].mean(), abs=0.005)
    for wrong, line in (([0, 1], "give roll, pitch and yaw in deg"), ("flat", "give roll, pitch and yaw in deg")):
        sensor["rotation"] = wrong
        with pytest.raises(InputError, match=line):
            imported()
    sensor["rotation"] = [0, 1, 0]
    del channels[FORCES[0]]
    with pytest.raises(InputError, match="sensors.0.rotation: needs .*; map all three"):
        imported()


def test_a_mean_that_is_no_zero_error_is_not_repaired():
    force = truth()[1]
    force[:, 2] -= 6.0
    record = measured(force)
    done = inspect(record)
    assert [one.kind for one in done.faults] == ["offset"]
    assert "check the unit, the mounting and the coupling" in done.faults[0].advice
    np.testing.assert_array_equal(done.cleaned[FORCES[2]], record[FORCES[2]])


@pytest.mark.parametrize("rate", [20.0, 100.0, 1024.0])
@pytest.mark.parametrize("length", [0.1, 0.5, 1.0, 1.5, 1.99, 2.0, 2.5, 3.0, 4.5])
def test_short_records_are_told_so(rate: float, length: float):
    count = max(2, round(rate * length))
    rng = np.random.default_rng(3)
    force = rng.normal([0.0, 0.0, GRAVITY], 0.2, (count, 3))
    sensors = [{"kind": "accelerometer", "name": "body", "body": "body", "channels": FORCES, "errors": ERRORS}]
    table = {TIME: np.arange(count) / rate} | dict(zip(FORCES, force.T, strict=True))
    done = inspect(Measurements({"origin": "test", "vehicle": {}, "sensors": sensors}, {rate: table}))
    short = [one for one in done.findings if one.kind == "too short"]
    assert bool(short) == (count / rate < 2.0)
    assert done.faults == []
    if short:
        assert "too short to be checked, 2 s are needed" in short[0].extent


def lateral(noise: bool, seed: int = 5) -> Measurements:
    """Lateral accelerometers of a wheelset and its box; vibration of both, or noise of the first, for 5 s."""
    rng = np.random.default_rng(seed)
    rate, names = 256.0, ["wheelset1.acceleration_y [m/s2]", "axlebox1_left.acceleration_y [m/s2]"]
    other = ["axlebox1_left.acceleration_z [m/s2]", "wheelset1.rate_yaw [rad/s]", "wheelset1.rate_roll [rad/s]"]
    time = np.arange(round(30 * rate)) / rate
    stretch = (time > 12) & (time < 17)
    own = {name: 0.01 * np.sqrt(rate / 2) * rng.standard_normal(time.size) for name in [*names, *other]}
    shaking = 0.2 * np.sqrt(rate / 2) * rng.standard_normal(time.size) * stretch
    own[names[0]] += shaking
    if not noise:
        own[names[1]] += shaking
    own[other[0]] += GRAVITY
    errors = {"noise_density": 0.01, "bias_std": 0.2, "range": 500.0}
    sensors = [
        {"kind": "gyro" if "rate" in name else "accelerometer", "name": name.split(".")[0], "body": "wheelset1"}
        | {"channels": [name], "errors": errors}
        for name in own
    ]
    return Measurements({"origin": "test", "vehicle": {}, "sensors": sensors}, {rate: {TIME: time} | own})


def test_vibration_along_an_axis_is_no_noise():
    assert "noise" not in kinds(inspect(lateral(noise=False)))
    found = [one for one in inspect(lateral(noise=True)).faults if one.kind == "noise"]
    assert [one.channel for one in found] == ["wheelset1.acceleration_y [m/s2]"]
