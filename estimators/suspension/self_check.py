"""Whether a filter's innovations are as large as it expects: what it assumes of the vehicle and the rails holds, or not.

The normalised innovation squared e' S^-1 e of a filter whose model holds is chi-square distributed (Bar-Shalom, Li and
Kirubarajan 2001, section 5.4). It is that of the steady filter at the estimate of each stretch.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from estimators.suspension.base import FilterBank, Problem
from estimators.suspension.filter_bank import exact, unpacked
from estimators.vehicle.affine import INPUTS

WINDOW = 10.0  # s that are looked at, up to each stretch (choice)
IMPROBABLE = 1e-4  # probability of an innovation so large where the model holds (choice)
STEP = 0.02  # of the box; filters are those of the nearest grid point


class Check(NamedTuple):
    """For every stretch: mean of the normalised innovation squared per reading over the last `WINDOW`, NaN where nothing
    is known, and whether the model holds; shapes (stretches,).
    """

    ratio: np.ndarray
    holds: np.ndarray

    def doubt(self) -> str:
        """Why no verdict is given at the end, in words; empty where the model holds."""
        if self.holds[-1]:
            return ""
        return (
            f"readings are off by {self.ratio[-1]:.1f} times the power that the filter expects (chi-square of the "
            "innovations): load, rails, wheels or vehicle are not as it assumes; suspension_spectral fits them"
        )


def check(problem: Problem, estimates: np.ndarray) -> Check:
    """Innovations of filters at an estimate (3,) for every stretch, shape (stretches, 3)."""
    filters = FilterBank(problem, 1)
    size = np.where(problem.high > problem.low, problem.high - problem.low, 1.0)
    kept: dict[tuple[object, ...], np.ndarray] = {}
    squares, counts = np.zeros(len(estimates)), np.zeros(len(estimates))
    for k, ((first, last), estimate) in enumerate(zip(problem.stretches, estimates, strict=True)):
        situation = problem.situation(first, last)
        if situation is None:
            filters.reset()
            continue
        vehicle, speed, unknowns, plan = problem.system(situation)
        cell = tuple(np.rint((estimate - problem.low) / size / STEP).astype(int).tolist())
        if (situation, cell) not in kept:
            near = np.clip(problem.low + np.array(cell) * STEP * size, problem.low, problem.high)
            near = np.where(problem.high > problem.low, near, problem.low)
            kept[situation, cell] = exact(vehicle, speed, problem.record.rate, unknowns, plan, near[None, :])
        packed, readings = kept[situation, cell], len(unknowns.reading)
        whitening = unpacked(packed, plan, len(INPUTS), readings)[2][0]
        found = float(filters.run(situation, plan, packed, first, last)[0])
        if found != 0.0:  # zero until the start is forgotten
            squares[k] = 2.0 * ((last - first) * float(np.log(np.diag(whitening)).sum()) - found)
            counts[k] = (last - first) * readings
    return _judged(problem, squares, counts)


def _judged(problem: Problem, squares: np.ndarray, counts: np.ndarray) -> Check:
    """Chi-square over the last `WINDOW` of stretches; the share of independent samples counts."""
    ends = np.array([problem.record.time[last - 1] for _, last in problem.stretches])
    ratio = np.full(len(ends), np.nan)
    holds = np.ones(len(ends), dtype=bool)
    for k, end in enumerate(ends):
        inside = (ends > end - WINDOW) & (ends <= end)
        count = float(counts[inside].sum())
        if count > 0.0:
            total = float(squares[inside].sum())
            ratio[k] = total / count
            holds[k] = chi2.sf(total * problem.trust, count * problem.trust) >= IMPROBABLE
    return Check(ratio, holds)
