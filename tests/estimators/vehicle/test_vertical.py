"""The vertical reduction against closed forms and the engine's own linearisation."""

import numpy as np
import pytest

from estimators.vehicle.state_space import Output
from estimators.vehicle.vertical import bounce_inverse, pitch_frequency, pitch_inverse, vertical
from railsim.analysis.linear import linearise
from railsim.errors import InputError
from railsim.vehicles.class175 import Class175
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.manchester import Manchester

VEHICLE = Class175().nominal()
OUTPUTS = [Output("acceleration"), Output("rate")]
OMEGA = 2.0 * np.pi * np.array([0.3, 1.0, 4.0, 11.0, 25.0])


@pytest.mark.parametrize("vehicle", [Manchester(), Class175()], ids=["manchester", "class175"])
def test_oscillations_are_those_of_the_linearised_engine(vehicle: HalfVehicle) -> None:
    """Bounce of body and bogie and the bogie's pitch; in the engine the wheelsets stand on stiff contacts."""
    linear = linearise(vehicle.model(), 20.0)
    keep = [i for i, name in enumerate(linear.names) if name.endswith((".z", ".pitch"))]
    mass, damping, stiffness = (part[np.ix_(keep, keep)] for part in (linear.mass, linear.damping, linear.stiffness))
    size, inverse = len(keep), np.linalg.inv(mass)
    theirs = np.linalg.eigvals(
        np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ stiffness, -inverse @ damping]])
    )
    mine = np.linalg.eigvals(vertical(vehicle.nominal(), OUTPUTS).A)
    assert len(mine) == 6
    for value in mine:
        assert np.min(np.abs(theirs - value)) < 0.02 * abs(value)


def test_inverse_undoes_the_equations_of_motion() -> None:
    """Both wheelsets up by one, then the line through them turned by one (nose down: the leading one by -b)."""
    response, b = vertical(VEHICLE, OUTPUTS).response(OMEGA), VEHICLE["semi_wheelbase"]
    bounce = response[:, 0] @ np.array([1.0, 1.0]) / (1j * OMEGA) ** 2
    pitch = response[:, 1] @ np.array([-b, b]) / (1j * OMEGA)
    assert bounce * bounce_inverse(VEHICLE).whole(OMEGA) == pytest.approx(np.ones(5), rel=1e-9)
    assert pitch * pitch_inverse(VEHICLE).whole(OMEGA) == pytest.approx(np.ones(5), rel=1e-9)


def test_inverse_is_the_closed_form_of_the_paper() -> None:
    """Ward et al. (2011), section 5.1: 1 + (m s^2 + Z) / (4 (k + c s)) and 1 + I s^2 / (4 b^2 (k + c s))."""
    p, s = VEHICLE, 1j * OMEGA
    primary = 4.0 * (p["primary_vertical_stiffness"] + s * p["primary_vertical_damping"])
    secondary = 2.0 * (p["secondary_vertical_stiffness"] + s * p["secondary_vertical_damping"])
    body = p["body_mass"] * s**2
    load = p["bogie_mass"] * s**2 + secondary * body / (secondary + body)
    bounce, pitch = bounce_inverse(p), pitch_inverse(p)
    assert bounce.inertial(OMEGA) == pytest.approx(load / primary, rel=1e-9)
    assert bounce.whole(OMEGA) == pytest.approx(1.0 + load / primary, rel=1e-9)
    turned = p["bogie_pitch_inertia"] * s**2 / (p["semi_wheelbase"] ** 2 * primary)
    assert pitch.inertial(OMEGA) == pytest.approx(turned, rel=1e-9)
    assert bounce.whole(np.zeros(1)) == pytest.approx(1.0)
    assert pitch.whole(np.zeros(1)) == pytest.approx(1.0)


def test_pitch_frequency_is_that_of_four_springs() -> None:
    stiffness = 4.0 * VEHICLE["primary_vertical_stiffness"] * VEHICLE["semi_wheelbase"] ** 2
    expected = np.sqrt(stiffness / VEHICLE["bogie_pitch_inertia"]) / (2.0 * np.pi)
    assert pitch_frequency(VEHICLE) == pytest.approx(expected)


def test_all_missing_parameters_are_named() -> None:
    known = {key: value for key, value in VEHICLE.items() if key not in ("bogie_mass", "body_mass")}
    with pytest.raises(InputError, match="'bogie_mass', 'body_mass'"):
        bounce_inverse(known)
    with pytest.raises(InputError, match="'bogie_pitch_inertia' is -1.0"):
        pitch_inverse(VEHICLE | {"bogie_pitch_inertia": -1.0})
