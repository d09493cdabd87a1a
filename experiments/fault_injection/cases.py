"""Cases: a run measured, spoilt or not, inspected, repaired, and estimated from again."""

from functools import lru_cache
from typing import Any

import numpy as np

from estimators.interface import Estimate
from experiments.fault_injection.faults import Fault, Spoiler
from experiments.fault_injection.kinds import FAULTS
from experiments.fault_injection.runs import RUNS, scenario, truth_of
from experiments.runs.estimation import estimate_all
from experiments.scoring.score import score
from railsim import measure
from railsim.errors import InputError
from railsim.measurements import TIME, Measurements
from railsim.quality.inspection import inspect
from railsim.quality.interface import Finding
from railsim.truth import Truth

HANDFUL = frozenset(
    {"alignment_vertical", "alignment_lateral", "alignment_displacement", "cross_level", "speed_plain", "speed_refined"}
)
"""Estimators of track and speed, quick ones: what is scored in mm and km/h."""
NEAR = 0.5  # s: as the place of a fault must be found
GRADES = ("industrial", "mems")
_ERRORS = "rms error"
_FLOOR = {"km/h": 0.02, "mm": 0.05}
"""Errors below which a share of an error says nothing, by unit; illustrative."""


class Study:
    """Cases by number: the same number, seed and code give the same row, in whatever order they are computed.

    Parameters
    ----------
    seed : of runs, noise and faults.
    shift : m by which the runs begin further on.
    fast : the compiled engine.
    every : of every so-many-th round of all kinds the estimators' scores are compared; 0 for none.
    estimators : that are scored; None for all.
    """

    def __init__(
        self, seed: int, shift: float, fast: bool, every: int, estimators: frozenset[str] | None = None
    ) -> None:
        self.seed, self.every, self.estimators = seed, every, estimators
        self.shift = shift
        self.truth = lru_cache(len(RUNS))(lambda name: truth_of(name, fast, shift))

    def spoilt(self, number: int) -> dict[str, Any]:
        """A recording with a fault; each kind has its turn."""
        kinds = list(FAULTS)
        rng = np.random.default_rng([self.seed, number])
        run, grade = str(rng.choice(list(RUNS))), str(rng.choice(GRADES))
        measured = self._measured(run, grade, number)
        kind = kinds[number % len(kinds)]
        fault, faulty = spoil(measured, kind, rng)
        row = {"case": number, "run": run, "grade": grade, **judge(fault, faulty), "fault": kind}
        if not self.every or number // len(kinds) % self.every:
            return row
        return row | restored(measured, faulty, self.truth(run), self.estimators)

    def clean(self, number: int) -> dict[str, Any]:
        """A recording without one; each run has its turn."""
        names = list(RUNS)
        run, grade = names[number % len(names)], GRADES[number // len(names) % 2]
        measured = self._measured(run, grade, number)
        return {"case": number, "run": run, "grade": grade, **judge(None, measured)}

    def _measured(self, run: str, grade: str, number: int) -> Measurements:
        return measure(self.truth(run), scenario(run, grade, self.shift), seed=self.seed + number).measurements


def spoil(measured: Measurements, kind: str, rng: np.random.Generator) -> tuple[Fault, Measurements]:
    """A fault of a kind, and the recording with it."""
    spoiler = Spoiler(measured, rng)
    fault = FAULTS[kind](spoiler)
    return fault, spoiler.result()


def judge(fault: Fault | None, measured: Measurements) -> dict[str, Any]:
    """What the inspection says of a recording, against what was done to it."""
    faults = inspect(measured).faults
    words = "; ".join(f"{finding.kind} {finding.channel}" for finding in faults)
    if fault is None:
        return {"fault": "none", "found": faults[0].kind if faults else "nothing", "alarms": len(faults), "text": words}
    concerned = [finding for finding in faults if finding.channel in fault.channels or finding.other in fault.channels]
    named = [finding for finding in concerned if finding.kind == fault.kind]
    best = named[0] if named else (concerned[0] if concerned else None)
    return {
        "fault": fault.kind,
        "channel": fault.channels[0],
        "size": fault.size,
        "start [s]": fault.start,
        "end [s]": fault.end,
        "found": best.kind if best else "nothing",
        "detected": float(bool(concerned)),
        "named": float(bool(named)),
        "placed": float(any(_placed(finding, fault) for finding in named)),
        "alarms": len(faults) - len(named),
        "text": words,
    }


def _placed(finding: Finding, fault: Fault) -> bool:
    """Whether begin and end are right."""
    return abs(finding.start - fault.start) <= NEAR and abs(finding.end - fault.end) <= NEAR


def restored(
    clean: Measurements, spoilt: Measurements, truth: Truth, estimators: frozenset[str] | None = None
) -> dict[str, Any]:
    """Largest rms error of any estimator after the repair, and without it, over that from the clean recording, and
    over that from the clean recording without the samples that the fault touched; how many scores each has lost.
    """
    before = _errors(clean, truth, estimators)
    scored = frozenset(key.partition(":")[0] for key in before)
    after, without, gap = (
        _errors(one, truth, scored) for one in (inspect(spoilt).cleaned, spoilt, gapped(clean, spoilt))
    )
    worst = {key: after[key] / value for key, value in before.items() if key in after}
    name = max(worst, key=lambda key: worst[key]) if worst else ""
    return {
        "repaired over clean": worst.get(name, np.nan),
        "worst score": name,
        "lost": len(before.keys() - after.keys()),
        "spoilt over clean": _worst(without, before),
        "repaired over gap": _worst(after, gap),
        "lost beside gap": len((before.keys() & gap.keys()) - after.keys()),
    }


def gapped(clean: Measurements, spoilt: Measurements) -> Measurements:
    """The clean recording without the samples and rows that differ in the spoilt one: the best a repair can leave of
    what takes information away.
    """
    frames: dict[float, dict[str, np.ndarray]] = {}
    for name in clean:
        time, values = clean.time(name), clean[name].copy()
        kept = np.isin(time, spoilt.time(name))
        values[~kept] = np.nan
        if kept.sum() == spoilt[name].size:
            values[np.flatnonzero(kept)[spoilt[name] != clean[name][kept]]] = np.nan
        frames.setdefault(clean.rate(name), {TIME: time})[name] = values
    return Measurements(clean.about, frames, clean.track)


def _worst(errors: dict[str, float], reference: dict[str, float]) -> float:
    """Largest of the ratios; NaN where there is no score in both."""
    return max((errors[key] / value for key, value in reference.items() if key in errors), default=np.nan)


def _errors(measured: Measurements, truth: Truth, estimators: frozenset[str] | None) -> dict[str, float]:
    """Root-mean-square errors of all estimators, not below a floor, by "estimator: score"."""
    errors: dict[str, float] = {}
    estimates = estimate_all(measured, estimators)
    if estimates.failed:
        return {}
    for name, estimate in estimates.given.items():
        for key, value in _scores(estimate, truth).items():
            unit = key.rpartition("[")[2].rstrip("]")
            if _ERRORS in key and unit in _FLOOR and np.isfinite(value):
                errors[f"{name}: {key}"] = max(value, _FLOOR[unit])
    return errors


def _scores(estimate: Estimate, truth: Truth) -> dict[str, float]:
    try:
        return score(estimate, truth)
    except InputError:
        return {}
