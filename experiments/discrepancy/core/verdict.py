"""Verdict: what every hypothesis is worth, and the statement with the least expected loss."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.core.model import Fit, Hypothesis, Library
from experiments.discrepancy.core.policy import Losses, Policy

NAMES = 3  # of a set at most


@dataclass(frozen=True)
class State:
    """What may be true: families of effects, and the place of something unknown."""

    families: frozenset[str] = frozenset()
    unknown: str | None = None

    @property
    def healthy(self) -> bool:
        """Nothing is missing."""
        return not self.families and self.unknown is None

    @classmethod
    def of(cls, hypothesis: Hypothesis) -> "State":
        """Of a hypothesis; an unknown at the place of its only effect is an unknown like it."""
        named, place = hypothesis.named, hypothesis.place
        if len(named) == 1 and place and named[0].place == place:
            return cls(unknown=place)
        return cls(hypothesis.families, place)


@dataclass(frozen=True)
class Action:
    """What may be said: `kind` "none", "name", "set", "pair", "unknown" or "name and unknown"."""

    kind: str
    families: tuple[str, ...] = ()
    place: str | None = None

    def __str__(self) -> str:
        joined = (" or " if self.kind == "set" else " and ").join(self.families)
        unknown = f"unknown: {self.place}" if self.place else ""
        return " and ".join(part for part in (joined, unknown) if part) or "none"


@dataclass(frozen=True)
class Row:
    """A hypothesis in the table: evidence over that of `none` [nats], log prior, posterior probability."""

    fit: Fit
    evidence: float
    prior: float
    posterior: float


@dataclass(frozen=True)
class Verdict:
    """The statement, the table behind it (best first), the expected loss of every statement, and what was not tried.

    misfit : what the model lacks beyond all hypotheses, see `screen.misfit`; evidence in `rows` is divided by it. cut :
    the time ended before the likeliest effects were fitted, and `none` once more from their nuisances: the
    statement stands on some of them.
    """

    action: Action
    rows: tuple[Row, ...]
    losses: dict[str, float]
    not_tried: tuple[str, ...] = ()
    steps: tuple[str, ...] = ()
    cut: bool = False
    misfit: float = 1.0

    def table(self) -> str:
        """As text, the ten best."""
        lines = [f"{'hypothesis':40s} evidence  posterior"]
        lines += [f"{row.fit.hypothesis.name:40s} {row.evidence:8.1f}  {row.posterior:9.3f}" for row in self.rows[:10]]
        return "\n".join(lines)

    def posterior(self) -> dict[State, float]:
        """Of what may be true."""
        return by_state([row.fit.hypothesis for row in self.rows], [row.posterior for row in self.rows])


def log_prior(hypothesis: Hypothesis, library: Library, places: Sequence[str], policy: Policy) -> float:
    """Equal over families, then over the variants of each; equal over places, then over the levels and laws of each.

    places : of each level and law that may be unknown, one beside the other.
    """
    families = library.families
    variants = {family: sum(one.family == family for one in library.effects) for family in families}
    each = [1.0 / len(families) / variants[effect.family] for effect in hypothesis.named]
    small = sum(effect.kind == "small" for effect in hypothesis.effects)
    each = [*each, *(1.0 / len(library.small) for _ in range(small))]
    count, unknown = len(hypothesis.named), hypothesis.place is not None
    where = 1.0 / len(set(places)) / places.count(hypothesis.place) if unknown else 1.0
    return _log_prior(count, unknown, where, each, policy)


def _log_prior(count: int, unknown: bool, where: float, each: Sequence[float], policy: Policy) -> float:
    """By the number of named effects; `each` holds the shares of all effects."""
    if count == 0:
        return math.log((policy.unknown * where if unknown else policy.none) * math.prod(each))
    if count == 1:
        return math.log((policy.pair * policy.beside * where if unknown else policy.effect) * math.prod(each))
    share = policy.pair * (1.0 - policy.beside) * (policy.unknown * where if unknown else 1.0)
    return math.log(share * 2.0 * math.prod(each))


def loss(action: Action, state: State, losses: Losses) -> float:
    """What it costs to say this where that is true."""
    if state.healthy:
        return {"none": 0.0, "unknown": losses.false_unknown}.get(action.kind, losses.false_alarm)
    if action.kind == "none":
        return losses.miss
    if action.kind == "unknown":
        if state.families:
            return losses.refuse * (2.0 / 3.0 if state.unknown else 1.0)
        return 0.0 if action.place == state.unknown else losses.half
    if not state.families:
        return losses.half if action.kind == "name and unknown" else losses.name_for_unknown
    said = set(action.families)
    if not said & state.families:
        return losses.wrong
    if action.kind == "set":
        unsaid = len(state.families) - 1 + 1.5 * (state.unknown is not None)
        return losses.extra * (len(said) - 1) + losses.half * unsaid
    missed, added = len(state.families - said), len(said - state.families)
    missed += (state.unknown is not None) - (action.place == state.unknown and state.unknown is not None)
    added += action.place is not None and state.unknown is None
    return losses.half * 1.5 * (missed + added) if added else losses.half * missed


def actions(posterior: Mapping[State, float]) -> list[Action]:
    """All that is worth saying: sets of the likeliest families, every pair and every unknown that was looked at."""
    weight: dict[str, float] = {}
    for state, probability in posterior.items():
        for family in state.families:
            weight[family] = weight.get(family, 0.0) + probability
    likely = sorted(weight, key=lambda family: -weight[family])
    found = [Action("none")] + [Action("name", (family,)) for family in likely[:NAMES]]
    found += [Action("set", tuple(likely[:count])) for count in range(2, min(NAMES, len(likely)) + 1)]
    for state in posterior:
        names = tuple(sorted(state.families))
        if len(names) == 2 and state.unknown is None:
            found.append(Action("pair", names))
        if state.unknown is not None and not names:
            found.append(Action("unknown", (), state.unknown))
        if state.unknown is not None and len(names) == 1:
            found.append(Action("name and unknown", names, state.unknown))
    return found


def weigh(
    hypotheses: Sequence[Hypothesis], evidence: np.ndarray, library: Library, places: Sequence[str], policy: Policy
) -> tuple[np.ndarray, np.ndarray]:
    """Log prior and posterior probability of each hypothesis."""
    priors = np.array([log_prior(one, library, places, policy) for one in hypotheses])
    shares = np.exp(evidence + priors - (evidence + priors).max())
    return priors, shares / shares.sum()


def by_state(hypotheses: Sequence[Hypothesis], shares: Sequence[float] | np.ndarray) -> dict[State, float]:
    """Probability of what may be true."""
    found: dict[State, float] = {}
    for hypothesis, share in zip(hypotheses, shares, strict=True):
        state = State.of(hypothesis)
        found[state] = found.get(state, 0.0) + float(share)
    return found


def expected_losses(posterior: Mapping[State, float], losses: Losses) -> dict[Action, float]:
    """Of everything that is worth saying."""
    parts = posterior.items()
    return {one: sum(share * loss(one, state, losses) for state, share in parts) for one in actions(posterior)}


def decide(
    fits: Sequence[Fit], library: Library, places: Sequence[str], policy: Policy,
    not_tried: Sequence[str] = (), steps: Sequence[str] = (), misfit: float = 1.0,
) -> Verdict:  # fmt: skip
    """The verdict over these fits, of which one is of `none`; each nat counts 1 / `misfit`."""
    base = next(fit.evidence for fit in fits if fit.hypothesis.name == "none")
    hypotheses, evidence = [fit.hypothesis for fit in fits], np.array([fit.evidence - base for fit in fits]) / misfit
    priors, shares = weigh(hypotheses, evidence, library, places, policy)
    parts = zip(fits, evidence, priors, shares, strict=True)
    rows = sorted((Row(fit, *map(float, numbers)) for fit, *numbers in parts), key=lambda row: -row.posterior)
    expected = expected_losses(by_state(hypotheses, shares), policy.losses)
    best = min(expected, key=lambda action: expected[action])
    losses = {str(action): value for action, value in expected.items()}
    return Verdict(best, tuple(rows), losses, tuple(not_tried), tuple(steps), misfit=misfit)
