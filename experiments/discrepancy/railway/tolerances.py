"""What of a build differs from specimen to specimen, by the tolerances of its data sheet."""

import math
from dataclasses import dataclass

from railsim.spec import Spec
from railsim.vehicles.interface import Vehicle

SPREADS = {
    "draw_gear_stiffness": 1.5,  # from 0.05 to 20 times, for nobody states what holds a vehicle at its speed
    "_mass": 0.02,
    "_inertia": 0.04,
    "_stiffness": 0.06,
    "_damping": 0.10,
    "_cubic": 0.15,
    "bump_stop_gap": 0.05,
    "contact_damping_ratio": 0.3,
}
"""Relative standard deviations of build parameters by the ending of their names; illustrative."""

PAIR = {"conicity": 0.10, "wheel_profile_radius": 0.05}
"""The same for the wheel-rail pair: lightly worn wheels within maintenance limits; illustrative."""

CREEP = {"friction": 0.15, "k_adhesion": 0.10, "k_slip": 0.10}
"""The same for the creep law; the reduction factors shape the creep curve, so that another creep law does not pass
for another friction.
"""

UNSTATED = 0.15
"""The same for a height above the rails at which something acts: of dampers that the sheet leaves to the height of the
springs; of bushings of axlebox arms that it leaves to that of the axle; and of the springs themselves, stated or not.
Their load F turns with the mean of both bodies in the model. Where it turns with one of them alone, springs with the
lateral stiffness k act as if F / (2 k) higher or lower: 0.2 m where 150 kN stand on 370 kN/m. Evenly spread up to
there, that is 0.1 m of 0.7 m.
"""

UPRIGHT = "upright_rails"
TURNED = 0.5
"""Spread of log(1 + c), where wheels turn on their rails by c times the wheelset's roll; illustrative. Nobody states
whether rails turn with the cross level (0) or stay upright (1).
"""

SPRINGS = "secondary_height"  # where what has no height of its own is
ARM, RISE, AXLE = "arm_length", "arm_rise", "wheel_radius"  # bushings of arms that have a length are above the axle

REAR, APART = "rear", math.sqrt(2.0)
"""Factors of the rear bogie's suspension, and their spread over that of a sheet's number: each bogie has its own parts,
and two that are drawn alone differ by so much.
"""

WIDEST = 3.0  # standard deviations beyond which nothing tells whether a number has room to grow


@dataclass(frozen=True)
class Tolerance:
    """A number of a build that may be a factor exp(spread z) off, z standard normal.

    Attributes
    ----------
    part : "vehicle", "rear", "pair" or "adhesion", whose field `name` is. nominal : the number, which is the
    field plus `above`. Where a field counts from the axle, `above` is the height of the axle. most : z up to which it
    may grow. built : whether specimens differ in it; else it is the model that leaves it open.
    """

    part: str
    name: str
    spread: float
    nominal: float
    most: float = WIDEST
    above: float = 0.0
    built: bool = True

    def value(self, change: float) -> float:
        """Of the field, where the number is a factor exp(change) off."""
        return self.nominal * math.exp(change) - self.above

    @property
    def key(self) -> str:
        """Of the vehicle's settings."""
        return self.name if self.part == "vehicle" else f"{self.part}.{self.name}"


def tolerances(vehicle: Vehicle) -> list[Tolerance]:
    """Of all numbers of a build."""
    found = []
    for name in type(vehicle).model_fields:
        value = getattr(vehicle, name)
        spread = next((std for ending, std in SPREADS.items() if name.endswith(ending)), None)
        if spread and isinstance(value, float) and value > 0.0:
            found.append(Tolerance("vehicle", name, spread, value))
    found += [
        Tolerance("vehicle", name, UNSTATED, getattr(vehicle, SPRINGS), built=name != SPRINGS)
        for name in type(vehicle).model_fields
        if name == SPRINGS or (name.endswith("_height") and getattr(vehicle, name) is None)
    ]
    if getattr(vehicle, ARM, 0.0) and not getattr(vehicle, RISE):
        axle = getattr(vehicle, AXLE)
        found.append(Tolerance("vehicle", RISE, UNSTATED, axle, above=axle))
    rear = getattr(vehicle, REAR, None)
    if isinstance(rear, Spec):
        found += [
            Tolerance(REAR, one.name, APART * one.spread, getattr(rear, one.name))
            for one in found
            if one.name in type(rear).model_fields and getattr(rear, one.name) > 0.0
        ]
    pair = getattr(vehicle, "pair", None)
    if isinstance(pair, Spec) and UPRIGHT in type(pair).model_fields:
        nominal = 1.0 + getattr(pair, UPRIGHT)
        room = _room(1.0 + most_of(pair, UPRIGHT), nominal, TURNED)
        found.append(Tolerance("pair", UPRIGHT, TURNED, nominal, room, above=1.0, built=False))
    for part, numbers in (("pair", PAIR), ("adhesion", CREEP)):
        settings = getattr(vehicle, part, None)
        for name, spread in numbers.items():
            if isinstance(settings, Spec) and name in type(settings).model_fields:
                nominal = getattr(settings, name)
                found.append(Tolerance(part, name, spread, nominal, _room(most_of(settings, name), nominal, spread)))
    return found


def _room(most: float, nominal: float, spread: float) -> float:
    """Standard deviations up to which a number may grow."""
    return min(max(math.log(most / nominal) / spread, 0.0), WIDEST)


def within(value: float, settings: Spec, name: str) -> float:
    """The value, or the bound of its field that it is beyond."""
    least = type(settings).limits(name)[0]
    return min(max(value, -math.inf if least is None else least), most_of(settings, name))


def most_of(settings: Spec, name: str) -> float:
    """Largest value that a field of the vehicle or its parts may have, like the 1 of the creep law's factors."""
    most = type(settings).limits(name)[1]
    return math.inf if most is None else most
