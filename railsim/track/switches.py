"""Crossover of two turnouts back to back: design curvature of the path across, and its features."""

import dataclasses

import numpy as np

from railsim.track.features import Feature
from railsim.track.joints import dip_angle


@dataclasses.dataclass(frozen=True)
class Crossover:
    """Path through a crossover to the left: toe A, heel B, crossing C, crossing D, heel E, toe F.

    From the toe the path turns by `entry_angle` within `entry_length` (the bent stock rail and the blade's tip), goes
    on with `blade_radius` to the heel and with the radius that follows from the crossing angle to `straight` before
    the crossing; then the same backwards with the other sign, a half turn about the middle between C and D.

    Sizes are illustrative but for the angle of 1 in 13, the length of 75 m (Ward et al. 2011, section 3.3) and that the
    tracks come out 3.4 m apart (British standard: 3.405 m between centre lines).

    Attributes
    ----------
    start : distance of the toe A, m.
    length : A to F, m.
    crossing_angle : between the tracks, rad.
    toe_heel, toe_crossing : A to B and A to C, m.
    entry_angle : rad; entry_length : m.
    blade_radius : m.
    straight : plain before C, m.
    rounding : of the curvature's steps, m.
    """

    start: float = 60.0
    length: float = 75.0
    crossing_angle: float = 1 / 13
    toe_heel: float = 11.0
    toe_crossing: float = 34.0
    entry_angle: float = 0.004
    entry_length: float = 1.5
    blade_radius: float = 600.0
    straight: float = 7.2
    rounding: float = 2.0

    @property
    def middle(self) -> float:
        """Distance of the centre of symmetry, m."""
        return self.start + self.length / 2

    @property
    def closure_curvature(self) -> float:
        """Of the closure rails between heel and crossing, 1/m: what is left of the crossing angle over their length."""
        left = self.crossing_angle - self.entry_angle - (self.toe_heel - self.entry_length) / self.blade_radius
        return left / (self.toe_crossing - self.straight - self.toe_heel)

    def curvature(self, s: np.ndarray) -> np.ndarray:
        """Design curvature at the distances `s`, m: 1/m, to the left +."""
        return self._turnout_curvature(s - self.start) - self._turnout_curvature(self.start + self.length - s)

    def features(self) -> list[Feature]:
        """Toes, heels and crossings with their dips.

        Wheels pass onto the blade at the toe and over the crossing's nose, each on one rail and felt less on the
        other by common sleepers; at the heel both rails have a joint (depths and lengths illustrative).
        """
        ends = (("switch toe", 0.0, 1.2e-3, 0.4e-3, 0.6), ("switch heel", self.toe_heel, 1.5e-3, 1.5e-3, 0.8))
        marks = []
        for kind, distance, near, far, half_length in (
            *ends,
            ("crossing", self.toe_crossing, 3.0e-3, 1.0e-3, 0.8),
        ):
            letters = {"switch toe": "AF", "switch heel": "BE", "crossing": "CD"}[kind]
            places = (self.start + distance, self.start + self.length - distance)
            for letter, at, nose in zip(letters, places, ("right", "left"), strict=True):
                for side in ("left", "right"):
                    depth = near if side == nose else far
                    angle = round(dip_angle(depth, half_length), 7)
                    marks.append(Feature(kind, round(at, 4), side, depth, angle, half_length, label=letter))
        return sorted(marks, key=lambda feature: (feature.s, feature.side))

    def _turnout_curvature(self, x: np.ndarray) -> np.ndarray:
        """Curvature of the first turnout `x` m from its toe, 1/m."""
        last = self.toe_crossing - self.straight
        entry = self.entry_angle / self.entry_length
        values = (entry, 1 / self.blade_radius, self.closure_curvature, 0.0)
        total, before = np.zeros(x.size), 0.0
        for distance, value in zip((0.0, self.entry_length, self.toe_heel, last), values, strict=True):
            total = total + (value - before) * rounded_step(x - distance, self.rounding)
            before = value
        return total


def rounded_step(x: np.ndarray, width: float) -> np.ndarray:
    """Step from 0 to 1 averaged with the raised cosine of `synthesis.rounded_ramp`, whose derivative it is."""
    inside = np.clip(x, -width / 2, width / 2)
    return (inside + width / 2) / width + np.sin(2 * np.pi * inside / width) / (2 * np.pi)


def lateral_offset(curvature: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Lateral distance from the first track's line, m, of a path of the given curvature (angles small)."""
    heading = np.concatenate([[0.0], np.cumsum((curvature[1:] + curvature[:-1]) / 2 * np.diff(s))])
    return np.concatenate([[0.0], np.cumsum((np.sin(heading[1:]) + np.sin(heading[:-1])) / 2 * np.diff(s))])
