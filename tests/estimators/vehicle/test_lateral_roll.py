"""The linear lateral plane against the engine's own linearisation and against closed forms."""

import numpy as np
import pytest

from estimators.vehicle.contact import arcs
from estimators.vehicle.creep import polach_slopes, slopes_about_spin
from estimators.vehicle.lateral_roll import COORDINATES, COUNT, along_the_track, both_bogies, followed, lateral
from estimators.vehicle.state_space import Output
from estimators.vehicle.suspension import PIVOT
from railsim import InputError
from railsim.analysis.linear import linearise
from railsim.contact.linear import creep_coefficients
from railsim.vehicles.class175 import Class175
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.whole_vehicle import WholeVehicle

OUTPUTS = [Output("rate", axis="yaw"), Output("acceleration")]


STIFF_MOUNTS = Class175Whole(yaw_damper_series_stiffness=None)  # the plane has none


@pytest.mark.parametrize("vehicle", [Manchester(), Class175(), STIFF_MOUNTS], ids=lambda one: type(one).__name__)
@pytest.mark.parametrize("speed", [10.0, 40.0])
def test_oscillations_are_those_of_the_linearised_engine(vehicle: HalfVehicle | WholeVehicle, speed: float):
    """Every oscillation below 20 rad/s per 10 m/s that the engine's matrices have sideways: kinematic wave and sway."""
    system = both_bogies(whole(vehicle), OUTPUTS, speed) if isinstance(vehicle, WholeVehicle) else None
    mine = np.linalg.eigvals((system or lateral(vehicle.nominal(), OUTPUTS, speed)).A)
    linear = linearise(vehicle.model(), speed)
    keep = [i for i, name in enumerate(linear.names) if name.endswith((".y", ".roll", ".yaw"))]
    inverse = np.linalg.inv(linear.mass[np.ix_(keep, keep)])
    stiffness, damping = (one[np.ix_(keep, keep)] for one in (linear.stiffness, linear.damping))
    size = len(keep)
    theirs = np.linalg.eigvals(
        np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ stiffness, -inverse @ damping]])
    )
    slow = theirs[(theirs.imag > 1.0) & (np.abs(theirs) < 25.0) & (np.abs(theirs.real) < 0.5 * np.abs(theirs))]
    assert len(slow) >= 2
    for value in slow:
        assert np.min(np.abs(mine - value)) < 0.06 * abs(value)


def whole(vehicle: WholeVehicle, **changes: float) -> dict[str, float]:
    """Numbers of a whole vehicle's nominal parameters, with the bogies' distance."""
    numbers = {name: float(value) for name, value in vehicle.nominal().items() if isinstance(value, int | float)}
    return numbers | {PIVOT: numbers["semi_bogie_spacing"]} | changes


def test_other_bogie_is_not_felt_where_hardly_anything_joins_it():
    secondary = [name for name in whole(Class175Whole()) if name.startswith(("secondary_", "yaw_damper_", "roll_bar_"))]
    loose = whole(
        Class175Whole(), body_mass=1e-3, **{one: 1e-3 for one in secondary if "stiff" in one or "damp" in one}
    )
    k = 2.0 * np.pi / np.array([60.0, 25.0, 12.0])
    lead, trail = np.split(lateral(loose, OUTPUTS, 25.0).response(25.0 * k), 2, axis=2)
    alone = lead + trail * np.exp(-1j * k * 2.0 * loose["semi_wheelbase"])[:, None, None]
    np.testing.assert_allclose(along_the_track(loose, OUTPUTS, 25.0, k), alone, rtol=1e-6)


def test_both_bogies_carry_a_whole_vehicle_along_the_longest_waves():
    """On a wave of 20 km all is carried along: the bogie turns as the track under it does."""
    p, k = whole(Class175Whole()), np.array([2.0 * np.pi / 20_000.0])
    yaw_rate = along_the_track(p, OUTPUTS, 10.0, k)[0, 0, 0]
    assert yaw_rate / (1j * k[0]) ** 2 / 10.0 == pytest.approx(1.0, abs=0.02)


def test_vehicle_follows_long_waves():
    k, speed = 2 * np.pi / 2000.0, 10.0
    p = Manchester().nominal()
    system = lateral(p, OUTPUTS, speed)
    late = np.exp(-1j * k * 2.0 * p["semi_wheelbase"])
    path = system.states(np.array([k * speed]))[0] @ np.array([1.0, 0.0, late, 0.0])
    centre = np.exp(-1j * k * p["semi_wheelbase"])
    bogie, yaw, body = (COORDINATES.index(name) for name in ("bogie.y", "bogie.yaw", "body.y"))
    assert path[bogie] / centre == pytest.approx(1.0, abs=0.01)
    assert path[body] / centre == pytest.approx(1.0, abs=0.01)
    assert path[yaw] / (1j * k * centre) == pytest.approx(1.0, abs=0.02)
    assert system.A.shape == (2 * COUNT, 2 * COUNT)


def test_heads_of_wheel_and_rail_are_found_from_rate_and_curvature():
    """Radii 0.5 and 0.3 m of the analytic pair: gain 0.5 / 0.2, angle 0.125 / 2.5 (Wickens 2003, section 2.5)."""
    contact = arcs(Manchester().nominal())
    assert contact.gain == pytest.approx(2.5, rel=0.01)
    assert contact.angle == pytest.approx(0.05, rel=0.01)


def test_spin_at_rest_takes_some_of_the_slope_along_the_track():
    """Across, and by spin, Polach's slopes are Kalker's times (kA + kS) / 2; along it is nearer to that across."""
    load = Manchester().nominal()["design_wheel_load"]
    kalker = creep_coefficients(1 / 0.46, 4 / 3, load, 0.7)
    spinning = slopes_about_spin(1 / 0.46, 4 / 3, load, 0.05 / 0.46)
    assert spinning.f22 == pytest.approx(kalker.f22, rel=0.06)
    assert kalker.f22 < spinning.f11 < 0.94 * kalker.f11


def test_resonance_is_the_kinematic_wavelength_of_a_stiff_bogie():
    """2 pi sqrt(r / (l lambda) (l^2 + Lb^2 f22 / f11)), Wickens 2003; slow, no gravitational stiffness.

    The formula leaves out that a wheelset rolls as it shifts, which moves its axle by 8 % of the shift.
    """
    p = Manchester().nominal() | {"design_contact_angle_rate": 1e-6, "secondary_longitudinal_stiffness": 1.0}
    p |= {"primary_longitudinal_stiffness": 1e10, "primary_lateral_stiffness": 1e10}
    slopes = polach_slopes(p, arcs(p).angle)
    ratio = slopes.f22 / slopes.f11
    length = 2 * np.pi * np.sqrt(0.46 / 0.75 / p["design_conicity"] * (0.75**2 + 1.28**2 * ratio))
    waves = np.linspace(12.0, 35.0, 2000)
    by_path, _, _ = followed(p, 1.0, 2 * np.pi / waves)
    assert waves[np.argmax(np.abs(by_path))] == pytest.approx(length, rel=0.08)


def test_cross_level_turns_a_bogie_where_lateral_irregularity_does_not():
    by_path, by_height, _ = followed(Manchester().nominal(), 15.0, 2 * np.pi / np.array([400.0, 6.0]))
    assert abs(by_path[0]) == pytest.approx(1.0, abs=0.03)
    assert abs(by_height[1]) > 2 * abs(by_path[1])


def test_missing_parameter_is_named():
    with pytest.raises(InputError, match="design_conicity"):
        followed({name: x for name, x in Manchester().nominal().items() if name != "design_conicity"}, 10.0, np.ones(1))
