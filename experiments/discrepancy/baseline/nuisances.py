"""Nuisances: all that may differ from the nominal within tolerance without being an effect, with data-sheet priors."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from railsim.sensors.interface import Sensor
from railsim.spec import Spec
from railsim.vehicles.interface import Vehicle

TOLERANCES = {
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

TOLERATED = 3.0  # standard deviations of its prior within which a build parameter stays
FURTHEST = 5.0  # the same of sensors and of the registration, which are not sorted out at a limit when they are made
SURPRISING = 2.7  # standard deviations from which a build parameter lets one look for more
SURPRISING_SENSOR = 3.3  # the same for sensors and registration, of which there are many
START = 0.5  # m, distance of the recording's first sample, after registration
FASTEST_WANDER = 0.002  # relative standard deviation of the speed's slow errors
WANDERS = 4  # pieces of the run
STEP = 0.02  # standard deviations of the prior, by which a number is varied for a derivative: with longer steps a
# damper's factor and the tolerance of the same damper seem two things,
SHIFT = 0.001  # m along the track at the run's end at most: over a centimetre the derivative is 3 % off


@dataclass(frozen=True)
class Nuisance:
    """One thing that may be a little off.

    Attributes
    ----------
    kind : "vehicle", "pair", "adhesion" (relative, as a factor exp(std z)); "start" [m], "speed" [-] (registration);
    "bias" [channel], "scale" [-], "mounting" [rad], "latency" [s] (sensors). name : field, channel or sensor.
    std : of the prior. index : component of a vector, or number of a piece. least, most : scores between which it
    stays; what leaves a build's tolerance is no tolerance but an effect, of a sensor the prior alone decides that.
    slight : scores by which it is varied for a derivative.
    """

    kind: str
    name: str
    std: float
    index: int = 0
    least: float = -TOLERATED
    most: float = TOLERATED
    slight: float = STEP

    @property
    def label(self) -> str:
        """Unique name."""
        return f"{self.kind}.{self.name}" + (f".{self.index}" if self.kind in ("mounting", "speed") else "")

    def step(self, z: float) -> float:
        """By how much a score is moved for a derivative there: towards the prior's middle, never beyond `most`."""
        return -self.slight if z > 0.0 or z + self.slight > self.most else self.slight

    @property
    def strained(self) -> float:
        """Score from which more than a tolerance is looked for."""
        return SURPRISING if self.most <= TOLERATED else SURPRISING_SENSOR

    @property
    def of_sensor(self) -> bool:
        """Whether it acts after the simulation, on what the sensors give."""
        return self.kind in ("bias", "scale", "mounting", "latency")


def nuisances_of(
    vehicle: Vehicle, sensors: Iterable[Sensor], channels: Iterable[str], scale: float, way: float
) -> list[Nuisance]:
    """All nuisances of a nominal vehicle, its sensors and the speed (`scale`: relative standard deviation) over a run
    of `way` [m].
    """
    return [*built(vehicle), *_registration(scale, way), *_sensors(list(sensors), set(channels))]


def built(vehicle: Vehicle) -> list[Nuisance]:
    """What of a build differs from specimen to specimen."""
    found = []
    for name in type(vehicle).model_fields:
        value = getattr(vehicle, name)
        tolerance = next((std for ending, std in TOLERANCES.items() if name.endswith(ending)), None)
        if tolerance and isinstance(value, float) and value > 0.0:
            found.append(Nuisance("vehicle", name, tolerance))
    for part, numbers in (("pair", PAIR), ("adhesion", CREEP)):
        settings = getattr(vehicle, part, None)
        for name, std in numbers.items():
            if isinstance(settings, Spec) and name in type(settings).model_fields:
                room = math.log(most_of(settings, name) / getattr(settings, name)) / std
                found.append(Nuisance(part, name, std, most=min(max(room, 0.0), TOLERATED)))
    return found


def most_of(settings: Spec, name: str) -> float:
    """Largest value that a field of the vehicle or its parts may have, like the 1 of the creep law's factors."""
    most = type(settings).limits(name)[1]
    return math.inf if most is None else most


def _registration(scale: float, way: float) -> list[Nuisance]:
    """Varied so little that no wave moves by more than a part of a turn: the answer to a shift is a phase."""
    slight = SHIFT / max(way, 1.0)
    pieces = [_free("speed", "wander", FASTEST_WANDER, number, slight) for number in range(WANDERS)]
    return [_free("start", "distance", START, 0, SHIFT), _free("speed", "scale", scale, WANDERS, slight), *pieces]


def _free(kind: str, name: str, std: float, index: int = 0, slight: float = math.inf) -> Nuisance:
    return Nuisance(kind, name, std, index, -FURTHEST, FURTHEST, min(STEP, slight / std) if std > 0.0 else STEP)


def _sensors(sensors: list[Sensor], channels: set[str]) -> list[Nuisance]:
    found = []
    for sensor in sensors:
        sheet = sensor.errors
        for name in sensor.channels():
            if name in channels:
                found += [_free("bias", name, sheet.bias_std)] * (sheet.bias_std > 0.0)
                found += [_free("scale", name, sheet.scale_error_std)] * (sheet.scale_error_std > 0.0)
        if sheet.misalignment_std > 0.0:
            found += [_free("mounting", sensor.name + "." + sensor.kind, sheet.misalignment_std, i) for i in range(3)]
    return found
