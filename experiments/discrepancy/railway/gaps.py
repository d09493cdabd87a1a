"""How far a model lies from a recording: rms of what is left, over noise and track errors as they are stated."""

from collections.abc import Sequence

import numpy as np

from experiments.discrepancy.core.held_out import quiet
from experiments.discrepancy.core.levels import Sums
from experiments.discrepancy.core.model import Group, Level

BANDS = ((0.6, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0), (20.0, 40.0))
"""Hz."""


def left(groups: Sequence[Group], levels: Sequence[Level], f: np.ndarray) -> np.ndarray:
    """(bands, channels); NaN where a band holds no frequency. 1 = nothing but noise and track errors as stated."""
    found = np.full((len(BANDS), groups[0].residual.shape[2]), np.nan)
    for row, (low, high) in enumerate(BANDS):
        inside = (f >= low) & (f < high)
        if inside.any():
            found[row] = _ratio(groups, levels, inside)
    return found


def overall(groups: Sequence[Group], levels: Sequence[Level]) -> np.ndarray:
    """(channels,) the same over all frequencies."""
    return _ratio(groups, levels, np.ones(groups[0].residual.shape[0], bool))


def _ratio(groups: Sequence[Group], levels: Sequence[Level], inside: np.ndarray) -> np.ndarray:
    total, count = np.zeros(groups[0].residual.shape[2]), 0
    for one in groups:
        expected = np.real(np.einsum("fcc->fc", Sums.of(one).covariance(quiet(levels))))
        total += (np.abs(one.residual[inside]) ** 2 / expected[inside, None]).sum((0, 1))
        count += int(inside.sum()) * one.residual.shape[1]
    return np.sqrt(total / max(count, 1))
