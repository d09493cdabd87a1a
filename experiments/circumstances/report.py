"""What the matrix says: counts, a table of estimators by circumstances, claims, and another run beside it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pandas as pd

from experiments.circumstances.circumstance import HOME, Circumstance
from experiments.circumstances.verdicts import (
    FAILED,
    NOT_APPLICABLE,
    RIGHT,
    SAYS_SO,
    SILENT,
    VERDICTS,
    Cell,
    worst,
)
from experiments.reporting.claims import Claim, at_least, at_most, exactly

LETTERS = {RIGHT: "R", SAYS_SO: "s", SILENT: "W", FAILED: "F", NOT_APPLICABLE: ""}
SUBJECTS = ("health", "value")
MOST_WRONG, MOST_AT_HOME, LEAST_RIGHT, FEWEST_CELLS = 0.02, 0.02, 0.75, 400
Merged = Mapping[tuple[str, str], Cell]


def counting(cells: Iterable[Cell]) -> list[Cell]:
    """Cells that hold a verdict."""
    return [cell for cell in cells if cell.verdict in VERDICTS]


def merged(cells: Iterable[Cell]) -> dict[tuple[str, str], Cell]:
    """The worst cell by circumstance and estimator."""
    groups: dict[tuple[str, str], list[Cell]] = {}
    for cell in cells:
        groups.setdefault((cell.circumstance, cell.estimator), []).append(cell)
    return {place: worst(group) for place, group in groups.items()}


def counts(cells: Iterable[Cell]) -> dict[str, dict[str, int]]:
    """Number of cells by verdict, for verdicts of health and adhesion levels, and for all others."""
    found: dict[str, dict[str, int]] = {subject: dict.fromkeys(VERDICTS, 0) for subject in SUBJECTS}
    for cell in counting(cells):
        found["health" if cell.subject == "health" else "value"][cell.verdict] += 1
    return found


def share(cells: Sequence[Cell], verdict: str) -> float | None:
    """Share of the cells with that verdict; None of no cells."""
    return sum(cell.verdict == verdict for cell in cells) / len(cells) if cells else None


def claims(cells: Sequence[Cell], whole: bool, before: Sequence[Cell] = ()) -> list[Claim]:
    """Claims on the whole vehicle.

    Parameters
    ----------
    whole : whether all of the matrix was run at its full size. A part of it can show a verdict that is silently wrong,
        but not that there is none.
    before : cells of another run, which should not have more that are right.
    """
    every = [cell for cell in counting(cells) if cell.base == "whole"]
    health = [cell for cell in every if cell.subject == "health"]
    others = [cell for cell in every if cell.subject != "health"]
    home = [cell for cell in every if cell.group == HOME]
    wrong = sum(cell.verdict == SILENT for cell in health)
    name = "verdicts of health and adhesion silently wrong"
    made = [
        Claim.definite("cells on the whole vehicle", float(len(every)), at_least(FEWEST_CELLS), enough=whole),
        _decided(Claim.definite(name, float(wrong), exactly(0.0), len(health)), whole or wrong > 0),
        _of_share("share of the other cells silently wrong", others, SILENT, at_most(MOST_WRONG), whole),
        _of_share("share that says so at home", home, SAYS_SO, at_most(MOST_AT_HOME), whole),
        _of_share("share of cells right", every, RIGHT, at_least(LEAST_RIGHT), whole),
    ]
    both = compared(every, [cell for cell in before if cell.base == "whole"])
    if len(both) > 1:
        gain = float(both["right"].iloc[-1] - both["right before"].iloc[-1])
        gained = Claim.definite(
            "share right beyond that of the other run", gain, at_least(0.0), int(both["cells"].iloc[-1])
        )
        made.append(_decided(gained, whole))
    return made


def _of_share(claim: str, cells: Sequence[Cell], verdict: str, target: Any, whole: bool) -> Claim:
    """Definite, as the matrix is what the claim is about and no sample of it."""
    return _decided(Claim.definite(claim, share(cells, verdict), target, len(cells)), whole)


def _decided(claim: Claim, enough: bool) -> Claim:
    """The claim, undecided where too little was run."""
    return claim if enough else replace(claim, held=None)


def compared(cells: Sequence[Cell], others: Sequence[Cell]) -> pd.DataFrame:
    """Shares of `right` and of `silently wrong` of two runs by estimator, over the circumstances that both have.

    Returns
    -------
    Columns "estimator" ("all" in the last row), "cells", "right", "right before", "silently wrong", "silently wrong
    before".
    """
    mine, theirs = counting(cells), counting(others)
    both = {(c.circumstance, c.estimator) for c in mine} & {(c.circumstance, c.estimator) for c in theirs}
    mine, theirs = ([c for c in group if (c.circumstance, c.estimator) in both] for group in (mine, theirs))
    rows = []
    for name in [*sorted({estimator for _, estimator in both}), "all"]:
        now, before = ([c for c in group if name in (c.estimator, "all")] for group in (mine, theirs))
        rows.append([name, len(now), *(share(g, v) for v in (RIGHT, SILENT) for g in (now, before))])
    names = ["estimator", "cells", "right", "right before", "silently wrong", "silently wrong before"]
    return pd.DataFrame(rows, columns=pd.Index(names))


def frame(cells: Sequence[Cell]) -> pd.DataFrame:
    """One row a cell."""
    names = pd.Index([field.name for field in fields(Cell)])
    rows = [cell.plain() | {"warnings": " / ".join(cell.warnings)} for cell in cells]
    return pd.DataFrame(rows, columns=names)


def markdown(
    circumstances: Mapping[str, Circumstance], estimators: Sequence[str], cells: Sequence[Cell], made: Sequence[Claim]
) -> str:
    """Counts, claims, the table of verdicts, what is silently wrong, and what says so."""
    by_place = merged(cells)
    shown = [name for name in circumstances if any((name, one) in by_place for one in estimators)]
    present = [one for one in estimators if any((name, one) in by_place for name in shown)]
    number = counts(cells)
    parts = [
        "# Circumstances",
        "A cell is a quantity of an estimator in a circumstance. R: right. s: says so. W: silently wrong. F: failed.",
        _table(["cells", *VERDICTS], [[name, *number[name].values()] for name in SUBJECTS]),
        "## Claims, on the whole vehicle",
        _table(
            ["claim", "value", "target", "", "cells"],
            [[c.claim, c.value, c.target, c.outcome, c.cases] for c in made],
        ),
        "## Worst of each estimator",
        "Verdict, then the worst quantity's error over its allowance.",
        _table(
            ["circumstance", *present],
            [[name, *(_shown(by_place.get((name, one))) for one in present)] for name in shown],
        ),
    ]
    for verdict, title in ((SILENT, "Silently wrong"), (FAILED, "Failed"), (SAYS_SO, "Says so")):
        rows = [_row(cell) for cell in sorted(counting(cells), key=_order(shown)) if cell.verdict == verdict]
        if rows:
            parts += [f"## {title}", _table(_HEADER, rows)]
    return "\n\n".join(parts) + "\n"


_HEADER = ["circumstance", "estimator", "quantity", "error", "allowed", "unit", "within 2 std", "says"]


def _row(cell: Cell) -> list[Any]:
    numbers = [cell.error, cell.allowance, cell.unit, cell.coverage]
    return [cell.circumstance, cell.estimator, cell.quantity, *numbers, cell.says]


def _order(shown: Sequence[str]) -> Any:
    return lambda cell: (cell.subject != "health", cell.estimator, shown.index(cell.circumstance), cell.quantity)


def _shown(cell: Cell | None) -> str:
    if cell is None or cell.verdict == NOT_APPLICABLE:
        return ""
    letter = LETTERS[cell.verdict]
    return letter if cell.error is None or not np.isfinite(cell.excess) else f"{letter} {cell.excess:.1f}"


def _table(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(map(_text, line)) + " |" for line in lines)


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.3g}" if isinstance(value, float) else str(value).replace("|", "/").replace("\n", " ")
