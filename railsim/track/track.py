"""Track: design geometry and irregularities over distance."""

import dataclasses
import functools
import hashlib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, PchipInterpolator

from railsim.errors import InputError

CANT_BASE = 1.5
"""Distance of the rail centres over which cant and cross level are given, m."""

UNITS = {
    "curvature": "1/m",
    "cant": "m",
    "gradient": "-",
    "vertical": "m",
    "lateral": "m",
    "cross_level": "m",
    "gauge_deviation": "m",
    "left_vertical": "m",
    "right_vertical": "m",
    "left_lateral": "m",
    "right_lateral": "m",
    "friction": "-",
    "stiffness": "N/m",
}
"""Columns of a track (beside `s`) and their units."""

_FEWEST_ROWS = 4
_POSITIVE = ("friction", "stiffness")
_LIMITS = {"cant": CANT_BASE, "gradient": 1.0}


@dataclasses.dataclass(frozen=True, eq=False)
class Geometry:
    """Track geometry at the distances `s`; all arrays have the shape of `s`.

    Curvature 1/m (to the left +), cant m (right rail higher +), gradient dz/ds (uphill +); the rails' vertical (up +)
    and lateral (left +) irregularities in m are totals: mean, cross level, gauge and single-rail parts together.
    Friction (-) and stiffness (N/m) are None where the track leaves them to the scenario.
    """

    s: np.ndarray
    curvature: np.ndarray
    cant: np.ndarray
    gradient: np.ndarray
    left_vertical: np.ndarray
    right_vertical: np.ndarray
    left_lateral: np.ndarray
    right_lateral: np.ndarray
    friction: np.ndarray | None = None
    stiffness: np.ndarray | None = None

    @property
    def vertical(self) -> np.ndarray:
        """Mean of both rails, m, up +."""
        return (self.left_vertical + self.right_vertical) / 2

    @property
    def lateral(self) -> np.ndarray:
        """Mean of both rails, m, left +."""
        return (self.left_lateral + self.right_lateral) / 2

    @property
    def cross_level(self) -> np.ndarray:
        """Deviation of cant, m, right rail higher +."""
        return self.right_vertical - self.left_vertical

    @property
    def gauge_deviation(self) -> np.ndarray:
        """Deviation of gauge, m, wider +."""
        return self.left_lateral - self.right_lateral


@dataclasses.dataclass(frozen=True, eq=False, init=False)
class Track:
    """A track over the distance `s` (m, strictly increasing).

    Between the rows every column is a cubic spline (not-a-knot), so that it has a continuous second derivative;
    friction and stiffness, which may step, are monotone piecewise cubics (Fritsch and Carlson, 1980) that stay within
    the range of the data.

    Parameters
    ----------
    s : distances of the rows, m, at least four.
    columns : any of `UNITS` by name, each as long as `s`; missing ones are zero (friction, stiffness: None).
    name : for messages and files.
    comments : where the track comes from, one line each.

    Raises
    ------
    InputError : too few rows, `s` not increasing, unknown column, values that are not finite or impossible.
    """

    s: np.ndarray
    curvature: np.ndarray
    cant: np.ndarray
    gradient: np.ndarray
    vertical: np.ndarray
    lateral: np.ndarray
    cross_level: np.ndarray
    gauge_deviation: np.ndarray
    left_vertical: np.ndarray
    right_vertical: np.ndarray
    left_lateral: np.ndarray
    right_lateral: np.ndarray
    friction: np.ndarray | None
    stiffness: np.ndarray | None
    given: tuple[str, ...]
    name: str
    comments: tuple[str, ...]

    def __init__(
        self,
        s: ArrayLike,
        columns: Mapping[str, ArrayLike] | None = None,
        name: str = "track",
        comments: Iterable[str] = (),
    ) -> None:
        distance = _frozen(s)
        values = {key: _frozen(column) for key, column in (columns or {}).items()}
        problem = fault(distance, values)
        if problem is not None:
            raise InputError(f"track {name}, row {problem[0] + 1}: {problem[1]}")
        self._set("s", distance)
        zeros = _frozen(np.zeros(distance.size))
        for key in UNITS:
            self._set(key, values.get(key, None if key in _POSITIVE else zeros))
        self._set("given", tuple(key for key in UNITS if key in values))
        self._set("name", name)
        self._set("comments", tuple(comments))

    def _set(self, key: str, value: Any) -> None:
        object.__setattr__(self, key, value)

    @property
    def length(self) -> float:
        """From the first row to the last, m."""
        return float(self.s[-1] - self.s[0])

    @property
    def spacing(self) -> float:
        """Median distance of the rows, m."""
        return float(np.median(np.diff(self.s)))

    def columns(self) -> dict[str, np.ndarray]:
        """The columns that were given, by name."""
        return {key: getattr(self, key) for key in self.given}

    def totals(self) -> dict[str, np.ndarray]:
        """Total vertical and lateral irregularity of each rail at the rows, m."""
        return {
            "left_vertical": self.vertical - self.cross_level / 2 + self.left_vertical,
            "right_vertical": self.vertical + self.cross_level / 2 + self.right_vertical,
            "left_lateral": self.lateral + self.gauge_deviation / 2 + self.left_lateral,
            "right_lateral": self.lateral - self.gauge_deviation / 2 + self.right_lateral,
        }

    @functools.cached_property
    def splines(self) -> dict[str, CubicSpline | PchipInterpolator]:
        """Interpolants of curvature, cant, gradient, the four totals, and friction and stiffness where given."""
        smooth = {"curvature": self.curvature, "cant": self.cant, "gradient": self.gradient} | self.totals()
        splines: dict[str, CubicSpline | PchipInterpolator] = {k: CubicSpline(self.s, v) for k, v in smooth.items()}
        for key, column in (("friction", self.friction), ("stiffness", self.stiffness)):
            if column is not None:
                splines[key] = PchipInterpolator(self.s, column)
        return splines

    def at(self, s: ArrayLike) -> Geometry:
        """Geometry at the distances `s`, m.

        Raises
        ------
        InputError : a distance is outside the track.
        """
        where = np.asarray(s, dtype=float)
        low, high = float(self.s[0]), float(self.s[-1])
        if where.size and not (where.min() >= low and where.max() <= high):
            raise InputError(
                f"track {self.name} reaches from {low:g} to {high:g} m, but {where.min():g} to {where.max():g} m is"
                " asked for; use a longer track or a shorter run"
            )
        values = {key: np.asarray(spline(where)) for key, spline in self.splines.items()}
        return Geometry(s=where, **values)

    def mirrored(self) -> "Track":
        """The track as seen in a mirror: left and right exchanged."""
        columns = self.columns()
        flipped = {key: -columns[key] for key in ("curvature", "cant", "lateral", "cross_level") if key in columns}
        swapped = {}
        for key in ("left_vertical", "right_vertical", "left_lateral", "right_lateral"):
            if key in columns:
                side, quantity = key.split("_")
                other = {"left": "right", "right": "left"}[side]
                swapped[f"{other}_{quantity}"] = -columns[key] if quantity == "lateral" else columns[key]
        kept = {k: v for k, v in columns.items() if k not in flipped and not k.startswith(("left_", "right_"))}
        return Track(self.s, kept | flipped | swapped, f"{self.name}_mirrored", self.comments)

    def digest(self) -> str:
        """SHA-256 over distances and all columns (name and comments do not count)."""
        total = hashlib.sha256()
        for key in ("s", *UNITS):
            column = getattr(self, key)
            total.update(key.encode())
            total.update(b"scenario" if column is None else (column + 0.0).astype("<f8").tobytes())
        return total.hexdigest()


def fault(s: np.ndarray, columns: Mapping[str, np.ndarray]) -> tuple[int, str] | None:
    """First thing wrong with the arrays of a track: (row from 0, one sentence with the cure), or None."""
    unknown = [key for key in columns if key not in UNITS]
    if unknown:
        return 0, f"unknown column '{unknown[0]}'; a track knows {', '.join(UNITS)}"
    wrong = [key for key, column in columns.items() if column.shape != s.shape or s.ndim != 1]
    if wrong or s.ndim != 1:
        return 0, f"{(wrong or ['s'])[0]} must be one number per row"
    if s.size < _FEWEST_ROWS:
        return max(s.size - 1, 0), f"only {s.size} rows; a track needs at least {_FEWEST_ROWS}"
    for key, column in {"s": s, **columns}.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            return int(bad[0]), f"{key} is {column[bad[0]]:g}; fill in a number"
    back = np.flatnonzero(np.diff(s) <= 0)
    if back.size:
        row = int(back[0]) + 1
        return row, f"s goes from {s[row - 1]:.10g} to {s[row]:.10g} m; it must increase from row to row"
    return _impossible(columns)


def _impossible(columns: Mapping[str, np.ndarray]) -> tuple[int, str] | None:
    for key, column in columns.items():
        if key in _POSITIVE and column.min() <= 0:
            row = int(np.argmax(column <= 0))
            return row, f"{key} is {column[row]:g}; it must be greater than zero"
        if key in _LIMITS and np.abs(column).max() >= _LIMITS[key]:
            row = int(np.argmax(np.abs(column) >= _LIMITS[key]))
            return row, f"{key} is {column[row]:g} {UNITS[key]}; its size must be below {_LIMITS[key]:g}"
    return None


def _frozen(values: ArrayLike) -> np.ndarray:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array
