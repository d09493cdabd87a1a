"""Constant curves: what the bogie's sensors must feel, and the limit of the creep forces."""

import numpy as np
import pytest

from railsim.constants import GRAVITY
from railsim.track import read_track
from railsim.track.track import CANT_BASE
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.class175 import Class175
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import Rows, curve, go, make_run

RADIUS, SPEED = 600.0, 20.0
BALANCED = SPEED**2 / RADIUS / GRAVITY * CANT_BASE
WHEELS = ("wheel1_left", "wheel1_right", "wheel2_left", "wheel2_right")


def steady_value(result: Rows, name: str) -> float:
    """Mean of the last second."""
    return float(result[name][-1024:].mean())


@pytest.mark.parametrize("cant", [0.0, BALANCED, 0.16], ids=["deficient", "balanced", "excessive"])
@pytest.mark.parametrize(
    ("engine", "vehicle"), [("compiled", Manchester()), ("compiled", Class175()), ("exudyn", Manchester())]
)
def test_bogie_feels_a_constant_curve(engine: str, vehicle: HalfVehicle, cant: float) -> None:
    result = go(engine, make_run(vehicle.model(), curve(RADIUS, cant, 380.0), SPEED, 17.0))
    roll = steady_value(result, "bogie.roll [rad]") - np.arcsin(cant / CANT_BASE)
    felt = SPEED**2 / RADIUS * np.cos(roll) + GRAVITY * np.sin(roll)
    pressed = GRAVITY * np.cos(roll) - SPEED**2 / RADIUS * np.sin(roll)
    assert steady_value(result, "bogie.angular_velocity_z [rad/s]") == pytest.approx(SPEED / RADIUS, rel=0.01)
    assert steady_value(result, "bogie.specific_force_y [m/s2]") == pytest.approx(felt, rel=0.01, abs=1e-3)
    assert steady_value(result, "bogie.specific_force_z [m/s2]") == pytest.approx(pressed, rel=1e-4)
    without_roll = SPEED**2 / RADIUS - GRAVITY * cant / CANT_BASE
    assert felt - without_roll == pytest.approx(GRAVITY * steady_value(result, "bogie.roll [rad]"), abs=0.01)


@pytest.mark.parametrize("friction", [0.5, 0.05])
@pytest.mark.parametrize("track", ["rough straight at 50 m/s", "sharp curve"])
def test_creep_force_never_exceeds_friction(track: str, friction: float) -> None:
    model = Manchester(adhesion=Adhesion(friction=friction)).model()
    if track == "sharp curve":
        result = go("compiled", make_run(model, curve(160.0, 0.1, 260.0), 10.0, 20.0))
    else:
        result = go("compiled", make_run(model, read_track("straight_erri_high"), 50.0, 15.0))
    used = 0.0
    for wheel in WHEELS:
        force = np.hypot(result[f"{wheel}.creep_force_x [N]"], result[f"{wheel}.creep_force_y [N]"])
        limit = result[f"{wheel}.friction [-]"] * result[f"{wheel}.normal_force [N]"]
        assert (force <= limit * (1.0 + 1e-12)).all(), wheel
        assert (result[f"{wheel}.friction [-]"] <= friction).all()
        used = max(used, float((force[limit > 0.0] / limit[limit > 0.0]).max()))
    assert used > 0.3
