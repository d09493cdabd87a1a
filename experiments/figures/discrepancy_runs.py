"""Every effect at three sizes on one nominal run: evidence that can be expected, nearest rivals, and blind runs."""

import json
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import norm

from experiments.discrepancy.baseline.evidence import gather
from experiments.discrepancy.blind.blind_cases import FASTSIM, build_specimen, record_blind, specimen_scores
from experiments.discrepancy.fit.candidates import Candidate, Context, candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.progress import Progress, silent
from experiments.discrepancy.result.adding import gaps, predicted_after
from experiments.discrepancy.result.planning import nominal_problem
from experiments.discrepancy.result.verdict import verdict
from experiments.discrepancy.rule import rule_hash
from experiments.discrepancy.screen.projection import Projection
from experiments.discrepancy.screen.screening import DROPPED
from experiments.discrepancy.select.decide import ENOUGH, SURE, TEMPERATURE
from experiments.discrepancy.workflow import investigate
from railsim.cache import cache_folder
from railsim.effects.interface import Effect
from railsim.errors import InputError
from railsim.files import write_folder_atomically, write_json
from railsim.scenario import Scenario, digest_of

SIZES = ("smallest", "middle", "largest")
FAR = 0.9  # of the way to a bound
THRESHOLDS = (1.0, 0.3, 0.05)  # of the smallest size's distance from the bound, for numbers like a velocity of blow-off
FITTED = 5.0  # nats that the numbers of an effect cost
NAMES = TEMPERATURE * math.log(SURE / (1.0 - SURE))
"""Nats ahead of the next class from which a name is given."""


@dataclass(frozen=True)
class Sized:
    """An effect at one of its sizes.

    Attributes
    ----------
    size : of `SIZES`. name, value, unit, absent : of its first number. gain : expected evidence [nats], nuisances free
    to follow, without its loudest sections where the rule leaves these out; 0 where this vehicle cannot have it.
    power : the same with all sections. own, cleaned : (n,) whitened signature, and what of it the nuisances cannot
    take; empty where there is none. own of one times cleaned of another is the precision that both share.
    """

    candidate: Candidate
    size: str
    effect: Effect
    name: str
    value: float
    unit: str
    absent: float
    gain: float
    power: float
    own: np.ndarray
    cleaned: np.ndarray


def three_sizes(candidate: Candidate) -> list[dict[str, float]]:
    """The smallest size worth naming, a middle one and one close to the bound, of all numbers that say a size."""
    free = candidate.parameters
    sizes = []
    for step in range(len(SIZES)):
        values = {name: min(max(one.default, one.low), one.high) for name, one in free.items()}
        for name, parameter in free.items():
            if parameter.absent is None or parameter.smallest is None:
                continue
            sign = 1.0 if parameter.smallest >= parameter.absent else -1.0
            bound = parameter.high if sign > 0.0 else parameter.low
            near, far = abs(parameter.smallest - parameter.absent), FAR * abs(bound - parameter.absent)
            if near == 0.0:  # another number says the smallest size
                values[name] = parameter.absent + sign * far * 0.5 * step
            elif near >= far:
                values[name] = bound - sign * THRESHOLDS[step] * max(abs(bound - parameter.absent) - near, 0.0)
            else:
                values[name] = parameter.absent + sign * near * (far / near) ** (0.5 * step)
        sizes.append(values)
    return sizes


def expected(scenario: Scenario, only: Sequence[str] | None, progress: Progress) -> list[Sized]:
    """All effects in their first variant at three sizes, a place or a time in the middle of the run."""
    problem = nominal_problem(scenario, progress)
    fit = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    projection = Projection(problem.differentiated(fit), problem.train, problem.forward.bounds)
    first: dict[str, Candidate] = {}
    for candidate in candidates(context_of(problem)):
        if only is None or candidate.name in only:
            first.setdefault(candidate.name, candidate)
    sized_effects = []
    for candidate in first.values():
        for size, values in zip(SIZES, three_sizes(candidate), strict=True):
            sized_effects.append(_sized(problem, projection, fit.stacked, candidate, size, values))
    return sized_effects


def context_of(problem: Problem) -> Context:
    """The nominal run; what has a place or a time stands in its middle, in a training section."""
    evidence = problem.evidence
    train = problem.frames.middles[problem.train]
    time = float(train[len(train) // 2])
    begin, speed = problem.forward.registration.start, float(np.median(evidence.speed[1]))
    return Context(
        tuple(name.split(" [")[0] for name in evidence.channels),
        (begin, begin + speed * evidence.duration),
        (0.0, evidence.duration),
        ((begin + speed * time, time),),
    )


def _sized(
    problem: Problem,
    projection: Projection,
    base: np.ndarray,
    candidate: Candidate,
    size: str,
    values: dict[str, float],
) -> Sized:
    distance, time = candidate.context.spots[0]
    free = candidate.parameters
    there = {"distance": distance, "time": time - 1.0}
    moved = {name: there[p.role] for name, p in free.items() if p.role in there}
    values = {**values, **{name: min(max(at, free[name].low), free[name].high) for name, at in moved.items()}}
    effect = candidate.build(values)
    sized = [(name, p) for name, p in free.items() if p.absent is not None]
    name, p = sized[0] if sized else next(iter(free.items()))
    head = (candidate, size, effect, name, values[name], p.unit, p.absent or 0.0)
    with suppress(InputError):
        z = np.zeros(len(problem.forward.nuisances))
        change = problem.stacked(problem.forward.predict(z, (effect,))) - base
        if np.isfinite(change).all():
            own = (WEIGHT * problem.whitened(change)[problem.train]).astype(np.float32)
            cleaned = projection.cleaned(own.ravel())
            frames = 0.5 * (cleaned**2).reshape(len(own), -1).sum(axis=1)
            loudest = (
                0.0 if candidate.speaks_in_places else float(np.clip(np.sort(frames)[::-1][:DROPPED], 0.0, None).sum())
            )
            power = 0.5 * float(cleaned @ own.ravel())
            return Sized(*head, max(0.0, power - loudest), power, own.ravel(), cleaned)
    return Sized(*head, 0.0, 0.0, np.zeros(0, np.float32), np.zeros(0, np.float32))


def detected(gain: float) -> float:
    """Probability that evidence of mean `gain` less its price and variance 2 `gain` passes the rule's threshold."""
    return _passes(gain - FITTED - ENOUGH, gain)


def named(sized: Sized, rival: "Rival | None") -> float:
    """Probability that it is detected and its nearest rival stays far enough behind, taken as independent."""
    ahead = 1.0 if rival is None else _passes(rival.apart - NAMES, rival.apart)
    return detected(sized.gain) * ahead


def _passes(mean: float, spread: float) -> float:
    return float(norm.cdf(mean / math.sqrt(2.0 * spread))) if spread > 0.0 else 0.0


@dataclass(frozen=True)
class Rival:
    """The other class that can imitate an effect best: cosine of the signatures, evidence [nats] that stays between."""

    name: str
    likeness: float
    apart: float


def rivals(sized_effects: Sequence[Sized]) -> list[Rival | None]:
    """The nearest rival of each; any size of it, scaled."""
    whole = [one for one in sized_effects if one.own.size]
    size = [math.sqrt(max(2.0 * one.power, 1e-12)) for one in whole]
    own = np.stack([one.own / s for one, s in zip(whole, size, strict=True)])
    cleaned = np.stack([one.cleaned / s for one, s in zip(whole, size, strict=True)])
    alike = np.clip(own @ cleaned.T, 0.0, 1.0)
    out: list[Rival | None] = []
    for sized in sized_effects:
        if not sized.own.size:
            out.append(None)
            continue
        row = alike[next(place for place, other in enumerate(whole) if other is sized)]
        others = [
            (float(cosine), other.candidate.name)
            for cosine, other in zip(row, whole, strict=True)
            if other.candidate.equivalence != sized.candidate.equivalence
        ]
        cosine, name = max(others, default=(0.0, ""))
        out.append(Rival(name, cosine, sized.power * (1.0 - cosine**2)) if name else None)
    return out


def blind(
    scenario: Scenario, sized: Sized, seed: int, only: Sequence[str] | None, progress: Progress
) -> dict[str, Any]:
    """What the workflow says of a recording that Exudyn made of a random build with the effect; kept on disk.

    Returns
    -------
    "status" (also "refused" or "impossible": this build cannot have it), "effect", "class", "evidence".
    """
    what = {"rule": rule_hash(), "scenario": scenario.to_yaml(), "effect": sized.effect.settings(), "seed": seed}
    folder = cache_folder().parent / "discrepancy_sizes" / digest_of({**what, "only": sorted(only or [])})
    row = folder.with_suffix(".json")
    with suppress(OSError, ValueError):
        return json.loads(row.read_text())
    row_values = _blind(scenario, sized, seed, only, folder)
    progress(f"blind: {sized.candidate.name}, {sized.size}: {row_values['status']} {row_values['effect'] or ''}")
    part = row.with_suffix(".part")
    with suppress(OSError):
        row.parent.mkdir(parents=True, exist_ok=True)
        write_json(part, row_values)
        part.replace(row)
    return row_values


def _blind(scenario: Scenario, sized: Sized, seed: int, only: Sequence[str] | None, folder: Path) -> dict[str, Any]:
    rng = np.random.default_rng([seed, SIZES.index(sized.size), *sized.candidate.name.encode()])
    nothing = {"status": "impossible", "effect": None, "class": None, "evidence": 0.0}
    scores = specimen_scores(scenario, False, rng)
    law = "fastsim" if rng.random() < FASTSIM else "polach"
    try:
        specimen = build_specimen(scenario, [sized.effect], scores, law, rng)
        with write_folder_atomically(folder) as aside:
            record_blind(specimen, scenario, aside)
    except InputError:
        return nothing
    try:
        findings = investigate(gather(folder, scenario), silent, only)
        whole, channels = gaps(findings, predicted_after(findings, "compiled"))
    except InputError:
        return {**nothing, "status": "refused"}
    said = verdict(findings, whole, channels)
    return {key: said[key] for key in nothing} | {"gap": said["gap"]}
