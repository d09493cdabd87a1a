"""Wheel forces under a steady cross wind and on canted track against statics written by hand.

The statics are a plane balance of half a body on one bogie: sway and roll on the springs, the bump stop, weights that
have moved sideways, and moments about the rails. Where the wheelsets stand and where they touch the rails is a
question of creep and profiles, not of statics: these two are taken from the run.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import root

from experiments.validation.curving import settled_model
from railsim.analysis.linear import straight
from railsim.constants import GRAVITY
from railsim.effects.crosswind import Crosswind
from railsim.effects.interface import Setup
from railsim.speed import Constant
from railsim.track.track import CANT_BASE
from railsim.vehicles.class175 import Class175
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.whole_vehicle import WholeVehicle

WIND_HEIGHT = 2.3  # m above the rails
LIMIT = 0.005  # of what wind or cant changes in a wheel's force


@dataclass(frozen=True)
class Statics:
    """Half a body on one bogie: gravity to the left and down in the track's plane [m/s2], wind to the left [N]."""

    vehicle: HalfVehicle
    left: float
    down: float
    wind: float

    def sway(self, y: float, roll: float) -> tuple[float, float]:
        """Lateral places of the body and the bogie [m], on wheelsets that stand at `y` [m] with `roll` [rad]."""
        found = root(lambda x: self.left_over(x, y, roll), [y, 0.0, y, 0.0], tol=1e-13)
        assert found.success or np.abs(found.fun).max() < 1e-3
        return float(found.x[0]), float(found.x[2])

    def left_over(self, x: np.ndarray, y: float, roll: float) -> list[float]:
        """Two shears [N] and two moments [N m] that are left over at places and rolls of body and bogie."""
        v = self.vehicle
        body_y, body_roll, bogie_y, bogie_roll = x
        carried = v.body_mass * self.down, (v.body_mass + v.bogie_mass) * self.down  # by secondary and primary [N]
        pushed = self.wind + v.body_mass * self.left, self.wind + (v.body_mass + v.bogie_mass) * self.left
        above = v.secondary_height - v.body_height, v.secondary_height - v.bogie_height
        ends = body_y - body_roll * above[0], bogie_y - bogie_roll * above[1]
        shear, middle = ends[0] - ends[1], 0.5 * (ends[0] + ends[1])
        beyond = max(abs(shear) - v.bump_stop_gap, 0.0)
        stop = np.sign(shear) * beyond * (v.bump_stop_stiffness + v.bump_stop_cubic * beyond**2)
        secondary = 2.0 * v.secondary_lateral_stiffness * shear + stop
        turned = 2.0 * v.secondary_vertical_stiffness * v.secondary_half_spacing**2 + v.roll_bar_stiffness
        twist = turned * (body_roll - bogie_roll)
        at_axle = v.wheel_radius - v.bogie_height
        guided = bogie_y - bogie_roll * at_axle
        primary = 4.0 * v.primary_lateral_stiffness * (guided - y)
        lower_twist = 4.0 * v.primary_vertical_stiffness * v.primary_half_spacing**2 * (bogie_roll - roll)
        lower_middle = 0.5 * (guided + y)
        return [
            pushed[0] - secondary - carried[0] * 0.5 * (body_roll + bogie_roll),
            pushed[1] - primary - carried[1] * 0.5 * (bogie_roll + roll),
            (middle - body_y) * carried[0] + above[0] * pushed[0] - self.wind * (WIND_HEIGHT - v.body_height) - twist,
            (lower_middle - bogie_y) * carried[1] + at_axle * pushed[1] - lower_twist
            - (middle - bogie_y) * carried[0] - above[1] * pushed[0] + twist,
        ]  # fmt: skip

    def wheel_forces(self, y: float, roll: float, contacts: tuple[float, float]) -> tuple[float, float]:
        """Forces of a left and a right wheel, square to the track [N], from moments about the rails.

        `contacts`: lateral places where left and right wheels touch the rails [m].
        """
        v = self.vehicle
        body_y, bogie_y = self.sway(y, roll)
        weights = (v.body_mass, body_y, v.body_height), (v.bogie_mass, bogie_y, v.bogie_height)
        weights = (*weights, (2.0 * v.wheelset_mass, y, v.wheel_radius))
        total = sum(mass for mass, _, _ in weights) * self.down
        moment = self.wind * WIND_HEIGHT
        moment += sum(mass * (self.down * place + self.left * height) for mass, place, height in weights)
        left = (moment - contacts[1] * total) / (contacts[0] - contacts[1])
        return 0.5 * left, 0.5 * (total - left)


def upward(run: dict[str, float], wheel: str) -> float:
    """Force of the rail on a wheel square to the track [N]."""
    angle = run[f"{wheel}.contact_angle [rad]"]
    return run[f"{wheel}.normal_force [N]"] * np.cos(angle) + run[f"{wheel}.creep_force_y [N]"] * np.sin(angle)


def compared(run: dict[str, float], vehicle: HalfVehicle | WholeVehicle, statics: Statics, bogie: int) -> list[float]:
    """Differences of left and right wheels of a bogie (means of its wheelsets) over the change from rest."""
    numbers = 2 * bogie - 1, 2 * bogie
    tables = vehicle.pair.sides(vehicle.wheel_radius, vehicle.half_gauge)[0]
    y = float(np.mean([run[f"wheelset{i}.y [m]"] for i in numbers]))
    roll = float(np.mean([run[f"wheelset{i}.roll [rad]"] for i in numbers]))
    shifts = [
        float(np.mean([run[f"wheel{i}_{side}.lateral_shift [m]"] for i in numbers])) for side in ("left", "right")
    ]
    contacts = (
        float(np.interp(shifts[0], tables.shift, tables.half_distance)),
        -float(np.interp(-shifts[1], tables.shift, tables.half_distance)),
    )
    expected = statics.wheel_forces(y, roll, contacts)
    got = [float(np.mean([upward(run, f"wheel{i}_{side}") for i in numbers])) for side in ("left", "right")]
    return [(ours - theirs) / (theirs - vehicle.wheel_load) for ours, theirs in zip(got, expected, strict=True)]


def one_bogie(vehicle: HalfVehicle | WholeVehicle) -> HalfVehicle:
    """What stands on one bogie."""
    return vehicle.half() if isinstance(vehicle, WholeVehicle) else vehicle


@pytest.mark.parametrize(
    ("vehicle", "engine", "wind"),
    [
        (Manchester(), "compiled", 20e3),
        (Manchester(), "exudyn", -15e3),
        (Class175(), "compiled", 10e3),
        (ManchesterWhole(), "compiled", 40e3),
        (Class175Whole(), "compiled", -30e3),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, HalfVehicle | WholeVehicle) else str(value),
)
def test_wheel_forces_in_a_cross_wind(vehicle: HalfVehicle | WholeVehicle, engine: str, wind: float) -> None:
    setup = Setup(vehicle, straight(), (), Constant(speed=15.0), (), 1.0)
    model = Crosswind(force=wind, height=WIND_HEIGHT).install(setup).model
    run = settled_model(model, 15.0, engine, np.inf, 0.0)
    bogies = len(model.wheelsets) // 2
    statics = Statics(one_bogie(vehicle), 0.0, GRAVITY, wind / bogies)
    for bogie in range(1, bogies + 1):
        differences = compared(run, vehicle, statics, bogie)
        assert np.abs(differences).max() < LIMIT, differences
    unloading = 1.0 - min(upward(run, f"wheel1_{side}") for side in ("left", "right")) / vehicle.wheel_load
    assert unloading > 0.1


@pytest.mark.parametrize(
    ("vehicle", "engine", "cant"),
    [
        (Manchester(), "compiled", 0.15),
        (Class175(), "compiled", -0.12),
        (ManchesterWhole(), "compiled", 0.15),
        (Class175Whole(), "compiled", 0.15),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, HalfVehicle | WholeVehicle) else str(value),
)
def test_wheel_forces_on_canted_track(vehicle: HalfVehicle | WholeVehicle, engine: str, cant: float) -> None:
    """Straight track with cant, at 5 m/s: all of it is cant excess."""
    model = vehicle.model()
    run = settled_model(model, 5.0, engine, np.inf, cant)
    lean = np.arcsin(cant / CANT_BASE)
    statics = Statics(one_bogie(vehicle), GRAVITY * np.sin(lean), GRAVITY * np.cos(lean), 0.0)
    for bogie in range(1, len(model.wheelsets) // 2 + 1):
        differences = compared(run, vehicle, statics, bogie)
        assert np.abs(differences).max() < LIMIT, differences
    unloading = 1.0 - min(upward(run, f"wheel1_{side}") for side in ("left", "right")) / vehicle.wheel_load
    assert unloading > 0.1
