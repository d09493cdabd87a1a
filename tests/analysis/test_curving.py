"""Steady curving: the balance's own checks, and runs of the engines against it."""

from functools import cache

import numpy as np
import pytest

from experiments.validation.curving import CANT, RADIUS, compared, settled
from experiments.validation.whole_curving import whole_compared
from railsim.analysis.curving import Curve, Curving, steady_curving
from railsim.constants import GRAVITY
from railsim.errors import InputError
from railsim.profiles.pair import ProfilePair
from railsim.vehicles.class175 import Class175
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole

PROFILES = ProfilePair(kind="profiles")


def test_on_straight_track_every_wheel_carries_its_share() -> None:
    vehicle = Manchester()
    found = steady_curving(vehicle, Curve(0.0, 0.0, 20.0))
    for wheel in found.wheels.values():
        vertical = wheel.force[2]
        assert vertical == pytest.approx(vehicle.wheel_load, rel=1e-9)
    assert max(abs(found.values[f"wheelset{i}.{axis}"]) for i in (1, 2) for axis in ("y", "yaw")) < 1e-9


def test_wheels_carry_weight_and_centrifugal_force() -> None:
    """All contact forces together, in the vertical and towards the curve's centre."""
    vehicle, speed = Class175(), 18.0
    found = steady_curving(vehicle, Curve(1.0 / RADIUS, CANT, speed))
    total = np.sum([wheel.force for wheel in found.wheels.values()], axis=0)
    weight = 4.0 * vehicle.wheel_load
    assert total[2] == pytest.approx(weight, rel=1e-6)
    assert total[1] == pytest.approx(weight / GRAVITY * speed**2 / RADIUS, rel=2e-3)  # bodies stand inside the circle


def test_right_hand_curve_is_the_mirror_of_the_left_hand_one() -> None:
    left = steady_curving(Manchester(), Curve(1.0 / RADIUS, CANT, 14.0))
    right = steady_curving(Manchester(), Curve(-1.0 / RADIUS, -CANT, 14.0))
    for name, value in left.values.items():
        sign = -1.0 if name.endswith((".y", ".roll", ".yaw")) else 1.0
        assert right.values[name] == pytest.approx(sign * value, rel=1e-6, abs=1e-9), name
    assert right.wheels["wheel1_left"].normal == pytest.approx(left.wheels["wheel1_right"].normal, rel=1e-6)


def test_a_curve_that_no_vehicle_can_run() -> None:
    with pytest.raises(InputError, match="choose a speed that suits the curve"):
        steady_curving(Manchester(), Curve(1.0 / 50.0, 0.0, 60.0))


@pytest.mark.parametrize(
    ("vehicle", "speed", "engine"),
    [
        (Manchester(), 14.0, "compiled"),
        (Manchester(), 14.0, "exudyn"),
        (Class175(), 8.0, "compiled"),
        (Manchester(pair=PROFILES), 14.0, "compiled"),
    ],
    ids=["Manchester", "Manchester, Exudyn", "Class 175", "Manchester, S1002"],
)
def test_runs_end_in_the_balance(vehicle: HalfVehicle, speed: float, engine: str) -> None:
    solved = steady_curving(vehicle, Curve(1.0 / RADIUS, CANT, speed))
    rows = compared(settled(vehicle, speed, engine), solved)
    assert len(rows) == 8
    limits = {"lateral position": 0.01, "yaw": 0.01, "creep force": 0.01 if vehicle.pair != PROFILES else 0.02}
    for row in rows:
        assert row["difference [-]"] < limits[row["kind"]], row
    assert abs(solved.values["wheelset1.y"]) > 5e-3  # on the flange


@cache
def whole_in_a_curve() -> tuple[ManchesterWhole, Curve, Curving]:
    """The Manchester vehicle at R 300 m."""
    vehicle, curve = ManchesterWhole(), Curve(1.0 / 300.0, 0.15, 14.0)
    return vehicle, curve, steady_curving(vehicle, curve)


def test_a_whole_vehicle_carries_weight_and_centrifugal_force() -> None:
    """All eight contact forces together; along the track they are what the body's holding force overcomes."""
    vehicle, curve, found = whole_in_a_curve()
    total = np.sum([wheel.force for wheel in found.wheels.values()], axis=0)
    weight = 8.0 * vehicle.wheel_load
    assert len(found.wheels) == 8
    assert total[2] == pytest.approx(weight, rel=1e-9)
    middle = vehicle.semi_bogie_spacing * curve.curvature  # angle between the frame of the circle and the body's own
    inwards = total[0] * np.sin(middle) + total[1] * np.cos(middle)
    assert inwards == pytest.approx(weight / GRAVITY * curve.speed**2 * curve.curvature, rel=2e-3)


def test_a_whole_vehicle_run_ends_in_the_balance() -> None:
    vehicle, curve, solved = whole_in_a_curve()
    rows = compared(settled(vehicle, curve.speed, radius=1.0 / curve.curvature, cant=curve.cant), solved)
    assert len(rows) == 16
    for row in rows:
        assert row["difference [-]"] < 0.01, row
    assert min(abs(solved.values[f"wheelset{i}.y"]) for i in (1, 3)) > 5e-3  # on the flange


def test_a_wide_curve_with_cant_deficiency() -> None:
    """Trailing wheels nearly roll freely there: their creep forces are held against the vehicle's largest."""
    vehicle, speed, radius, cant = Class175Whole(), 27.0, 800.0, 0.1
    solved = steady_curving(vehicle, Curve(1.0 / radius, cant, speed))
    rows = whole_compared(settled(vehicle, speed, radius=radius, cant=cant), solved)
    held = [row for row in rows if row["kind"] != "creep force"]
    assert len(held) == 18
    for row in held:
        assert row["difference [-]"] < 0.01, row


def test_a_payload_is_refused() -> None:
    with pytest.raises(InputError, match="without payload and air springs"):
        steady_curving(ManchesterWhole.build({"payload": {"mass": 5000.0}}), Curve(1.0 / RADIUS, CANT, 14.0))
