"""The curve of a law without a name: its force as a function of a state, with its standard deviation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.core.levels import Sums
from experiments.discrepancy.core.model import Fit, Group


@dataclass(frozen=True)
class Curve:
    """Mean and standard deviation of a law at `states`."""

    states: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray


def curve(fit: Fit, level: int, states: np.ndarray, cross: np.ndarray, own: np.ndarray) -> Curve:
    """The law of one level in a fit, given the residuals (conditional normal distribution).

    Parameters
    ----------
    level : place of the law in the levels. cross : (states, samples) covariance of the law with the samples of the
    first group, at level 1. own : (states,) variance of the law at level 1.
    """
    one, square = Sums.of(fit.groups[0]), float(np.exp(2.0 * fit.psi[level]))
    gain = square * np.linalg.solve(one.covariance(fit.psi)[0], cross.T).T
    mean = gain @ fit.groups[0].residual[0, 0]
    variance = square * own - square * np.einsum("sn,sn->s", gain, cross)
    return Curve(states, mean, np.sqrt(np.maximum(variance, 0.0)))


def whitened_power(groups: Sequence[Group], psi: np.ndarray) -> float:
    """Mean square of the residuals in units of what these levels expect; 1 is right."""
    total, count = 0.0, 0
    for group in groups:
        one = Sums.of(group)
        inverse = np.linalg.inv(one.covariance(psi))
        total += float(np.real(np.einsum("fcd,fdc->", inverse, one.outer)))
        count += group.residual.size
    return total / count
