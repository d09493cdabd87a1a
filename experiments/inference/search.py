"""The search: every effect is fitted, `none` gets every chance that the effects had, pairs and unknowns come last.

Most wrong verdicts come from a bad optimum, not from the score. So `none` is tried again from the nuisances of the
best effect (what nuisances can do is no evidence), every effect begins at the fit of `none` and at the nominal build,
and each half of a pair is tried alone from the pair.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from experiments.inference.fitting import Problem, few_steps, fit, with_unknown
from experiments.inference.levels import cost, middles, sums
from experiments.inference.model import Effect, Fit, Group, Hypothesis, Level, Library, System
from experiments.inference.policy import Policy
from experiments.inference.verdict import Verdict, decide, log_prior
from railsim.errors import InputError

PAIRS = 3  # partners of the best effect that are fitted whole
FIRST_STEPS = 2  # of each effect of a large library, before any is fitted whole
BESIDE = 2  # effects beside which something unknown is looked for


def places(levels: Sequence[Level]) -> tuple[str, ...]:
    """Where something unknown may be."""
    return tuple(dict.fromkeys(level.place for level in levels if level.place is not None))


@dataclass
class Search:
    """A search under way: the best fit of every hypothesis so far, and what was done."""

    system: System
    library: Library
    policy: Policy
    fits: dict[str, Fit] = field(default_factory=dict)
    steps: list[str] = field(default_factory=list)
    not_tried: list[str] = field(default_factory=list)

    def verdict(self) -> Verdict:
        """Over all that was fitted."""
        return decide(
            list(self.fits.values()), self.library, places(self.system.levels), self.policy, self.not_tried, self.steps
        )

    def problem(self, *effects: Effect) -> Problem:
        """Of these effects."""
        return Problem(self.system, Hypothesis(effects), self.policy)

    def take(self, found: Fit | None, what: str) -> None:
        """Keep a fit where it is better than the one so far."""
        if found is None:
            return
        name = found.hypothesis.name
        before = self.fits.get(name)
        if before is None or found.evidence > before.evidence:
            gained = "" if before is None else f" (+{found.evidence - before.evidence:.1f} nats)"
            self.steps.append(f"{name}: {what}{gained}")
            self.fits[name] = found

    def value(self, found: Fit) -> float:
        """Evidence and prior together."""
        where = places(self.system.levels)
        return found.evidence + log_prior(found.hypothesis, self.library, where, self.policy)


def infer(system: System, library: Library, policy: Policy | None = None) -> Verdict:
    """What is missing in a model.

    Raises
    ------
    InputError : the predictions of the nominal model are not finite.
    """
    search = Search(system, library, policy or Policy())
    _none(search)
    base = np.array([one.mean for one in system.coordinates])
    for effect in _ordered(search):
        for begin in _distinct([*effect.begins(search.fits["none"].x, system.coordinates),
                                *effect.begins(_aligned(search, base), system.coordinates)]):  # fmt: skip
            search.take(fit(search.problem(effect), begin), "fitted")
    _none_again(search)
    _pairs(search)
    _unknowns(search)
    return search.verdict()


def _none(search: Search) -> None:
    """Alignment from all starts first, then the fit."""
    problem = search.problem()
    starts = search.system.starts()
    components = search.system.covariances(starts[0], ())
    residuals = problem.residuals(starts)
    high = middles(problem.levels) + np.array([1.6 if level.place else 0.0 for level in problem.levels])
    costs = []
    for index, start in enumerate(starts):
        groups = [Group(residual[index], part) for residual, part in zip(residuals, components, strict=True)]
        costs.append(cost(sums(groups), high) + problem.prior(start))
    if not np.isfinite(costs).any():
        raise InputError("the nominal model gives no finite prediction of this record; check its sheet and its start")
    for index in np.argsort(costs)[:2]:
        search.take(fit(problem, starts[index]), f"fitted from start {index}")
    search.take(fit(problem, search.fits["none"].x, search.fits["none"].psi), "fitted again from its own end")


def _aligned(search: Search, base: np.ndarray) -> np.ndarray:
    """The nominal build with the alignment of the best start."""
    start = search.system.starts()[0]
    return np.where(np.isfinite(start), start, base)


def _distinct(points: Sequence[np.ndarray]) -> list[np.ndarray]:
    return [one for index, one in enumerate(points) if not any(np.array_equal(one, two) for two in points[:index])]


def _ordered(search: Search) -> Sequence[Effect]:
    """Effects that are fitted whole; of a large library those whose first step gains most."""
    effects = search.library.effects
    if len(effects) <= search.policy.candidates:
        return effects
    gains = {effect.name: _first_gain(search, effect) for effect in effects}
    order = sorted(effects, key=lambda effect: -gains[effect.name])
    left = order[search.policy.candidates :]
    search.not_tried += [f"{one.name}: first steps gain {gains[one.name]:.1f} nats" for one in left]
    return order[: search.policy.candidates]


def _first_gain(search: Search, effect: Effect) -> float:
    """What two steps from `none`, in its covariance, gain [nats]; only an order, nothing is decided by it."""
    base, problem = search.fits["none"], search.problem(effect)
    components = [group.components for group in base.groups]
    costs = []
    for begin in effect.begins(base.x, search.system.coordinates):
        costs.append(few_steps(problem, begin, base.psi, components, FIRST_STEPS))
    return base.cost - min(costs)


def _none_again(search: Search) -> None:
    """`none` from the nuisances of the two best effects."""
    count = len(search.system.coordinates)
    named = sorted((one for one in search.fits.values() if one.hypothesis.effects), key=lambda one: -search.value(one))
    for found in named[:2]:
        x = found.x[:count].copy()
        for fault in (one for effect in found.hypothesis.effects for one in effect.faults):
            index = [one.name for one in search.system.coordinates].index(fault.name)
            x[index] = search.system.coordinates[index].mean
        search.take(fit(search.problem(), x), f"from the nuisances of {found.hypothesis.name}")


def _pairs(search: Search) -> None:
    """The best effect with others of other families, and each half alone from the pair."""
    count = len(search.system.coordinates)
    named = sorted((one for one in search.fits.values() if one.hypothesis.effects), key=lambda one: -search.value(one))
    if not named or search.value(named[0]) < search.value(search.fits["none"]):
        return
    first = named[0].hypothesis.effects[0]
    others = [one.hypothesis.effects[0] for one in named[1:] if one.hypothesis.effects[0].family != first.family]
    search.not_tried += [f"{first.name} + {other.name}" for other in others[PAIRS:]]
    for other in others[:PAIRS]:
        begins = other.begins(named[0].x, search.system.coordinates)
        for begin in begins:
            search.take(fit(search.problem(first, other), begin), "fitted")
        pair = search.fits.get(Hypothesis((first, other)).name)
        if pair is None:
            continue
        own = count + len(first.own)
        alone = np.concatenate([pair.x[:count], pair.x[own:]])
        search.take(fit(search.problem(first), pair.x[:own]), f"from {pair.hypothesis.name}")
        search.take(fit(search.problem(other), alone), f"from {pair.hypothesis.name}")


def _unknowns(search: Search) -> None:
    """Something unknown at each place, beside `none` and beside the best effects."""
    named = [one for one in search.fits.values() if len(one.hypothesis.effects) == 1]
    best = sorted(named, key=lambda one: -search.value(one))[:BESIDE]
    for base in (search.fits["none"], *best):
        for place in places(search.system.levels):
            problem = Problem(search.system, base.hypothesis, search.policy)
            search.take(with_unknown(problem, base, place), f"levels of {base.hypothesis.name} fitted anew")
