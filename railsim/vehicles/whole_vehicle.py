"""Whole vehicle: a car body on two bogies with four wheelsets, and its suspension as it is built."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np

from railsim.constants import GRAVITY
from railsim.contact.functions import ContactTable
from railsim.errors import InputError
from railsim.force_laws import Damper, ForceLaw, Maxwell, SeriesDamper
from railsim.model import Body, LinearElement, Model, NonlinearElement, Wheelset
from railsim.spec import quantity
from railsim.speed import Constant, Profile
from railsim.vehicles.draw_gear import pulled
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.payload import LoadedBody
from railsim.vehicles.rear_bogie import RearBogie
from railsim.vehicles.running_gear import ILLUSTRATIVE, IWNICKI, RunningGear, contact_law
from railsim.vehicles.secondary import both_points, secondary_springs, sides

AS_SPRINGS = "none = the height of the secondary springs"
RIGID = "none = rigid"
LINEAR = "none = linear"
HALVED = ("body_mass", "body_roll_inertia", "seats", "standing_area")
"""Fields of which half a vehicle has half."""
REAR = 2  # number of the rear bogie
SIDEWAYS = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class _Place:
    """A bogie: number, name, name's ending of its elements, and distance ahead of the reference [m].

    What it bears of the body [N]; how far it and the body over it have sunk from their design heights [m].
    """

    number: int
    x: float
    load: float
    sunk: float
    body_sunk: float

    @property
    def ending(self) -> str:
        return "" if self.number == 1 else str(self.number)

    @property
    def name(self) -> str:
        return f"bogie{self.ending}"

    @property
    def wheelsets(self) -> tuple[tuple[int, float], ...]:
        """Numbers of its wheelsets, and whether they lead or trail it (1, -1)."""
        return (2 * self.number - 1, 1.0), (2 * self.number, -1.0)


class _Dampers(NamedTuple):
    """A damper on each side of a bogie: name, axis, height [m], half spacing [m], damping of each [N s/m], law."""

    name: str
    axis: str
    height: float | None
    half_spacing: float
    damping: float
    law: ForceLaw | None

    def along(self, value: float) -> tuple[float, float, float]:
        """A value along the axis."""
        x, y, z = (value if axis == self.axis else 0.0 for axis in "xyz")
        return x, y, z


class WholeVehicle(RunningGear, frozen=True):
    """Whole vehicle: a body on two bogies with four wheelsets.

    Parameters are those of `HalfVehicle`, with the whole body's mass and inertia. All bodies are free along the track.
    Where a speed is prescribed, a train that keeps it pulls the body by its draw gear.
    """

    body_mass: float = quantity(32000.0, unit="kg", source=IWNICKI, gt=0.0)
    body_roll_inertia: float = quantity(56800.0, unit="kg m2", source=IWNICKI, gt=0.0)
    body_pitch_inertia: float = quantity(1.97e6, unit="kg m2", source=IWNICKI, gt=0.0)
    body_yaw_inertia: float = quantity(1.97e6, unit="kg m2", source=IWNICKI, gt=0.0)
    traction_rod_stiffness: float = quantity(5e6, unit="N/m", source=f"{ILLUSTRATIVE}; per bogie", ge=0.0)
    traction_rod_damping: float = quantity(25e3, unit="N s/m", source=f"{ILLUSTRATIVE}; per bogie", ge=0.0)
    traction_rod_height: float | None = quantity(None, unit="m above the rails", source=AS_SPRINGS, gt=0.0)
    lateral_damper_height: float | None = quantity(None, unit="m above the rails", source=AS_SPRINGS, gt=0.0)
    yaw_damper_height: float | None = quantity(None, unit="m above the rails", source=AS_SPRINGS, gt=0.0)
    arm_length: float = quantity(
        0.0, unit="m", source="from the axle to the bushing, towards the bogie's centre; 0 = guided at the axle", ge=0.0
    )
    arm_rise: float = quantity(0.0, unit="m", source="bushing above the axle; the arm pulls along itself")
    arm_half_spacing: float | None = quantity(None, unit="m", source="none = as the primary springs", gt=0.0)
    yaw_damper_series_stiffness: float | None = quantity(None, unit="N/m", source=RIGID, gt=0.0)
    yaw_damper_blow_off_velocity: float | None = quantity(None, unit="m/s", source=LINEAR, gt=0.0)
    yaw_damper_blow_off_share: float = quantity(0.0, unit="- of the damping, beyond", source=ILLUSTRATIVE, ge=0.0)
    lateral_damper_series_stiffness: float | None = quantity(None, unit="N/m", source=RIGID, gt=0.0)
    lateral_damper_blow_off_velocity: float | None = quantity(None, unit="m/s", source=LINEAR, gt=0.0)
    lateral_damper_blow_off_share: float = quantity(0.0, unit="- of the damping, beyond", source=ILLUSTRATIVE, ge=0.0)
    vertical_damper_series_stiffness: float | None = quantity(None, unit="N/m", source=RIGID, gt=0.0)
    vertical_damper_blow_off_velocity: float | None = quantity(None, unit="m/s", source=LINEAR, gt=0.0)
    vertical_damper_blow_off_share: float = quantity(0.0, unit="- of the damping, beyond", source=ILLUSTRATIVE, ge=0.0)
    draw_gear_stiffness: float | None = quantity(
        1e6, unit="N/m", source=f"{ILLUSTRATIVE}; none = the body is held at the prescribed speed", gt=0.0
    )
    rear: RearBogie = quantity(RearBogie(), unit="factors, by field", source="both bogies alike")

    derived: ClassVar[Mapping[str, tuple[str, str]]] = MappingProxyType(
        {
            **RunningGear.derived,
            "whole_body_mass": (
                "kg",
                "body_mass; under that name about.json has one bogie's share, as of a half vehicle",
            ),
            "whole_body_roll_inertia": ("kg m2", "body_roll_inertia, likewise"),
        }
    )

    def model(self) -> Model:
        """Bodies `body`, `bogie` (leading), `bogie2`, `wheelset1` (leading) to `wheelset4`: 37 free coordinates and
        four spins. The body is held along the track.

        Raises
        ------
        InputError : a payload that stands beyond the bogies.
        """
        left, right = self.pair.sides(self.wheel_radius, self.half_gauge)
        places = self._places()
        sunk = 0.5 * (places[0].body_sunk + places[1].body_sunk)
        owners = [(self._with_bogie(place.number), place) for place in places]
        elements = [e for own, place in owners for e in (*own._secondary(place, sunk), *own._primaries(place))]
        law = contact_law(
            self.adhesion, left.stiffness(), self.wheel_load, self.wheelset_mass, self.contact_damping_ratio
        )
        return Model(
            bodies=self._bodies(places, sunk),
            elements=tuple(e for e in elements if isinstance(e, LinearElement)),
            nonlinear=tuple(e for e in elements if isinstance(e, NonlinearElement)),
            wheelsets=tuple(
                Wheelset(
                    f"wheelset{i}",
                    self.wheelset_spin_inertia,
                    self.wheel_radius,
                    self.primary_half_spacing,
                    place.name,
                )
                for place in places
                for i, _ in place.wheelsets
            ),
            contact=ContactTable.build(left, right),
            law=law,
            reference="bogie",
        )

    def pulled(self, model: Model, speed: Constant | Profile, duration: float) -> Model:
        """The model on its draw gear."""
        gear = self.draw_gear_stiffness
        return model if gear is None else pulled(model, gear, speed, duration)

    def half(self) -> HalfVehicle:
        """The half vehicle of the same parameters: half the body on one bogie; it has no arms, rods and heights."""
        same = {name: getattr(self, name) for name in RunningGear.model_fields}
        half = {name: 0.5 * getattr(self, name) for name in HALVED}
        payload = self.payload.but(ahead=0.0)
        if payload.mass is not None:
            payload = payload.but(mass=0.5 * payload.mass)
        return HalfVehicle.build(same | half | {"payload": payload})

    @classmethod
    def of_half(cls, half: HalfVehicle, inertia: float) -> "WholeVehicle":
        """A whole vehicle that is half of it twice, without arms and with rigid dampers.

        inertia : about pitch and yaw, over m a^2 (m the body's mass, 2 a the distance of the bogies' centres); at 1 a
        push over one bogie does not move the body over the other.
        """
        same = {name: getattr(half, name) for name in RunningGear.model_fields}
        twice = {name: 2.0 * getattr(half, name) for name in HALVED}
        turned = inertia * twice["body_mass"] * half.semi_bogie_spacing**2
        payload = half.payload if half.payload.mass is None else half.payload.but(mass=2.0 * half.payload.mass)
        turning = {"body_pitch_inertia": turned, "body_yaw_inertia": turned, "payload": payload}
        return cls.build(same | twice | turning)

    def nominal(self) -> dict[str, Any]:
        """Parameters of the half vehicle, which estimators know, and under names of their own those of the whole."""
        own = {f"whole_{name}": getattr(self, name) for name in ("body_mass", "body_roll_inertia")}
        plain = self.model_dump(mode="json")
        unknown = {*RunningGear.model_fields, "draw_gear_stiffness"}  # nobody states what holds a vehicle at its speed
        rest = {name: plain[name] for name in type(self).model_fields if name not in unknown}
        numbers = {name: value for name, value in rest.items() if isinstance(value, int | float)}
        return self.half().nominal() | own | numbers

    @property
    def wheel_load(self) -> float:
        """Static vertical force of one wheel [N]."""
        return (self.body_mass + 2.0 * self.bogie_mass + 4.0 * self.wheelset_mass) * GRAVITY / 8.0

    @property
    def empty_body(self) -> LoadedBody:
        """The body that stands on both bogies."""
        inertia = (self.body_roll_inertia, self.body_pitch_inertia, self.body_yaw_inertia)
        return LoadedBody(self.body_mass, inertia, -self.semi_bogie_spacing, 0.0, self.body_height)

    def bogie_load(self, number: int) -> float:
        """What a bogie, 1 leading or 2, bears of the body and its payload [N].

        Raises
        ------
        InputError : the payload lifts the body off the other one.
        """
        body = self.loaded_body
        ahead = (body.ahead + self.semi_bogie_spacing) / self.semi_bogie_spacing
        if abs(ahead) >= 1.0:
            raise InputError("payload: with it the centre of the body stands beyond a bogie; give a smaller 'ahead'")
        return 0.5 * body.mass * GRAVITY * (1.0 + (ahead if number == 1 else -ahead))

    def _places(self) -> tuple[_Place, _Place]:
        return self._place(1, 0.0), self._place(2, -2.0 * self.semi_bogie_spacing)

    def _with_bogie(self, number: int) -> "WholeVehicle":
        """The vehicle as if both its bogies were this one."""
        changes = self.rear.changes(self) if number == REAR else {}
        return self.but(**changes) if changes else self

    def _place(self, number: int, x: float) -> _Place:
        load = self.bogie_load(number)
        bogie, body = self._with_bogie(number).sinks(load - 0.5 * self.body_mass * GRAVITY)
        return _Place(number, x, load, bogie, bogie + body)

    def _bodies(self, places: tuple[_Place, ...], sunk: float) -> tuple[Body, ...]:
        body = self.loaded_body
        bogie = (self.bogie_roll_inertia, self.bogie_pitch_inertia, self.bogie_yaw_inertia)
        wheelset = (self.wheelset_yaw_inertia, self.wheelset_spin_inertia, self.wheelset_yaw_inertia)
        above = ("y", "z", "roll", "pitch", "yaw")
        centre = (body.ahead, body.left, body.height - sunk)
        bodies = [Body("body", body.mass, body.inertia, centre, above, body.ahead, sunk)]
        for place in places:
            at = (place.x, 0.0, self.bogie_height - place.sunk)
            bodies.append(Body(place.name, self.bogie_mass, bogie, at, ("x", *above), place.x, place.sunk))
        for place in places:
            for i, ahead in place.wheelsets:
                at = (place.x + ahead * self.semi_wheelbase, 0.0, self.wheel_radius)
                free = ("x", "y", "z", "roll", "yaw")
                bodies.append(Body(f"wheelset{i}", self.wheelset_mass, wheelset, at, free, place.x))
        return tuple(bodies)

    def _secondary(self, place: _Place, body_sunk: float) -> list[LinearElement | NonlinearElement]:
        """What joins the body and a bogie: springs, with the linear parts that act at their height; the traction rod
        and dampers elsewhere; yaw dampers; dampers that are not linear, one a side; the bump stop.
        """
        own = secondary_springs(self, place.load, 0.5 * self.body_mass * GRAVITY, body_sunk - place.sunk)
        stiffness, damping = own.stiffness, np.zeros((6, 6))
        apart: list[LinearElement | NonlinearElement] = []
        rod = np.outer(np.eye(6)[0], np.eye(6)[0])
        for name, height, k, c in [
            (
                "traction_rod",
                self.traction_rod_height,
                self.traction_rod_stiffness * rod,
                self.traction_rod_damping * rod,
            ),
            *self._linear_dampers(),
        ]:
            if height is None:
                stiffness, damping = stiffness + k, damping + c
            elif k.any() or c.any():
                at = (place.x, 0.0, height - place.sunk)
                apart.append(LinearElement(f"{name}{place.ending}", "body", place.name, at, k, c, finite=True))
        at, load = (place.x, 0.0, self.secondary_height - place.sunk), (0.0, 0.0, own.force)
        springs = LinearElement(
            f"secondary{place.ending}", "body", place.name, at, stiffness, damping, load, finite=True
        )
        return [
            springs,
            *apart,
            *own.elements(self, place.ending, place.name, place.x, at[2]),
            *self._damper_laws(place),
            self.bump_stop(f"bump_stop{place.ending}", place.name, place.x, at[2]),
        ]

    def _dampers(self) -> list[_Dampers]:
        yaw_height = self.secondary_height if self.yaw_damper_height is None else self.yaw_damper_height
        half = self.secondary_half_spacing
        dampers = [
            ("yaw_damper", "x", yaw_height, self.yaw_damper_half_spacing, self.yaw_damper_damping),
            ("lateral_damper", "y", self.lateral_damper_height, half, self.secondary_lateral_damping),
            ("vertical_damper", "z", None, half, self.secondary_vertical_damping),
        ]
        return [
            _Dampers(name, axis, height, spacing, damping, self._law(name, damping))
            for name, axis, height, spacing, damping in dampers
            if damping > 0.0
        ]

    def _law(self, name: str, damping: float) -> ForceLaw | None:
        """Law of a damper, None where it is linear."""
        series, velocity = getattr(self, f"{name}_series_stiffness"), getattr(self, f"{name}_blow_off_velocity")
        beyond = damping * getattr(self, f"{name}_blow_off_share")
        if velocity is None:
            return None if series is None else Maxwell(series, damping)
        if series is None:
            return Damper(damping, beyond, velocity)
        return SeriesDamper(series, damping, beyond, velocity)

    def _linear_dampers(self) -> list[tuple[str, float | None, np.ndarray, np.ndarray]]:
        """Name, height (none: that of the springs), stiffness and damping of linear pairs of dampers."""
        return [
            (f"{pair.name}s", pair.height, np.zeros((6, 6)), sides(pair.along(pair.damping), pair.half_spacing))
            for pair in self._dampers()
            if pair.law is None
        ]

    def _damper_laws(self, place: _Place) -> list[NonlinearElement]:
        """Dampers that are not linear, one a side."""
        laws = []
        for pair in self._dampers():
            height = self.secondary_height if pair.height is None else pair.height
            for side, y in (("left", pair.half_spacing), ("right", -pair.half_spacing)):
                name, at = f"{pair.name}{place.ending}_{side}", (place.x, y, height - place.sunk)
                if pair.law is not None:
                    laws.append(NonlinearElement(name, "body", place.name, at, pair.axis, pair.law))
        return laws

    def _primaries(self, place: _Place) -> list[LinearElement]:
        """Springs and guidance of both wheelsets of a bogie."""
        springs = (self.primary_longitudinal_stiffness, self.primary_lateral_stiffness, self.primary_vertical_stiffness)
        dampers = (self.primary_longitudinal_damping, self.primary_lateral_damping, self.primary_vertical_damping)
        load = (0.0, 0.0, 0.5 * (place.load + self.bogie_mass * GRAVITY))
        rise = self.arm_rise - place.sunk
        half = self.primary_half_spacing
        elements = []
        for i, ahead in place.wheelsets:
            wheelset, x = f"wheelset{i}", place.x + ahead * self.semi_wheelbase
            at_axle = (x, 0.0, self.wheel_radius)
            if self.arm_length == 0.0:
                pair = sides(springs, half), sides(dampers, half)
                elements.append(LinearElement(f"primary{i}", place.name, wheelset, at_axle, *pair, load))
                continue
            upright = sides((0.0, 0.0, springs[2]), half), sides((0.0, 0.0, dampers[2]), half)
            elements.append(LinearElement(f"primary{i}", place.name, wheelset, at_axle, *upright, load))
            slope = -ahead * rise / self.arm_length
            width = half if self.arm_half_spacing is None else self.arm_half_spacing
            guided = _guidance(springs, width, slope), _guidance(dampers, width, slope)
            bushing = (x - ahead * self.arm_length, 0.0, self.wheel_radius + rise)
            elements.append(LinearElement(f"bushing{i}", place.name, wheelset, bushing, *guided))
        return elements


def _guidance(values: tuple[float, float, float], half_spacing: float, slope: float) -> np.ndarray:
    """(6, 6) of the bushings of two arms that turn about the axle: along the arm, of this slope against the horizontal,
    and sideways.
    """
    along = np.array([1.0, 0.0, slope]) / np.hypot(1.0, slope)
    matrix = values[0] * np.outer(along, along) + values[1] * np.outer(SIDEWAYS, SIDEWAYS)
    return both_points(matrix, matrix, half_spacing)
