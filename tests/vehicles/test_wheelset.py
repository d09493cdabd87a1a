"""The multibody wheelset against Klingel's wavelength and the paper's linear equations."""

import dataclasses

import numpy as np
import pytest

from railsim.analysis.linear import Linearised, linearise
from railsim.contact.functions import AXIS_A, AXIS_B, C11, C22, C23
from railsim.contact.pairs import WheelRailPair
from railsim.contact.polach import SHEAR
from railsim.dynamics.equilibrium import initial_state
from railsim.dynamics.plant import build_plant
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.wheelset import WheelsetVehicle
from railsim.wheelset import WheelsetParameters, cone_conicity, full_linear
from tests.engines.rig import ENGINES, flat, go, make_run

SLOPE = 0.02
KALKER = Adhesion(friction=1.0, friction_ratio=1.0, k_adhesion=1.0, k_slip=1.0)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("slope", [0.05, 0.2])
def test_slow_cone_has_the_wavelength_of_klingel(engine: str, slope: float) -> None:
    vehicle = WheelsetVehicle(
        pair=WheelRailPair(kind="conical", conicity=slope),
        lateral_stiffness=100.0,
        lateral_damping=0.0,
        yaw_stiffness=100.0,
    )
    model = vehicle.model()
    run = make_run(model, flat(), 4.0, 12.0, start=0.0)
    x = initial_state(build_plant(model, run.track, run.speed), run)
    x[model.names.index("wheelset1.y")] += 1e-3
    result = go(engine, dataclasses.replace(run, initial=x))
    s, y = result["s [m]"], result["wheelset1.y [m]"]
    before = np.flatnonzero(np.diff(np.sign(y)))
    crossings = s[before] - y[before] * (s[before + 1] - s[before]) / (y[before + 1] - y[before])
    assert len(crossings) >= 4
    klingel = 2.0 * np.pi * np.sqrt(vehicle.wheel_radius * vehicle.half_gauge / slope)
    assert 2.0 * np.diff(crossings).mean() == pytest.approx(klingel, rel=1e-3)


def both(speed: float) -> tuple[Linearised, WheelsetParameters]:
    """Linearised multibody wheelset of a shallow cone, and the paper's parameters with Kalker's coefficients for it.

    Friction is high, so that the spin of the cone's contact leaves the creep forces linear.
    """
    vehicle = WheelsetVehicle(pair=WheelRailPair(kind="conical", conicity=SLOPE), adhesion=KALKER)
    model = vehicle.model()
    row = model.contact.coefficients[0, model.contact.coefficients.shape[1] // 2, :, 0]
    scale = vehicle.wheel_load ** (1.0 / 3.0)
    a, b = row[AXIS_A] * scale, row[AXIS_B] * scale
    parameters = WheelsetParameters(
        mass=vehicle.wheelset_mass,
        yaw_inertia=vehicle.wheelset_yaw_inertia,
        spin_inertia=vehicle.wheelset_spin_inertia,
        wheel_radius=vehicle.wheel_radius,
        half_width=vehicle.half_gauge,
        load=2.0 * vehicle.wheel_load,
        longitudinal_creep=SHEAR * a * b * row[C11],
        lateral_creep=SHEAR * a * b * row[C22],
        lateral_spin_creep=SHEAR * (a * b) ** 1.5 * row[C23],
        spin_creep=0.0,
        lateral_stiffness=vehicle.lateral_stiffness,
        lateral_damping=vehicle.lateral_damping,
        yaw_stiffness=vehicle.yaw_stiffness,
        yaw_damping=vehicle.yaw_damping,
        suspended_mass=vehicle.suspended_mass,
    )
    return linearise(model, speed), parameters


def test_creep_coefficients_are_those_of_kalker() -> None:
    speed = 20.0
    small, c = both(speed)
    y, yaw = small.names.index("wheelset1.y"), small.names.index("wheelset1.yaw")
    damping, stiffness = small.damping, small.stiffness
    assert damping[yaw, yaw] * speed / 2.0 / c.half_width**2 == pytest.approx(c.longitudinal_creep, rel=5e-3)
    assert (damping[y, y] - c.lateral_damping) * speed / 2.0 == pytest.approx(c.lateral_creep, rel=5e-3)
    assert -stiffness[y, yaw] / 2.0 == pytest.approx(c.lateral_creep, rel=5e-3)
    assert damping[y, yaw] * speed / 2.0 == pytest.approx(c.lateral_spin_creep, rel=5e-3)


@pytest.mark.parametrize("speed", [5.0, 20.0, 60.0])
def test_slow_eigenvalues_are_those_of_the_papers_equations(speed: float) -> None:
    """Hunting and the suspended mass; Polach's law has no spin moment, so the paper's f23 in the yaw is not there."""
    small, parameters = both(speed)
    expected = full_linear(parameters, cone_conicity(SLOPE, parameters), speed).eigenvalues()
    found = small.eigenvalues()
    slow = [value for value in expected if abs(value) < 50.0]
    assert len(slow) == 4
    for value in slow:
        assert np.abs(found - value).min() < 0.01 * abs(value), value
