"""The linear plan view behind lateral compensation."""

import numpy as np
import pytest

from estimators.vehicle.contact import cones, creep_forces, relations, weight, wheelsets
from estimators.vehicle.creep import kalker_slopes
from estimators.vehicle.linear_model import Kinematics, reduce
from estimators.vehicle.plan_view import COORDINATES, RAILS, PlanView, suspension
from estimators.vehicle.suspension import LEVEL, half_vehicle_bogies, masses
from railsim import InputError
from railsim.contact.linear import creep_coefficients
from railsim.vehicles.manchester import Manchester

VEHICLE = Manchester().nominal()


def test_bogie_follows_long_waves_and_not_short_ones():
    k = 2 * np.pi / np.array([400.0, 6.0])
    vehicle = PlanView(VEHICLE).on_rails()
    position, height = vehicle.yaw_by_position(15.0, k), vehicle.yaw_by_roll(15.0, k)
    assert abs(position[0]) == pytest.approx(1.0, abs=0.03)
    assert abs(height[1]) > 2 * abs(position[1])  # cross level turns the bogie where lateral irregularity does not
    assert abs(position[1]) < 0.2


def test_resonance_is_the_kinematic_wavelength_of_a_stiff_bogie():
    """2 pi sqrt(r / (l lambda) (l^2 + Lb^2 f22 / f11)), Wickens 2003; slow, no gravitational stiffness."""
    p = VEHICLE | {"design_contact_angle_rate": 0.0, "secondary_longitudinal_stiffness": 1.0}
    p |= {"primary_longitudinal_stiffness": 1e10, "primary_lateral_stiffness": 1e10}
    f11, f22, _ = creep_coefficients(1 / 0.46, p["design_contact_curvature"], p["design_wheel_load"])
    length = 2 * np.pi * np.sqrt(0.46 / 0.75 / p["design_conicity"] * (0.75**2 + 1.28**2 * f22 / f11))
    waves = np.linspace(12.0, 35.0, 2000)
    position = PlanView(p).on_rails().yaw_by_position(1.0, 2 * np.pi / waves)
    assert waves[np.argmax(np.abs(position))] == pytest.approx(length, rel=0.03)


def test_missing_parameter_is_named():
    with pytest.raises(InputError, match="design_conicity"):
        PlanView({key: value for key, value in VEHICLE.items() if key != "design_conicity"})


def test_damping_of_creep_goes_with_the_inverse_of_the_speed():
    """Assembled at the speed itself, and from the equations at another one."""
    p, at = VEHICLE, PlanView(VEHICLE).on_rails(0.6).at
    bogies, geometry = half_vehicle_bogies(p), cones(p)
    elements = suspension(p, LEVEL)
    for wheelset in wheelsets(p, bogies):
        elements += creep_forces(wheelset, kalker_slopes(p, 0.6), 25.0, spin_of_angles=False)
        elements += weight(wheelset, geometry)
    moving = Kinematics(COORDINATES, RAILS, relations(geometry, wheelsets(p, bogies)))
    whole = reduce(elements, masses(p, bogies, COORDINATES), moving, reactions=False)
    for name in ("mass", "damping", "stiffness", "input_damping", "input_stiffness"):
        expected = getattr(whole, name)
        np.testing.assert_allclose(getattr(at(25.0), name), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
