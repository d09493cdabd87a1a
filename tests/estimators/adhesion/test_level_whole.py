"""Adhesion level on whole vehicles: both bogies, and what the calibration does not hold for."""

import numpy as np
import pandas as pd
import pytest

from estimators.adhesion.adhesion_creep_forces_profile import AdhesionCreepForcesProfile
from estimators.adhesion.adhesion_level import WINDOW, AdhesionLevel
from estimators.adhesion.bogie_place import places
from estimators.adhesion.channels import RATE
from estimators.adhesion.classifier import LEVELS
from estimators.adhesion.creep_model import parameters
from estimators.adhesion.level_gates import ASIDE, Gate, gates
from estimators.adhesion.level_windows import COLUMNS, LIKELY, Reason, pooled, undecided, withheld
from experiments.runs.adhesion import run, scenario, sensors
from experiments.scoring.score import score
from railsim.measurements import Measurements
from railsim.truth import Truth

SPEED, APART = 30.0, 8.0
LADEN = {"payload": {"mass": 9000.0}}
Runs = dict[str, tuple[Truth, Measurements]]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    """Eighteen seconds with nine tonnes aboard, unknown to the recording, on four wheelsets with sensors."""
    suite = sensors("mems", apart=APART)
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        for level in ("wet", "low"):
            vehicle = {"name": "class175_whole", "adhesion": level}
            stated = {"track": "straight_erri_low", "vehicle": vehicle, "start": 60.0}
            real = scenario({**stated, "vehicle": vehicle | LADEN}, SPEED, 18.0, suite)
            found[level] = run(real, 3, stated=scenario(stated, SPEED, 18.0, suite))
    return found


def changed(measured: Measurements, values: dict[str, np.ndarray]) -> Measurements:
    """The same recording with other samples of some channels."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measured.channels:
        table = tables.setdefault(measured.rate(name), {"time [s]": measured.time(name)})
        table[name] = values.get(name, measured[name])
    return Measurements(measured.about, tables)


@pytest.mark.parametrize("level", ["wet", "low"])
def test_level_is_named_whatever_the_load(runs: Runs, level: str):
    truth, measured = runs[level]
    found = AdhesionLevel(hop=1.0).estimate(measured)
    assert score(found, truth)["level wrong [-]"] == 0.0
    assert found.about["cannot_tell"] == []
    assert found.series["valid [-]"].to_numpy().all()
    assert (found.series[list(COLUMNS)].to_numpy().argmax(axis=1) == LEVELS.index(level)).all()


def test_creep_alone_on_all_four_wheelsets(runs: Runs):
    truth, measured = runs["wet"]
    found = score(AdhesionCreepForcesProfile().estimate(measured), truth)
    for number in (1, 2, 3, 4):
        assert found[f"wheelset{number} lateral force rms error over load [-]"] < 0.015
        assert found[f"wheelset{number} lateral force within 2 std [-]"] >= 0.85


def test_a_curve_is_left_out_and_named(runs: Runs):
    """A steady yaw rate of V / R on every gyro; the bias of a single one makes no curve."""
    measured = runs["low"][1]
    yaw = [name for name in measured.channels if name.partition(".")[2].startswith("rate_yaw")]
    one = AdhesionLevel(hop=1.0).estimate(changed(measured, {yaw[0]: measured[yaw[0]] + SPEED / 500.0}))
    assert one.about["cannot_tell"] == []
    curved = changed(measured, {name: measured[name] + SPEED / 500.0 for name in yaw})
    found = AdhesionLevel(hop=1.0).estimate(curved)
    assert not found.series["valid [-]"].to_numpy().any()
    (reason,) = found.about["cannot_tell"]
    assert (reason["reason"], reason["would_help"], reason["share"]) == ("a curve", "straight track", 1.0)
    assert any("straight track would help" in line for line in found.about["warnings"])
    forces = AdhesionCreepForcesProfile().estimate(curved)
    assert not forces.series["valid [-]"].to_numpy().any()
    assert any("a curve" in line for line in forces.about["warnings"])


def test_the_curve_that_counts_is_by_the_shift_that_it_asks_for(runs: Runs):
    """l r / (lambda R) = 1 mm."""
    measured = runs["low"][1]
    estimator, p = AdhesionLevel(), parameters(measured.vehicle)
    health = estimator.health(measured)
    record = estimator.record(measured, health, ("bogie",), places(measured.vehicle)[0])
    radius = p["half_gauge"] * p["wheel_radius"] / (p["design_conicity"] * ASIDE)
    for factor, closed in ((0.8, True), (1.25, False)):
        bent = {
            name: np.full_like(measured[name], SPEED / (factor * radius)) for name in measured if "rate_yaw" in name
        }
        curve, _ = gates(changed(measured, bent), health, record.time, np.full(len(record.time), SPEED), p)
        assert curve.closed.all() == closed
        assert curve.closed.any() == closed


def test_a_slide_is_left_out_from_where_it_begins_to_where_the_wheel_has_its_speed_again(runs: Runs):
    measured = runs["low"][1]
    estimator, p = AdhesionLevel(), parameters(measured.vehicle)
    health = estimator.health(measured)
    time = np.arange(0.0, 40.0, 1.0 / RATE)
    speed = 30.0 - 0.8 * np.clip(time - 5.0, 0.0, 30.0)  # brakes as trains do
    _, braking = gates(measured, health, time, speed, p)
    assert not braking.closed.any()
    slipping = speed * np.interp(time, [14.0, 15.0, 27.0, 27.5], [1.0, 0.8, 0.8, 1.0])
    _, slide = gates(measured, health, time, slipping, p)
    inside = (time > 14.5) & (time < 27.0)
    assert slide.closed[inside].all()
    assert not slide.closed[(time < 13.5) | (time > 28.5)].any()


def table(probabilities: list[list[float]], valid: list[float], unlike: float = 0.5) -> pd.DataFrame:
    columns = dict(zip(COLUMNS, np.array(probabilities, dtype=float).T, strict=True))
    count = len(valid)
    more = {"creep_slope [-]": [0.2] * count, "creep_slope_std [-]": [0.02] * count}
    more |= {"unlike_calibration [-]": [unlike] * count, "wheelset_sensors [-]": [1.0] * count, "valid [-]": valid}
    return pd.DataFrame({"time [s]": 10.0 + np.arange(count), **columns, **more})


def test_bogies_are_pooled_by_their_geometric_mean():
    first = table([[0.8, 0.2, 0.0, 0.0], [0.9, 0.1, 0.0, 0.0]], [1.0, 0.0])
    second = table([[0.2, 0.8, 0.0, 0.0], [0.1, 0.9, 0.0, 0.0]], [1.0, 1.0], 0.9)
    both = pooled([first, second])
    assert both[list(COLUMNS)].to_numpy()[0, :2] == pytest.approx([0.5, 0.5], rel=1e-4)
    assert both[list(COLUMNS)].to_numpy()[1, :2] == pytest.approx([0.1, 0.9], rel=1e-4)
    assert both["valid [-]"].tolist() == [1.0, 1.0]
    assert both["unlike_calibration [-]"].tolist() == [0.9, 0.9]
    assert pooled([first]) is first


def test_a_window_of_no_likely_level_is_not_valid():
    reasons: dict[str, Reason] = {}
    found = undecided(table([[0.6, 0.4, 0.0, 0.0], [LIKELY, 1.0 - LIKELY, 0.0, 0.0]], [1.0, 1.0]), reasons)
    assert found["valid [-]"].tolist() == [0.0, 1.0]
    assert found[COLUMNS[0]].tolist() == [0.6, LIKELY]
    assert [one.share for one in reasons.values()] == [0.5]


def test_windows_unlike_the_calibration_or_behind_a_gate_are_withheld():
    time = np.arange(0.0, 40.0, 1.0 / RATE)
    shut = Gate("a test", "nothing", (time > 25.0) & (time < 26.0))
    levels = table([[1.0, 0.0, 0.0, 0.0]] * 12, [1.0] * 12)
    reasons: dict[str, Reason] = {}
    found = withheld(levels, WINDOW, time, [shut], reasons)
    assert found["valid [-]"].tolist() == [1.0] * 11 + [0.0]  # the last one reaches from 16 to 26 s
    assert np.isnan(found[COLUMNS[0]].to_numpy()).tolist() == [False] * 11 + [True]
    assert reasons["a test"].share == pytest.approx(1.0 / 12.0)
    strange: dict[str, Reason] = {}
    unlike = withheld(levels.assign(**{"unlike_calibration [-]": 1.1}), WINDOW, time, [], strange)
    assert not unlike["valid [-]"].to_numpy().any()
    assert list(strange) == ["unlike all of the calibration"]
