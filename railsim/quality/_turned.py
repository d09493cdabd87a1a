"""Right-angled turns of a whole box: which of its axes is read as which, and with which sign."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from scipy.spatial.transform import Rotation

from railsim.measurements import Measurements
from railsim.quality._axes import AXES, TURNS, Axes, angles
from railsim.quality._offsets import axis_of
from railsim.quality._signals import kind_of, sheet
from railsim.quality.interface import Finding
from railsim.quality.repairs import Rotate


@dataclass(frozen=True)
class Turn:
    """A box, and how its axes stand on the body.

    Attributes
    ----------
    axes : channels of the accelerometer, of the gyro, or of both.
    matrix : from the sensor's axes to the body's, a rotation by right angles, shape (3, 3).
    """

    axes: Axes
    matrix: np.ndarray

    def reading(self) -> dict[str, tuple[str, float]]:
        """By channel, from which one and with which sign it is to be read."""
        read = {}
        for channels, order in ((self.axes.accelerations, AXES), (self.axes.rates, TURNS)):
            for row, axis in enumerate(order if channels else ()):
                column = int(np.flatnonzero(self.matrix[row])[0])
                read[channels[axis]] = (channels[order[column]], float(self.matrix[row, column]))
        return read

    def finding(self, measured: Measurements, gain: float) -> Finding:
        """What is said of it; all axes are turned back."""
        rotation = Rotation.from_matrix(self.matrix)
        angle = float(np.degrees(rotation.magnitude()))
        channels = self.axes.accelerations or self.axes.rates
        name = channels["z" if self.axes.accelerations else "yaw"]
        time = measured.time(name)
        return Finding(
            "turned",
            name,
            float(time[0]),
            float(time[-1]),
            f"a rigid body only with the axes turned by {angle:.0f} deg (likelihood ratio exp({gain:.0f}))",
            f"state 'rotation: {angles(rotation)}' for this sensor in the map; the axes are turned",
            repair=Rotate(angle, rotation=rotation, axes=self.axes),
        )


def turns(measured: Measurements, told: set[str]) -> list[Turn]:
    """All right-angled turns of each accelerometer and gyro with three axes, and of those of one box together.

    Parameters
    ----------
    told : channels of which relations say something; of a sensor that is turned, all have to be among them.
    """
    boxes: dict[tuple[str, str], list[dict[str, str]]] = {}
    for kind, order in (("accelerometer", AXES), ("gyro", TURNS)):
        for (stem, body), channels in _sensors(measured, kind, told).items():
            if set(order) == set(channels):
                boxes.setdefault((stem, body), [{}, {}])[order is TURNS] = channels
    found = []
    for accelerations, rates in boxes.values():
        parts = [(accelerations, rates), (accelerations, {}), ({}, rates)]
        if not (accelerations and rates):
            parts = parts[:1]
        found += [Turn(Axes(a, r, np.full(3, np.nan)), matrix) for a, r in parts for matrix in _right_angled()]
    return found


def _sensors(measured: Measurements, kind: str, told: set[str]) -> dict[tuple[str, str], dict[str, str]]:
    found: dict[tuple[str, str], dict[str, str]] = {}
    for name in measured:
        if kind_of(measured, name) == kind and name in told:
            key = name.split(".")[0], str(sheet(measured, name).get("body"))
            found.setdefault(key, {})[axis_of(name)] = name
    return found


def _right_angled() -> list[np.ndarray]:
    """The 23 rotations of a cube that move something."""
    found = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        matrix = np.zeros((3, 3))
        matrix[range(3), order] = signs
        if np.linalg.det(matrix) > 0.0 and np.trace(matrix) < 2.5:
            found.append(matrix)
    return found


def by_reading(found: list[Turn]) -> list[tuple[Turn, Mapping[str, tuple[str, float]]]]:
    """Each turn with what it makes of the channels."""
    return [(one, one.reading()) for one in found]
