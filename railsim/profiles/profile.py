"""Cross-sections of wheels and rails in one common frame, their smoothing and their running surface."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline

from railsim.errors import InputError

Kind = Literal["wheel", "rail"]

_FEWEST = 4  # points of a cubic spline with a slope at its top
STEEPEST = np.radians(85.0)
"""Largest inclination of the part of a profile that can be touched [rad]; gauge faces and flange backs lie beyond."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A cross-section in the frame of its own side: y towards the field side (away from the track's centre), z up.

    For the left wheel and rail that is the track frame's y (left); for the right ones it is its mirror image.

    Attributes
    ----------
    kind : "wheel" or "rail".
    y, z : points from the flange (wheel) or the gauge face (rail), at negative y, to the field side [m]. Wheel: y = 0
    at the taping line (nominal running circle) and z = 0 there, so that the rolling radius is r0 - z and the flange
    has negative z. Rail: z = 0 at the highest point; where y = 0 lies is the file's choice, the gauge places the rail.
    name : for tables and messages.
    assumptions : what was taken for granted when it was read, in words.
    """

    kind: Kind
    y: np.ndarray
    z: np.ndarray
    name: str
    assumptions: tuple[str, ...] = ()

    def arc_length(self) -> np.ndarray:
        """Distance along the polygon of points from the first one [m]."""
        return np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(self.y), np.diff(self.z)))))

    def smoothed(self, tolerance: float, spacing: float = 2e-4) -> "Profile":
        """Cubic smoothing splines y(s), z(s) over arc length (de Boor 2001, chapter XIV), sampled again.

        Parameters
        ----------
        tolerance : root-mean-square distance between given and smoothed points [m]; the smoothest curve within it.
        spacing : distance of the new points along the curve [m].
        """
        s = self.arc_length()
        kept = np.concatenate(([True], np.diff(s) > 1e-9))
        s, points = s[kept], np.column_stack((self.y, self.z))[kept]
        low, high = -20.0, 4.0  # decimal logarithm of the weight of the second derivative, with s in mm
        for _ in range(40):
            middle = 0.5 * (low + high)
            fit = make_smoothing_spline(1e3 * s, points, lam=10.0**middle)
            residual = np.sqrt(np.mean(np.sum((fit(1e3 * s) - points) ** 2, axis=1)))
            low, high = (middle, high) if residual <= tolerance else (low, middle)
        fit = make_smoothing_spline(1e3 * s, points, lam=10.0**low)
        fine = np.linspace(0.0, s[-1], max(int(s[-1] / spacing), 2) + 1)
        y, z = fit(1e3 * fine).T
        return replace(self, y=y, z=z).zeroed()

    def inclined(self, slope: float) -> "Profile":
        """A rail that leans towards the track's centre by `slope` (1/20, 1/40); y = z = 0 at its highest point."""
        if self.kind != "rail":
            raise ValueError("only rails are inclined")
        cos, sin = 1.0 / np.hypot(1.0, slope), slope / np.hypot(1.0, slope)
        leaning = replace(self, y=cos * self.y - sin * self.z, z=sin * self.y + cos * self.z)
        return replace(leaning, y=leaning.y - leaning.surface().top()).zeroed()

    def surface(self) -> "Surface":
        """The part that can be touched: single-valued z(y) around the taping line or the rail's top."""
        rise, run = np.diff(self.z), np.diff(self.y)
        fit = run > np.abs(rise) / np.tan(STEEPEST) + 1e-9
        middle = int(np.argmin(np.abs(self.y))) if self.kind == "wheel" else int(np.argmax(self.z))
        middle = min(middle, fit.size - 1)
        first = middle - int(np.argmin(np.append(fit[: middle + 1][::-1], False))) + 1
        last = middle + int(np.argmin(np.append(fit[middle:], False)))
        if self.kind == "wheel":  # not beyond the flange's tip: the back is never touched
            first += int(np.argmin(self.z[first : middle + 1]))
        part = slice(max(first, 0), last + 1)
        if self.y[part].size < _FEWEST:
            raise InputError(f"{self.name}: no running surface of {_FEWEST} points in a row found; mend their order")
        return Surface(CubicSpline(self.y[part], self.z[part]), float(self.y[part][0]), float(self.y[part][-1]))

    def gauge_point(self, depth: float) -> float:
        """Place y nearest to the track's centre of a rail's points within `depth` [m] below its top.

        Raises
        ------
        InputError : the profile does not reach that far down on the gauge side.
        """
        if self.kind != "rail":
            raise ValueError("only rails have a gauge point")
        top = int(np.argmax(self.z))
        level = float(self.z[top]) - depth
        below = np.nonzero(self.z[:top] < level)[0]
        if below.size == 0:
            reached = 1e3 * float(self.z[top] - self.z[: top + 1].min())
            raise InputError(
                f"{self.name}: the gauge face does not reach {1e3 * depth:g} mm below the top (only {reached:.1f} mm); "
                "measure it further down, or state gauge_side where the gauge side is the other one"
            )
        crossing = int(below[-1])
        share = (level - self.z[crossing]) / (self.z[crossing + 1] - self.z[crossing])
        at_level = self.y[crossing] + share * (self.y[crossing + 1] - self.y[crossing])
        return float(min(at_level, self.y[crossing + 1 : top + 1].min()))

    def zeroed(self) -> "Profile":
        """The same shape with z = 0 at the taping line or at the rail's highest point."""
        surface = self.surface()
        return replace(self, z=self.z - float(surface.height(0.0 if self.kind == "wheel" else surface.top())))


@dataclass(frozen=True, eq=False)
class Surface:
    """Height z(y) of the running surface: cubic spline between `start` and `end` [m]."""

    height: CubicSpline
    start: float
    end: float

    def top(self) -> float:
        """Place y of the highest point [m]."""
        fine = np.linspace(self.start, self.end, 2001)
        guess = float(fine[np.argmax(self.height(fine))])
        roots = np.atleast_1d(self.height.derivative().roots(extrapolate=False))
        return float(roots[np.argmin(np.abs(roots - guess))]) if roots.size else guess
