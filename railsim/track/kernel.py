"""Track tables for the compiled kernels: cubic splines over a uniform grid of distance.

Every channel has a continuous second derivative (friction: first), except CURVATURE, which is *defined* as the
derivative of the HEADING spline and so is piecewise quadratic with a continuous first derivative: the frame's yaw rate
and yaw acceleration agree with its heading to rounding. It differs from the file's own spline by less than 1e-5 of the
design curvature at 0.2 m rows. EAST, NORTH and UP are splines through the exact integral of the tangent (Gauss-Legendre
in each cell); their derivative agrees with the tangent to 1e-11 in straights and circles and to some 1e-9 where a
rounded ramp begins; HEADING and GRADIENT give directions.

Outside the table the distance is clamped to its ends (callers check the range of a run beforehand).
"""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

from railsim.compiled import kernel
from railsim.errors import InputError
from railsim.track.track import CANT_BASE, Track

CURVATURE = 0
"""d(heading)/ds, 1/m, to the left +."""
ROLL = 1
"""Design roll of the track plane, -asin(cant / 1.5 m), rad, left side up +; cross level is in the rails' verticals."""
GRADIENT = 2
"""Slope angle asin(dz/ds), rad, uphill + (the track frame's pitch is its negative)."""
HEADING = 3
"""Angle of the horizontal tangent from east, rad, to the left +, zero at the table's start."""
EAST = 4
"""Centre line at rail level, m from the table's start along the start's tangent."""
NORTH = 5
"""Centre line at rail level, m from the table's start to the left of the start's tangent."""
UP = 6
"""Centre line at rail level, m above the table's start."""
LEFT_VERTICAL = 7
"""Total vertical irregularity of the left rail, m, up +."""
RIGHT_VERTICAL = 8
"""Total vertical irregularity of the right rail, m, up +."""
LEFT_LATERAL = 9
"""Total lateral irregularity of the left rail, m, left +."""
RIGHT_LATERAL = 10
"""Total lateral irregularity of the right rail, m, left +."""
LEFT_FRICTION = 11
"""Friction coefficient under left wheels, NaN where the scenario's holds (`friction_given` False)."""
RIGHT_FRICTION = 12
"""Friction coefficient under right wheels, NaN where the scenario's holds."""
COMPLIANCE = 13
"""Deflection of a rail per vertical force on it, m/N; zero where the track states no stiffness (`compliant` False)."""
CHANNELS = 14
"""Number of channels."""

WIDEST_CELL = 0.25
"""Coarser tracks get cells no wider than this, m, so that the integrated centre line stays exact."""
MOST_CELLS = 500_000
"""More cells than this are refused (200 MB)."""

MOST_KEPT = 64e6
"""Tables up to this size, bytes, are kept for as long as their track lives."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


class TrackTables(NamedTuple):
    """Plain arrays and numbers that numba functions take.

    s0 : distance of the first node, m.
    ds : width of a cell, m.
    count : number of cells.
    coefficients : (count, CHANNELS, 4), C order: value = c0 + c1 x + c2 x^2 + c3 x^3 with x = s - s0 - cell ds in m.
    friction_given : the friction channels hold numbers.
    compliant : the rails give way under the wheels.
    """

    s0: float
    ds: float
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]
    coefficients: np.ndarray
    friction_given: bool
    compliant: bool = False


@kernel
def locate(s0: float, ds: float, count: int, s: float) -> tuple[int, float]:
    """Cell of the distance `s` and the distance x into it, m; `s` is clamped to the table; NaN gives cell 0, x NaN."""
    position = s - s0
    if position != position:
        return 0, position
    position = min(max(position, 0.0), count * ds)
    cell = min(int(position / ds), count - 1)
    return cell, position - cell * ds


@kernel
def value(coefficients: np.ndarray, cell: int, channel: int, x: float) -> float:
    """Value of a channel, in its unit."""
    c = coefficients[cell, channel]
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]))


@kernel
def slope(coefficients: np.ndarray, cell: int, channel: int, x: float) -> float:
    """First derivative by distance, unit/m."""
    c = coefficients[cell, channel]
    return c[1] + x * (2.0 * c[2] + x * 3.0 * c[3])


@kernel
def second(coefficients: np.ndarray, cell: int, channel: int, x: float) -> float:
    """Second derivative by distance, unit/m^2."""
    c = coefficients[cell, channel]
    return 2.0 * c[2] + 6.0 * x * c[3]


@kernel
def _sample(s0, ds, count, coefficients, channel, derivative, s, out):
    for i in range(s.size):
        cell, x = locate(s0, ds, count, s[i])
        if derivative == 0:
            out[i] = value(coefficients, cell, channel, x)
        elif derivative == 1:
            out[i] = slope(coefficients, cell, channel, x)
        else:
            out[i] = second(coefficients, cell, channel, x)


def sample(tables: TrackTables, channel: int, s: ArrayLike, derivative: int = 0) -> np.ndarray:
    """Channel (or its first or second derivative) at the distances `s`, m, for use outside compiled code."""
    where = np.asarray(s, dtype=float)
    out = np.empty(where.size)
    _sample(tables.s0, tables.ds, tables.count, tables.coefficients, channel, derivative, where.ravel(), out)
    return out.reshape(where.shape)


_kept: WeakKeyDictionary[Track, "TrackTables"] = WeakKeyDictionary()


def build_tables(track: Track) -> TrackTables:
    """Tables of a track; nobody may write into them.

    Rows at equal distances keep their nodes (divided into cells of at most 0.25 m); others are resampled through the
    track's own spline at their smallest distance.

    They are kept as long as the track is: the runs of a sweep share them.

    Raises
    ------
    InputError : more than `MOST_CELLS` cells would be needed.
    """
    kept = _kept.get(track)
    if kept is None:
        kept = _built(track)
        if kept.coefficients.nbytes <= MOST_KEPT:
            _kept[track] = kept
    return kept


def _built(track: Track) -> TrackTables:
    nodes, exact = _grid(track)
    splines = track.splines
    coefficients = np.full((nodes.size - 1, CHANNELS, 4), np.nan)
    roll = CubicSpline(track.s, -np.arcsin(track.cant / CANT_BASE))
    slope_angle = CubicSpline(track.s, np.arcsin(track.gradient))
    _store(coefficients, ROLL, nodes, roll, exact)
    _store(coefficients, GRADIENT, nodes, slope_angle, exact)
    _store_centre_line(coefficients, nodes, splines["curvature"])
    rails = {
        LEFT_VERTICAL: "left_vertical",
        RIGHT_VERTICAL: "right_vertical",
        LEFT_LATERAL: "left_lateral",
        RIGHT_LATERAL: "right_lateral",
    }
    for channel, key in rails.items():
        _store(coefficients, channel, nodes, splines[key], exact)
    if "friction" in splines:
        friction = splines["friction"] if exact else PchipInterpolator(nodes, splines["friction"](nodes))
        for channel in (LEFT_FRICTION, RIGHT_FRICTION):
            coefficients[:, channel] = _taylor(friction, nodes)
    coefficients[:, COMPLIANCE] = 0.0
    if "stiffness" in splines:
        softness = PchipInterpolator(nodes, 1.0 / splines["stiffness"](nodes))
        coefficients[:, COMPLIANCE] = _taylor(softness, nodes)
    width = (nodes[-1] - nodes[0]) / (nodes.size - 1)
    given = "friction" in splines, "stiffness" in splines
    return TrackTables(float(nodes[0]), float(width), nodes.size - 1, coefficients, *given)


def _grid(track: Track) -> tuple[np.ndarray, bool]:
    """Nodes of the table and whether every row of the track is one of them."""
    steps = np.diff(track.s)
    uniform = bool(np.ptp(steps) <= 1e-6 * steps.mean())
    width = steps.mean() if uniform else steps.min()
    parts = max(1, int(np.ceil(width / WIDEST_CELL - 1e-9)))
    count = steps.size * parts if uniform else int(np.ceil(track.length / min(width, WIDEST_CELL) - 1e-9))
    if count > MOST_CELLS:
        raise InputError(
            f"track {track.name}: {track.length:g} m at {width:g} m makes {count} cells, more than {MOST_CELLS};"
            " cut the track or take its rows at wider, equal distances"
        )
    return np.linspace(track.s[0], track.s[-1], count + 1), uniform


def _store(coefficients: np.ndarray, channel: int, nodes: np.ndarray, spline: PPoly, exact: bool) -> None:
    if not exact:
        spline = CubicSpline(nodes, spline(nodes))
    coefficients[:, channel] = _taylor(spline, nodes)


def _taylor(spline: PPoly, nodes: np.ndarray) -> np.ndarray:
    """Taylor coefficients (cells, 4) of a piecewise cubic at the left end of each cell.

    They are taken at the cell's middle, where there is no doubt about the piece, and shifted to its left end.
    """
    half = np.diff(nodes) / 2
    d0, d1, d2, d3 = (spline(nodes[:-1] + half, order) for order in range(4))
    return np.stack(
        [
            d0 - half * (d1 - half * (d2 / 2 - half * d3 / 6)),
            d1 - half * (d2 - half * d3 / 2),
            d2 / 2 - half * d3 / 2,
            d3 / 6,
        ],
        axis=1,
    )


def _store_centre_line(coefficients: np.ndarray, nodes: np.ndarray, curvature: PPoly) -> None:
    """HEADING, CURVATURE and the integrated position; GRADIENT must be stored already."""
    heading = curvature.antiderivative()(nodes)
    ends = curvature(nodes[[0, -1]])
    c = _clamped(nodes, heading - heading[0], ends[0], ends[1])
    coefficients[:, HEADING] = c
    coefficients[:, CURVATURE] = np.stack([c[:, 1], 2 * c[:, 2], 3 * c[:, 3], np.zeros(len(c))], axis=1)
    x = (_NODES + 1) / 2 * np.diff(nodes)[:, None]
    angle = _polynomial(coefficients[:, HEADING], x)
    climb = _polynomial(coefficients[:, GRADIENT], x)
    tangents = {EAST: np.cos(angle) * np.cos(climb), NORTH: np.sin(angle) * np.cos(climb), UP: np.sin(climb)}
    first = coefficients[0, GRADIENT, 0]
    last = _polynomial(coefficients[-1:, GRADIENT], np.diff(nodes)[-1:, None])[0, 0]
    total_turning = heading[-1] - heading[0]
    slopes = {
        EAST: (np.cos(first), np.cos(total_turning) * np.cos(last)),
        NORTH: (0.0, np.sin(total_turning) * np.cos(last)),
        UP: (np.sin(first), np.sin(last)),
    }
    for channel, tangent in tangents.items():
        path = np.concatenate([[0.0], np.cumsum((tangent @ _WEIGHTS) * np.diff(nodes) / 2)])
        coefficients[:, channel] = _clamped(nodes, path, *slopes[channel])


def _clamped(nodes: np.ndarray, values: np.ndarray, start: float, end: float) -> np.ndarray:
    """Coefficients (cells, 4) of the cubic spline through `values` with the slopes `start` and `end` at its ends."""
    spline = CubicSpline(nodes, values, bc_type=((1, start), (1, end)))  # pyright: ignore[reportArgumentType]
    return spline.c[::-1].T


def _polynomial(c: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Cubics `c` (cells, 4) at the points `x` (cells, points)."""
    c0, c1, c2, c3 = (c[:, i, None] for i in range(4))
    return c0 + x * (c1 + x * (c2 + x * c3))
