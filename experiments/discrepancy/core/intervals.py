"""How far off the coordinates of a fit may be: the spread of its optimum over records that a system itself would make.

Second derivatives of the cost tell it where errors are just as S says: frames apart from one another, small motions.
An error e moves the optimum by H^-1 J^T S^-1 e, whatever it is like. So its spread is taken over drawn errors, with
that of the priors: H^-1 (P + mean of J^T S^-1 e e^T S^-1 J) H^-1 (White 1982, Econometrica 50, theorem 3.2).
"""

from typing import Protocol, runtime_checkable

import numpy as np

from experiments.discrepancy.core.levels import sums
from experiments.discrepancy.core.model import Effect, Fit
from experiments.discrepancy.core.problem import whitened

DRAWS = 100


@runtime_checkable
class Drawn(Protocol):
    """A system that can draw its own errors."""

    def errors(
        self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray, count: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, ...]:
        """(count, F, T, C) of each group, of all sources at these levels."""
        ...


def covariance(found: Fit, rng: np.random.Generator) -> np.ndarray:
    """(coordinates, coordinates) of a fit's coordinates; by second derivatives alone where a system draws no errors."""
    inverse = np.linalg.inv(found.precision)
    if not isinstance(found.system, Drawn):
        return inverse
    parts = sums(found.groups)
    drawn = found.system.errors(found.x, found.hypothesis.effects, found.psi, DRAWS, rng)
    slopes = whitened(parts, found.psi, found.slopes)
    pulls = whitened(parts, found.psi, drawn) @ slopes.T
    return inverse @ (found.precision - slopes @ slopes.T + pulls.T @ pulls / DRAWS) @ inverse
