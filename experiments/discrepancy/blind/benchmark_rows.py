"""Rows of the blind benchmark that outlive its folder: a file for each seed, a line of JSON for each answered case.

Recordings are made again from their seed wherever they are wanted; what was answered is not asked again.
"""

import json
from pathlib import Path
from typing import Any

from railsim.errors import InputError

Row = tuple[dict[str, Any], dict[str, Any]]
OF_ROW = (
    "rule",
    "case",
    "seed",
    "duration",
    "cpu",
    "seconds",
    "memory",
    "expected",
    "expected_at_first",
    "true_gap",
    "over_named",
)
OF_VERDICT = (
    "status",
    "effect",
    "class",
    "confidence",
    "further",
    "alternative_classes",
    "parameters",
    "place_bodies",
    "gap",
)
OF_LABEL = ("kind", "setting", "effects", "acting", "classes", "law")


def keep(store: Path, row: dict[str, Any], label: dict[str, Any]) -> None:
    """Add a case and its label to its seed's file in the store: what the scoring reads of it."""
    verdict = _part(row["verdict"], OF_VERDICT) | {"empirical": bool(row["verdict"].get("empirical"))}
    line = json.dumps({"row": _part(row, OF_ROW) | {"verdict": verdict}, "label": _part(label, OF_LABEL)})
    store.mkdir(parents=True, exist_ok=True)
    with _file_of(store, row["seed"]).open("a", encoding="utf-8") as file:
        file.write(line + "\n")


def kept(store: Path, rule: str, seed: int, duration: float) -> list[Row]:
    """Cases (result, label) of a seed and a duration that a rule has answered, by their numbers; none without a file.

    Raises
    ------
    InputError : the store is a file; a line is no row.
    """
    if store.is_file():
        raise InputError(f"{store} is a file; give a folder, in which each seed has a file of its rows")
    path = _file_of(store, seed)
    if not path.is_file():
        return []
    found: dict[int, Row] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        try:
            both = json.loads(line)
            row, label = both["row"], both["label"]
            own = (row["rule"], row["seed"], row["duration"])
            case = int(row["case"])
        except (ValueError, KeyError, TypeError):
            raise InputError(f"{path}: line {number} is no answered case; remove that line") from None
        if own == (rule, seed, duration):
            found[case] = (row, label)
    return [found[case] for case in sorted(found)]


def _file_of(store: Path, seed: int) -> Path:
    """Where the rows of a seed lie."""
    return store / f"seed_{seed}.jsonl"


def _part(whole: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    return {name: whole[name] for name in names if name in whole}
