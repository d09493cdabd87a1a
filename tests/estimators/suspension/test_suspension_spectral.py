"""The spectral estimator and the filters' self-check on laden, slippery and whole vehicles."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import scenarios
from estimators.suspension.base import SuspensionEstimator
from estimators.suspension.spectral_vehicle import nominal_vehicle
from estimators.suspension.suspension_ekf import SuspensionEkf
from estimators.suspension.suspension_ml import SuspensionMl
from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.suspension_spectral import SuspensionSpectral
from estimators.suspension.suspension_ukf import SuspensionUkf
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import FULL, PARAMETERS, half_vehicle, nominal
from estimators.vehicle.creep import DRY_ROLLING
from estimators.vehicle.lateral_frequency import respond
from railsim import InputError, load_scenario, measure, simulate
from railsim.measurements import Measurements
from tests.estimators.suspension_rig import changed

SECONDS = 25.0
WHOLE: dict[str, Any] = {"vehicle": "class175_whole", "duration": SECONDS}
PAYLOAD = {"kind": "payload", "mass": 8600.0}
"""A quarter of the body."""


@lru_cache(maxsize=8)
def whole(*effects: tuple[str, str, float]) -> Measurements:
    """The shipped scenario's sensors on the whole vehicle, by the compiled engine; effects as kind, field, value."""
    sensors = yaml.safe_load((Path(scenarios.__file__).parent / "suspension.yaml").read_text())["sensors"]
    for sensor in sensors:
        if sensor["name"] == "body":
            sensor["position"] = [8.0, 0.0, -0.7]  # on the floor over the leading bogie
    found = [{"kind": kind, field: value} for kind, field, value in effects]
    scenario = load_scenario("suspension", {**WHOLE, "sensors": sensors, "effects": found})
    return measure(simulate(scenario, "compiled"), scenario).measurements


def shares(measurements: Measurements, estimator: Any) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Shares of the dampers' nominal damping, stated deviations, and the verdicts."""
    estimate = estimator.estimate(measurements)
    last, built = estimate.series.iloc[-1], nominal(measurements.vehicle)[:2]
    mean, std = (last[list(names)].to_numpy(dtype=float) for names in (PARAMETERS[:2], map(std_name, PARAMETERS[:2])))
    return mean / built, std / built, [entry["verdict"] for entry in estimate.about["verdicts"]]


LOADED = ("payload", "mass", 8600.0)
SLIPPERY = ("low_adhesion", "factor", 0.25)


@pytest.mark.parametrize("circumstances", [(), (LOADED,), (LOADED, SLIPPERY)])
def test_healthy_dampers_of_a_whole_vehicle_are_not_accused(circumstances: tuple):
    mean, std, verdicts = shares(whole(*circumstances), SuspensionSpectral())
    assert set(verdicts[:2]) <= {"healthy", "cannot tell"}
    assert (np.abs(mean - 1.0) < np.maximum(2.0 * std, 0.1)).all()
    assert (std < 0.2).all()


@pytest.mark.parametrize(("kind", "which"), [("weak_lateral_damper", 0), ("weak_yaw_damper", 1)])
@pytest.mark.parametrize(("left", "verdict"), [(0.5, "degraded"), (0.0, "failed")])
def test_a_damper_that_lost_half_or_all_is_called_under_load(kind: str, which: int, left: float, verdict: str):
    mean, _, verdicts = shares(whole(LOADED, (kind, "factor", left)), SuspensionSpectral())
    assert verdicts[which] == verdict
    assert verdicts[1 - which] != verdict
    assert mean[which] == pytest.approx(left, abs=0.1)


@pytest.mark.parametrize("estimator", [SuspensionMl(), SuspensionEkf(), SuspensionRbpf(), SuspensionUkf()])
def test_filters_of_half_a_vehicle_refuse_a_whole_one_and_name_what_takes_it(estimator: SuspensionEstimator):
    measured = whole(LOADED)
    assert not estimator.fits(measured)
    with pytest.raises(InputError, match="use suspension_spectral"):
        estimator.estimate(measured)
    assert SuspensionSpectral().fits(measured)


def _half_stated(measured: Measurements) -> Measurements:
    """The same with about.json that gives half of the vehicle."""
    stated = {name: value for name, value in measured.vehicle.items() if not name.startswith(("whole_", "body_yaw"))}
    sensors = [dict(one) for one in measured.about["sensors"]]
    for sensor in sensors:
        if sensor["name"] == "body":
            sensor["position"] = [0.0, 0.0, -0.7]  # from the centre of half a body
    about = {**measured.about, "vehicle": stated, "sensors": sensors}
    return changed(measured, about=about)


@pytest.mark.parametrize("estimator", [SuspensionMl(keep_every=4, starts=4), SuspensionEkf()])
def test_filters_on_a_whole_vehicle_of_which_only_half_is_stated_tell_nothing_and_say_why(
    estimator: SuspensionEstimator,
):
    estimate = estimator.estimate(_half_stated(whole(LOADED)))
    assert {entry["verdict"] for entry in estimate.about["verdicts"]} == {"cannot tell"}
    assert any("chi-square" in line for line in estimate.about["warnings"])
    assert estimate.series["valid [-]"].to_numpy()[-1] == 0.0


def test_a_vehicle_without_yaw_dampers_has_none():
    scenario = load_scenario("suspension", {"vehicle": "manchester", "duration": SECONDS})
    estimate = SuspensionSpectral().estimate(measure(simulate(scenario, "compiled"), scenario).measurements)
    assert estimate.series[PARAMETERS[0]].to_numpy()[-1] == pytest.approx(2 * 32e3, rel=0.05)
    assert [entry["verdict"] for entry in estimate.about["verdicts"]] == ["healthy", "not there", "healthy"]


def test_half_a_vehicle_is_told_from_a_whole_one_where_about_json_leaves_it_open():
    scenario = load_scenario("suspension", {"duration": SECONDS})
    half = measure(simulate(scenario, "compiled"), scenario).measurements
    assert SuspensionSpectral().estimate(half).about["structure_found"] == "half"
    measured = whole()
    assert SuspensionSpectral().estimate(_half_stated(measured)).about["structure_found"] == "whole"


def test_without_a_place_the_track_counts_as_unknown_and_it_says_so():
    measured = changed(whole(), without=("gnss.position_east [m]", "gnss.position_north [m]"))
    estimate = SuspensionSpectral().estimate(measured)
    assert any("the track counts as unknown" in line for line in estimate.about["warnings"])
    assert not {"degraded", "failed"} & {entry["verdict"] for entry in estimate.about["verdicts"]}


def test_a_curve_tells_of_lateral_dampers_alone():
    changes = {"track": "curve_r400", "speed": {"kind": "constant", "speed": 14.0}, "start": 250.0}
    scenario = load_scenario("suspension", {**WHOLE, **changes})
    measured = measure(simulate(scenario, "compiled"), scenario).measurements
    estimate = SuspensionSpectral().estimate(measured)
    assert [entry["verdict"] for entry in estimate.about["verdicts"]] == ["healthy", "cannot tell", "cannot tell"]
    assert any("curve" in line for line in estimate.about["warnings"])


def test_nothing_usable_is_said_in_words():
    measured = whole()
    speed = "wheelset1_axle.speed [m/s]"
    wheel = "wheelset1_axle.wheel_speed [rad/s]"
    slow = changed(measured, {name: 0.1 * measured[name] for name in (speed, wheel)})
    estimate = SuspensionSpectral().estimate(changed(slow, without=("gnss.speed [m/s]",)))
    assert {entry["verdict"] for entry in estimate.about["verdicts"]} == {"cannot tell"}
    assert any("speed under 5 m/s" in line for line in estimate.about["warnings"])
    assert np.isnan(estimate.series[PARAMETERS[0]].to_numpy()).all()


def test_half_of_the_structure_is_the_filters_vehicle():
    """Responses over the rails and over forces agree with the states of `affine` at any parameters."""
    scenario = load_scenario("suspension", {"duration": 1.0})
    vehicle = measure(simulate(scenario, "compiled"), scenario).measurements.vehicle
    built = nominal(vehicle)
    model = nominal_vehicle(vehicle, {}, FULL, False, DRY_ROLLING, (1.0, 1.0))
    s = 2j * np.pi * np.array([0.3, 1.0, 3.0, 7.0])
    values = np.array([0.8, 0.7, 0.1, *np.zeros(len(model.unknowns) - 3)])
    found = respond(model.matrices(values, 30.0, range(7)), model.dampers, model.shares(values), s)
    half = half_vehicle(vehicle, 30.0, FULL, DRY_ROLLING)
    A, B, C, D = half.at([0.8 * built[0], 0.7 * built[1], built[2] * np.exp(0.1)])
    by_input = C @ np.linalg.solve(s[:, None, None] * np.eye(len(A)) - A, B.astype(complex)) + D
    by_rate = s[:, None, None]
    rails = by_input[:, :, :4] + by_rate * by_input[:, :, [6, 7, 4, 5]]
    assert np.abs(found.rails - rails).max() < 1e-9 * np.abs(rails).max()
