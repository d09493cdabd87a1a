"""The numbers in a command's JSON by name, those that are stored, and how the two differ."""

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.reproduction.slices import Slice
from railsim.files import replace_file

STORED = Path(__file__).with_name("stored.csv")
HEAD = ("slice", "size", "number", "value")
Numbers = dict[tuple[str, str], dict[str, float]]
"""By slice and size ("full" or "fast"), the numbers by name."""


@dataclass(frozen=True)
class Difference:
    """A number of a slice: the stored one and the one made anew, NaN where there is none; and whether it agrees."""

    name: str
    stored: float
    made: float
    agrees: bool


def numbers_in(result: Mapping[str, Any]) -> dict[str, float]:
    """The numbers in a command's JSON: claims of figures, scores, and metrics and medians with their intervals."""
    found = {}
    for name, part in result.get("figures", {}).items():
        found |= {f"{name}: {claim['claim']}": claim["value"] for claim in part.get("claims", ())}
        found |= _with_interval(name, part)
    found |= {f"{one['estimator']}: {one['score']}": one["value"] for one in result.get("scores", [])}
    for name, one in result.get("metrics", {}).items():
        found |= _with_interval(name, one)
    return {name: float(value) for name, value in found.items() if isinstance(value, int | float)}


def _with_interval(name: str, one: Mapping[str, Any]) -> dict[str, Any]:
    ends = {"value": name, "low": f"{name}, from", "high": f"{name}, to"}
    return {words: one[key] for key, words in ends.items() if key in one}


def differences(one: Slice, stored: Mapping[str, float], made: Mapping[str, float]) -> list[Difference]:
    """Each number that is stored or was made; one that is missing on either side does not agree."""
    rows = []
    for name in dict.fromkeys([*stored, *made]):
        before, now = stored.get(name, math.nan), made.get(name, math.nan)
        near = math.isclose(before, now, rel_tol=one.tolerance, abs_tol=one.small)
        both = name in stored and name in made
        rows.append(Difference(name, before, now, both and (near or before == now)))
    return rows


def read_stored(file: Path = STORED) -> Numbers:
    """The numbers in a stored table; none where there is no file."""
    found: Numbers = {}
    if file.is_file():
        with file.open(encoding="utf-8", newline="") as lines:
            for row in csv.DictReader(lines):
                found.setdefault((row["slice"], row["size"]), {})[row["number"]] = float(row["value"])
    return found


def write_stored(numbers: Numbers, file: Path = STORED) -> None:
    """Write a stored table; raises `InputError` where it cannot be written."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEAD)
    for (name, size), values in sorted(numbers.items()):
        writer.writerows([name, size, number, f"{value:.9g}"] for number, value in values.items())
    replace_file(file, text.getvalue().encode())
