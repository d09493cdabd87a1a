"""What the balance of steady curving reads of a vehicle: its bodies, their free coordinates, and what joins them."""

from dataclasses import dataclass, field
from functools import singledispatch

import numpy as np

from railsim.constants import GRAVITY
from railsim.errors import InputError
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.rear_bogie import RearBogie
from railsim.vehicles.running_gear import RunningGear
from railsim.vehicles.whole_vehicle import WholeVehicle

ALONG, ACROSS, UP = np.eye(3)


@dataclass(frozen=True)
class Part:
    """A body: place ahead of the reference [m], height [m], mass [kg], moments of inertia about its axes [kg m2], and
    its unknowns.

    `chord` is the distance [m] to the place to which a body of held yaw points along the chord; 0 where it is free.
    """

    name: str
    along: float
    height: float
    mass: float
    moments: tuple[float, float, float]
    free: tuple[str, ...]
    chord: float = 0.0


@dataclass(frozen=True)
class Suspension:
    """What joins two bodies at one place: stiffness (3, 3) against shift [N/m] and turning [N m/rad], the vertical load
    that it carries [N], and its lateral stop [m, N/m, N/m3].

    `arms` (2, 3) lead from the centres of the upper and the lower body to the place [m].
    """

    upper: str
    lower: str
    arms: np.ndarray
    stiffness: np.ndarray
    turning: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    load: float = 0.0
    gap: float = np.inf
    stop: float = 0.0
    stop_cubic: float = 0.0


@dataclass(frozen=True)
class Passing:
    """The force along the track that is left over on a body held there goes on to the next, at this height above the
    giver's centre [m].
    """

    giver: str
    taker: str
    height: float


@dataclass(frozen=True)
class Layout:
    """A vehicle as the balance sees it: bodies in the order of their unknowns, wheelsets named `wheelset1`, ..."""

    parts: tuple[Part, ...]
    suspensions: tuple[Suspension, ...]
    passings: tuple[Passing, ...]
    wheelsets: int

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of all unknowns."""
        return tuple(f"{part.name}.{axis}" for part in self.parts for axis in part.free)

    def part(self, name: str) -> Part:
        """The body of this name."""
        return next(part for part in self.parts if part.name == name)


@singledispatch
def layout(vehicle: RunningGear) -> Layout:
    """Bodies and suspensions of a vehicle."""
    raise TypeError(f"steady curving: no balance for a {type(vehicle).__name__}")


def check(vehicle: RunningGear) -> None:
    """The balance knows empty vehicles on steel springs, with bogies that are alike.

    Raises
    ------
    InputError : the vehicle has a payload, air springs or another rear bogie.
    """
    loaded = vehicle.payload.carried(vehicle.seats, vehicle.standing_area) != 0.0
    if loaded or vehicle.air_spring is not None:
        raise InputError("steady curving: solved for vehicles without payload and air springs only; leave these out")
    rear = getattr(vehicle, "rear", None)
    if isinstance(rear, RearBogie) and rear.changes(vehicle):
        raise InputError("steady curving: solved for vehicles with two bogies that are alike only; leave 'rear' out")


@layout.register
def _half(vehicle: HalfVehicle) -> Layout:
    """Every body is held along the track; the missing half holds the body's pitch and yaw."""
    v = vehicle
    long = v.body_mass * v.semi_bogie_spacing**2 / 3.0
    wheelsets = _wheelsets(v, 0, 0.0, ("y", "z", "roll", "yaw", "spin"))
    bogie = _bogie(v, "bogie", 0.0, ("y", "z", "roll", "pitch", "yaw"))
    body = Part(
        "body", 0.0, v.body_height, v.body_mass, (v.body_roll_inertia, long, long), ("y", "z", "roll"),
        -2.0 * v.semi_bogie_spacing,
    )  # fmt: skip
    guided = np.array([0.0, v.primary_lateral_stiffness, v.primary_vertical_stiffness])
    springs = np.array([0.0, v.secondary_lateral_stiffness, v.secondary_vertical_stiffness])
    secondary = _secondary(v, "bogie", 0.0, v.body_mass, springs)
    primaries = tuple(_primary(v, part, bogie, 0.5 * v.body_mass, guided) for part in wheelsets)
    passings = (*(Passing(part.name, "bogie", 0.0) for part in wheelsets),)
    rod = Passing("bogie", "body", v.secondary_height - v.bogie_height)
    return Layout((*wheelsets, bogie, body), (secondary, *primaries), (*passings, rod), 2)


@layout.register
def _whole(vehicle: WholeVehicle) -> Layout:
    """Bogies and wheelsets are free along the track; the body's place there is prescribed."""
    v = vehicle
    behind = -2.0 * v.semi_bogie_spacing
    moments = v.body_roll_inertia, v.body_pitch_inertia, v.body_yaw_inertia
    above = ("y", "z", "roll", "pitch", "yaw")
    parts: list[Part] = []
    suspensions: list[Suspension] = []
    springs = np.array(
        [v.secondary_longitudinal_stiffness, v.secondary_lateral_stiffness, v.secondary_vertical_stiffness]
    )
    for number, (name, along) in enumerate((("bogie", 0.0), ("bogie2", behind))):
        bogie = _bogie(v, name, along, ("x", *above))
        wheelsets = _wheelsets(v, 2 * number, along, ("x", "y", "z", "roll", "yaw", "spin"))
        parts += [*wheelsets, bogie]
        suspensions.append(_secondary(v, name, -v.semi_bogie_spacing, 0.5 * v.body_mass, springs))
        suspensions.append(_traction_rod(v, bogie))
        for part, ahead in zip(wheelsets, (1.0, -1.0), strict=True):
            suspensions += _guidance(v, part, bogie, ahead)
    parts.append(Part("body", -v.semi_bogie_spacing, v.body_height, v.body_mass, moments, above))
    return Layout(tuple(parts), tuple(suspensions), (), 4)


def _wheelsets(v: RunningGear, before: int, along: float, free: tuple[str, ...]) -> tuple[Part, Part]:
    """Both wheelsets of a bogie at `along` [m]; their numbers follow on `before`."""
    moments = v.wheelset_yaw_inertia, v.wheelset_spin_inertia, v.wheelset_yaw_inertia
    first, second = (
        Part(f"wheelset{before + i}", along + ahead, v.wheel_radius, v.wheelset_mass, moments, free)
        for i, ahead in ((1, v.semi_wheelbase), (2, -v.semi_wheelbase))
    )
    return first, second


def _bogie(v: RunningGear, name: str, along: float, free: tuple[str, ...]) -> Part:
    moments = v.bogie_roll_inertia, v.bogie_pitch_inertia, v.bogie_yaw_inertia
    return Part(name, along, v.bogie_height, v.bogie_mass, moments, free)


def _secondary(v: RunningGear, bogie: str, body_along: float, carried: float, springs: np.ndarray) -> Suspension:
    """Springs of both sides, roll bar and bump stop; `body_along` is the body's centre ahead of the leading bogie [m],
    `carried` the mass on this bogie [kg], `springs` the stiffness of a side against shift [N/m].
    """
    bogie_along = 0.0 if bogie == "bogie" else 2.0 * body_along
    apart = v.secondary_half_spacing**2
    roll = 2.0 * v.secondary_vertical_stiffness * apart + v.roll_bar_stiffness
    yaw = 2.0 * v.secondary_longitudinal_stiffness * apart
    arms = np.array(
        [
            [bogie_along - body_along, 0.0, v.secondary_height - v.body_height],
            [0.0, 0.0, v.secondary_height - v.bogie_height],
        ]
    )
    return Suspension(
        "body", bogie, arms, np.diag(2.0 * springs), np.diag([roll, 0.0, yaw]), carried * GRAVITY,
        v.bump_stop_gap, v.bump_stop_stiffness, v.bump_stop_cubic,
    )  # fmt: skip


def _primary(v: RunningGear, wheelset: Part, bogie: Part, carried: float, springs: np.ndarray) -> Suspension:
    """Springs of both axleboxes at the axle; `carried` is the body's share of one wheelset's side pair [kg] before the
    bogie's.
    """
    apart = v.primary_half_spacing**2
    roll, yaw = 2.0 * v.primary_vertical_stiffness * apart, 2.0 * v.primary_longitudinal_stiffness * apart
    arms = np.array([[wheelset.along - bogie.along, 0.0, v.wheel_radius - v.bogie_height], [0.0, 0.0, 0.0]])
    load = (carried + 0.5 * v.bogie_mass) * GRAVITY
    return Suspension(
        bogie.name, wheelset.name, arms, np.diag(2.0 * springs), np.diag([roll, 0.0, yaw]), load
    )  # fmt: skip


def _guidance(v: WholeVehicle, wheelset: Part, bogie: Part, ahead: float) -> list[Suspension]:
    """Springs of both axleboxes, and bushings of the arms where the vehicle has arms; `ahead` is 1 for the leading
    wheelset of the bogie, -1 for the trailing one.
    """
    springs = np.array([v.primary_longitudinal_stiffness, v.primary_lateral_stiffness, v.primary_vertical_stiffness])
    carried = 0.25 * v.body_mass
    if v.arm_length == 0.0:
        return [_primary(v, wheelset, bogie, carried, springs)]
    upright = _primary(v, wheelset, bogie, carried, springs * UP)
    apart = np.diag([2.0 * springs[2] * v.primary_half_spacing**2, 0.0, 0.0])
    upright = Suspension(upright.upper, upright.lower, upright.arms, upright.stiffness, apart, upright.load)
    width = v.primary_half_spacing if v.arm_half_spacing is None else v.arm_half_spacing
    arm = np.array([v.arm_length, 0.0, -ahead * v.arm_rise]) / np.hypot(v.arm_length, v.arm_rise)
    square = np.array([arm[2], 0.0, -arm[0]])  # the arms' pulls on both sides turn the wheelset about this axis
    stiffness = 2.0 * (springs[0] * np.outer(arm, arm) + springs[1] * np.outer(ACROSS, ACROSS))
    place = np.array([-ahead * v.arm_length, 0.0, v.arm_rise])
    arms = upright.arms + place
    turning = 2.0 * springs[0] * width**2 * np.outer(square, square)
    return [upright, Suspension(bogie.name, wheelset.name, arms, stiffness, turning)]


def _traction_rod(v: WholeVehicle, bogie: Part) -> Suspension:
    height = v.secondary_height if v.traction_rod_height is None else v.traction_rod_height
    arms = np.array(
        [[bogie.along + v.semi_bogie_spacing, 0.0, height - v.body_height], [0.0, 0.0, height - v.bogie_height]]
    )
    return Suspension("body", bogie.name, arms, v.traction_rod_stiffness * np.outer(ALONG, ALONG))
