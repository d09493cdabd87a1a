"""Verdict: the JSON that other programs read."""

import math
from typing import Any

import numpy as np

from experiments.discrepancy.fit.hypothesis import intervals
from experiments.discrepancy.result.adding import Gaps
from experiments.discrepancy.screen.screening import Screened
from experiments.discrepancy.select.decide import IN_SET, Judged
from experiments.discrepancy.workflow import Findings

DETECTED = 10.0  # nats that a size must be worth to be detected (`decide.ENOUGH`)


def verdict(findings: Findings, whole: Gaps, channels: dict[str, Gaps]) -> dict[str, Any]:
    """Contract shape; further keys after it."""
    decision = findings.decision
    best = decision.best
    return {
        "status": decision.status,
        "effect": best.hypothesis.candidate.name if best else None,
        "class": best.hypothesis.candidate.equivalence if best else None,
        "alternatives": alternatives(findings),
        "place": place(findings),
        "place_bodies": place_bodies(findings),
        "parameters": intervals(findings.problem, best.hypothesis) if best else {},
        "evidence": _number(best.evidence if best else max((one.evidence for one in decision.judged), default=0.0)),
        "confidence": _number(decision.confidence),
        "gap": whole.plain(),
        "channels": {name: one.plain() for name, one in channels.items()},
        "detectable_size": {name: one["size"] for name, one in detectable(findings.screened).items()},
        "reason": decision.reason,
        "alternative_classes": list(
            dict.fromkeys(
                name
                for one in decision.judged
                if best and one.probability >= IN_SET
                for name in sorted(one.hypothesis.classes)
            )
        ),
        "detectable": detectable(findings.screened),
        "further": _further(findings, best) if best else [],
        "empirical": findings.empirical.effect.settings() if findings.empirical else None,
        "choices": dict(best.hypothesis.candidate.choices) if best else {},
        "located": findings.located.plain(),
        "hypotheses": [_row(one) for one in findings.judged],
        "latent": [
            {
                "place": one.place.label,
                "explained": _number(one.explained),
                "evidence": _number(one.gain),
                "state": one.state,
                "follows": _number(one.follows),
                "curve": one.curve.round(6).tolist(),
            }
            for one in findings.latent
        ],
        "nuisances": {
            nuisance.label: round(float(z), 2)
            for nuisance, z in zip(findings.problem.forward.nuisances, _scores(findings), strict=True)
            if abs(z) > 1.0
        },
        "not_tried": list(findings.not_tried),
        "track_errors_stated": findings.problem.evidence.track_errors_stated,
        "left_out": list(findings.problem.evidence.left_out),
        "lost_sections": lost(findings),
    }


def alternatives(findings: Findings) -> list[str]:
    """Effects that explain the recording nearly as well, and those of the same class."""
    best = findings.decision.best
    if best is None:
        return []
    own = {one.name for one in best.hypothesis.candidates}
    near = [one.hypothesis.candidates for one in findings.decision.judged if one.probability >= IN_SET]
    return list(dict.fromkeys(one.name for candidates in near for one in candidates if one.name not in own))


def place(findings: Findings) -> str | None:
    """Where it acts: the effect's own word for a named one, the latent force's place for an unknown one."""
    best = findings.decision.best
    if best is not None:
        made = ", ".join(f"{key} {value}" for key, value in best.hypothesis.candidate.choices)
        acts = best.hypothesis.candidate.kind.acts_on
        return f"{acts}: {made}" if made else acts
    if findings.decision.status == "unknown" and findings.latent:
        return findings.latent[0].place.label
    return None


def place_bodies(findings: Findings) -> list[str]:
    """Bodies (or the channel) between which an unknown effect acts; empty otherwise."""
    if findings.decision.status != "unknown" or not findings.latent:
        return []
    where = findings.latent[0].place
    return sorted(name for name in (where.upper, where.lower) if name)


def lost(findings: Findings) -> dict[str, float]:
    """Share of the sections in which a channel has lost samples, of those that have."""
    missing = np.isnan(findings.problem.measured).any(axis=1).mean(axis=0)
    channels = findings.problem.evidence.channels
    return {name: round(float(share), 3) for name, share in zip(channels, missing, strict=True) if share > 0.0}


def detectable(screened: tuple[Screened, ...]) -> dict[str, dict[str, Any]]:
    """Smallest size of each effect's first number that would be detected here, and where the effect is absent.

    Between two sizes that were run the gain is taken as a power of the size; below the smallest as the square of what
    is measured.
    """
    sides: dict[tuple[str, bool], list[Screened]] = {}
    for one in screened:
        if one.size and one.detect > 0.0:
            sides.setdefault((one.candidate.label, one.size > 0.0), []).append(one)
    found: dict[str, dict[str, Any]] = {}
    for alike in sides.values():
        one = alike[0]
        name, parameter = next((name, p) for name, p in one.candidate.parameters.items() if p.absent is not None)
        growth = one.candidate.kind.growth.get(name, 1.0)
        sizes, gains = [abs(other.size) for other in alike], [other.detect for other in alike]
        size = np.sign(one.size) * _needed(sizes, gains, growth)
        absent = parameter.absent or 0.0
        value = float(np.clip(absent + size, parameter.low, parameter.high))
        kept = found.get(one.candidate.name)
        if kept is None or abs(value - absent) < abs(kept["size"] - absent):
            found[one.candidate.name] = {"name": name, "absent": absent, "size": _number(value)}
    return found


def _needed(sizes: list[float], gains: list[float], growth: float) -> float:
    """The size at which the gain is `DETECTED`, on straight lines between logarithms; beyond them what is measured
    grows as that power of the size.
    """
    order = np.argsort(sizes)
    x, y = np.log(np.array(sizes)[order]), np.log(np.maximum.accumulate(np.array(gains)[order]))
    wanted = math.log(DETECTED)
    if wanted <= y[0]:
        return float(np.exp(x[0] + 0.5 * (wanted - y[0]) / growth))
    if wanted >= y[-1]:
        return float(np.exp(x[-1] + 0.5 * (wanted - y[-1]) / growth))
    return float(np.exp(np.interp(wanted, y + 1e-9 * np.arange(len(y)), x)))


def _row(judged: Judged) -> dict[str, Any]:
    return {
        "effect": judged.hypothesis.label,
        "class": " + ".join(sorted(judged.hypothesis.classes)),
        "evidence": _number(judged.evidence),
        "held_out": _number(judged.held_out),
        "probability": _number(judged.probability),
        "gap": _number(judged.gap),
    }


def _further(findings: Findings, judged: Judged) -> list[dict[str, Any]]:
    """Effects beside the first."""
    one = judged.hypothesis
    return [
        {
            "effect": candidate.name,
            "class": candidate.equivalence,
            "choices": dict(candidate.choices),
            "parameters": intervals(findings.problem, one, number),
        }
        for number, candidate in enumerate(one.candidates)
        if number
    ]


def _scores(findings: Findings) -> np.ndarray:
    return findings.final.z


def _number(value: float) -> float:
    return float(f"{value:.6g}") if math.isfinite(value) else 0.0
