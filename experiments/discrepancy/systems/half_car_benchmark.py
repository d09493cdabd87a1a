"""Verdicts on simulated half cars whose truth is hidden: healthy ones, effects of the library, foreign laws, pairs."""

import json
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discrepancy.core.counting import dealt, judged
from experiments.discrepancy.core.healthy import learned_scales
from experiments.discrepancy.core.intervals import covariance
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.search import healthy_fit, infer
from experiments.discrepancy.core.verdict import Row, Verdict
from experiments.discrepancy.systems.half_car import COORDINATES, HalfCar
from experiments.discrepancy.systems.half_car_library import LIBRARY
from experiments.discrepancy.systems.half_car_truth import SETTINGS, Case, make
from railsim.errors import InputError
from railsim.files import replace_file

NAME = "half_car"  # of the files
KINDS = ("null", "effect", "null", "foreign", "null", "effect", "null", "pair", "null", "effect")
"""Of ten cases in a row; each goes on to the next setting after ten."""
DEVELOPMENT = 55  # seed of the healthy records that scales are learned from
LEARNED = 16  # healthy records

Say = Callable[[str], None]


def case_of(seed: int, index: int) -> tuple[str, Case]:
    """Kind and case."""
    kind, setting = dealt(index, KINDS, SETTINGS)
    return kind, make(np.random.default_rng([seed, index]), kind, setting)


def learn(say: Say) -> dict[str, float]:
    """Scales of the latent levels over healthy records of all settings; `half_car.SCALES` holds them."""
    fits, levels = [], ()
    for index in range(LEARNED):
        case = make(np.random.default_rng([DEVELOPMENT, index]), "null", SETTINGS[index % len(SETTINGS)])
        system = HalfCar(case.record, dict.fromkeys(HalfCar(case.record).scales, 0.01))
        fits.append(healthy_fit(system, Policy()))
        levels = system.levels
        say(f"healthy record {index + 1} of {LEARNED}")
    return learned_scales(fits, levels)


def run_benchmark(
    folder: Path, seed: int, indices: Iterable[int], say: Say, policy: Policy | None = None,
    scales: dict[str, float] | None = None,
) -> None:  # fmt: skip
    """Answer the cases that `folder` does not hold yet, a file each; by a policy and scales of one's own."""
    if seed == DEVELOPMENT:
        raise InputError(f"--seed {seed}: the healthy levels were learned from these records; take another")
    folder.mkdir(parents=True, exist_ok=True)
    for index in indices:
        path = folder / f"{NAME}_{seed}_{index:04d}.json"
        if path.exists():
            continue
        kind, case = case_of(seed, index)
        begin = time.monotonic()
        system = HalfCar(case.record) if scales is None else HalfCar(case.record, scales)
        verdict = infer(system, LIBRARY, policy)
        row = answered(kind, case, verdict, np.random.default_rng([seed, index, 1]))
        row |= {"seed": seed, "index": index, "seconds": time.monotonic() - begin}
        replace_file(path, (json.dumps(row, indent=1) + "\n").encode())
        say(f"{index} {kind} {case.setting} {' + '.join(case.effects) or case.place or ''}: {verdict.action}")


def answered(kind: str, case: Case, verdict: Verdict, rng: np.random.Generator) -> dict[str, Any]:
    """Truth, statement and the best hypotheses of a case. rng : of the errors by which intervals are made."""
    best = [row for row in verdict.rows if row.fit.hypothesis.named]
    own = next((row.evidence for row in verdict.rows if _is(row, case)), None)
    state, probability = max(verdict.posterior().items(), key=lambda one: one[1])
    return {
        "kind": kind, "setting": case.setting, "effects": case.effects, "families": case.families, "place": case.place,
        "said": str(verdict.action), "judged": judged(kind, case.families, case.place, verdict.action),
        "table": [[r.fit.hypothesis.name, round(r.evidence, 2), round(r.posterior, 4)] for r in verdict.rows],
        "largest": max((row.evidence for row in best), default=None),
        "own": own, "stated": probability,
        "leads": (state.families, state.unknown) == (frozenset(case.families), case.place),
        "covered": covered(case, verdict.rows, rng),
    }  # fmt: skip


def covered(case: Case, rows: Sequence[Row], rng: np.random.Generator) -> dict[str, float]:
    """Normalised errors of the sizes of the true effects, in the hypothesis that has just these."""
    row = next((one for one in rows if _is(one, case)), None)
    if row is None:
        return {}
    spreads, errors, hypothesis = np.sqrt(np.diag(covariance(row.fit, rng))), {}, row.fit.hypothesis
    for effect, places in zip(hypothesis.effects, hypothesis.places(COORDINATES), strict=True):
        for one, place in zip((*effect.faults, *effect.own), places, strict=True):
            if one.name in case.sizes:
                errors[one.name] = float((row.fit.x[place] - case.sizes[one.name]) / spreads[place])
    return errors


def _is(row: Row, case: Case) -> bool:
    names = {effect.name for effect in row.fit.hypothesis.effects}
    return bool(names) and names == set(case.effects) and not row.fit.hypothesis.unknown
