"""Scores of the blind benchmark: rates with confidence intervals, the confusion table, and a page for people."""

import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from experiments.discrepancy.blind.benchmark import OUTSIDE, ROW
from experiments.discrepancy.blind.benchmark_rows import Row
from experiments.discrepancy.rule import rule_hash
from railsim.effects.interface import EFFECTS
from railsim.files import read_json

COVERED = 1.96  # standard deviations of a 95 % interval
ANY = "any verdict"
SURE_FROM = (0.0, 0.5, 0.9, 0.97, 0.99)  # edges of the confidence that calibration looks at
DISTINCT = "unknown where it is outside the library, and nothing in it does the same"
MADE_UP = "second effect that is not there, beside the right name"
LEAST_CLOSED = 0.02  # of the gap, below which its share is noise
DETECTABLE = 27.0
"""Expected evidence [nats] g from which g - 1.645 sqrt(2 g) is at least 15: the 10 that the rule asks for, and 5 for
the numbers that are fitted.
"""


def read_rows(folder: Path, rule: str = "", elsewhere: Sequence[Row] = ()) -> list[Row]:
    """(result, label) of every case that a rule has answered, the present one if none is stated; `elsewhere`: rows that
    need not be in the folder.
    """
    rule = rule or rule_hash()
    found = {row["case"]: (row, label) for row, label in elsewhere}
    for path in sorted((folder / "results").glob("*.json")):
        row = read_json(path, ROW)
        if row.get("rule") == rule:
            found[row["case"]] = (row, read_json(folder / "sealed" / path.name, "a label"))
    return [found[case] for case in sorted(found)]


def score(rows: Sequence[Row]) -> dict[str, Any]:
    """Contract shape: metrics with Wilson intervals, figures with their spread, right names by class and outcomes by
    setting, verdict counts by truth, and how often verdicts are true that are stated so surely.
    """
    counts: dict[str, list[bool]] = defaultdict(list)
    settings: dict[str, dict[str, list[bool]]] = defaultdict(lambda: defaultdict(list))
    classes: dict[str, list[bool]] = defaultdict(list)
    confusion: dict[str, Counter[str]] = defaultdict(Counter)
    for row, label in rows:
        verdict = row["verdict"]
        truth = " + ".join(effect["kind"] for effect in label["effects"]) or label["kind"]
        said = verdict["effect"] if verdict["status"] == "named" else verdict["status"]
        confusion[f"{truth} (withheld)" if label["kind"] == "withheld" else truth][str(said)] += 1
        outcomes = _outcomes(row, label)
        for name, held in outcomes.items():
            counts[name].append(held)
            if name in BY_SETTING:
                settings[label.get("setting", "home")][name].append(held)
        if "right name" in outcomes:
            classes[label["classes"][0]].append(outcomes["right name"])
    return {
        "metrics": _shares(counts),
        "figures": figures(rows),
        "settings": {name: _shares(found) for name, found in sorted(settings.items())},
        "classes": _shares(classes),
        "confusion": {truth: dict(said) for truth, said in sorted(confusion.items())},
        "calibration": calibration(rows),
    }


BY_SETTING = ("right name", "wrong name", "truth in the stated set", "false alarm", "two-sigma interval covers")


def _shares(counts: dict[str, list[bool]]) -> dict[str, dict[str, float | int]]:
    return {name: wilson(sum(values), len(values)) for name, values in sorted(counts.items())}


def figures(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Medians of what is no share, with their 95 % intervals (order statistics) and extremes."""
    found: dict[str, list[float]] = defaultdict(list)
    for row, label in rows:
        status = row["verdict"]["status"]
        group = "an empty case" if label["kind"] in ("null", "decoy") else "a case with an effect"
        for key, text in (("seconds", "s of wall clock"), ("cpu", "s of processor time")):
            if key in row:
                found[f"{text}, {group}"].append(float(row[key]))
        if "memory" in row:
            found["MiB held at most"].append(float(row["memory"]))
        share = closure(row)
        if share is None or not label["effects"]:
            continue
        if status == "named":
            found["share of the true model's gap closure beyond nuisances, named"].append(share)
            if row["verdict"].get("class") in label["classes"]:
                found["share of the true model's gap closure beyond nuisances, named right"].append(share)
        if status == "unknown" and label["kind"] in OUTSIDE:  # nought where no table was found
            found["share of the true model's gap closure beyond nuisances, unknown"].append(share)
    return {name: median(values) for name, values in sorted(found.items())}


def calibration(rows: Sequence[Row]) -> dict[str, dict[str, float | int]]:
    """How often verdicts are true, by what they say and how sure they are: Wilson shares, with the mean confidence that
    was stated ("stated"). Rows without one, and refusals, do not count.
    """
    found: dict[tuple[str, float], list[tuple[float, bool]]] = defaultdict(list)
    for row, label in rows:
        verdict = row["verdict"]
        if verdict["status"] == "refused" or "confidence" not in verdict:
            continue
        sure = float(verdict["confidence"])
        step = max(edge for edge in SURE_FROM if sure >= edge)
        for status in (verdict["status"], ANY):
            found[status, step].append((sure, is_true(row, label)))
    table = {}
    for status, step in sorted(found):
        both = found[status, step]
        share = wilson(sum(held for _, held in both), len(both))
        table[f"{status}, from {step:g}"] = share | {"stated": float(np.mean([sure for sure, _ in both]))}
    return table


def is_true(row: dict[str, Any], label: dict[str, Any]) -> bool:
    """Whether a verdict is true: what it names is there; `unknown`, something from outside the library; `none`, nothing
    that could have been detected. An `ambiguous` one states how sure its first class is.
    """
    verdict, nats = row["verdict"], row.get("expected", [])
    status = verdict["status"]
    if status == "unknown":
        return label["kind"] in OUTSIDE
    if status == "none":
        return len(nats) == len(label["effects"]) and max(nats, default=0.0) < DETECTABLE
    further = verdict.get("further", []) if status == "named" else []
    return {verdict["class"], *(one["class"] for one in further)} <= set(label["classes"])


def closure(row: dict[str, Any]) -> float | None:
    """How much of what the true model closes of the held-out gap beyond nuisances the verdict's model closes; None
    where nuisances alone leave nothing to close (less than `LEAST_CLOSED`).
    """
    gap, true = row["verdict"].get("gap"), row.get("true_gap")
    if gap is None or true is None or gap["nuisance_only"] - true < LEAST_CLOSED:
        return None
    return float((gap["nuisance_only"] - gap["after"]) / (gap["nuisance_only"] - true))


def median(values: list[float]) -> dict[str, Any]:
    """Median with the 95 % interval of its order statistics, smallest and largest."""
    ordered = np.sort(values)
    reach = 0.5 * COVERED * math.sqrt(len(ordered))
    low = int(np.clip(math.floor(0.5 * len(ordered) - reach), 0, len(ordered) - 1))
    high = int(np.clip(math.ceil(0.5 * len(ordered) + reach), 0, len(ordered) - 1))
    return {
        "value": float(np.median(ordered)),
        "low": float(ordered[low]),
        "high": float(ordered[high]),
        "least": float(ordered[0]),
        "most": float(ordered[-1]),
        "cases": len(ordered),
    }


def _outcomes(row: dict[str, Any], label: dict[str, Any]) -> dict[str, bool]:
    """What a case counts for."""
    verdict = row["verdict"]
    status, named = verdict["status"], verdict.get("class")
    kind = label["kind"]
    if status == "refused":
        return {"refused to say anything": True}
    found = {"refused to say anything": False}
    if kind in ("null", "decoy"):
        alarm = status in ("named", "ambiguous", "unknown")
        return found | {f"false alarm on a {kind}": alarm, "false alarm": alarm}
    said = {named, *(one["class"] for one in verdict.get("further", []))}
    if not detectable(row, label):
        seen = {one for one, nats in zip(label["classes"], row.get("expected", []), strict=False) if nats >= DETECTABLE}
        fair = status != "unknown" and seen <= said and said - {None} <= set(label["classes"])
        return found | {"undetectable effect left alone or named right": fair}
    if kind in OUTSIDE:
        text = "unknown where its effect is withheld" if kind == "withheld" else "unknown where the law is foreign"
        found |= {text: status == "unknown", "unknown where it is outside the library": status == "unknown"}
        if row.get("over_named") is None or row["over_named"] >= DETECTABLE:
            found |= {DISTINCT: status == "unknown"}
        return found | ({"place of an unknown": _placed(verdict, label)} if status == "unknown" else {})
    if kind == "pair":
        return found | {
            "pair exactly right": status == "named" and said == set(label["classes"]),
            "pair at least half right": status == "named" and bool(said & set(label["classes"])),
        }
    true = label["classes"][0]
    listed = {named, *verdict.get("alternative_classes", [])}
    right = status == "named" and named == true
    return {
        **found,
        "right name": right,
        "truth in the stated set": status in ("named", "ambiguous") and true in listed,
        "wrong name": status == "named" and not right,
        **({MADE_UP: bool(verdict.get("further"))} if right else {}),
        "detected": status in ("named", "ambiguous", "unknown"),
        **_covered(verdict, label),
    }


def _placed(verdict: dict[str, Any], label: dict[str, Any]) -> bool:
    """Whether the stated bodies are those of an element that the effect changes, or hold the one that it acts on."""
    stated = set(verdict.get("place_bodies", []))
    groups = [set(group) for acting in label["acting"] for group in acting]
    return any(stated == group or (min(len(stated), len(group)) == 1 and stated & group) for group in groups)


def _covered(verdict: dict[str, Any], label: dict[str, Any]) -> dict[str, bool]:
    """Whether the first number's interval holds the truth, where the very effect was named."""
    true = label["effects"][0]
    if verdict["status"] != "named" or verdict["effect"] != true["kind"]:
        return {}
    name, stated = next(iter(verdict["parameters"].items()))
    return {"two-sigma interval covers": stated["low"] <= true[name] <= stated["high"]}


def detectable(row: dict[str, Any], label: dict[str, Any]) -> bool:
    """Whether every effect of the case was large enough to be detected in 95 % of repetitions (`oracle`)."""
    expected = row.get("expected", [])
    return len(expected) == len(label["effects"]) and min(expected, default=0.0) >= DETECTABLE


def wilson(successes: int, cases: int) -> dict[str, float | int]:
    """Share with its 95 % interval (Wilson 1927)."""
    if not cases:
        return {"value": 0.0, "low": 0.0, "high": 1.0, "cases": 0}
    interval = binomtest(successes, cases).proportion_ci(0.95, method="wilson")
    return {"value": successes / cases, "low": float(interval.low), "high": float(interval.high), "cases": cases}


TARGETS = {
    "right name": (0.9, 1.0),
    "truth in the stated set": (0.97, 1.0),
    "wrong name": (0.0, 0.03),
    "false alarm": (0.0, 0.01),
    "unknown where it is outside the library": (0.9, 1.0),
    "place of an unknown": (0.8, 1.0),
    "two-sigma interval covers": (0.9, 0.98),
    "pair exactly right": (0.6, 1.0),
}
"""Shares that are asked for: from, to."""


def page(rows: Sequence[Row], rule: str) -> str:
    """Markdown: shares against their targets, medians, and every case with something in it or with a false alarm."""
    found = score(rows)
    lines = [
        f"Rule `{rule}`: {len(rows)} cases, {sum(bool(label['effects']) for _, label in rows)} with something in them."
    ]
    lines += ["", "| share of | cases | value (95 % interval) | target | |", "|---|---|---|---|---|"]
    for name, one in found["metrics"].items():
        between = f"{one['value']:.1%} ({one['low']:.1%} to {one['high']:.1%})"
        lines.append(f"| {name} | {one['cases']} | {between} | {_target(name, one)} |")
    lines += ["", "| median of | cases | value (95 % interval) | least, most |", "|---|---|---|---|"]
    for name, one in found["figures"].items():
        between = f"{one['value']:.3g} ({one['low']:.3g} to {one['high']:.3g})"
        lines.append(f"| {name} | {one['cases']} | {between} | {one['least']:.3g}, {one['most']:.3g} |")
    lines += ["", "| stated confidence of | verdicts | stated, mean | true (95 % interval) |", "|---|---|---|---|"]
    for name, one in found["calibration"].items():
        between = f"{one['value']:.1%} ({one['low']:.1%} to {one['high']:.1%})"
        lines.append(f"| {name} | {one['cases']} | {one['stated']:.1%} | {between} |")
    lines += [
        "",
        "| case | truth (setting, creep law; nats to be expected) | verdict | gap: nuisances only, after, true model |",
    ]
    lines += ["|---|---|---|---|", *(_line(row, label) for row, label in rows if _told(row, label))]
    return "\n".join(lines) + "\n"


def _target(name: str, one: dict[str, Any]) -> str:
    """What is asked for, and whether the share and its whole interval are there."""
    if name not in TARGETS:
        return "| "
    least, most = TARGETS[name]
    reached = [least <= value <= most for value in (one["value"], one["low"], one["high"])]
    shown = all(reached[1:])
    held = "held" if shown else "held; interval does not show it" if reached[0] else "NOT HELD"
    asked = (
        f"at most {most:.0%}" if not least else f"at least {least:.0%}" if most == 1.0 else f"{least:.0%} to {most:.0%}"
    )
    return f"{asked} | {held}"


def _told(row: dict[str, Any], label: dict[str, Any]) -> bool:
    return bool(label["effects"]) or row["verdict"]["status"] != "none"


def _line(row: dict[str, Any], label: dict[str, Any]) -> str:
    verdict, outcomes = row["verdict"], _outcomes(row, label)
    nats = row.get("expected", [])
    truth = " and ".join(_effect(one) for one in label["effects"]) or f"{label['kind']}"
    kind = f"{label['kind']}, " if label["kind"] in OUTSIDE else ""
    where = f"{kind}{label.get('setting', 'home')}, {label['law']}"
    expected = "; " + ", ".join(f"{one:.0f}" for one in nats) if nats else ""
    said = verdict["status"]
    if said == "named":
        names = [verdict["effect"], *(one["effect"] for one in verdict.get("further", []))]
        first = next(iter(verdict["parameters"].values()), None)
        size = f", {first['value']:.3g} ({first['low']:.3g} to {first['high']:.3g})" if first else ""
        said = f"`{'` and `'.join(names)}`{size}"
    wrong = [
        name
        for name, held in outcomes.items()
        if held == (name in UNWANTED) and name != DISTINCT and not name.endswith((" null", " decoy"))
    ]
    gap, true = verdict.get("gap") or {}, row.get("true_gap")
    gaps = [gap.get("nuisance_only"), gap.get("after"), true]
    shown = ", ".join("-" if one is None else f"{one:.3g}" for one in gaps)
    missed = f" (**{'; '.join(_words(name) for name in wrong)}**)" if wrong else ""
    return f"| {row['case']} | {truth} ({where}{expected}) | {said}{missed} | {shown} |"


UNWANTED = ("refused to say anything", "false alarm", "wrong name", MADE_UP)


def _words(name: str) -> str:
    return name if name in UNWANTED else f"not: {name}"


def _effect(one: dict[str, Any]) -> str:
    """Name and first number of an effect of a label."""
    kinds = EFFECTS.classes()
    held = kinds[one["kind"]].held() if one["kind"] in kinds else ()
    numbers = [value for key, value in one.items() if isinstance(value, float) and key not in held]
    return f"`{one['kind']}`" + (f" {numbers[0]:.3g}" if numbers else "")
