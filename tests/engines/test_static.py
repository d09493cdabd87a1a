"""Rest, symmetry and repeatability of both engines."""

import numpy as np
import pytest

from railsim.constants import GRAVITY
from railsim.vehicles.class175 import Class175
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.wheelset import WheelsetVehicle
from tests.engines.rig import ENGINES, Rows, curve, flat, go, make_run, mirrored, rough

VEHICLES = [Manchester(), Class175(), WheelsetVehicle(), Class175Whole()]


def vertical_forces(result: Rows, wheels: list[str], row: int) -> float:
    """Sum of the wheels' vertical forces [N]: normal and creep force turned by the contact angle."""
    total = 0.0
    for wheel in wheels:
        angle = result[f"{wheel}.contact_angle [rad]"][row]
        total += result[f"{wheel}.normal_force [N]"][row] * np.cos(angle)
        total += result[f"{wheel}.creep_force_y [N]"][row] * np.sin(angle)
    return total


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: type(v).__name__)
def test_wheel_forces_carry_the_weight(engine: str, vehicle: Vehicle) -> None:
    model = vehicle.model()
    result = go(engine, make_run(model, flat(), 20.0, 0.5))
    wheels = [f"wheel{i + 1}_{side}" for i in range(len(model.wheelsets)) for side in ("left", "right")]
    carried = [body.mass for body in model.bodies if "z" in body.free]
    weight = sum(carried) * GRAVITY + sum(model.vertical_load.values())
    for row in (0, -1):
        assert vertical_forces(result, wheels, row) == pytest.approx(weight, rel=1e-6)


@pytest.mark.parametrize("vehicle", [Manchester(), ManchesterWhole()], ids=lambda v: type(v).__name__)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_on_smooth_straight_track_leaves_the_vehicle_at_rest(engine: str, vehicle: Vehicle) -> None:
    model = vehicle.model()
    duration = 60.0 if isinstance(vehicle, Manchester) else 10.0
    result = go(engine, make_run(model, flat(1300.0), 20.0, duration, start=0.0))
    for body in model.bodies:
        assert np.abs(result[f"{body.name}.y [m]"]).max() < 1e-9
        assert np.abs(result[f"{body.name}.yaw [rad]"]).max() < 1e-9
        assert np.ptp(result[f"{body.name}.z [m]"]) < 1e-9
    assert result["s [m]"][-1] == pytest.approx(20.0 * duration, abs=1e-5)


@pytest.mark.parametrize(("engine", "tolerance"), [("compiled", 1e-9), ("exudyn", 1e-5)])
@pytest.mark.parametrize("vehicle", [Manchester(), WheelsetVehicle(), Class175Whole()], ids=lambda v: type(v).__name__)
def test_mirrored_track_mirrors_every_channel(engine: str, tolerance: float, vehicle: Vehicle) -> None:
    """Exudyn's longitudinal accelerations hold the rounding of places times the square of the holding rate."""
    model, track = vehicle.model(), rough(curve(500.0, 0.1, 220.0))
    seen = go(engine, make_run(model, track, 20.0, 8.0, start=25.0))
    other = mirrored(go(engine, make_run(model, track.mirrored(), 20.0, 8.0, start=25.0)))
    assert np.abs(seen["wheelset1.y [m]"]).max() > 1e-3
    scale = np.abs(seen.rows).max(axis=0)
    difference = np.abs(other.rows - seen.rows).max(axis=0)
    worst = int(np.argmax(difference / (tolerance * scale + 1e-11)))
    assert difference[worst] <= tolerance * scale[worst] + 1e-11, seen.names[worst]


@pytest.mark.parametrize("engine", ENGINES)
def test_same_run_gives_the_same_bytes(engine: str) -> None:
    run = make_run(Class175().model(), rough(curve(500.0, 0.1, 220.0)), 20.0, 2.0)
    assert np.array_equal(go(engine, run).rows, go(engine, run).rows)
