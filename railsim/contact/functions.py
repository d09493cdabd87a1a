"""Contact functions of one wheel on its rail, tabled over the lateral shift u of the wheel relative to the rail."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.contact.hertz import hertz_ellipse, hertz_ellipses
from railsim.contact.kalker import kalker_table

LIFT, RADIUS, HALF_DISTANCE, AXIS_A, AXIS_B, C11, C22, C23, BY_TURN = range(9)
CHANNELS = 9
LEAST_WAY = 0.05  # of the contact on the rail over that of the wheelset: less tells no curvature; illustrative
STEEPEST, FLATTEST = 0.3, 1.0
"""Largest slope [-] and least sum of curvatures [1/m] with which roll changes the radius; illustrative. On flanges roll
hardly changes it. Where the contact jumps, the way for a small angle says nothing of the way for a large one.
"""


@dataclass(frozen=True, eq=False)
class ContactFunctions:
    """Left wheel; the right wheel is its mirror image unless given on its own. Tables are made once of each.

    Attributes
    ----------
    shift : u [m], uniform grid; positive = wheelset to the left (towards the left rail's gauge face).
    lift : height H of the wheel's centre above its place at u = 0 at which it just touches the rail [m]; dH/du =
    tan(contact angle).
    radius : rolling radius [m]. half_distance : lateral distance of the contact from the track's centre line [m].
    curvature : sum of the lateral curvatures of wheel and rail at the contact [1/m].
    hertz : stiffness of the contact [N/m^1.5]; None = that of the middle.
    upright : share of the wheelset's roll by which the rolling radius takes the wheel to turn on its rail [-], see
    `pairs.upright_rails`. Contact angle and normal force always take it to turn by all of it.
    second : contact functions, over the same `shift`, of another place at which the wheel may touch at the same time.
    """

    shift: np.ndarray
    lift: np.ndarray
    radius: np.ndarray
    half_distance: np.ndarray
    curvature: np.ndarray
    hertz: float | None = None
    upright: float = 0.0
    second: "ContactFunctions | None" = None

    def contact_angle(self) -> np.ndarray:
        """Angle of the contact plane over `shift` [rad]."""
        return np.arctan(CubicSpline(self.shift, self.lift)(self.shift, 1))

    def stiffness(self) -> float:
        """Hertz stiffness C of N = C p^1.5, that at u = 0 unless given [N/m^1.5]; one value serves all shifts, so that
        the contact has a potential.
        """
        return self._stiffness

    @cached_property
    def _stiffness(self) -> float:
        if self.hertz is not None:
            return self.hertz
        middle = len(self.shift) // 2
        return hertz_ellipse(1.0 / self.radius[middle], self.curvature[middle]).stiffness

    def channels(self) -> np.ndarray:
        """(points, CHANNELS): geometry, unit-load semi-axes, Kalker coefficients, rolling radius by roll [m].

        A wheel that turns by a small angle on its rail touches it farther along by the angle over the sum of
        curvatures, where the slopes of both are equal again; its radius grows by the slope times that way.
        """
        columns = np.empty((len(self.shift), CHANNELS))
        columns[:, LIFT], columns[:, RADIUS], columns[:, HALF_DISTANCE] = self.lift, self.radius, self.half_distance
        columns[:, AXIS_A], columns[:, AXIS_B], _ = hertz_ellipses(1.0 / self.radius, self.curvature)
        columns[:, C11 : C23 + 1] = kalker_table(columns[:, AXIS_A] / columns[:, AXIS_B])
        tread = np.clip(np.tan(self.contact_angle()), -STEEPEST, STEEPEST)
        columns[:, BY_TURN] = self.upright * tread / np.maximum(self._curvature_of_place(), FLATTEST)
        return columns

    def _curvature_of_place(self) -> np.ndarray:
        """Sum of curvatures [1/m] that the slope has over the places of contact: those of the profiles, which Hertz's
        theory need not have, as on a flange that begins within a patch. With u the wheel's place moves by 1 - b' and
        the rail's by -b', where b is the contact's place across the track. Straight wheels have that of the rail.
        """
        bend = CubicSpline(self.shift, self.lift)(self.shift, 2)
        rail = -CubicSpline(self.shift, self.half_distance)(self.shift, 1)
        found = bend / (np.maximum(rail, LEAST_WAY) * np.maximum(1.0 + rail, LEAST_WAY))
        return np.where((rail > LEAST_WAY) & (bend > 0.0), found, np.maximum(found, self.curvature))


@dataclass(frozen=True)
class ContactTable:
    """Uniform cubic-spline tables of both wheels: what the kernels read.

    Attributes
    ----------
    start, spacing : grid of u [m]. coefficients : (2 or 4, cells, CHANNELS, 4), side 0 = left, powers ascending in the
    cell's fraction; rows 2 and 3 are the second contacts of the left and right wheels, where they have one.
    stiffness : (2 or 4,) Hertz stiffness [N/m^1.5].
    """

    start: float
    spacing: float
    coefficients: np.ndarray
    stiffness: np.ndarray

    @property
    def contacts(self) -> int:
        """Contacts that a wheel may have at once."""
        return len(self.stiffness) // 2

    @property
    def middle_radius(self) -> np.ndarray:
        """(2,) rolling radius of the left and the right wheel in the middle of the table [m]."""
        return self.coefficients[:2, self.coefficients.shape[1] // 2, RADIUS, 0]

    @classmethod
    def build(cls, left: ContactFunctions, right: ContactFunctions | None = None) -> "ContactTable":
        """Tables of a left wheel and, by mirroring u and H's argument, the right one (`right` is given as if it were
        a left wheel).
        """
        return _table(left, right)


@lru_cache(maxsize=8)
def _table(left: ContactFunctions, right: ContactFunctions | None) -> ContactTable:
    start, spacing = float(left.shift[0]), float(left.shift[1] - left.shift[0])
    if not np.allclose(left.shift, -left.shift[::-1], atol=1e-12) or not np.allclose(np.diff(left.shift), spacing):
        raise ValueError("contact functions need a uniform grid that is symmetric about u = 0")
    lefts, others = _places(left), _places(left if right is None else right)
    if len(lefts) != len(others):
        raise ValueError("both sides need the same number of contacts")
    tables, stiffness = [], []
    for own, other in zip(lefts, others, strict=True):
        cells = _cells(own.shift, own.channels())
        mirrored = (cells if other is own else _cells(other.shift, other.channels()))[::-1]
        tables += [cells, _reversed_argument(mirrored)]
        stiffness += [own.stiffness(), other.stiffness()]
    return ContactTable(start, spacing, np.ascontiguousarray(np.stack(tables)), np.array(stiffness))


def _places(given: ContactFunctions) -> list[ContactFunctions]:
    """All places at which a wheel may touch."""
    return [given] if given.second is None else [given, *_places(given.second)]


def _cells(shift: np.ndarray, channels: np.ndarray) -> np.ndarray:
    """(cells, CHANNELS, 4) coefficients in x = (u - u_cell) / spacing."""
    spacing = shift[1] - shift[0]
    spline = CubicSpline(shift / spacing, channels)
    return np.ascontiguousarray(np.transpose(spline.c[::-1], (1, 2, 0)))


def _reversed_argument(cells: np.ndarray) -> np.ndarray:
    """Coefficients of f(1 - x) from those of f(x)."""
    c0, c1, c2, c3 = np.moveaxis(cells, -1, 0)
    return np.stack((c0 + c1 + c2 + c3, -(c1 + 2 * c2 + 3 * c3), c2 + 3 * c3, -c3), axis=-1)
