"""Suspension estimators on runs of the nonlinear vehicle."""

import numpy as np
import pytest

from estimators.suspension.base import SuspensionEstimator
from estimators.suspension.suspension_ekf import SuspensionEkf
from estimators.suspension.suspension_ml import SuspensionMl
from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.suspension_ukf import SuspensionUkf
from estimators.suspension.verdicts import damper, profiles, std_name
from estimators.vehicle.affine import FULL, PARAMETERS
from experiments.scoring.suspension import true_parameters
from railsim import load_scenario, measure, simulate
from railsim.errors import InputError
from tests.estimators.suspension_rig import changed, recording

FAST = SuspensionRbpf(particles=300, keep_every=4)
"""Small enough for tests; `railsim figure fig07` judges the accuracy."""


def relative(series, true: np.ndarray) -> np.ndarray:
    """Error at the end: dampers over the true ones, conicity as it is."""
    found = series.iloc[-1][list(PARAMETERS)].to_numpy(dtype=float)
    return np.append(found[:2] / true[:2] - 1.0, found[2] - true[2])


@pytest.mark.parametrize("wheelsets", [True, False])
def test_healthy_dampers_and_conicity_are_found(wheelsets: bool):
    run = recording()
    estimate = FAST.but(wheelset_sensors=wheelsets).estimate(run.measurements)
    assert run.truth is not None
    lateral, turn, conicity = np.abs(relative(estimate.series, true_parameters(run.truth)))
    assert lateral < 0.05
    assert turn < 0.2  # half the time that the paper's claim has
    assert conicity < 0.02
    assert [one["verdict"] for one in estimate.about["verdicts"]] == ["healthy"] * 3


def test_a_wheelset_rolls_as_far_as_its_contact_angle_tilts_it():
    """Roll against the rails over the shift: (delta / l) / (1 - r delta / l), which `vehicle.lateral` takes."""
    run = recording(12.0)
    truth, p = run.truth, run.measurements.vehicle
    assert truth is not None
    left, right, rail = (truth[f"track1.{name} [m]"] for name in ("left_vertical", "right_vertical", "left_lateral"))
    tilt = (left - right) / (2.0 * p["half_gauge"])
    shift = truth["wheelset1.y [m]"] + p["wheel_radius"] * tilt - (rail + truth["track1.right_lateral [m]"]) / 2.0
    found = np.polyfit(shift, truth["wheelset1.roll [rad]"] - tilt, 1)[0]
    slope = p["design_contact_angle"] / p["half_gauge"]
    assert found == pytest.approx(slope / (1.0 - p["wheel_radius"] * slope), rel=0.03)


@pytest.mark.parametrize("kind", [FAST, SuspensionMl(keep_every=4, starts=8), SuspensionEkf()])
def test_a_vehicle_without_yaw_dampers_has_none_and_its_lateral_ones_are_found(kind: SuspensionEstimator):
    scenario = load_scenario("suspension", {"vehicle": "manchester", "duration": 20.0})
    run = measure(simulate(scenario, "compiled"), scenario)
    estimate = kind.estimate(run.measurements)
    assert estimate.series[PARAMETERS[0]].to_numpy()[-1] == pytest.approx(2 * 32e3, rel=0.05)
    assert estimate.series[std_name(PARAMETERS[0])].to_numpy()[-1] < 0.05 * 64e3
    assert estimate.series[PARAMETERS[1]].to_numpy()[-1] == 0.0
    assert [entry["verdict"] for entry in estimate.about["verdicts"]] == ["healthy", "not there", "healthy"]


def test_half_a_damper_is_called_degraded():
    estimate = FAST.but(wheelset_sensors=False).estimate(recording(20.0, 10e3).measurements)
    assert estimate.about["verdicts"][0]["verdict"] == "degraded"
    assert estimate.series[PARAMETERS[0]].to_numpy()[-1] == pytest.approx(20e3, rel=0.1)


def test_maximum_likelihood_agrees_with_the_particles():
    run = recording()
    particles = SuspensionRbpf(particles=600, keep_every=4)  # with 300 chance alone moves the yaw dampers by 9e4
    both = [one.estimate(run.measurements).series for one in (particles, SuspensionMl(keep_every=4, starts=16))]
    particles, fit = (series.iloc[-1][list(PARAMETERS)].to_numpy(dtype=float) for series in both)
    assert (np.abs(particles - fit) < (2e3, 8e4, 0.01)).all()


def test_level_of_an_unknown_track_comes_out_where_it_is_assumed_three_times_too_low():
    """The run's track is ERRI B176 low: level 1."""
    estimator = SuspensionMl(
        keep_every=4, starts=8, wheelset_sensors=False, track="unknown", track_level=0.3, fit_level=True
    )
    found = estimator.estimate(recording().measurements)
    assert found.about["track_level"] == pytest.approx(1.0, rel=0.35)
    assert found.series[PARAMETERS[2]].to_numpy()[-1] == pytest.approx(0.15, abs=0.04)


@pytest.mark.parametrize("value", [np.nan, 0.0, 78.5])
def test_a_dead_channel_gives_the_bytes_of_a_recording_without_it(value: float):
    run, name = recording(12.0).measurements, FULL[0]
    dead = FAST.but(particles=50).estimate(changed(run, {name: np.full(len(run[name]), value)}))
    absent = FAST.but(particles=50).estimate(changed(run, without=(name,)))
    assert dead.series.to_numpy().tobytes() == absent.series.to_numpy().tobytes()
    assert [entry["channel"] for entry in dead.about["left_out"]] == [name]
    assert dead.about["warnings"]


def test_a_channel_that_gets_stuck_is_left_out_from_then_on():
    run, name = recording(20.0).measurements, FULL[4]
    values = run[name].copy()
    values[2560:] = values[2560]
    stuck = FAST.but(particles=200).estimate(changed(run, {name: values}))
    clean = FAST.but(particles=200).estimate(run)
    assert np.array_equal(stuck.series.iloc[:20].to_numpy(), clean.series.iloc[:20].to_numpy())
    assert stuck.series[PARAMETERS[0]].to_numpy()[-1] == pytest.approx(40e3, rel=0.1)
    assert [entry["reason"] for entry in stuck.about["left_out"]] == ["stuck"]


def test_too_few_particles_are_flagged_and_said():
    estimate = FAST.but(particles=10, smallest_share=0.01).estimate(recording(12.0).measurements)
    assert estimate.series["degenerate [-]"].to_numpy().any()
    assert any("particles carried the weight" in line for line in estimate.about["warnings"])


def test_same_seed_gives_the_same_bytes():
    run = recording(12.0).measurements
    first, second = (FAST.but(particles=50).estimate(run).series for _ in range(2))
    assert first.to_numpy().tobytes() == second.to_numpy().tobytes()


def test_without_a_track_the_known_one_is_asked_for():
    run = recording(12.0).measurements
    with pytest.raises(InputError, match="GNSS|place|gnss"):
        SuspensionRbpf().estimate(changed(run, without=("gnss.position_east [m]",)))


def test_verdicts_keep_from_their_limits():
    assert damper(1.0, 0.05, 1.0) == "healthy"
    assert damper(0.8, 0.05, 1.0) == "cannot tell"
    assert damper(0.7, 0.05, 1.0) == "cannot tell"
    assert damper(0.6, 0.05, 1.0) == "degraded"
    assert damper(0.1, 0.05, 1.0) == "failed"
    assert damper(0.5, 0.5, 1.0) == "cannot tell"
    assert damper(0.0, 0.4, 1.0) == "cannot tell"  # at the bound, with little known: dampings are not below zero
    assert damper(np.nan, 0.1, 1.0) == "cannot tell"
    assert damper(0.0, 0.0, 0.0) == "not there"
    assert profiles(0.15, 0.02) == "healthy"
    assert profiles(0.5, 0.02) == "degraded"


@pytest.mark.parametrize("kind", [SuspensionEkf, SuspensionUkf])
def test_filters_of_state_and_parameters_find_the_lateral_damper(kind: type[SuspensionEkf]):
    run = recording(12.0).measurements
    series = kind(wheelset_sensors=False, every=8).estimate(run).series
    assert series[PARAMETERS[0]].to_numpy()[-1] == pytest.approx(40e3, rel=0.1)
    assert series[PARAMETERS[2]].to_numpy()[-1] == pytest.approx(0.15, abs=0.03)
