"""One wheel's rolling radius over its shift towards the rail, as a function that is linear in coefficients."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline

SPACING, HALF = 1e-4, 120
"""Of the shifts in the tables, m, and how many on either side of the middle."""


@dataclass(frozen=True)
class Basis:
    """Change of one wheel's rolling radius F(u) = radius @ coefficients, over its shift u towards the rail (m).

    Attributes
    ----------
    radius : (2 HALF + 1, count), m, at equal steps of u. cone : (count,): coefficients of a cone of conicity 1 with a
    tilt. curvature : (rows, count): second differences of the slope.
    """

    radius: np.ndarray
    cone: np.ndarray
    curvature: np.ndarray

    @property
    def shift(self) -> np.ndarray:
        """y - d of the rows of `conicity`, m."""
        return SPACING * np.arange(HALF + 1)

    @property
    def conicity(self) -> np.ndarray:
        """Coefficients to the conicity at nominal gauge, (F(x) - F(-x)) / 2 x, at `shift` x: (HALF + 1, count)."""
        difference = self.radius[HALF:] - self.radius[HALF::-1]
        difference[0] = self.radius[HALF + 1] - self.radius[HALF - 1]
        return difference / (2.0 * np.maximum(self.shift, 0.0) + 2.0 * SPACING * (self.shift == 0.0))[:, None]

    def moved(self, shift: float) -> "Basis":
        """F(u - shift) for every function: what a gauge narrower by twice the shift does."""
        columns = [np.interp(_shifts() - shift, _shifts(), column) for column in self.radius.T]
        return replace(self, radius=np.stack(columns, axis=1))


def wheel_basis(reach: float, pieces: int, tilt: float, transition: float, middle: float = 0.0) -> Basis:
    """Slope of F by cubic B-splines between -`reach` and `reach` (m), constant beyond.

    The cone's slope grows towards the flange, by the share `tilt` over `transition` about `middle` (m): with an even
    slope wide and narrow gauge are the same, and no search would leave that.
    """
    knots = -reach + 2.0 * reach / pieces * np.arange(-3, pieces + 4)
    slope = BSpline.design_matrix(np.clip(_shifts(), -reach, reach * (1.0 - 1e-9)), knots, 3).toarray()
    count = slope.shape[1]
    steps = 0.5 * SPACING * (slope[1:] + slope[:-1])
    radius = np.vstack([np.zeros(count), np.cumsum(steps, axis=0)])
    positions = -reach + 2.0 * reach / pieces * (np.arange(count) - 1.0)
    return Basis(
        radius - radius[HALF],
        1.0 + tilt * np.tanh((positions - middle) / transition),
        np.diff(np.eye(count), 2, axis=0),
    )


def _shifts() -> np.ndarray:
    return SPACING * np.arange(-HALF, HALF + 1)
