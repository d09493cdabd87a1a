"""Piecewise cubic polynomials with two continuous derivatives, as a linear combination of B-splines, with a penalty."""

import numpy as np
from scipy.interpolate import BSpline


class Pieces:
    """Cubic polynomials on equal pieces of an interval; beyond it the functions keep their end values.

    Parameters
    ----------
    low, high : ends of the interval. count : number of pieces.
    """

    def __init__(self, low: float, high: float, count: int) -> None:
        self.low, self.high = low, high
        width = (high - low) / count
        self.knots = low + width * np.arange(-3, count + 4)
        self.size = count + 3

    def basis(self, x: np.ndarray) -> np.ndarray:
        """Value of every B-spline at `x` (n,), shape (n, size)."""
        inside = np.clip(x, self.low, self.high - 1e-9 * (self.high - self.low))
        return BSpline.design_matrix(inside, self.knots, 3).toarray()

    def roughness(self) -> np.ndarray:
        """Square root of the penalty on curvature: second differences of the coefficients, shape (size - 2, size)."""
        return np.diff(np.eye(self.size), 2, axis=0)
