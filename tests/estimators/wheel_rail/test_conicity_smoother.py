"""Conicity without a known track: filter against its model, transition against differences, cone on random rails."""

import numpy as np
import pytest

from estimators.wheel_rail.conicity_kernel import RAIL, STATES, Numbers, Y, half_difference, step
from estimators.wheel_rail.conicity_likelihood import SPACING
from estimators.wheel_rail.conicity_smoother import ConicitySmoother
from experiments.scoring.score import scorers
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.track import featured
from railsim.track.track import Track
from railsim.wheelset import conical
from tests.estimators.single_wheelset import recording

R0 = 0.45
NUMBERS = Numbers(
    700.0, 0.75, R0, 2.5e6, 0.0, 7e6, 0.8, 0.02, 1e-3, 20.0, 1e-3, 100.0, 0.05, 0.2, 1e-6, 1e-10, 3e-4
)  # fmt: skip


def line(seed: int) -> Track:
    """Lateral irregularity of 2 mm with ERRI's shape, gauge constant."""
    made = featured.main_line("line", seed=seed)
    return Track(made.s, {"lateral": made.columns()["lateral"]}, "line", [])


def test_transition_matrix_is_the_derivative_of_the_step():
    rng = np.random.default_rng(5)
    table = 0.1 + 20.0 * np.arange(240) * SPACING
    x = rng.standard_normal(STATES) * 1e-3
    F, other = np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
    step(x.copy(), F, table, SPACING, NUMBERS, 30.0, 1 / 128, 0.3)
    for column in range(STATES):
        ends = []
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[column] += sign * 1e-7
            step(moved, other, table, SPACING, NUMBERS, 30.0, 1 / 128, 0.3)
            ends.append(moved)
        assert np.allclose(F[:, column], (ends[0] - ends[1]) / 2e-7, rtol=2e-3, atol=1e-4)


def test_another_conicity_has_a_rail_that_moves_the_wheelset_just_so():
    """The proof that the track's spectrum is needed: F'(y - d') = F(y - d) leaves equation (18) as it is."""
    rng = np.random.default_rng(6)
    own, other = np.full(240, 0.2), np.full(240, 0.1)
    x = rng.standard_normal(STATES) * 1e-3
    x[-1] = 0.0
    twin = x.copy()
    twin[RAIL] = x[Y] - 2.0 * (x[Y] - x[RAIL])
    value, _ = half_difference(own, SPACING, x[Y] - x[RAIL])
    same, _ = half_difference(other, SPACING, twin[Y] - twin[RAIL])
    assert same == pytest.approx(value, rel=1e-12)


@pytest.fixture(scope="module")
def cone():
    measured, run = recording(conical(0.2, R0), line(7), 30.0, 32.0)
    return measured, run, ConicitySmoother(creep=1.0, pieces=4, starts=1, gauge=0.0).estimate(measured)


def test_cone_is_found_without_the_track(cone: tuple):
    measured, _, estimate = cone
    assert estimate.about["effective_conicity [-]"] == pytest.approx(0.2, abs=0.03)
    blind = Measurements(measured.about, {256.0: _table(measured)})
    again = ConicitySmoother(creep=1.0, pieces=4, starts=1, gauge=0.0).estimate(blind)
    assert again.about["effective_conicity [-]"] == estimate.about["effective_conicity [-]"]


def test_shift_relative_to_the_unknown_rails_is_found(cone: tuple):
    _, run, estimate = cone
    true = (run["wheelset.y [m]"] - run["track.left_lateral [m]"]).to_numpy()
    series = estimate.series
    late = series["time [s]"].to_numpy() > 5.0
    error = series["wheelset1.lateral_shift [m]"].to_numpy() - np.interp(series["time [s]"], run["time [s]"], true)
    assert np.std(error[late]) < 0.3 * np.std(true)


def test_cone_is_found_where_the_gauge_may_vary(cone: tuple):
    measured, run, _ = cone
    smoother = ConicitySmoother(creep=1.0, pieces=4, particles=40)
    estimate = smoother.estimate(measured)
    assert estimate.about["effective_conicity [-]"] == pytest.approx(0.2, abs=0.03)
    true = (run["wheelset.y [m]"] - run["track.left_lateral [m]"]).to_numpy()
    late = estimate.series["time [s]"].to_numpy() > 5.0
    error = estimate.series["wheelset1.lateral_shift [m]"].to_numpy() - np.interp(
        estimate.series["time [s]"], run["time [s]"], true
    )
    assert np.std(error[late]) < 0.4 * np.std(true)
    scored = [name for scorer in scorers().values() for name in scorer.columns_of(estimate)]
    assert scored == ["conicity [-]", "track_lateral [m]", "wheelset1.lateral_shift [m]"], (
        "the gauge under the wheelset is no estimate of the track over distance"
    )


def test_a_short_run_on_varying_gauge_is_refused(cone: tuple):
    measured, _, _ = cone
    short = {name: values[:2000] for name, values in _table(measured).items()}
    with pytest.raises(InputError, match="too short"):
        ConicitySmoother(creep=1.0, pieces=4).estimate(Measurements(measured.about, {256.0: short}))


def test_more_data_give_a_smaller_stated_uncertainty(cone: tuple):
    measured, _, _ = cone
    found = []
    for count in (2500, 8000):
        table = {name: values[:count] for name, values in _table(measured).items()}
        smoother = ConicitySmoother(creep=1.0, pieces=4, starts=1, model_error=0.0, gauge=0.0)
        found.append(smoother.estimate(Measurements(measured.about, {256.0: table})).about)
    assert found[1]["effective_conicity_std [-]"] < 0.8 * found[0]["effective_conicity_std [-]"]


def test_standstill_is_refused(cone: tuple):
    measured, _, _ = cone
    table = _table(measured)
    table["wheelset1.speed [m/s]"] = np.zeros(len(table["time [s]"]))
    with pytest.raises(InputError, match="speed"):
        ConicitySmoother().estimate(Measurements(measured.about, {256.0: table}))


def _table(measured: Measurements) -> dict[str, np.ndarray]:
    time = {"time [s]": measured.time("wheelset1.rate_yaw [rad/s]")}
    return time | {name: np.array(measured[name]) for name in measured}
