"""The suspension estimators' own model: against the vehicle's matrices, and its filters against filterpy's."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.linalg import solve_discrete_lyapunov
from scipy.stats import qmc

from estimators.filters.track_spectrum import TrackSpectrum
from estimators.suspension.discrete_model import Discrete, Unknowns, discrete, layout, shaped, steady
from estimators.suspension.filter_bank import exact, gains, run_filters, unpacked
from estimators.suspension.fisher_information import fisher
from estimators.suspension.suspension_ml import SuspensionMl
from estimators.vehicle.affine import COORDINATES, DEGREES, FULL, INPUTS, WITHOUT_WHEELSETS, half_vehicle, nominal
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import creep_coefficients
from railsim.contact.polach import polach_force
from railsim.track.spectra import WC, WR, WS
from railsim.vehicles.class175 import Class175
from railsim.vehicles.manchester import Manchester

RATE, SPEED = 256.0, 30.0
TRACK = TrackSpectrum(1.4e-7, 0, (WR, WC)), TrackSpectrum(4.9e-7, 0, (WS, WC))


def unknowns(channels: tuple[str, ...], track: tuple[TrackSpectrum, ...] = ()) -> Unknowns:
    """Plausible noise, low-passed where the readings are."""
    return Unknowns(np.full(DEGREES, 30.0**2), np.full(len(channels), 0.01**2), track, 8.0)


@pytest.mark.parametrize("vehicle", [Class175(), Manchester()])
@pytest.mark.parametrize("kind", ["stiffness", "damping"])
def test_suspension_is_that_of_the_vehicle(vehicle: Class175, kind: str):
    """Forces on bogie and body by every coordinate are the assembled K and C of the vehicle, preloads included."""
    values = vehicle.nominal() | {"design_contact_angle": 0.0}  # wheelsets that roll by themselves
    A = half_vehicle(values, SPEED, FULL, 0.6).at(nominal(values))[0]
    model = vehicle.model()
    assembled = model.stiffness if kind == "stiffness" else model.damping
    names = [f"{body.name}.{axis}" for body in model.bodies for axis in ("x", "y", "z", "roll", "pitch", "yaw")]
    above = [name for name in COORDINATES if not name.startswith("wheelset")]
    rows, columns = [names.index(name) for name in above], [names.index(name) for name in COORDINATES]
    mass = model.mass[rows][:, None]
    first = 0 if kind == "stiffness" else DEGREES
    ours = -A[DEGREES + 4 :, first : first + DEGREES] * mass
    theirs = assembled[np.ix_(rows, columns)]
    assert np.allclose(ours, theirs, atol=1e-6 * np.abs(theirs).max())


def test_matrices_are_affine_in_the_parameters():
    vehicle = half_vehicle(Class175().nominal(), SPEED, FULL, 0.6)
    one, other = np.array([1e4, 2e5, 0.1]), np.array([5e4, 6e5, 0.3])
    for low, high, middle in zip(vehicle.at(one), vehicle.at(other), vehicle.at((one + other) / 2), strict=True):
        assert np.allclose((low + high) / 2, middle, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("track", [(), TRACK])
def test_steady_filter_is_the_one_that_filterpy_converges_to(track: tuple[TrackSpectrum, ...]):
    values = Class175().nominal()
    vehicle = half_vehicle(values, SPEED, WITHOUT_WHEELSETS, 0.6)
    inside = unknowns(WITHOUT_WHEELSETS, track)
    plan = layout(2.6, SPEED, 64.0, inside)
    system = discrete(vehicle, nominal(values), SPEED, 64.0, inside, plan)
    K, S = steady(*(part[None] for part in (system.F, system.C, system.Q, system.R)))
    reference = KalmanFilter(dim_x=plan.size, dim_z=3)
    reference.F, reference.H, reference.Q, reference.R = system.F, system.C, system.Q, system.R
    reference.P = np.diag(np.diag(system.Q)) * 10 + 1e-9 * np.eye(plan.size)
    for _ in range(1500):
        reference.predict()
        reference.update(np.zeros(3))
    assert np.allclose(S[0], reference.S, rtol=1e-4, atol=1e-6 * np.abs(reference.S).max())
    expected = system.F @ reference.K
    assert np.allclose(K[0], expected, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("track", [(), TRACK])
def test_bank_gives_the_likelihood_of_the_equations_and_of_its_interpolated_gains(track: tuple[TrackSpectrum, ...]):
    values, rate = Class175().nominal(), RATE / 4
    inside, rng = unknowns(FULL, track), np.random.default_rng(3)
    vehicle, plan = half_vehicle(values, SPEED, FULL, 0.6), layout(2.6, SPEED, rate, inside)
    parameters = nominal(values)[None, :]
    readings, inputs = 0.02 * rng.standard_normal((300, 7)), 1e-4 * rng.standard_normal((301, len(INPUTS)))
    inputs[:, 4:] = 0.0

    def likelihood(packed: np.ndarray) -> float:
        state, found, work = np.zeros((1, plan.size)), np.zeros(1), np.zeros((3, 99))
        noise, sources = shaped(SPEED, rate, inside, plan), np.array(plan.sources, dtype=np.int64)
        parts = unpacked(packed, plan, len(INPUTS), 7)
        assert all(part.flags.c_contiguous for part in parts), "else the kernel is compiled without vector instructions"
        run_filters(
            state, *parts, plan.columns, sources, plan.length, noise, inputs[:-1], inputs[1:], readings, found, work
        )
        return float(found[0])

    packed = exact(vehicle, SPEED, rate, inside, plan, parameters)
    table = gains(vehicle, SPEED, rate, inside, plan, np.array([0.0, 0.0, 0.01]), np.array([64e3, 811e3, 0.45]))
    system = discrete(vehicle, parameters[0], SPEED, rate, inside, plan)
    K, S = steady(*(part[None] for part in (system.F, system.C, system.Q, system.R)))
    x, total = np.zeros(plan.size), 0.0
    for k, reading in enumerate(readings):
        error = reading - system.C @ x - system.D @ inputs[k]
        total -= 0.5 * (error @ np.linalg.solve(S[0], error) + np.linalg.slogdet(S[0])[1])
        x = system.F @ x + system.G @ np.concatenate([inputs[k], inputs[k + 1]]) + K[0] @ error
    assert likelihood(packed) == pytest.approx(total, rel=1e-9)
    assert likelihood(table.at(parameters)) == pytest.approx(total, abs=1.0)


def test_low_passed_noise_has_the_spectrum_that_white_noise_has_behind_the_filter():
    """Force on the leading wheelset: twice its (two-sided) intensity times the filter's noise bandwidth."""
    corner, intensity = 8.0, 50.0**2
    inside = Unknowns(np.full(DEGREES, intensity), np.full(3, 1e-4), (), corner)
    vehicle, plan = half_vehicle(Class175().nominal(), SPEED, WITHOUT_WHEELSETS, 0.6), layout(2.6, SPEED, 256.0, inside)
    system = discrete(vehicle, nominal(Class175().nominal()), SPEED, 256.0, inside, plan)
    first = plan.forces(inside)[0]
    F, Q = (part[first : first + 2, first : first + 2] for part in (system.F, system.Q))
    variance = solve_discrete_lyapunov(F, Q)[0, 0]
    assert variance == pytest.approx(2.0 * intensity * corner * np.pi / (2.0 * np.sqrt(2.0)), rel=1e-9)


def test_information_on_a_level_is_half_the_number_of_samples():
    """A signal whose whole spectrum goes with exp(p): the variance of the logarithm of a variance is 2 / n."""

    def system(p: np.ndarray) -> Discrete:
        one = np.ones((1, 1))
        return Discrete(0.9 * one, 0.0 * one, one, 0.0 * one, np.exp(p[0]) * one, 1e-12 * one)

    assert fisher(system, np.array([0.3]), 64.0, 1e-4, 100.0)[0, 0] == pytest.approx(3200.0, rel=1e-3)


def test_creep_shares_are_those_of_polachs_law_on_dry_rails():
    """Statistical linearisation: least squares of the law's forces over Gaussian creepages as in running at 30 m/s."""
    p, law = Class175().nominal(), Class175().adhesion
    radius, across, load = p["wheel_radius"], p["design_contact_curvature"], p["design_wheel_load"]
    ellipse, kalker = hertz_ellipse(1.0 / radius, across), creep_coefficients(1.0 / radius, across, load)
    a, b = (half * load ** (1.0 / 3.0) for half in (ellipse.longitudinal, ellipse.lateral))
    normal = qmc.MultivariateNormalQMC(np.zeros(3), rng=np.random.default_rng(1)).random(1024)
    creep = normal * (4e-4, 1.3e-4, p["design_contact_angle_rate"] * 1.4e-3 / radius)
    spin = -p["design_contact_angle"] / radius
    given = law.friction, law.k_adhesion, law.k_slip
    forces = [polach_force(x, y, spin + turn, a, b, *kalker_coefficients(a / b), load, *given) for x, y, turn in creep]
    slopes = -np.linalg.lstsq(creep, np.array(forces) - np.mean(forces, axis=0), rcond=None)[0]
    found = slopes[0, 0] / kalker.f11, slopes[1, 1] / kalker.f22, slopes[2, 1] / kalker.f23
    assert found == pytest.approx(SuspensionMl().creep, rel=0.03)
