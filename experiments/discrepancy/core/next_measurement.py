"""What to measure next: how much loss a further record of each kind would save, before it is made.

Where two hypotheses predict m_a and m_b, whitened, the log of the odds that a record adds is normal with mean +-D and
variance 2 D, D = |m_a - m_b|^2 / 2, whichever is true (Kullback 1959). What one hypothesis can still move towards the
other, by its own coordinates within what is known of them, is no difference: it is projected out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.core.levels import Sums
from experiments.discrepancy.core.model import Fit, System
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem, whitened
from experiments.discrepancy.core.verdict import State, Verdict, expected_losses

MOST = 4  # likeliest states that are compared
DRAWS = 2000


@dataclass(frozen=True)
class Saving:
    """Of a further record: its name, the expected loss before and after it, and the weakest separation [nats] of two
    states that are compared.
    """

    name: str
    before: float
    after: float
    separation: float


def savings(
    verdict: Verdict, options: Mapping[str, System], policy: Policy, rng: np.random.Generator
) -> list[Saving]:  # fmt: skip
    """What each further record would save, the best first; nothing where only one state is likely.

    options : the system as it would be measured, by name (another speed, a better sensor, another road).
    """
    fits = _best(verdict)
    states = list(fits)
    if len(states) < 2:
        return []
    posterior = np.array([verdict.posterior()[state] for state in states])
    posterior /= posterior.sum()
    before = _least(states, posterior, policy)
    found = []
    for name, system in options.items():
        apart = _separations([fits[state] for state in states], system, policy)
        after = _afterwards(states, posterior, apart, policy, rng)
        found.append(Saving(name, before, after, float(apart[np.triu_indices(len(states), 1)].min())))
    return sorted(found, key=lambda one: one.after)


def _best(verdict: Verdict) -> dict[State, Fit]:
    """The best fit of each of the likeliest states."""
    likely = sorted(verdict.posterior().items(), key=lambda one: -one[1])[:MOST]
    fits: dict[State, Fit] = {}
    for row in verdict.rows:
        state = State.of(row.fit.hypothesis)
        if state in dict(likely) and state not in fits:
            fits[state] = row.fit
    return fits


def _least(states: Sequence[State], posterior: np.ndarray, policy: Policy) -> float:
    return min(expected_losses(dict(zip(states, posterior, strict=True)), policy.losses).values())


def _separations(fits: Sequence[Fit], system: System, policy: Policy) -> np.ndarray:
    """(states, states) D [nats] between the predictions of two states; where both are the same but for a level, the
    divergence of their covariances.
    """
    count = len(fits)
    apart = np.zeros((count, count))
    for a in range(count):
        for b in range(count):
            if a != b:
                apart[a, b] = _apart(fits[a], fits[b], system, policy)
    return np.minimum(apart, apart.T)


def _apart(true: Fit, other: Fit, system: System, policy: Policy) -> float:
    """Half the squared distance of what `true` predicts from all that `other` can still predict."""
    here = system.about(true.x, true.hypothesis.effects, true.psi)
    components = here.covariances(true.x, true.hypothesis.effects)
    problem = Problem(here, other.hypothesis, policy)
    ours, theirs = (
        here.predict(true.x[None], true.hypothesis.effects),
        here.predict(other.x[None], problem.hypothesis.effects),
    )
    parts = [Sums(np.zeros(part.shape[1:]), part, one.shape[2]) for part, one in zip(components, ours, strict=True)]
    difference = whitened(parts, true.psi, [a - b for a, b in zip(ours, theirs, strict=True)])[0]
    slopes = whitened(parts, true.psi, problem.slopes(other.x, problem.groups(other.x, components)))
    matrix = slopes @ slopes.T + other.precision
    rest = difference @ difference - (slopes @ difference) @ np.linalg.solve(matrix, slopes @ difference)
    return 0.5 * float(rest) + _divergence(parts, true.psi, other.psi)


def _divergence(parts: Sequence[Sums], true: np.ndarray, other: np.ndarray) -> float:
    """Of the covariances at two sets of levels (Kullback and Leibler) [nats]."""
    total = 0.0
    for one in parts:
        ours, theirs = one.covariance(true), one.covariance(other)
        ratio = np.linalg.solve(theirs, ours)
        logs = np.linalg.slogdet(ratio)[1]
        total += (
            0.5 * one.repeats * float(np.real(np.einsum("fcc->", ratio)) - logs.sum() - ratio.shape[-1] * len(ratio))
        )
    return max(total, 0.0)


def _afterwards(
    states: Sequence[State], posterior: np.ndarray, apart: np.ndarray, policy: Policy, rng: np.random.Generator
) -> float:
    """Mean of the least expected loss over what the record may say, with independent draws of the odds."""
    total = 0.0
    for true in rng.choice(len(states), DRAWS, p=posterior):
        odds = -apart[true] + np.sqrt(2.0 * apart[true]) * rng.standard_normal(len(states))
        odds[true] = 0.0
        weights = np.log(np.maximum(posterior, 1e-300)) + odds
        shares = np.exp(weights - weights.max())
        total += _least(states, shares / shares.sum(), policy)
    return total / DRAWS
