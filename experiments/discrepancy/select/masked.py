"""Masked: what nuisances imitate so well that beside them its signature promises nothing, and a fit all the same finds.

A wider gauge changes conicity and creepage. Nuisances that have followed it stand at another minimum, and from there
the way back does not lead downhill.
"""

from collections.abc import Sequence

from experiments.discrepancy.baseline.parallel import in_parallel
from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import starting_fit
from experiments.discrepancy.fit.hypothesis import Hypothesis, hypothesis
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.select.decide import ENOUGH
from experiments.discrepancy.select.refining import time_for
from experiments.discrepancy.select.stand import Stand
from experiments.discrepancy.select.starts import at_home

REACH = 50.0  # nats behind nuisances alone, from which a fit is followed: 23 healthy recordings ended 12 to 72 behind


def unmasked(stand: Stand, found: Sequence[Candidate], progress: Progress) -> Stand:
    """With the masked effects fitted from the nominal build, larger and smaller ones; where one is better than
    nuisances alone, with its rivals too, else as it was.
    """
    masked = {one.name: one.kind for one in found if one.kind.masked}
    made = [one for name in masked for one in _fitted(stand, name, found, progress)]
    if all(one.log_evidence < stand.null.log_evidence + ENOUGH for one in made):
        return stand
    names = dict.fromkeys(name for kind in masked.values() for name in kind.rivals)
    rivals = [one for name in names for one in _fitted(stand, name, found, progress)]
    return Stand(stand.problem, stand.null, [*made, *rivals])


def _fitted(stand: Stand, name: str, found: Sequence[Candidate], progress: Progress) -> list[Hypothesis]:
    """All variants of an effect in both directions, side by side."""
    problem = stand.problem
    home = starting_fit(problem, at_home(problem, stand.null.fit))
    level = stand.null.fit.cost(problem.train) + REACH

    def fitted(job: tuple[Candidate, list[dict[str, float]]]) -> Hypothesis | None:
        one, sizes = job
        return hypothesis(problem, home, (one,), [(home.z, [values]) for values in sizes], progress, level)

    jobs = [(one, sizes) for one in found if one.name == name for sizes in _directions(one)]
    jobs = [job for job in jobs if time_for(problem, "fit", job[0].label, progress)]
    return [one for one in in_parallel(fitted, jobs) if one is not None]


def _directions(one: Candidate) -> list[list[dict[str, float]]]:
    """The bank's sizes, those above its absent value and those below."""
    name, free = next((name, free) for name, free in one.parameters.items() if free.absent is not None)
    sizes = list(one.banked())
    both = [[v for v in sizes if v[name] > (free.absent or 0.0)], [v for v in sizes if v[name] < (free.absent or 0.0)]]
    return [some for some in both if some]
