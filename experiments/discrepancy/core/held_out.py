"""Sections that a fit did not see: whether what was named improves what comes next.

Sections are interleaved, for alignment does not extrapolate; coordinates and levels are those of the seen sections.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.discrepancy.core.curve import whitened_power
from experiments.discrepancy.core.fitting import fit
from experiments.discrepancy.core.levels import middles
from experiments.discrepancy.core.model import Coordinate, Effect, Fit, Hypothesis, Level, Predicted, System, T
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import OutOfTimeError, Problem

NOTHING = np.log(1e-9)  # of a level that is left out
EVERY = 6  # sections: of so many in a row the last third is held out


@dataclass(frozen=True, eq=False)
class Sections:
    """A system of which only some repetitions are seen. `kept`: their places in each group."""

    system: System
    kept: tuple[np.ndarray, ...]

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Those of the system."""
        return self.system.coordinates

    @property
    def levels(self) -> tuple[Level, ...]:
        """Those of the system."""
        return self.system.levels

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """The kept repetitions."""
        return tuple(one[:, kept] for one, kept in zip(self.system.observed, self.kept, strict=True))

    def starts(self) -> np.ndarray:
        """Those of the system."""
        return self.system.starts()

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """The kept repetitions."""
        predicted = self.system.predict(points, effects)
        return tuple(one[:, :, kept] for one, kept in zip(predicted, self.kept, strict=True))

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """Those of the system."""
        return self.system.covariances(x, effects)

    @property
    def dear(self) -> bool:
        """As the system is."""
        return self.system.dear

    def predict_each(self, points: Sequence[tuple[np.ndarray, tuple[Effect, ...]]]) -> list[Predicted]:
        """The kept repetitions."""
        found = self.system.predict_each(points)
        return [tuple(one[:, :, kept] for one, kept in zip(part, self.kept, strict=True)) for part in found]

    def side_by_side(self, tasks: Sequence[Callable[[], T]]) -> list[T]:
        """As the system does it."""
        return self.system.side_by_side(tasks)

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> "Sections":
        """The system with what it knows at a state."""
        return Sections(self.system.about(x, effects, psi), self.kept)

    def settle(self, x: np.ndarray) -> bool:
        """The choice of the whole system stays."""
        del x
        return False


@dataclass(frozen=True, eq=False)
class Known(Sections):
    """A system of which another record has told: its healthy coordinates have `priors`."""

    priors: tuple[Coordinate, ...] = ()

    @classmethod
    def after(cls, found: Fit) -> tuple["Known", Hypothesis]:
        """The system of a fit and its hypothesis, with what the fit knows in place of all priors, coordinate by
        coordinate.
        """
        spreads = np.sqrt(np.diag(np.linalg.inv(found.precision)))
        named = found.hypothesis.coordinates(found.system.coordinates)
        known = [replace(one, mean=x, spread=sd) for one, x, sd in zip(named, found.x, spreads, strict=True)]
        count, effects = len(found.system.coordinates), []
        own = iter(known[count:])
        healthy = {one.name: one for one in known[:count]}
        for effect in found.hypothesis.effects:
            faults = tuple(healthy[one.name] for one in effect.faults)
            effects.append(replace(effect, faults=faults, own=tuple(next(own) for _ in effect.own), starts=()))
        kept = tuple(np.arange(one.shape[1]) for one in found.system.observed)
        return cls(found.system, kept, tuple(healthy.values())), replace(found.hypothesis, effects=tuple(effects))

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """With what is known of them."""
        return self.priors

    def starts(self) -> np.ndarray:
        """Those of the system, about what is known."""
        return self.system.starts() + np.array([one.mean for one in self.priors])

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> "Known":
        """The system with what it knows at a state."""
        return replace(self, system=self.system.about(x, effects, psi))

    def settle(self, x: np.ndarray) -> bool:
        """The choice is that of the system."""
        return self.system.settle(x)


@dataclass(frozen=True)
class Held:
    """What is left in sections that were not seen. `power` : mean square over all fitted levels; 1 is right. `gap` :
    root mean square over noise and the input's error as they are stated.
    """

    power: float
    gap: float


def interleaved(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places of the seen and of the held-out sections."""
    held = np.arange(count) % EVERY >= EVERY - EVERY // 3
    return np.nonzero(~held)[0], np.nonzero(held)[0]


def parted(system: System) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """Places of the seen and of the held-out sections in each group."""
    seen, held = zip(*(interleaved(one.shape[1]) for one in system.observed), strict=True)
    return tuple(seen), tuple(held)


def held_out(found: Fit, system: System, policy: Policy, end: float = math.inf) -> Held | None:
    """A hypothesis fitted to the seen sections, judged by the others; None where no fit is finite, or none is done
    before `end` of time.monotonic().
    """
    seen, held = parted(system)
    slopes = [one[:, :, kept] for one, kept in zip(found.slopes, seen, strict=True)]
    problem = Problem(Sections(system, seen), found.hypothesis, policy, end)
    try:
        again = fit(problem, found.x, found.psi, slopes)
    except OutOfTimeError:
        return None
    if again is None:
        return None
    other = Problem(
        Sections(system.about(again.x, again.hypothesis.effects, again.psi), held), again.hypothesis, policy
    )
    return _judged(other, again.x, again.psi)


def untouched(system: System, start: np.ndarray, policy: Policy) -> Held:
    """The nominal model at `start`, where it is best aligned, judged by the held-out sections."""
    _, held = parted(system)
    problem = Problem(Sections(system.about(start, (), None), held), Hypothesis(), policy)
    return _judged(problem, start, middles(system.levels))


def _judged(problem: Problem, x: np.ndarray, psi: np.ndarray) -> Held:
    groups = problem.groups(x, problem.system.covariances(x, problem.hypothesis.effects))
    return Held(whitened_power(groups, psi), math.sqrt(whitened_power(groups, quiet(problem.levels))))


def quiet(levels: Sequence[Level]) -> np.ndarray:
    """Levels as stated, without the latent ones."""
    return np.where([one.place is not None for one in levels], NOTHING, middles(levels))
