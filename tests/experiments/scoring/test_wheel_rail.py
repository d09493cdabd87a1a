"""True wheel-rail geometry from a run's channels, and scores against it."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.runs.contact import Case, run
from experiments.scoring.conicity import function_errors, function_scores
from experiments.scoring.score import score
from experiments.scoring.suspension import true_conicity
from experiments.scoring.wheel_rail_truth import cone_of, contact_truth
from railsim import load_scenario, simulate
from railsim.truth import Truth
from railsim.wheelset import WheelsetParameters, cone_conicity

SLOPE = 0.1


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Truth:
    """Cones on a rough track."""
    scenario = load_scenario("wheelset_new", {"vehicle.pair": {"kind": "conical", "conicity": SLOPE}, "duration": 15})
    return simulate(scenario, "compiled", tmp_path_factory.mktemp("truth") / "run")


def test_cone_has_its_conicity_at_every_shift(truth: Truth) -> None:
    """Klingel's: the slope of the cone itself."""
    table = contact_truth(truth).table
    expected = SLOPE
    columns = {name: table[name].to_numpy() for name in ("local [-]", "secant [-]", "share [-]")}
    common = columns["share [-]"] > 0.01
    np.testing.assert_allclose(columns["local [-]"][common], expected, rtol=5e-3)
    np.testing.assert_allclose(columns["secant [-]"][common], expected, rtol=2e-2)
    assert columns["share [-]"].sum() == pytest.approx(1.0, abs=0.01)


def test_over_the_axle_a_cone_is_steeper(truth: Truth) -> None:
    """Over y - d it is slope / (1 - slope r0 / l), as roll carries the treads outwards (Wickens 2003, section 2.5)."""
    found = contact_truth(truth)
    axle = truth["wheelset1.y [m]"] - found.track
    expected = cone_conicity(SLOPE, WheelsetParameters())
    assert cone_of(axle, found.half_difference) == pytest.approx(expected, rel=5e-3)
    assert cone_of(found.shift, found.half_difference) == pytest.approx(SLOPE, rel=5e-3)
    assert np.isnan(cone_of(np.ones(3), np.ones(3)))


def test_shift_is_that_of_the_wheels_contact_functions(truth: Truth) -> None:
    """Each wheel has its own over its own rail, half the gauge deviation aside."""
    wheels = [truth[f"wheel1_{side}.lateral_shift [m]"] for side in ("left", "right")]
    np.testing.assert_allclose(contact_truth(truth).shift, (wheels[0] + wheels[1]) / 2.0, atol=2e-5)


def test_cross_level_is_no_shift(tmp_path: Path) -> None:
    """Both scorers' conicity on rails of uneven height: the slope of the profiles, 0.15 by their closed form."""
    scenario = load_scenario("suspension", {"duration": 8.0})
    run_of_half = simulate(scenario, "compiled", tmp_path / "run")
    found = contact_truth(run_of_half)
    cross_level = run_of_half["track1.left_vertical [m]"] - run_of_half["track1.right_vertical [m]"]
    assert np.std(cross_level) > 1e-3
    assert cone_of(found.shift, found.half_difference) == pytest.approx(0.15, rel=0.01)
    assert true_conicity(run_of_half) == pytest.approx(0.15, rel=0.01)
    axle = run_of_half["wheelset1.y [m]"] - found.track
    assert abs(cone_of(axle, found.half_difference) - 0.15) > 0.005


def test_sum_of_angles_is_that_of_two_cones(truth: Truth) -> None:
    found = contact_truth(truth)
    np.testing.assert_allclose(found.sum_of_angles, 2.0 * np.arctan(SLOPE), rtol=2e-3)
    np.testing.assert_allclose(found.effective(2.0), SLOPE, rtol=2e-2)


def test_perfect_and_shifted_estimates(truth: Truth) -> None:
    true = contact_truth(truth)
    shift = true.table["shift [m]"].to_numpy()
    function = {"shift [m]": shift.tolist(), "conicity [-]": (true.table["secant [-]"] + 0.02).tolist()}
    function |= {"conicity_std [-]": [0.011] * len(shift), "kind": "secant"}
    time = np.arange(0.0, 15.0, 0.1)
    value = np.interp(time, true.time, true.effective(4.0))
    series = pd.DataFrame({"time [s]": time, "conicity [-]": value, "conicity_std [-]": 0.01})
    series["sum_of_radii [m]"] = np.interp(time, true.time, true.sum_of_radii) + 1e-4
    found = score(Estimate("test", series, {"conicity_function": function}), truth)
    assert found["conicity rms error [-]"] == pytest.approx(0.0, abs=1e-12)
    assert found["conicity within 2 std [-]"] == 1.0
    assert found["function rms error by data [-]"] == pytest.approx(0.02)
    assert found["function inner largest error [-]"] == pytest.approx(0.02)
    assert found["function within 2 std [-]"] == pytest.approx(1.0)
    assert found["sum_of_radii rms error [mm]"] == pytest.approx(0.1)


def test_shifts_outside_the_function_are_not_judged(truth: Truth) -> None:
    true = contact_truth(truth)
    narrow = {"shift [m]": [-5e-4, 5e-4], "conicity [-]": [0.1, 0.1]}
    errors = function_errors(narrow, true)
    known = np.isfinite(errors["estimate [-]"].to_numpy())
    assert np.abs(errors["shift [m]"].to_numpy()[known]).max() <= 5e-4 + 1e-9
    assert 0.0 < function_scores(errors)["function covered [-]"] < 1.0


def test_cases_are_true_to_their_wear_and_silent_about_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("RAILSIM_CACHE", str(tmp_path))
    new, about_new = run(Case(seed=3, duration=2.0), "compiled")
    worn, about_worn = run(Case(seed=3, duration=2.0, wear=0.2), "compiled")
    assert about_new.vehicle == about_worn.vehicle
    assert about_new.vehicle["wheelset_mass"] == load_scenario("wheelset_new").vehicle.nominal()["wheelset_mass"]
    assert new.about["vehicle"]["wheelset_mass [kg]"] != about_new.vehicle["wheelset_mass"]
    assert not np.array_equal(new["wheel1_left.rolling_radius [m]"], worn["wheel1_left.rolling_radius [m]"])
