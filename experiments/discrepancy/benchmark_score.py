"""Scores of the blind benchmark: rates with confidence intervals, and the confusion table."""

import math
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

from experiments.discrepancy.benchmark import ROW, rule_hash
from railsim.files import read_json

COVERED = 1.96
DETECTABLE = 27.0
"""Expected evidence [nats] g from which g - 1.645 sqrt(2 g) is at least 15: the 10 that the rule asks for, and 5 for
the numbers that are fitted.
"""


def read_rows(folder: Path) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """(result, label) of every case that the present rule has answered."""
    rule = rule_hash()
    rows = []
    for path in sorted((folder / "results").glob("*.json")):
        row = read_json(path, ROW)
        if row.get("rule") == rule:
            rows.append((row, read_json(folder / "sealed" / path.name, "a label")))
    return rows


def score(rows: list[tuple[dict[str, Any], dict[str, Any]]]) -> dict[str, Any]:
    """Contract shape: metrics with Wilson intervals, and verdict counts by truth."""
    counts: dict[str, list[bool]] = defaultdict(list)
    confusion: dict[str, Counter[str]] = defaultdict(Counter)
    for row, label in rows:
        verdict = row["verdict"]
        truth = " + ".join(effect["kind"] for effect in label["effects"]) or label["kind"]
        said = verdict["effect"] if verdict["status"] == "named" else verdict["status"]
        confusion[f"{truth} (withheld)" if label["kind"] == "withheld" else truth][str(said)] += 1
        for name, held in _outcomes(row, label).items():
            counts[name].append(held)
    metrics = {name: wilson(sum(values), len(values)) for name, values in sorted(counts.items())}
    return {"metrics": metrics, "confusion": {truth: dict(said) for truth, said in sorted(confusion.items())}}


def _outcomes(row: dict[str, Any], label: dict[str, Any]) -> dict[str, bool]:
    """What a case counts for."""
    verdict = row["verdict"]
    status, named = verdict["status"], verdict.get("class")
    kind = label["kind"]
    if kind in ("null", "decoy"):
        return {f"false alarm on a {kind}": status in ("named", "ambiguous", "unknown")}
    seen = detectable(row, label)
    if not seen:
        classes = {named, *(one["class"] for one in verdict.get("further", []))}
        return {"undetectable effect left alone or named right": status == "none" or classes == set(label["classes"])}
    if kind in ("withheld", "foreign"):
        text = "unknown where its effect is withheld" if kind == "withheld" else "unknown where the law is foreign"
        found = {text: status == "unknown", "unknown where it is outside the library": status == "unknown"}
        return found | ({"place of an unknown": _placed(verdict, label)} if status == "unknown" else {})
    if kind == "pair":
        said = {named, *(one["class"] for one in verdict.get("further", []))}
        return {"pair exactly right": status == "named" and said == set(label["classes"])}
    right = label["classes"][0]
    listed = {named, *verdict.get("alternative_classes", [])}
    return {
        "right name": status == "named" and named == right,
        "truth in the stated set": status in ("named", "ambiguous") and right in listed,
        "wrong name": status == "named" and named != right,
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
    share, z2 = successes / cases, COVERED**2
    middle = (share + z2 / (2 * cases)) / (1 + z2 / cases)
    reach = COVERED * math.sqrt(share * (1 - share) / cases + z2 / (4 * cases**2)) / (1 + z2 / cases)
    return {"value": share, "low": max(0.0, middle - reach), "high": min(1.0, middle + reach), "cases": cases}
