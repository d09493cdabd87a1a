"""Tables of text for people."""

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

NARROWEST = 30  # characters of a wrapped column, however narrow the terminal is


def table(header: Sequence[str], rows: Sequence[Sequence[Any]], decimals: int = 3, columns: int | None = None) -> str:
    """Columns of text, aligned: numbers to the right with so many decimals, the rest to the left.

    columns : characters of a line, into which the last column is wrapped; None = as long as it is.
    """
    cells = [[*header], *([cell(value, decimals) for value in row] for row in rows)]
    if columns is not None:
        before = sum(max(len(row[i]) for row in cells) + 2 for i in range(len(header) - 1))
        cells = [line for row in cells for line in _wrapped(row, max(NARROWEST, columns - before))]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    right = [all(isinstance(row[i], int | float) or row[i] is None for row in rows) for i in range(len(header))]
    lines = [
        "  ".join(
            text.rjust(width) if flag else text.ljust(width)
            for text, width, flag in zip(row, widths, right, strict=True)
        )
        for row in cells
    ]
    rule = "  ".join("-" * width for width in widths)
    return "\n".join(line.rstrip() for line in [lines[0], rule, *lines[1:]])


def first_sentence(text: str) -> str:
    """First sentence of a text's first paragraph, on one line."""
    line = " ".join(text.strip().partition("\n\n")[0].split())
    return re.split(r"(?<=[.!?])\s+(?=[A-Z])", line)[0]


def _wrapped(row: list[str], width: int) -> list[list[str]]:
    first, *lines = textwrap.wrap(row[-1], width) or [""]
    return [[*row[:-1], first], *([""] * (len(row) - 1) + [line] for line in lines)]


def cell(value: Any, decimals: int = 3) -> str:
    """A cell: nothing for None, powers of ten for the very large and small."""
    if value is None:
        return ""
    if isinstance(value, float):
        plain = value == 0.0 or 0.5 * 10.0**-decimals <= abs(value) < 1e6
        return f"{value:.{decimals}f}" if plain else f"{value:.2e}"
    return str(value)


def score_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Scores side by side: a row a score, a column an estimator; a table for each group of estimators that have the
    same scores.

    rows : with "estimator", "score", "unit" and "value".
    """
    values: dict[tuple[str, str], dict[str, float]] = {}
    for row in rows:
        values.setdefault((row["score"], row["unit"]), {})[row["estimator"]] = row["value"]
    groups: dict[tuple[str, ...], list[list[Any]]] = {}
    for (name, unit), by_estimator in values.items():
        groups.setdefault(tuple(by_estimator), []).append([name, unit, *by_estimator.values()])
    return "\n\n".join(table(["score", "unit", *names], lines) for names, lines in groups.items())
