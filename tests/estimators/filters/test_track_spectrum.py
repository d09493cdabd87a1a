"""Tables of the track smoother and spectra of its noise, against numerical integration and closed forms."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp
from scipy.linalg import expm

from estimators.filters.information import Information, information
from estimators.filters.track_spectrum import SPEED_STEP, Noise, Passage, TrackSpectrum, passage
from estimators.signals.bands import BANDS, response
from estimators.vehicle.state_space import System

PRIORS = [TrackSpectrum(1e-6, 2, (0.02, 0.8, 0.4)), TrackSpectrum(2e-6, 0, (0.03, 0.5))]
SPEED, SPACING, COUNT = 20.0, 0.5, 3  # m/s, m, steps in a wheelbase
DURATION = SPACING / SPEED  # s, of a step
TILT = np.array([[5e-3, 0.0], [6e-3, 4e-3]])  # rad
SIZES = (2, 2, 2)  # states of the vehicle, readings, quantities of the track


def _system(twice: bool) -> System:
    """A vehicle of random numbers; with `twice` its readings feel second derivatives of the track too."""
    (n, m, q), rng = SIZES, np.random.default_rng(5)
    A = np.array([[0.0, 1.0], [-400.0, -6.0]])
    B, E, D, G, J = (rng.normal(size=(rows, 2 * q)) for rows in (n, n, m, m, m))
    return System(A, 30.0 * B, E, rng.normal(size=(m, n)), D, 0.02 * G, 1e-3 * J if twice else None)


def _noise() -> Noise:
    m = SIZES[1]
    bias, drift = np.array([0.4, 0.5]), np.array([0.3, 1.2])
    return Noise(np.full(m, 1e-3), bias, drift, np.array([50.0, 80.0]), TILT)


def _tables(system: System, speeds: tuple[float, float] = (SPEED, SPEED), drive: float = 0.0) -> Passage:
    drives = [lambda _: np.full(SIZES[0], drive)]
    return passage([lambda _: system], PRIORS, _noise(), drives, np.array(speeds), SPACING, COUNT, np.full(2, 0.1))


class _Before(NamedTuple):
    """State before a step: the whole, and what is in it."""

    state: np.ndarray
    vehicle: np.ndarray
    track: np.ndarray  # heights one step ahead, here, one step ago ..., (places, q)


def _before(made: Passage, places: int, seed: int) -> _Before:
    """A random state whose track goes on as its shaping states say, without new noise."""
    n, _, q = SIZES
    state = np.random.default_rng(seed).normal(size=len(made.covariance))
    rows = made.steps.F.shape[1]
    ahead = made.steps.F[0, -q:] @ state[made.steps.column]
    heights = np.concatenate([ahead, state[rows - q : rows - q + q * places]]).reshape(-1, q)
    return _Before(state, state[:n], heights)


def _integrated(system: System, before: _Before) -> tuple[np.ndarray, np.ndarray]:
    """States after a step and mean readings over it, on heights that go in straight lines from place to place."""
    lead, trail = before.track[:2][::-1], before.track[COUNT : COUNT + 2][::-1]
    start, end = np.concatenate([lead[0], trail[0]]), np.concatenate([lead[1], trail[1]])
    slope = (end - start) / DURATION

    def rates(time: float, both: np.ndarray) -> np.ndarray:
        inputs = start + slope * time
        x = both[: SIZES[0]]
        moved = system.A @ x + system.B @ inputs + system.E @ slope
        return np.concatenate([moved, system.C @ x + system.D @ inputs + system.G @ slope])

    at_start = np.concatenate([before.vehicle, np.zeros(SIZES[1])])
    found = solve_ivp(rates, (0.0, DURATION), at_start, rtol=1e-10, atol=1e-12).y[:, -1]
    return found[: SIZES[0]], found[SIZES[0] :] / DURATION


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_step_is_the_integral_over_the_track_under_both_wheelsets(twice: bool, seed: int):
    """Where readings feel second derivatives: central differences of the heights about the place before the step."""
    n, system = SIZES[0], _system(twice)
    made = _tables(system)
    output, bias, *_ = made.steps.parts.T
    before = _before(made, COUNT + 2, seed)
    after = made.steps.F[0] @ before.state[made.steps.column]
    states, readings = _integrated(system, before)
    if system.J is not None:
        bends = [before.track[i] - 2.0 * before.track[i + 1] + before.track[i + 2] for i in (0, COUNT)]
        readings = readings + system.J @ np.concatenate(bends) / DURATION**2
    assert after[:n] == pytest.approx(states, rel=1e-7)
    assert after[output] == pytest.approx(readings, rel=1e-7)
    assert np.array_equal(after[bias], before.state[bias])


def test_second_differences_of_a_cubic_track_are_its_second_derivative():
    """Height s^3 / 6: its second derivative by time is V^2 s, under the trailing wheelset V^2 (s - wheelbase)."""
    (n, m, q), place = SIZES, 0.7
    none = np.zeros((n, 2 * q))
    J = np.array([[0.7, 0.2, -0.3, 0.5], [1.1, -0.4, 0.6, 0.9]])
    system = System(np.array([[0.0, 1.0], [-1.0, -1.0]]), none, none, np.zeros((m, n)), np.zeros_like(J), 0.0 * J, J)
    made = _tables(system)
    rows = made.steps.F.shape[1]
    state = np.zeros(len(made.covariance))
    heights = (place - SPACING * np.arange(COUNT + 2)) ** 3 / 6.0
    state[rows - q : rows - q + q * (COUNT + 2)] = np.outer(heights, [1.0, -2.0]).ravel()
    ahead, track = np.array([1.0, -2.0]) * (place + SPACING) ** 3 / 6.0, made.steps.F[0, -q:]
    hidden = (made.steps.column >= made.steps.parts.max() + 1) & (made.steps.column < rows - q)
    shaping = np.linalg.lstsq(track[:, hidden], ahead - track @ state[made.steps.column], rcond=None)[0]
    state[made.steps.column[hidden]] = shaping  # so that the track goes on as the cubic
    found = (made.steps.F[0] @ state[made.steps.column])[made.steps.parts[:, 0]]
    lead, trail = place, place - COUNT * SPACING
    assert found == pytest.approx(SPEED**2 * J @ [lead, -2.0 * lead, trail, -2.0 * trail], rel=1e-7)


def test_noise_of_a_step_is_what_the_track_and_the_drives_bring():
    """A bias drifts so that its drifting part keeps its variance: 2 drift^2 dt / T a step. What drives the states is in
    them after the step and in the mean outputs over it: integrals over the time left, by the trapezoidal rule.
    """
    (n, m, q), drive = SIZES, 0.03
    system = _system(False)
    made, quiet = _tables(system, drive=drive), _tables(system)
    brought = made.steps.Q[0] - quiet.steps.Q[0]
    left = np.linspace(0.0, DURATION, 4001)
    moved = np.stack([expm(system.A * one) for one in left])
    mean = system.C @ np.concatenate([np.zeros((1, n, n)), cumulative_trapezoid(moved, left, axis=0)]) / DURATION
    both = np.concatenate([moved, mean], axis=1)
    expected = drive * np.trapezoid(both @ np.swapaxes(both, 1, 2), left, axis=0)
    assert brought[: n + m, : n + m] == pytest.approx(expected, rel=1e-5, abs=1e-9 * expected.max())
    assert not brought[n + m :].any()
    drifting = np.diag(quiet.steps.Q[0])[quiet.steps.parts[:, 1]]
    assert drifting == pytest.approx([2.0 * 0.09 * DURATION / 50.0, 2.0 * 1.44 * DURATION / 80.0])
    rows = made.steps.F.shape[1]
    lately = quiet.steps.Q[0][rows - q :, rows - q :]
    gone = [prior.step(SPACING)[0] @ prior.stationary() @ prior.step(SPACING)[0].T for prior in PRIORS]
    left = [prior.stationary()[0, 0] - moved[0, 0] for prior, moved in zip(PRIORS, gone, strict=True)]
    assert lately == pytest.approx(np.diag(left), rel=1e-6, abs=1e-18)  # a stationary track stays as rough as it is


def test_start_knows_of_a_bias_what_its_constant_and_its_drifting_part_leave():
    """Of 0.4 and 0.3: 0.5; of 0.5 and 1.2: 1.3. Tilts have their own."""
    made = _tables(_system(False))
    spread = np.sqrt(np.diag(made.covariance))
    assert spread[: SIZES[0]] == pytest.approx([0.1, 0.1])
    assert spread[made.steps.parts[:, 1]] == pytest.approx([0.5, 1.3])
    assert spread[made.steps.parts[:, 2:]][TILT > 0] == pytest.approx(TILT[TILT > 0])


def test_between_the_speeds_of_the_tables_a_step_is_that_of_the_speed_itself():
    made = _tables(_system(True), (14.0, 17.0))
    assert np.diff(np.log(made.speeds)).max() <= SPEED_STEP
    place = float(made.table_index(np.array(15.53)))
    low, share = int(place), place - int(place)
    between = (1.0 - share) * made.steps.F[low] + share * made.steps.F[low + 1]
    exact = _tables(_system(True), (15.53, 15.53)).steps.F[0]
    assert np.abs(between - exact).max() < 1e-4 * np.abs(exact).max()


def test_noise_spectrum_has_the_variances_of_its_parts():
    """Integrals over the wavenumbers: white noise has density^2 times the bandwidth in Hz, a first-order Gauss-Markov
    process its variance times the share 2 / pi atan(omega T) below omega.
    """
    m = 2
    none = np.zeros((1, 2))
    system = System(np.array([[-5.0]]), none, none, np.array([[1.0], [2.0]]), np.zeros((m, 2)), np.zeros((m, 2)))
    density, drift, time = np.array([0.1, 0.2]), np.array([0.3, 0.4]), np.array([0.5, 0.2])
    noise = Noise(density, np.ones(m), drift, time, np.zeros((m, 2)))
    known = information([system], [PRIORS[0]], noise, SPEED, 2.5, np.zeros(m))
    omega = known.wavenumber[[0, -1]] * SPEED

    def share(constant: np.ndarray | float) -> np.ndarray:
        """Of a first-order process of that time constant within the wavenumbers, s."""
        return 2.0 / np.pi * (np.arctan(omega[1] * constant) - np.arctan(omega[0] * constant))

    total = np.trapezoid(known.noise * known.wavenumber[:, None, None], np.log(known.wavenumber), axis=0)
    white = density**2 * (omega[1] - omega[0]) / (2.0 * np.pi)
    assert np.real(total) == pytest.approx(np.diag(white + drift**2 * share(time)), rel=1e-3)


def test_what_the_model_says_wrongly_is_the_change_of_the_response_by_each_unknown():
    """First the unknowns of the vehicle, then the distance, last the readings' scale factors."""
    plain, other, base, scales = _system(False), _system(True), 2.5, np.array([0.01, 0.03])
    known = information([plain, other], PRIORS, _noise(), SPEED, base, scales, 1e-6)
    k, q = known.wavenumber[:, None, None], SIZES[2]
    lead, trail = np.split(plain.response(known.wavenumber * SPEED), [q], axis=2)
    late = np.exp(-1j * k * base)
    size = np.abs(known.H).max()
    assert np.abs(known.H - (lead + trail * late)).max() < 1e-12 * size
    assert other.J is not None  # of which the second derivative is -(k V)^2
    bent = -((k * SPEED) ** 2) * (other.J[:, :q] + other.J[:, q:] * late)
    vehicle, distance, first, second = known.wrong
    assert np.abs(vehicle - bent).max() < 1e-12 * np.abs(bent).max()
    assert np.abs(distance - 1e-6 * base * -1j * k * late * trail).max() < 1e-10 * size
    assert np.abs(first + second - known.H * scales[:, None]).max() < 1e-12 * size
    assert not first[:, 1].any() and not second[:, 0].any()


@pytest.fixture
def of_few_waves() -> Information:
    """Six wavenumbers far apart, readings without doubt, and one unknown whose error goes with the wavenumber."""
    k = np.geomspace(2 * np.pi / 200.0, 2 * np.pi / 1.0, 6)
    one = np.ones((6, 1, 1))
    return Information(k, np.full((6, 1), 1e12), one, one.astype(complex), 0.2 * k[None, :, None, None] * one)


def test_local_error_between_the_wavenumbers_goes_in_a_straight_line(of_few_waves: Information):
    """An error of 0.2 k of a wave of height h: 0.02 k^2 h^2 is its mean square, as much as the band leaves of it."""
    s, band = np.arange(0.0, 1200.0, 0.25), BANDS["d1"]
    for length in (5.0, 6.25, 12.5):  # whole waves in the longest, over which errors are averaged
        k = 2 * np.pi / length
        found = of_few_waves.local(1e-3 * np.sin(k * s)[:, None], 0.25, band)
        expected = 0.5 * (0.2 * k * 1e-3 * float(response(np.array([k]), band)[0])) ** 2
        assert found[len(s) // 2, 0] == pytest.approx(expected, rel=1e-3, abs=0.0)


def test_rms_is_the_root_of_the_integral_over_a_band_and_over_all():
    noise = _noise()
    known = information([_system(False)], PRIORS, noise, SPEED, 2.5, np.zeros(2))
    ends = float(known.wavenumber[0]), float(known.wavenumber[-1])
    flat = np.full(len(known.wavenumber), 3e-6)
    assert known.rms(flat) == pytest.approx(np.sqrt(3e-6 * (ends[1] - ends[0])), rel=1e-3)
    for band in BANDS.values():
        kept = quad(lambda k: float(response(np.array([k]), band)[0]) ** 2, *ends, limit=500)[0]  # noqa: B023
        assert known.rms(flat, band) == pytest.approx(np.sqrt(3e-6 * kept), rel=1e-3)
