"""Gusts: when, and for how long, a force blows that rises and falls once, put together from the answer to a short one.

Short gusts of 1 - cosine that begin half a length apart add up to any smooth force, and the vehicle answers to each of
them alike: one run of the model says what any gust would do.
"""

from collections.abc import Callable

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.screen.places import distance_at

WORTH_RUNNING = 1.0  # nats that a gust must promise to be run beside the best
SHORTEST, LONGEST = 2.0, 1.5  # short gusts, and runs, that a gust may last
BEGINS = 0.5  # of a short gust's way, from one begin that is tried to the next
LONGER = 1.15  # ratio of a length that is tried and the next
SCALES = (-5.0, -1.0, -0.2, 0.2, 1.0, 5.0)  # of the middle size, each of which may be scaled as a signature may
APART = 2.0  # ratio of two lengths from which both are worth a run

Weighed = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[float, int, float, np.ndarray, float]]


def put_together(
    problem: Problem,
    candidate: Candidate,
    change_of: Callable[[Candidate, dict[str, float]], np.ndarray | None],
    rows_of: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]],
    weighed: Weighed,
) -> list[dict[str, float]]:
    """Numbers of the gusts that take most of the residual, the best of each range of lengths, the best of all first.

    Parameters
    ----------
    change_of : change of the coefficients (k, f, c) by a candidate's numbers. rows_of : products with the derivatives
    (k, numbers), with the residual (k,) and with each other (k, k) of k changes (k, k, f, c). weighed : the best of
    some signatures of which such products are known.
    """
    free, middle = candidate.parameters, next(iter(candidate.sizes()))
    where, length = candidate.number("distance", "time"), candidate.number("length", "duration")
    force = next(name for name, one in free.items() if one.smallest is not None)
    starts = problem.frames.starts
    hop = float(starts[1] - starts[0])
    at, peaks = starts, starts + hop
    if free[where].role == "distance":
        at, peaks = distance_at(problem, at), distance_at(problem, peaks)
    short = {where: float(at[1]), length: float(at[3] - at[1])}
    change = change_of(candidate, {**middle, **short})
    if change is None:
        return []
    along, across, gram = rows_of(np.stack([delayed(change, number - 1) for number in range(len(starts))]))
    step = float(np.median(np.diff(at)))
    found: list[tuple[float, float, dict[str, float]]] = []
    long = SHORTEST * step
    while long < LONGEST * (at[-1] - at[0]):
        if free[length].low <= long <= free[length].high:
            begins = np.arange(max(free[where].low, at[0] - long), min(free[where].high, at[-1]), BEGINS * step)
            phase = np.clip((peaks - begins[:, None]) / long, 0.0, 1.0)
            shape = 0.5 * (1.0 - np.cos(2.0 * np.pi * phase))
            shape = np.concatenate([scale * shape for scale in SCALES])
            gain, which, scale, *_ = weighed(shape @ along, shape @ across, ((shape @ gram) * shape).sum(axis=1))
            size = scale * SCALES[which // len(begins)] * middle[force]
            begin = float(begins[which % len(begins)])
            size = float(np.clip(size, free[force].low, free[force].high))
            found.append((gain, long, {**middle, where: begin, length: float(long), force: size}))
        long *= LONGER
    best: list[tuple[float, dict[str, float]]] = []
    for _, long, values in sorted(found, key=lambda one: -one[0]):
        if all(max(long / other, other / long) > APART for other, _ in best):
            best.append((long, values))
    gains = {long: gain for gain, long, _ in found}
    return [values for number, (long, values) in enumerate(best) if not number or gains[long] > WORTH_RUNNING]


def delayed(change: np.ndarray, frames: int) -> np.ndarray:
    """A change (k, f, c) so many frames later, or earlier; nothing before the first, as before a force."""
    moved = np.zeros_like(change)
    if frames >= 0:
        moved[frames:] = change[: len(change) - frames]
    else:
        moved[:frames] = change[-frames:]
    return moved
