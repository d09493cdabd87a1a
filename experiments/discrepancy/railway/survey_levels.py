"""Levels of a track file's errors, in whole steps of their logs: the best of those nearby, kind by kind."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

SWEEPS = 8  # over all kinds at most, so that a search always ends
TOLD = 1.0  # nats; levels of which the record tells less stay as they are

Steps = tuple[int, ...]
"""Steps from the stated level, kind by kind."""


def moved(steps: Steps, kind: int, step: int) -> Steps:
    """With another step of one kind."""
    return (*steps[:kind], step, *steps[kind + 1 :])


@dataclass
class LevelSearch:
    """A search: `costs_of` gives what levels leave [nats]; `known` keeps it."""

    costs_of: Callable[[Sequence[Steps]], Sequence[float]]
    known: dict[Steps, float] = field(default_factory=dict)

    def beside(self, steps: Steps, kind: int, sides: Sequence[int] = (-1, 1)) -> Steps:
        """The best of these levels and of those with one kind's a step to a side, which must gain `TOLD`."""
        near = [moved(steps, kind, steps[kind] + side) for side in (0, *sides)]
        new = [one for one in near if one not in self.known]
        self.known |= dict(zip(new, self.costs_of(new), strict=True))
        best = min(near, key=self.known.__getitem__)
        return best if self.known[steps] - self.known[best] >= TOLD else steps

    def lowered(self, begin: Steps) -> Steps:
        """Levels from which no step down of one kind gains enough. They are never raised: what a model lacks looks like
        errors of the file, so these can seem too large, but not too small.
        """
        best = begin
        for _ in range(SWEEPS):
            last = best
            for kind in range(len(best)):
                best = self.beside(best, kind, (-1,))
            if best == last:
                break
        return best
