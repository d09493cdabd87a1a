"""What several records share (one camera, one track): each learns it from the others.

A record's verdict gives a normal distribution of the shared coordinates, over its hypotheses by their posterior. Taken
apart from the prior it was made with, it is a message: precision and precision times mean. A record's prior is the
first prior and the messages of all others (expectation propagation: Minka 2001).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.core.verdict import Verdict


@dataclass(frozen=True)
class Gaussian:
    """Normal distribution: `mean` (n,), `covariance` (n, n)."""

    mean: np.ndarray
    covariance: np.ndarray

    @property
    def natural(self) -> tuple[np.ndarray, np.ndarray]:
        """Precision, and precision times mean."""
        precision = np.linalg.inv(self.covariance)
        return precision, precision @ self.mean


def marginal(verdict: Verdict, first: int, last: int) -> Gaussian:
    """Mean and covariance of coordinates `first` ... `last` - 1 over all hypotheses."""
    weights = np.array([row.posterior for row in verdict.rows])
    means = np.array([row.fit.x[first:last] for row in verdict.rows])
    mean = weights @ means
    covariance = np.einsum("r,ri,rj->ij", weights, means - mean, means - mean)
    for weight, row in zip(weights, verdict.rows, strict=True):
        covariance += weight * np.linalg.inv(row.fit.precision)[first:last, first:last]
    return Gaussian(mean, covariance)


def message(after: Gaussian, before: Gaussian) -> tuple[np.ndarray, np.ndarray]:
    """What a record says of the shared coordinates: precision (never negative), and precision times mean."""
    (later, pull), (earlier, pulled) = after.natural, before.natural
    values, vectors = np.linalg.eigh(later - earlier)
    kept = values > 0.0
    onto = vectors[:, kept] @ vectors[:, kept].T
    return onto @ (later - earlier) @ onto, onto @ (pull - pulled)


def combined(first: Gaussian, messages: Sequence[tuple[np.ndarray, np.ndarray]]) -> Gaussian:
    """The prior with these messages."""
    precision, pull = first.natural
    total = precision + sum((one[0] for one in messages), np.zeros_like(precision))
    covariance = np.linalg.inv(total)
    return Gaussian(covariance @ (pull + sum((one[1] for one in messages), np.zeros_like(pull))), covariance)
