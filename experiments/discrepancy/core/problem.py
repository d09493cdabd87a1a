"""A hypothesis of a system as a search meets it: residuals, slopes and priors."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.core.levels import Sums, middles
from experiments.discrepancy.core.model import Coordinate, Group, Hypothesis, Level, System
from experiments.discrepancy.core.policy import Policy

ROWS = 16  # of slopes whose products are made at a time
ABOVE = math.log(5.0)  # log by which latent levels stand above their healthy middles where a search begins


class OutOfTimeError(Exception):
    """The time for a search has ended."""


Slopes = tuple[np.ndarray, ...]
"""(coordinates, F, T, C) of each group: derivatives of the predictions."""


@dataclass(frozen=True)
class Problem:
    """A hypothesis of a system: what is searched for, with which priors; `end` of time.monotonic()."""

    system: System
    hypothesis: Hypothesis
    policy: Policy
    end: float = math.inf

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Of the hypothesis."""
        return self.hypothesis.coordinates(self.system.coordinates)

    @property
    def levels(self) -> tuple[Level, ...]:
        """Of the hypothesis."""
        return self.hypothesis.levels(self.system.levels, self.policy)

    @property
    def means(self) -> np.ndarray:
        """Of the coordinates' priors."""
        return np.array([one.mean for one in self.coordinates])

    @property
    def spreads(self) -> np.ndarray:
        """Standard deviations of the coordinates' priors."""
        return np.array([one.spread for one in self.coordinates])

    def prior(self, x: np.ndarray) -> float:
        """Minus log prior density of the coordinates."""
        apart = (x - self.means) / self.spreads
        return 0.5 * float(apart @ apart) + float(np.log(self.spreads).sum()) + 0.5 * len(x) * math.log(2.0 * math.pi)

    def residuals(self, points: np.ndarray) -> tuple[np.ndarray, ...]:
        """(points, F, T, C) of each group; raises `OutOfTimeError`."""
        if time.monotonic() > self.end:
            raise OutOfTimeError
        predicted = self.system.predict(points, self.hypothesis.effects)
        return tuple(seen[None] - one for seen, one in zip(self.system.observed, predicted, strict=True))

    def groups(self, x: np.ndarray, components: Sequence[np.ndarray]) -> tuple[Group, ...]:
        """Residuals at x with these covariances."""
        return tuple(Group(one[0], part) for one, part in zip(self.residuals(x[None]), components, strict=True))

    @property
    def followed(self) -> np.ndarray:
        """Places of the coordinates whose slopes come with every prediction: those that the hypothesis brings or gives
        other priors, and the cheap ones.
        """
        faults = {one.name for effect in self.hypothesis.effects for one in effect.faults}
        faults |= {one.name for level in self.hypothesis.unknown for one in level.law}
        count = len(self.system.coordinates)
        places = enumerate(self.coordinates)
        return np.array([k for k, one in places if k >= count or one.name in faults or one.cheap], int)

    @property
    def sizes(self) -> np.ndarray:
        """Steps of the derivatives."""
        return np.array([one.difference for one in self.coordinates])

    def slopes(self, x: np.ndarray, groups: Sequence[Group]) -> Slopes:
        """(coordinates, F, T, C) of each group: forward differences of the predictions from `groups` at x on, all runs
        at once.
        """
        sizes = self.sizes
        parts = zip(groups, self.residuals(x + np.diag(sizes)), strict=True)
        return tuple((one.residual[None] - other) / sizes.reshape(-1, 1, 1, 1) for one, other in parts)

    def ahead(self, x: np.ndarray, components: Sequence[np.ndarray]) -> tuple[tuple[Group, ...], Slopes]:
        """Residuals at x, and slopes there by the coordinates that are `followed`, all runs at once."""
        sizes, which = self.sizes, self.followed
        points = np.concatenate([x[None], x + np.diag(sizes)[which]])
        parts = tuple(zip(self.residuals(points), components, strict=True))
        rows = tuple((one[:1] - one[1:]) / sizes[which].reshape(-1, 1, 1, 1) for one, _ in parts)
        return tuple(Group(one[0], part) for one, part in parts), rows

    def with_own(self, slopes: Sequence[np.ndarray], rows: Sequence[np.ndarray]) -> Slopes:
        """A copy of slopes, of another hypothesis or point, with these rows of the coordinates that are `followed`."""
        count, which = len(self.coordinates), self.followed
        found = tuple(np.zeros((count, *one.shape[1:]), one.dtype) for one in slopes)
        for whole, old, part in zip(found, slopes, rows, strict=True):
            whole[: len(old)] = old
            whole[which] = part
        return found


def distinct(points: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Points in their order, each once."""
    return [one for index, one in enumerate(points) if not any(np.array_equal(one, two) for two in points[:index])]


def raised(levels: Sequence[Level], above: float = ABOVE) -> np.ndarray:
    """Levels at their middles, the latent ones above them by a log: as high as where a fit begins."""
    return middles(levels) + np.array([above if one.place else 0.0 for one in levels])


def whitened(parts: Sequence[Sums], psi: np.ndarray, arrays: Sequence[np.ndarray]) -> np.ndarray:
    """(rows, values) of arrays (rows, F, T, C): multiplied with the inverse root of each covariance, real."""
    columns = []
    for one, values in zip(parts, arrays, strict=True):
        root = np.linalg.inv(np.linalg.cholesky(one.covariance(psi)))
        white = np.einsum("fcd,rftd->rftc", root, values, optimize=True).reshape(len(values), -1)
        columns += [white.real, white.imag] if np.iscomplexobj(white) else [white]
    return np.concatenate(columns, axis=1)


def between(
    parts: Sequence[Sums], psi: np.ndarray, left: Sequence[np.ndarray], right: Sequence[np.ndarray]
) -> np.ndarray:
    """(rows of left, rows of right) products of arrays (rows, F, T, C) in the inverse covariances."""
    found = np.zeros((len(left[0]), len(right[0])))
    for one, a, b in zip(parts, left, right, strict=True):
        inverse, whole = np.swapaxes(np.linalg.inv(one.covariance(psi)), -1, -2), _real(a)
        for first in range(0, len(b), ROWS):
            turned = (b[first : first + ROWS] @ inverse).astype(a.dtype, copy=False)
            found[:, first : first + ROWS] += whole @ _real(turned).T
    return found


def _real(values: np.ndarray) -> np.ndarray:
    """(rows, numbers): real and imaginary parts one after the other."""
    return np.ascontiguousarray(values).reshape(len(values), -1).view(np.float64)
