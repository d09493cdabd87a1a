"""What an answer says, in numbers for programs and in words for people."""

import math
from typing import Any

from experiments.discrepancy.core.held_out import Held
from experiments.discrepancy.core.known import Known
from experiments.discrepancy.core.model import Fit
from experiments.discrepancy.railway.answer import Answer
from experiments.discrepancy.railway.gaps import overall
from experiments.discrepancy.railway.unknown import BROADBAND, told
from railsim.effects.interface import EFFECTS

STRAINED = 2.0  # standard deviations of its tolerance from which a coordinate is told
BEYOND = 4.0  # from which it is said in words: one in 16 000 healthy ones
LACKING = 1.5  # times what chance explains, from which it is said in words
LOUD = 2.0  # times its healthy scale from which a level is told
STATUS = {
    "none": "none", "name": "named", "set": "ambiguous", "pair": "pair", "unknown": "unknown",
    "name and unknown": "named and unknown",
}  # fmt: skip
"""Of actions; `status` has two more."""
FURTHER = ("a recording like this, ...", "nats between the likeliest two", "expected loss now", "with it")
"""Titles of a table of further recordings."""


def statement(answer: Answer) -> dict[str, Any]:
    """The verdict as JSON holds it."""
    verdict, record, best = answer.verdict, answer.system.record, answer.best
    before, only, after = (
        overall(groups, answer.system.levels) for groups in (answer.nominal, answer.none.groups, best.groups)
    )
    gaps, kind = zip(record.channels, before, only, after, strict=True), status(answer)
    action = verdict.action if kind in STATUS.values() else None
    named = [one.listed.partition(" (")[0] for one in best.hypothesis.named] if action and action.families else []
    families = list(action.families) if action else []
    evidence = next(row.evidence for row in verdict.rows if row.fit.hypothesis.name == best.hypothesis.name)
    before_held, only_held, after_held = answer.held
    after_held = only_held if best is answer.none else after_held
    held = {"before": _held(before_held), "nuisance_only": _held(only_held), "after": _held(after_held)}
    return {
        "status": kind,
        "effect": " + ".join(named) or None,
        "class": " + ".join(sorted(best.hypothesis.families)) if named else None,
        "alternatives": families if action and action.kind == "set" else [],
        "place": action.place if action else None,
        "parameters": parameters(answer, best),
        "evidence": _round(evidence),
        "confidence": _round(_probability(answer)),
        "gap": {name: one["gap"] if one else None for name, one in held.items()},
        "detectable_size": answer.plan.sizes() if answer.plan else {},
        "statement": str(action) if action else kind,
        "effects": families,
        "unknown": told(answer.unknown) if action and action.place and answer.unknown else None,
        "channels": {
            name: {"before": round(a, 3), "nuisance_only": round(b, 3), "after": round(c, 3)} for name, a, b, c in gaps
        },
        "held_out": held,
        "misfit": round(verdict.misfit, 2),
        "hypotheses": [
            {
                "hypothesis": row.fit.hypothesis.name, "evidence": _round(row.evidence),
                "log_prior": _round(row.prior), "probability": _round(row.posterior),
                "strained": _strained(answer, row.fit), "loud": _loud(row.fit),
            }
            for row in verdict.rows
        ],
        "further": [
            {"recording": one.name, "nats": _round(one.separation), "loss": _round(one.before),
             "loss_after": _round(one.after)}
            for one in answer.further
        ],
        "losses": {name: _round(value) for name, value in sorted(verdict.losses.items(), key=lambda one: one[1])},
        "not_tried": list(verdict.not_tried),
        "not_shown": list(answer.found.left_out),
        "compared [s]": record.duration,
        "left_out": list(record.left_out),
        "shortest_waves [m]": {name: _round(one) for name, one in _smoothed(answer).items()},
        "steps": list(verdict.steps),
        "seconds": round(answer.seconds, 1),
    }  # fmt: skip


def status(answer: Answer) -> str:
    """What kind of statement it is: `undecided` where the time ended before the likeliest effects were fitted;
    `unexplained` where what would be named does not predict sections that no fit has seen better than the nominal model
    does.
    """
    if answer.verdict.cut or (len(answer.verdict.rows) == 1 and answer.found.library.effects):
        return "undecided"
    before, _, after = answer.held
    if answer.verdict.action.families and before and after and after.gap >= before.gap:
        return "unexplained"
    return STATUS[answer.verdict.action.kind]


def parameters(answer: Answer, fit: Fit) -> dict[str, dict[str, Any]]:
    """Values of the effects of a fit by the names of their fields, with 90 % intervals. Of several effects the names
    tell whose they are.
    """
    found: dict[str, dict[str, Any]] = {}
    for effect, numbers in answer.found.known(fit):
        if effect.kind == "law":  # its curve tells more than its terms
            continue
        whose = f"{effect.family}: " if len(fit.hypothesis.effects) > 1 else ""
        for (name, unit), known in zip(answer.found.fields(effect), numbers, strict=True):
            found[whose + name] = _value(known, unit)
    return found


def _value(known: Known, unit: str) -> dict[str, Any]:
    value, low, high = known
    width = high - low
    digits = 1 - math.floor(math.log10(width)) if 0.0 < width < math.inf else 3  # two of the width mean something
    told = {name: round(one, digits) for name, one in (("value", value), ("low", low), ("high", high))}
    return told | {"unit": unit}


def _strained(answer: Answer, fit: Fit) -> dict[str, float]:
    """Coordinates of the healthy vehicle far from the middle of their tolerance, in standard deviations."""
    healthy = answer.system.coordinates
    faults = {one.name for effect in fit.hypothesis.effects for one in effect.faults}
    scores = {one.name: (x - one.mean) / one.spread for one, x in zip(healthy, fit.x, strict=False)}
    return {k: round(float(v), 1) for k, v in scores.items() if abs(v) > STRAINED and k not in faults}


def _loud(fit: Fit) -> dict[str, float]:
    """Latent forces and readings larger than healthy vehicles have, over what acts at their place."""
    levels = zip(fit.system.levels, fit.psi, strict=True)
    return {
        one.name: _round(math.exp(psi))
        for one, psi in levels
        if one.place and math.exp(psi) > LOUD * math.exp(one.prior.middle)
    }


def _held(one: Held | None) -> dict[str, float] | None:
    return None if one is None else {"power": round(one.power, 3), "gap": round(one.gap, 3)}


def _round(value: float) -> float:
    """Three figures that mean something."""
    value = float(value)
    if not math.isfinite(value) or value == 0.0:
        return value
    return round(value, max(1, 2 - math.floor(math.log10(abs(value))))) if abs(value) < 100.0 else round(value, 1)


def in_words(answer: Answer) -> str:
    """What a person would say."""
    if status(answer) not in STATUS.values():
        return _unsaid(answer) + compared(answer)
    verdict, action = answer.verdict, answer.verdict.action
    rivals = [
        row for row in verdict.rows if row.fit.hypothesis.effects and row.fit.hypothesis != answer.best.hypothesis
    ]
    rival = f" Next comes {_plain(rivals[0].fit.hypothesis.name)} ({rivals[0].evidence:+.1f} nats)." if rivals else ""
    if action.kind == "none" and verdict.misfit >= LACKING:
        said = "No effect of the library stands out: each explains about as much as others that are not there."
    elif action.kind == "none":
        said = "Nothing is missing: tolerances, sensors and the errors of the track file explain the recording."
    elif action.kind == "unknown":
        said = (
            f"Something is missing that no effect of the library explains. It acts at: {action.place}.{_like(answer)}"
        )
    else:
        sizes = "; ".join(
            f"{name} {one['value']:.10g} ({one['low']:.10g} to {one['high']:.10g}) {one['unit'].strip('- ')}".strip()
            for name, one in parameters(answer, answer.best).items()
        )
        lead = {"set": "One of these is missing, and the recording cannot tell which"}.get(
            action.kind, "What is missing"
        )
        beside = f" Beside it something unknown acts at: {action.place}.{_like(answer)}" if action.place else ""
        said = (
            f"{lead}: {_plain(' or '.join(action.families) if action.kind == 'set' else ' and '.join(action.families))}"
        )
        said += f". Sizes, with 90 % intervals: {_plain(sizes)}.{beside}"
    late = f" {len(verdict.not_tried)} hypotheses were not fitted whole." if verdict.not_tried else ""
    plugins = (one for one in EFFECTS.classes().values() if one.equivalence() in action.families)
    advice = "".join(f" {one.advice}" for one in plugins if one.advice)
    words = f"{said} Its probability is {chance(_probability(answer))}.{advice}{rival}{_more(answer)}"
    return f"{words}{_lacking(verdict.misfit)}{_beyond(answer)}{late}{compared(answer)}"


def _probability(answer: Answer) -> float:
    """Of the likeliest hypothesis that says what is stated."""
    best = answer.best.hypothesis.name
    return sum(row.posterior for row in answer.verdict.rows if row.fit.hypothesis.name == best)


def _like(answer: Answer) -> str:
    """What the unknown is like."""
    one = answer.unknown
    if one is None:
        return ""
    part = (
        f" ({100.0 * one.share:.0f} % of it)"
        if one.words != BROADBAND
        else "; neither a tone nor pulses nor a curve over the motion holds half of it"
    )
    return f" It is like this: {one.words}{part}."


def _more(answer: Answer) -> str:
    """Which further recording would tell most."""
    if not answer.further or answer.further[0].after >= answer.further[0].before:
        return ""
    best = answer.further[0]
    return f" What would tell most: a recording like this, {best.name} ({best.separation:.1f} nats between them)."


def _lacking(misfit: float) -> str:
    """What the model lacks beyond all hypotheses."""
    if misfit < LACKING:
        return ""
    return (
        " The model lacks something that no hypothesis describes: effects that are not named explain"
        f" {misfit:.1f} times as much of what is left as they would by chance. So each nat of evidence counts less."
    )


def compared(answer: Answer) -> str:
    """How much of the recording was compared, where it is not all, and what the track file does not tell."""
    record, lost = answer.system.record, _smoothed(answer)
    waves = ", ".join(f"{_plain(name)} {_round(one):g} m" for name, one in lost.items())
    smoothed = (
        f" The track file tells of no waves shorter than: {waves}. They are taken as not there, so what they do to the"
        " vehicle may look like something missing. Take a file that was smoothed less."
        if lost
        else ""
    )
    part = "" if record.duration == record.whole else f" Compared: the first {record.duration:g} of {record.whole:g} s."
    return part + smoothed


def _smoothed(answer: Answer) -> dict[str, float]:
    """Shortest waves that the track file tells of [m], where the channels show shorter ones."""
    record = answer.system.record
    seen = max(record.speed_of(number) for number in range(len(record.sections))) / float(record.frequencies[-1])
    return {name: one for name, one in record.surveyed.shortest().items() if one > seen}


def _unsaid(answer: Answer) -> str:
    """Why nothing is stated, and what leads."""
    rows, late = answer.verdict.rows, f"{len(answer.verdict.not_tried)} hypotheses were not fitted whole"
    leads = f" So far {_plain(rows[0].fit.hypothesis.name)} leads." if len(rows) > 1 else ""
    if status(answer) == "undecided":
        cure = "Give a longer --time-limit, or fewer --effects."
        return f"Not decided: the time ended before the likeliest effects were fitted; {late}.{leads} {cure}"
    before, _, after = answer.held
    assert before and after
    gaps = f"{after.gap:.2f} against {before.gap:.2f}"
    return (
        f"Not explained: what fits best does not predict unseen sections better than the nominal model (gap {gaps})."
        f"{leads}{_beyond(answer)} Check the scenario's vehicle, profiles and sensors against the recording."
    )


def chance(probability: float) -> str:
    """A probability in words; nothing is certain."""
    return "over 0.999" if probability > 0.999 else "under 0.001" if probability < 0.001 else f"{probability:.3f}"


def _beyond(answer: Answer) -> str:
    """What the best hypothesis stretches beyond its data sheet."""
    far = {name: size for name, size in _strained(answer, answer.best).items() if abs(size) > BEYOND}
    if not far:
        return ""
    told = ", ".join(f"{_plain(name)} {size:+.0f}" for name, size in sorted(far.items(), key=lambda one: -abs(one[1])))
    return f" It stretches tolerances far beyond their sheet (in deviations: {told}): the two differ in more than this."


def _plain(name: str) -> str:
    return name.replace("_", " ")
