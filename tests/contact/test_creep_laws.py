"""The creep laws side by side: linear, Polach, FASTSIM; adhesion conditions; Polach fitted to falling friction."""

import dataclasses
import math

import numpy as np
import pytest

from experiments.validation.eurosprinter import LAYER, MODIFIED, STATIC, fit_polach, reference_curve
from railsim.contact.adhesion import CONDITIONS, DRY, WET, adhesion_condition
from railsim.contact.fastsim import fastsim_force
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import creep_coefficients, linear_force
from railsim.contact.polach import SHEAR, friction_coefficient, polach_force
from railsim.errors import InputError
from railsim.vehicles.adhesion import Adhesion
from tests.profiles.reference import needs_reference

A, B, NORMAL, FRICTION = 6e-3, 5e-3, 6e4, 0.3
KALKER = kalker_coefficients(A / B)
SMALL = 1e-5 * FRICTION * NORMAL / (SHEAR * A * B)
LAWS = pytest.mark.parametrize("law", [polach_force, fastsim_force], ids=["polach", "fastsim"])


@LAWS
@pytest.mark.parametrize(
    "creep",
    [(SMALL, 0.0, 0.0), (0.0, SMALL, 0.0), (0.0, 0.0, SMALL / math.sqrt(A * B))],
    ids=["longitudinal", "lateral", "spin"],
)
def test_pure_creepages_start_with_kalkers_slope(law, creep: tuple[float, float, float]) -> None:
    """kA = kS = 1: within 1 %."""
    expected = linear_force(*creep, A, B, *KALKER)
    assert law(*creep, A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0) == pytest.approx(expected, rel=0.01)


def test_combined_small_creepages_where_polach_leaves_kalker() -> None:
    """Longitudinal and lateral creepage together: Polach's force opposes the slip, Kalker's is steeper along x.

    Largest deviation over all directions, as a share of the linear force: 5 % here, where C22 is 0.9 C11. Lateral
    creepage with spin stays within 1 %; spin beside longitudinal creepage loses a quarter of its lateral force.
    """
    deviations = []
    for angle in np.linspace(0.0, 0.5 * math.pi, 31):
        creep = (SMALL * math.cos(angle), SMALL * math.sin(angle), 0.0)
        linear = np.array(linear_force(*creep, A, B, *KALKER))
        found = np.array(polach_force(*creep, A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0))
        deviations.append(np.linalg.norm(found - linear) / np.linalg.norm(linear))
    assert 0.05 < max(deviations) < 0.06
    spin = SMALL / math.sqrt(A * B)
    found = polach_force(0.0, SMALL, spin, A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0)
    assert found == pytest.approx(linear_force(0.0, SMALL, spin, A, B, *KALKER), rel=0.01)
    found = polach_force(SMALL, 0.0, spin, A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0)
    assert found[1] == pytest.approx(0.739 * linear_force(SMALL, 0.0, spin, A, B, *KALKER)[1], rel=0.01)


@LAWS
def test_law_is_odd_and_saturates_at_friction_times_load(law) -> None:
    for creep in ((0.002, -0.001, 0.3), (0.5, 0.2, 0.0), (0.0, 0.4, -0.5), (0.003, 0.0, 0.0)):
        force = np.array(law(*creep, A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0))
        opposite = law(*(-value for value in creep), A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0)
        assert opposite == pytest.approx(-force, rel=1e-12)
        assert np.linalg.norm(force) <= FRICTION * NORMAL * (1.0 + 1e-12)
    full = law(0.5, 0.2, 0.0, A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0)
    assert math.hypot(*full) == pytest.approx(FRICTION * NORMAL, rel=1e-3)


@LAWS
def test_force_falls_with_slip_as_friction_does(law) -> None:
    """Far beyond saturation the force is mu(w) N of Polach 2005, eq. 9."""
    speed, creepage = 20.0, np.array([0.2, 0.3, 0.5])
    expected = 0.55 * (0.6 * np.exp(-0.6 * speed * creepage) + 0.4) * NORMAL
    forces = []
    for value in creepage:
        friction = friction_coefficient(0.55, 0.4, 0.6, speed * value)
        forces.append(-law(value, 0.0, 0.0, A, B, *KALKER, NORMAL, friction, 1.0, 1.0)[0])
    assert forces == pytest.approx(expected, rel=1e-3)
    assert (np.diff(forces) < 0.0).all()


@pytest.mark.parametrize(("spin_number", "most", "typical"), [(0.0, 0.06, 0.03), (0.3, 0.18, 0.08), (1.0, 0.28, 0.13)])
def test_polach_and_fastsim_in_combined_creepage_and_spin(spin_number: float, most: float, typical: float) -> None:
    """Largest and typical (rms) difference as a share of mu N over direction and size of creepage.

    spin_number: linear spin force over mu N. The laws drift apart with spin, of which Polach's has an approximation.
    """
    limit = FRICTION * NORMAL
    spin = spin_number * limit / (SHEAR * (A * B) ** 1.5 * KALKER[2])
    differences = []
    for size in np.geomspace(0.1, 10.0, 12) * limit / (SHEAR * A * B * KALKER[1]):
        for angle in np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False):
            creep = (size * math.cos(angle), size * math.sin(angle), spin, A, B)
            arguments = (*creep, *KALKER, NORMAL, FRICTION, 1.0, 1.0)
            apart = np.array(polach_force(*arguments)) - np.array(fastsim_force(*arguments))
            differences.append(np.linalg.norm(apart) / limit)
    assert max(differences) < most
    assert np.sqrt(np.mean(np.square(differences))) < typical


@needs_reference
@pytest.mark.parametrize(
    ("series", "fitted"),
    [(LAYER, (0.250, 0.279, 0.421, 0.547)), (MODIFIED, (0.53, 0.28, 0.336, 0.60))],
)
def test_polach_fits_falling_friction(series: str, fitted: tuple[float, ...]) -> None:
    """kA, kS, A, B fitted to CONTACT's series: every point within 3 % of mu N (mu 0.33)."""
    curve = reference_curve(series)
    result = fit_polach(curve, STATIC[series])
    assert len(curve) == 30
    assert np.abs(result.fun).max() < 0.03
    assert result.x == pytest.approx(fitted, rel=0.03)


def test_creep_coefficients_are_the_slopes_of_the_linear_law() -> None:
    ellipse = hertz_ellipse(1.0 / 0.46, 1.0 / 0.3)
    a, b = ellipse.longitudinal * math.cbrt(NORMAL), ellipse.lateral * math.cbrt(NORMAL)
    kalker = kalker_coefficients(a / b)
    f = creep_coefficients(1.0 / 0.46, 1.0 / 0.3, NORMAL, share=0.5)
    force_x, force_y = linear_force(2e-4, 3e-4, 0.1, a, b, *kalker)
    assert (2.0 * f.f11 * 2e-4, 2.0 * (f.f22 * 3e-4 + f.f23 * 0.1)) == pytest.approx((-force_x, -force_y))
    assert 5e6 < 2.0 * f.f11 < 2e7  # about 10 MN


def test_conditions_are_ordered_and_have_sources() -> None:
    values = list(CONDITIONS.values())
    assert list(CONDITIONS) == ["dry", "wet", "low", "very low"]
    for better, worse in zip(values, values[1:], strict=False):
        assert better.friction > worse.friction
        assert better.initial_share > worse.initial_share
    assert all(condition.source for condition in values)
    assert "not confirmed" in CONDITIONS["low"].source
    assert "not confirmed" in CONDITIONS["very low"].source


def test_conditions_of_polach_and_their_use_in_a_vehicle() -> None:
    """Polach (2005), parameters for dry and wet rails."""
    assert dataclasses.astuple(DRY)[:5] == (0.55, 0.40, 0.60, 1.0, 0.4)
    assert dataclasses.astuple(WET)[:5] == (0.30, 0.40, 0.20, 0.3, 0.1)
    for name in CONDITIONS:
        condition = adhesion_condition(name)
        assert Adhesion.build(condition.parameters()).k_slip == condition.k_slip


def test_condition_cannot_be_changed_and_unknown_one_is_refused() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        DRY.friction = 0.1  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(InputError, match="use one of dry, wet, low, very low"):
        adhesion_condition("icy")
