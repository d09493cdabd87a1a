"""Studies of the half car: other numbers of the policy, other models of error, longer records."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.discrepancy.core.counting import judged
from experiments.discrepancy.core.model import Hypothesis, Level
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from experiments.discrepancy.core.search import infer, places
from experiments.discrepancy.core.verdict import Action, by_state, expected_losses, weigh
from experiments.discrepancy.systems.half_car import HalfCar, Record
from experiments.discrepancy.systems.half_car_benchmark import case_of
from experiments.discrepancy.systems.half_car_library import LIBRARY
from experiments.discrepancy.systems.half_car_truth import SETTINGS, make

LENGTHS = (8.0, 16.0, 40.0)  # s
LENGTH_SETTINGS = ("home", "survey loud", "rough and fast", "integrator")
FOR_TIME = ("tolerance", "candidates", "longest_step")
"""Numbers of the policy that change what a search costs; the table of other numbers leaves them out."""
IN_EVIDENCE = ("unknown_median", "unknown_spread")
"""Numbers that stand in the evidence: a table of kept evidence cannot tell what they do."""

Say = Callable[[str], None]


def hypothesis_of(name: str, levels: Sequence[Level]) -> Hypothesis:
    """The hypothesis that has this name in a table."""
    effects = {one.name: one for one in (*LIBRARY.effects, *LIBRARY.small)}
    parts = [] if name == "none" else re.split(r" \+ ", name)
    own = tuple(effects[part] for part in parts if part in effects)
    unknown = tuple(level for part in parts for level in levels if part == f"unknown: {level.place}")
    return Hypothesis(own, unknown)


def decided_anew(row: Mapping[str, Any], policy: Policy) -> Action:
    """What would be said of an answered case by another policy; its evidence is kept."""
    levels = _levels()
    hypotheses = [hypothesis_of(name, levels) for name, *_ in row["table"]]
    evidence = np.array([value for _, value, _ in row["table"]])
    _, shares = weigh(hypotheses, evidence, LIBRARY, places(levels, LIBRARY), policy)
    losses = expected_losses(by_state(hypotheses, shares), policy.losses)
    return min(losses, key=lambda action: losses[action])


def _levels() -> tuple[Level, ...]:
    nothing = np.zeros(0)
    return HalfCar(Record(nothing, 1.0, 1.0, nothing, 0.0, None)).levels


def sensitivity(rows: Sequence[Mapping[str, Any]]) -> list[list[Any]]:
    """Rows of a table: a number of the policy by half and twice, and by how much right verdicts of each kind change."""
    kinds = ("null", "effect", "foreign", "pair")
    base, found = _right(rows, Policy()), []
    for name, value in Policy().numbers().items():
        if name in (*FOR_TIME, *IN_EVIDENCE):
            continue
        for times in (0.5, 2.0):
            right = _right(rows, Policy().but({name: times * value}))
            found.append([f"{name} x {times:g}", *(right[kind] - base[kind] for kind in kinds)])
    return [["as it is", *(base[kind] for kind in kinds)], *found]


def _right(rows: Sequence[Mapping[str, Any]], policy: Policy) -> dict[str, int]:
    """Right verdicts of each kind."""
    found: dict[str, int] = dict.fromkeys(("null", "effect", "foreign", "pair"), 0)
    for row in rows:
        action = decided_anew(row, policy)
        found[row["kind"]] += verdict_of(row, action) == "right"
    return found


def verdict_of(row: Mapping[str, Any], action: Action) -> str:
    """`judged` of an answered case."""
    return judged(row["kind"], row["families"], row["place"], action)


@dataclass(frozen=True, eq=False)
class OtherErrors(HalfCar):
    """A half car whose latent levels are held at `times` their healthy scales; 0 = white noise and survey alone."""

    times: float = 0.0

    @property
    def levels(self) -> tuple[Level, ...]:
        """Healthy ones, the latent ones known."""
        held = max(self.times, 1e-4)
        return tuple(
            replace(one, prior=LogNormal(held * one.prior.scale, 1e-2), place=one.place if self.times else None)
            if isinstance(one.prior, HalfNormal)
            else one
            for one in self.healthy_levels()
        )


def other_errors(seed: int, indices: Sequence[int], say: Say) -> list[list[Any]]:
    """Rows of a table: latent levels left out, or held at 1 and 3 times their scales; kind, verdict, and how many."""
    counted: dict[tuple[str, str, str], int] = {}
    for index in indices:
        kind, case = case_of(seed, index)
        for title, times in (("none, white noise alone", 0.0), ("held at 1", 1.0), ("held at 3", 3.0)):
            action = infer(OtherErrors(case.record, times=times), LIBRARY).action
            key = (title, kind, judged(kind, case.families, case.place, action))
            counted[key] = counted.get(key, 0) + 1
            say(f"{index} {kind} {case.setting} {' + '.join(case.effects) or case.place or ''}, {title}: {action}")
    return [[*key, count] for key, count in sorted(counted.items())]


def lengths(seed: int, records: int, say: Say) -> list[list[Any]]:
    """Rows of a table: setting, length [s], largest evidence of an effect and of something unknown over `none`, mean
    over healthy records [nats].
    """
    found = []
    for setting in LENGTH_SETTINGS:
        for length in LENGTHS:
            effects, unknown = [], []
            for index in range(records):
                rng = np.random.default_rng([seed, SETTINGS.index(setting), index])
                verdict = infer(HalfCar(make(rng, "null", setting, duration=length).record), LIBRARY)
                effects.append(max(row.evidence for row in verdict.rows if row.fit.hypothesis.named))
                unknown.append(
                    max(r.evidence for r in verdict.rows if r.fit.hypothesis.place and not r.fit.hypothesis.named)
                )
            found.append([setting, length, float(np.mean(effects)), float(np.mean(unknown))])
            say(f"{setting}, {length:g} s: {found[-1][2]:.1f} and {found[-1][3]:.1f} nats")
    return found
