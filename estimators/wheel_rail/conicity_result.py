"""What was found of the conicity function, and how an `Estimate` states it."""

from typing import NamedTuple

import numpy as np
import pandas as pd

POINTS = 121
QUANTILE = 0.999  # of the visited shifts, to which the function is stated


class ConicityFit(NamedTuple):
    """Series over time; conicity (n,) with covariance (n, n) at `shifts` (m); visited shifts (m); other parameters."""

    series: pd.DataFrame
    shifts: np.ndarray
    conicity: np.ndarray
    covariance: np.ndarray
    visited: np.ndarray
    others: dict[str, float]

    def stated(self, model_error: float) -> dict:
        """Function at the visited shifts, and conicity of the cone that fits best over the whole record.

        Parameters
        ----------
        model_error : standard deviation (-) besides that of the data.
        """
        shifts, visited = self.shifts, self.visited
        table = np.linspace(-1.0, 1.0, POINTS) * float(np.quantile(visited, QUANTILE))
        spread = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        function = {
            "shift [m]": table.tolist(),
            "conicity [-]": np.interp(np.abs(table), shifts, self.conicity).tolist(),
            "conicity_std [-]": np.hypot(np.interp(np.abs(table), shifts, spread), model_error).tolist(),
            "kind": "secant",
        }
        weights = np.zeros(len(shifts))
        cell = np.minimum(visited / (shifts[1] - shifts[0]), len(shifts) - 1.001)
        near, share = cell.astype(int), cell - np.floor(cell)
        np.add.at(weights, near, (1.0 - share) * visited**2)
        np.add.at(weights, near + 1, share * visited**2)
        weights /= weights.sum()
        own = float(weights @ self.covariance @ weights)
        return {
            "conicity_function": function,
            "found": self.others,
            "effective_conicity [-]": float(weights @ self.conicity),
            "effective_conicity_std [-]": float(np.hypot(np.sqrt(max(own, 0.0)), model_error)),
        }


def mean_over(values: np.ndarray, count: int) -> np.ndarray:
    """Over a window of `count` samples, shorter at the ends."""
    weights = np.ones(min(max(1, count), len(values)))
    return np.convolve(values, weights, "same") / np.convolve(np.ones(len(values)), weights, "same")
