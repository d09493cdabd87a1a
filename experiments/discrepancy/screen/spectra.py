"""Spectra: which effects give the channels the power that they have, whatever the phase of what they do.

Where the track file's errors are passed on as no healthy vehicle would (dry friction), or the motion cannot be repeated
at all (a wheel that leaves the rail), what is measured is not what the true model predicts, but it has that model's
power. Log likelihood of power after Whittle (1953).
"""

from collections.abc import Iterable

import numpy as np
from scipy.ndimage import uniform_filter1d

from experiments.discrepancy.baseline.frames import REDUNDANCY
from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Problem

SMOOTHED = 9  # bins over which the power of model and file are compared
Sized = tuple[Candidate, dict[str, float]]


def by_power(problem: Problem, stacked: np.ndarray, found: Iterable[Candidate]) -> list[tuple[Sized, float]]:
    """Sizes of the bank's candidates without a place by how likely they make the power of the training frames, the best
    first [nats against none of them]; `stacked`: coefficients (k, f, c) that the model predicts without them.
    """
    if problem.bank is None or problem.white is None:
        raise ValueError("give the problem a bank and its noise first")
    whole = problem.train & problem.white.good.all(axis=1)
    if not whole.any():
        return []
    measured = _power(problem.measured[whole])
    plain = _power(stacked[whole])
    passed = problem.bank.propagated
    errors = np.zeros_like(plain)
    if passed is not None:
        errors = np.real(np.diagonal(passed[whole], axis1=-2, axis2=-1)).mean(axis=0)[1:]
    own = np.maximum((problem.white.deviation[whole] ** 2).mean(axis=0)[1:] - errors, 1e-9 * plain.max(axis=0))
    count = whole.sum() / REDUNDANCY

    def likely(power: np.ndarray) -> float:
        smooth = uniform_filter1d(power, SMOOTHED, axis=0, mode="nearest")
        expected = smooth * (1.0 + errors / uniform_filter1d(plain, SMOOTHED, axis=0, mode="nearest")) + own
        return -float(count * (np.log(expected) + measured / expected).sum())

    none = likely(plain)
    jobs = [(one, values) for one in found if not (one.local or one.of_sensor) for values in one.banked()]
    problem.bank.fill(jobs)
    ranked = []
    for one, values in jobs:
        change = problem.bank.signature(one, values)
        if change is not None:
            change = change[0] if one.sharp else change
            ranked.append(((one, values), likely(_power((stacked + change)[whole])) - none))
    return sorted(ranked, key=lambda pair: -pair[1])


def _power(coefficients: np.ndarray) -> np.ndarray:
    """(f - 1, c) mean over frames (k, f, c), without the constant part."""
    return (np.abs(coefficients) ** 2).mean(axis=0)[1:]
