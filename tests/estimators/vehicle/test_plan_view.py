"""The linear plan view behind lateral compensation."""

import numpy as np
import pytest

from estimators.vehicle.plan_view import yaw_response
from railsim import InputError
from railsim.contact.linear import creep_coefficients
from railsim.vehicles.manchester import Manchester

VEHICLE = Manchester().nominal()


def test_bogie_follows_long_waves_and_not_short_ones():
    k = 2 * np.pi / np.array([400.0, 6.0])
    position, height = yaw_response(VEHICLE, 15.0, k)
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
    position, _ = yaw_response(p, 1.0, 2 * np.pi / waves)
    assert waves[np.argmax(np.abs(position))] == pytest.approx(length, rel=0.03)


def test_missing_parameter_is_named():
    with pytest.raises(InputError, match="design_conicity"):
        yaw_response({key: value for key, value in VEHICLE.items() if key != "design_conicity"}, 10.0, np.array([0.1]))
