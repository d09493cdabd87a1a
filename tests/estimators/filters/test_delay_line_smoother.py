"""Kernels of the track smoother against filterpy on dense matrices, priors against integrals, bounds against limits."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from estimators.filters import delay_line_smoother
from estimators.filters.delay_line_smoother import forward, smooth
from estimators.filters.information import information
from estimators.filters.track_spectrum import (
    ERRI_VERTICAL,
    Noise,
    Passage,
    TrackSpectrum,
    passage,
    step_transition,
    step_transitions,
)
from estimators.signals.bands import BANDS, response
from estimators.vehicle.lateral_roll import lateral
from estimators.vehicle.state_space import Output
from estimators.vehicle.vertical import vertical
from railsim.vehicles.manchester import Manchester

VEHICLE = Manchester().nominal()
OUTPUTS = [Output("rate"), Output("acceleration", (0.3, 0.0, 0.0))]
PRIOR = ERRI_VERTICAL
SPEEDS = (14.0, 17.0)  # m/s
COUNT = 4
SPACING = 2.0 * VEHICLE["semi_wheelbase"] / COUNT


def _noise() -> Noise:
    pair = np.ones(2)
    return Noise(
        np.array([8.7e-5, 7.4e-4]),
        np.array([2e-3, 0.05]),
        np.array([5e-5, 2e-4]),
        100.0 * pair,
        np.array([[5e-3, 0.0], [5e-3, 5e-3]]),
    )


def _passage() -> Passage:
    start = np.array([0.01, 0.01, 0.003, 0.05, 0.05, 0.05])
    system = vertical(VEHICLE, OUTPUTS)
    return passage(
        [lambda _speed: system], [PRIOR], _noise(), [lambda _: np.zeros(6)], np.array(SPEEDS), SPACING, COUNT, start
    )


def _dense(made: Passage, place: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and noise of the whole state, written out."""
    states, rows = len(made.covariance), made.steps.F.shape[1]
    low = int(place)
    share = place - low
    F, Q = np.zeros((states, states)), np.zeros((states, states))
    for table, into in ((made.steps.F, F), (made.steps.Q, Q)):
        columns = made.steps.column if into is F else np.arange(rows)
        high = min(low + 1, len(table) - 1)
        into[np.ix_(np.arange(rows), columns)] = (1 - share) * table[low] + share * table[high]
    for i in range(rows, states):
        F[i, i - 1] = 1.0
    return F, Q


def _along(made: Passage, turning: np.ndarray) -> np.ndarray:
    H = np.zeros((2, len(made.covariance)))
    for j, (output, bias, turn, lean) in enumerate(made.steps.parts):
        H[j, output] += 1.0
        H[j, bias] += 1.0
        H[j, turn] += turning[j, 0]
        H[j, lean] += turning[j, 1]
    return H


def _scaled_inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse of a covariance whose states have very different units, by its correlations."""
    size = np.sqrt(np.diag(matrix))
    return np.linalg.pinv(matrix / np.outer(size, size), rcond=1e-11, hermitian=True) / np.outer(size, size)


def test_smoother_gives_the_numbers_of_filterpy(monkeypatch: pytest.MonkeyPatch):
    rng = np.random.default_rng(3)
    made, count = _passage(), 60
    place = made.table_index(np.linspace(*SPEEDS, count))
    turning = rng.normal(size=(count, 2, 2))
    turning[:, 0, 1] = 0.0
    measured = rng.normal(size=(count, 2)) * [0.01, 0.3]
    measured[20:30] = np.nan
    measured[40, 0] = np.nan
    R = np.full((count, 2), [1e-4, 1e-2])
    x, P = np.zeros(len(made.covariance)), made.covariance.copy()
    settled = np.ones(count, dtype=bool)
    start = x.copy(), P.copy()
    values, variance = smooth(made.steps, place, measured, R, turning, settled, x, P)
    for block in (7, 59, 60):  # the same to the last bit in pieces
        monkeypatch.setattr(delay_line_smoother, "BLOCK", block)
        again = smooth(made.steps, place, measured, R, turning, settled, *(one.copy() for one in start))
        np.testing.assert_array_equal(again, (values, variance))

    reference = KalmanFilter(dim_x=len(made.covariance), dim_z=1)
    reference.x, reference.P = np.zeros((len(made.covariance), 1)), made.covariance.copy()
    means, spreads, Fs, Qs = [], [], [], []
    for k in range(count):
        F, Q = _dense(made, float(place[k]))
        if k:
            reference.predict(F=F, Q=Q)
        for j in range(2):
            if np.isfinite(measured[k, j]):
                reference.update(measured[k, j], R=R[k, j], H=_along(made, turning[k])[j : j + 1])
        means.append(reference.x.copy())
        spreads.append(reference.P.copy())
        Fs.append(F)
        Qs.append(Q)
    smoothed, covariances, _, _ = reference.rts_smoother(
        np.array(means), np.array(spreads), Fs, Qs, inv=_scaled_inverse
    )
    now = made.steps.F.shape[1] - 1
    size = np.abs(smoothed[:, now, 0]).max()
    np.testing.assert_allclose(values[:, 0], smoothed[:, now, 0], atol=1e-4 * size)
    np.testing.assert_allclose(variance[:, 0], covariances[:, now, now], rtol=1e-3)


def test_likelihood_is_the_density_of_all_measurements_together():
    """One Gaussian density of the whole record, whose covariance is written out, without its power of 2 pi."""
    rng = np.random.default_rng(4)
    made, count = _passage(), 12
    place = made.table_index(np.linspace(*SPEEDS, count))
    turning = rng.normal(size=(count, 2, 2))
    turning[:, 0, 1] = 0.0
    measured, R = rng.normal(size=(count, 2)) * [0.01, 0.3], np.full((count, 2), [1e-4, 1e-2])
    among: list[list[np.ndarray]] = [[made.covariance]]  # of the states at step k with those at all steps before
    for k in range(1, count):
        F, Q = _dense(made, float(place[k]))
        among.append([*(F @ before for before in among[-1]), F @ among[-1][-1] @ F.T + Q])
    along = [_along(made, turn) for turn in turning]
    blocks = [
        [along[k] @ (among[k][j] if j <= k else among[j][k].T) @ along[j].T for j in range(count)] for k in range(count)
    ]
    whole, values = np.block(blocks) + np.diag(R.ravel()), measured.ravel()
    expected = -0.5 * (np.linalg.slogdet(whole)[1] + values @ np.linalg.solve(whole, values))
    start = np.zeros(len(made.covariance)), made.covariance.copy()
    likelihood = forward(made.steps, place, measured, R, turning, np.ones(count, dtype=bool), *start, True)[-1]
    assert likelihood == pytest.approx(expected, rel=1e-9)


def test_standstill_makes_the_vehicle_unknown_again():
    made, count = _passage(), 40
    place = np.zeros(count)
    nothing, R, turning = np.full((count, 2), np.nan), np.full((count, 2), 1e-6), np.zeros((count, 2, 2))
    for stopped in (False, True):
        settled = np.full(count, True)
        settled[20] = not stopped
        P = made.covariance.copy()
        forward(made.steps, place, nothing, R, turning, settled, np.zeros(len(P)), P, True)
        assert np.isfinite(P).all()


@pytest.mark.parametrize("prior", [PRIOR, TrackSpectrum(1e-6, 2, (0.02, 0.8, 0.4))])
def test_shaped_noise_has_the_density_it_states(prior: TrackSpectrum):
    k = np.geomspace(1e-7, 1e3, 200_000)
    variance = np.trapezoid(prior.density(k) * k, np.log(k))
    assert prior.stationary()[0, 0] == pytest.approx(variance, rel=1e-4)
    lag = np.trapezoid(prior.density(k) * np.cos(3.0 * k) * k, np.log(k))
    order = len(prior.corners)
    covariance = prior.covariance(1.0, 4)
    assert covariance[order - 1, order + 2] == pytest.approx(lag, rel=1e-3, abs=1e-4 * float(variance))
    assert np.linalg.eigvalsh(covariance).min() > -1e-9 * variance


def test_long_waves_lift_bogie_and_body_alike():
    slow = vertical(VEHICLE, [Output("displacement", (1.0, 0.0, 0.0)), Output("rate")]).response(np.array([1e-3]))
    assert abs(slow[0, 0].sum()) < 1e-6
    assert slow[0, 1] * 2 * VEHICLE["semi_wheelbase"] / 1e-3j == pytest.approx([-1.0, 1.0], rel=1e-5)
    rates = [Output("rate", axis="roll"), Output("rate", axis="yaw")]
    long = lateral(VEHICLE, rates, 20.0).response(np.array([1e-3]))[0]
    lean = (long[0, 1] + long[0, 3]) / 1e-3j
    assert lean.real == pytest.approx(-1 / 1.5, rel=0.15)  # more than the track: the body leans on its springs


def test_bound_goes_from_the_prior_to_the_noise():
    """Useless sensors leave the prior; good ones leave noise / |H|^2 of the gyro and accelerometer together."""
    system, wheelbase = vertical(VEHICLE, OUTPUTS), 2.0 * VEHICLE["semi_wheelbase"]
    noise = _noise()._replace(drift=np.full(2, 1e-12))
    blind = information([system], [PRIOR], noise._replace(density=np.full(2, 1e9)), 20.0, wheelbase, np.zeros(2))
    np.testing.assert_allclose(blind.bound, blind.tracks, rtol=1e-6)
    sharp = information([system], [PRIOR.scaled(1.0)], noise, 20.0, wheelbase, np.zeros(2))
    white = noise.density**2 * 20.0 / (2 * np.pi)
    expected = 1.0 / np.sum(np.abs(sharp.H[:, :, 0]) ** 2 / white, axis=1)
    inside = (sharp.wavenumber > 2 * np.pi / 70.0) & (sharp.wavenumber < 2 * np.pi / 3.0)
    np.testing.assert_allclose(sharp.bound[inside, 0], expected[inside], rtol=1e-3)
    assert (
        sharp.rms(sharp.bound[:, 0], BANDS["d1"])
        < sharp.rms(sharp.bound[:, 0], BANDS["d2"])
        < sharp.rms(sharp.bound[:, 0])
    )


def test_moves_between_exact_speeds_are_splines_of_them():
    speeds = np.geomspace(2.0, 30.0, 200)
    system = vertical(VEHICLE, OUTPUTS)
    exact = np.stack([step_transition(system, 0.125 / speed, 2) for speed in speeds])
    size = np.abs(exact).max(axis=0)
    error = np.abs(step_transitions(lambda _: system, speeds, 0.125, 1) - exact).max(axis=0)
    np.testing.assert_array_less(error, 2e-4 * size + 1e-12)


def test_local_model_error_of_a_wave_is_that_of_its_wavenumber():
    """Half the squared amplitude that the unknowns leave of a pure wave, four times that where it is twice as high."""
    system, other = (vertical(VEHICLE | {"bogie_mass": m * VEHICLE["bogie_mass"]}, OUTPUTS) for m in (1.0, 1.05))
    known = information([system, other], [PRIOR], _noise(), 20.0, 4 * SPACING, np.array([0.01, 0.01]), 0.01)
    s, k, band = np.arange(0.0, 2000.0, 0.125), 2 * np.pi / 12.0, BANDS["d1"]
    height = np.where(s < 1000.0, 1.0, 2.0) * 1e-3
    found = known.local((height * np.sin(k * s))[:, None], 0.125, band)
    left = np.array([np.interp(k, known.wavenumber, one[:, 0, 0]) for one in known.left])
    expected = 0.5 * np.sum(np.abs(left) ** 2) * float(response(np.array([k]), band)[0]) ** 2 * height**2
    for place in (500.0, 1500.0):
        at = round(place / 0.125)
        assert found[at, 0] == pytest.approx(expected[at], rel=0.05)
