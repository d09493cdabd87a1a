"""What healthy systems have a little of: scales of latent levels, learned from records of healthy systems.

Amplitudes of a level over healthy systems are half-normal; the scale is their root mean square. Each record's amplitude
is fitted with the scale so far, the scale follows from all of them and two records more that had the first one (two
pseudo-records: forgotten with twenty real ones), and so on until nothing moves (EM: Dempster, Laird and Rubin 1977).
A mean square is that of a log-normal number as far as the record tells the level; where it tells nothing, the level is
the prior's, whose mean square is that of its mode.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from experiments.discrepancy.core.levels import fit_levels, prior_cost, sums
from experiments.discrepancy.core.model import Fit, Level
from experiments.discrepancy.core.priors import HalfNormal

PSEUDO_RECORDS = 2.0
ROUNDS = 12


def learned_scales(fits: Sequence[Fit], levels: Sequence[Level]) -> dict[str, float]:
    """Scale of each half-normal level by name.

    fits : of healthy systems, or of systems with the effect that they have. levels : with the first scales.
    """
    parts = [sums(fit.groups) for fit in fits]
    psis = [fit.psi for fit in fits]
    scales = {level.name: level.prior.scale for level in levels if isinstance(level.prior, HalfNormal)}
    first = dict(scales)
    for _ in range(ROUNDS):
        current = rescaled(levels, scales)
        squares = []
        for index, one in enumerate(parts):
            best = fit_levels(one, current, psis[index], steps=20)
            psis[index] = best.psi
            spread = np.diag(np.linalg.inv(best.precision))
            told = 1.0 - np.minimum(prior_cost(current, best.psi)[2] * spread, 1.0)  # by the record, not by the prior
            squares.append(np.exp(2.0 * best.psi + np.minimum(2.0 * spread * told, 1.0)))
        mean = np.sum(squares, axis=0)
        for index, level in enumerate(levels):
            if level.name in scales:
                total = mean[index] + PSEUDO_RECORDS * first[level.name] ** 2
                scales[level.name] = float(np.sqrt(total / (len(fits) + PSEUDO_RECORDS)))
    return scales


def rescaled(levels: Sequence[Level], scales: Mapping[str, float]) -> tuple[Level, ...]:
    """Levels with other scales where their names are given."""
    return tuple(
        replace(level, prior=HalfNormal(scales[level.name])) if level.name in scales else level for level in levels
    )
