"""What an accelerometer's mean says beside gravity: its unit, gravity taken off, upside down, tilted."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railsim.constants import GRAVITY
from railsim.measurements import Measurements
from railsim.quality._axes import AXES, Axes, angles, mounting, sensors_of
from railsim.quality._offsets import expected, tolerance
from railsim.quality._rigid import relations, spectra_of
from railsim.quality._signals import limit
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Repair, Rotate, Scale
from railsim.spec import quantity

_UNITS = (
    ("g", 9.80665), ("mg", 9.80665e-3), ("mm/s2", 1e-3), ("Gal", 1e-2), ("ft/s2", 0.3048),
    ("m/s2, which the map takes for g", 1.0 / 9.80665),
)  # fmt: skip
"""Units that values in m/s2 may be in by mistake, and m/s2 of each."""
_HALFWAY = 0.5  # of gravity, at most: the nearest unit is 3.3 times another


@dataclass(frozen=True)
class Verdict:
    """What is wrong with a whole accelerometer."""

    kind: str
    axes: Axes
    extent: str
    advice: str
    repair: Repair | None = None


class Mounting(Check, frozen=True):
    """The mean specific force of each accelerometer against gravity: its size first, then its direction."""

    near: float = quantity(0.05, unit="- of gravity", source="zero and scale of poor sensors", gt=0, lt=0.2)
    missing: float = quantity(0.1, unit="- of gravity", source="what poor sensors' zeros may be", gt=0, lt=0.5)
    width: float = quantity(5.0, unit="standard deviations", source="as for zeros: 1e-6 a channel", gt=0)
    guess: float = quantity(30.0, unit="deg, turned back without a known heading", source="illustrative", gt=0)

    stage: ClassVar[int] = 1

    def find(self, measurements: Measurements) -> list[Finding]:
        """At most one finding for a sensor."""
        found = []
        for verdict in self.verdicts(measurements):
            channel = verdict.axes.accelerations["z"]
            time = measurements.time(channel)
            ends = float(time[0]), float(time[-1])
            found += [
                Finding(verdict.kind, name, *ends, verdict.extent, verdict.advice, repair=verdict.repair)
                for name in (verdict.axes.accelerations.values() if isinstance(verdict.repair, Scale) else [channel])
            ]
        return found

    def verdicts(self, measured: Measurements) -> list[Verdict]:
        """Of all sensors with which something is wrong."""
        sensors = sensors_of(measured)
        found = [verdict for axes in sensors if (verdict := self._size(measured, axes)) is not None]
        judged = {id(verdict.axes) for verdict in found}
        leaning = [a for a in sensors if id(a) not in judged and self._leans(measured, a)]
        if leaning:
            related = relations(measured, *spectra_of(measured))
            told = {name for relation in related for name in relation.weights}
            alone = [axes for axes in leaning if not told & set(axes.accelerations.values())]
            found += [self._direction(measured, axes) for axes in alone]
        return found

    def _size(self, measured: Measurements, axes: Axes) -> Verdict | None:
        """Another unit, or no gravity; a zero that the data sheet lets be off is off by as much in any unit."""
        zero = self.width * limit(measured, axes.accelerations["z"], "bias_std") / GRAVITY
        near = max(self.near, min(zero, _HALFWAY))
        for unit, factor in _UNITS:
            if abs(axes.size * factor / GRAVITY - 1.0) < near:
                extent = f"gravity is read as {axes.size:.4g} m/s2: the values are in {unit}"
                advice = f"state 'unit: {unit.split(',')[0]}' in the map; the values are brought to m/s2"
                return Verdict("unit", axes, extent, advice, Scale(1.0 / factor))
        if axes.size < self.missing * GRAVITY:
            extent = f"gravity is missing: the mean is {axes.size:.2g} m/s2 where it is {GRAVITY:.2f}"
            advice = (
                "take the app's acceleration with gravity, or a sensor coupled to d.c.; what needs gravity (levels, "
                "cant, signs) cannot be told; the samples stay"
            )
            return Verdict("no gravity", axes, extent, advice)
        return None

    def _leans(self, measured: Measurements, axes: Axes) -> bool:
        """Whether the mean has gravity's size and another direction than the vehicle's running explains."""
        if set(AXES) - set(axes.accelerations) or abs(axes.size / GRAVITY - 1.0) > self.near:
            return False
        for value, name in zip(axes.mean, (axes.accelerations[axis] for axis in AXES), strict=True):
            allowed = tolerance(measured, name)
            if abs(value - expected(measured, name)) > self.width * allowed.deviation + allowed.running:
                unstated = allowed.running + self.near * GRAVITY
                return allowed.deviation > 0.0 or abs(value - expected(measured, name)) > unstated
        return False

    def _direction(self, measured: Measurements, axes: Axes) -> Verdict:
        rotation, heading = mounting(measured, axes)
        angle = math.degrees(math.acos(float(np.clip(axes.mean[2] / axes.size, -1.0, 1.0))))
        turned = angles(rotation)
        means = ", ".join(f"{one:+.2f}" for one in axes.mean)
        known = "" if heading else "; its heading is not known: no change of speed or curve shows it"
        advice = f"state 'rotation: {turned}' for this sensor in the map{known}"
        advice = advice.replace("this sensor", "this sensor and its gyro") if axes.rates else advice
        extent = f"gravity is read {angle:.1f} deg off z (x, y, z: {means} m/s2)"
        backwards = angle > 150.0 and rotation.as_matrix()[0, 0] < 0.0  # or all signs are turned: y tells them apart
        certain = (heading and not backwards) or angle < self.guess
        repair = Rotate(angle, rotation=rotation, axes=axes) if certain else None
        done = "; the axes are turned" if repair else "; the samples stay"
        if angle > 150.0:
            advice += "; or 'sign: -1' for its three channels where the device counts gravity downwards (iOS)"
            return Verdict("upside down", axes, f"{extent}: it stands upside down", advice + done, repair)
        kind = "tilted" if angle < 45.0 else "turned"
        return Verdict(kind, axes, f"{extent}: the sensor is {kind} on its body", advice + done, repair)


def doubtful(measured: Measurements) -> set[str]:
    """Channels of accelerometers of which no zero, sign or exchange can be told."""
    names: set[str] = set()
    for verdict in Mounting().verdicts(measured):
        names |= set(verdict.axes.accelerations.values())
    return names
