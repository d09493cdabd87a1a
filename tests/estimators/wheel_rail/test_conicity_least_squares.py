"""Conicity by least squares: on cones and on a known function, from ideal sensors and the exact track."""

import numpy as np
import pytest

from estimators.wheel_rail.conicity_least_squares import ConicityLeastSquares
from estimators.wheel_rail.cubic_splines import Pieces
from estimators.wheel_rail.known_rails import Survey
from estimators.wheel_rail.wheelset_motion import wheelset_motion
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.wheelset import conical, rolling_table
from tests.estimators.single_wheelset import START, recording, waves

R0 = 0.45


def cubic_wheel(slope: float, bend: float):
    """Radius r0 + slope u + bend u^3: (r_L - r_R) / 2 over u is slope + bend u^2."""
    u = np.linspace(-0.02, 0.02, 401)
    return rolling_table(u, R0 + slope * u + bend * u**3, slope + 3.0 * bend * u**2)


def test_pieces_hold_a_cubic_and_its_curvature_is_not_penalised_where_there_is_none():
    pieces = Pieces(-1.0, 2.0, 7)
    x = np.linspace(-1.0, 1.999, 200)
    basis = pieces.basis(x)
    wanted = 0.3 - x + 0.5 * x**2 + 2.0 * x**3
    found = basis @ np.linalg.lstsq(basis, wanted, rcond=None)[0]
    assert np.allclose(found, wanted, atol=1e-9)
    line = np.arange(pieces.size, dtype=float)
    assert np.allclose(pieces.roughness() @ line, 0.0)


@pytest.mark.parametrize("conicity", [0.1, 0.3])
def test_cone(conicity: float):
    measured, _ = recording(conical(conicity, R0), waves(900.0), 25.0, 30.0)
    about = ConicityLeastSquares(pieces=(4, 8)).estimate(measured).about
    assert np.allclose(about["conicity_function"]["conicity [-]"], conicity, atol=0.01)
    assert about["offset [m]"] == pytest.approx(START, abs=0.1)
    assert about["creep_coefficient [N]"] == pytest.approx(1e7, rel=0.1)


def test_function_of_the_shift_with_gauge_variation_at_nominal_gauge():
    slope, bend = 0.12, 3000.0
    measured, run = recording(cubic_wheel(slope, bend), waves(900.0, gauge=1.5e-3), 25.0, 30.0)
    estimate = ConicityLeastSquares(pieces=(4, 8)).estimate(measured)
    function = estimate.about["conicity_function"]
    shift = np.array(function["shift [m]"])
    inner = np.abs(shift) < 0.8 * np.abs(shift).max()
    error = np.array(function["at_nominal_gauge [-]"]) - (slope + bend * shift**2)
    assert np.abs(error[inner & (np.abs(shift) > 5e-4)]).max() < 0.02
    true = (run["wheelset.y [m]"] - (run["track.left_lateral [m]"] + run["track.right_lateral [m]"]) / 2.0).to_numpy()
    found = estimate.series["wheelset1.lateral_shift [m]"].to_numpy()
    valid = np.isfinite(found)
    assert valid.mean() > 0.5
    assert np.std((found - true)[valid]) < 0.1 * np.std(true)


def test_place_on_the_track_is_found_from_the_path():
    measured, _ = recording(conical(0.15, R0), waves(900.0), 25.0, 30.0)
    motion = wheelset_motion(measured, 100.0, 20.0)
    assert Survey(measured).find(motion) == pytest.approx(START, abs=1.5)


def test_gaps_make_samples_invalid_and_do_not_spoil_the_rest():
    measured, _ = recording(conical(0.2, R0), waves(900.0), 25.0, 30.0)
    gyro = np.array(measured["wheelset1.rate_yaw [rad/s]"])
    gyro[3000:3100] = np.nan
    table = {"time [s]": measured.time("wheelset1.rate_yaw [rad/s]")}
    table |= {name: np.array(measured[name]) for name in measured}
    table["wheelset1.rate_yaw [rad/s]"] = gyro
    lossy = Measurements(measured.about, {256.0: table}, measured.track)
    estimate = ConicityLeastSquares(pieces=(4,)).estimate(lossy)
    assert estimate.series["conicity [-]"].isna().to_numpy()[3005:3095].all()
    assert np.allclose(estimate.about["conicity_function"]["conicity [-]"], 0.2, atol=0.02)


def test_without_measured_track_the_line_says_what_to_add():
    measured, _ = recording(conical(0.2, R0), waves(900.0), 25.0, 15.0)
    table = {"time [s]": measured.time("wheelset1.rate_yaw [rad/s]")} | {name: measured[name] for name in measured}
    blind = Measurements(measured.about, {256.0: table})
    assert not ConicityLeastSquares().fits(blind)
    with pytest.raises(InputError, match="track_measured"):
        ConicityLeastSquares().estimate(blind)
