"""Verdicts on an estimate of which the truth is known: right, says so, or silently wrong."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from estimators.interface import Estimate
from experiments.circumstances.circumstance import HOME
from experiments.scoring.interface import Check

RIGHT, SAYS_SO, SILENT, FAILED, NOT_APPLICABLE = "right", "says so", "silently wrong", "failed", "not applicable"
VERDICTS: tuple[str, ...] = (RIGHT, SAYS_SO, SILENT, FAILED)
"""Verdicts that count."""
WORST_FIRST = (SILENT, FAILED, SAYS_SO, RIGHT, NOT_APPLICABLE)
COVERED = 0.85
"""Share of errors within two stated deviations, from which on these are honest."""


@dataclass(frozen=True)
class Cell:
    """One quantity of one estimator in one circumstance.

    Attributes
    ----------
    error, allowance : in `unit`; None where there is none.
    coverage : share of the errors within two stated deviations; None where none are stated.
    answered : share of the samples that the estimate calls valid.
    says : what the estimate says of itself, or why there is none.
    warnings : all of its warnings. excusable : whether one of them may excuse a mistake.
    seconds : processor time of the whole estimate.
    """

    circumstance: str
    group: str
    base: str
    estimator: str
    quantity: str
    subject: str
    verdict: str
    error: float | None = None
    allowance: float | None = None
    unit: str = ""
    coverage: float | None = None
    answered: float | None = None
    says: str = ""
    seconds: float | None = None
    warnings: tuple[str, ...] = ()
    excusable: bool = True

    def plain(self) -> dict[str, Any]:
        """As JSON and tables hold it."""
        return asdict(self)

    @property
    def excess(self) -> float:
        """Error over allowance; infinite where nothing is allowed."""
        if self.error is None or self.allowance is None:
            return 0.0
        return self.error / self.allowance if self.allowance > 0.0 else (float("inf") if self.error > 0.0 else 0.0)


@dataclass(frozen=True)
class Judgement:
    """Verdict on one quantity, and what it rests on."""

    verdict: str
    error: float | None
    coverage: float | None
    answered: float | None
    says: str


def judge(check: Check, scores: Mapping[str, float]) -> Judgement:
    """The verdict on one quantity, before any warning excuses it.

    Right: the error is allowed, and two stated deviations cover 0.85 of the errors, where deviations are stated. Says
    so: nothing is given, or the error is larger, but the stated deviations cover it. Silently wrong: all else.
    """
    error, coverage = _number(scores, check.error), _number(scores, check.within)
    answered = _number(scores, check.answered)
    withheld = error is None or (answered is not None and answered < check.enough)
    covered = coverage is None or coverage >= COVERED
    within = error is not None and error <= check.allowance
    verdict, says = SILENT, ""
    if error is None or (withheld and within):
        verdict, says = SAYS_SO, "gives no verdict" if check.enough >= 1.0 else "calls no sample valid"
    elif within and covered:
        verdict = RIGHT
    elif not within and coverage is not None and covered:
        verdict, says = SAYS_SO, "its stated deviation is as large as the error"
    return Judgement(verdict, error, coverage, answered, says)


def excused(cells: Sequence[Cell]) -> list[Cell]:
    """The cells, those that are wrong with a warning in words as `says so`.

    A warning that the estimator gives at home too, whatever the numbers in it, says nothing of the circumstance and
    excuses nothing. Words never excuse verdicts on components (`Check.excused`).
    """
    usual: dict[tuple[str, str], set[str]] = {}
    for cell in cells:
        if cell.group == HOME:
            usual.setdefault((cell.base, cell.estimator), set()).update(map(_shape, cell.warnings))
    return [_excused(cell, usual.get((cell.base, cell.estimator), set())) for cell in cells]


def _excused(cell: Cell, usual: set[str]) -> Cell:
    new = [text for text in cell.warnings if _shape(text) not in usual]
    if cell.verdict != SILENT or not cell.excusable or not new:
        return cell
    return replace(cell, verdict=SAYS_SO, says="; ".join(filter(None, [cell.says, *new])))


def _shape(text: str) -> str:
    """A warning without its numbers."""
    return re.sub(r"\d+(\.\d+)?", "#", text)


def warnings_of(estimate: Estimate) -> tuple[str, ...]:
    """What an estimate says against itself in words."""
    warnings = estimate.about.get("warnings", [])
    texts = map(str, warnings) if isinstance(warnings, list | tuple) else [str(warnings)]
    return tuple(dict.fromkeys(text for text in texts if text))


def told(estimate: Estimate) -> str:
    """The verdicts on components that an estimate states."""
    verdicts = estimate.about.get("verdicts", [])
    return "; ".join(f"{one.get('component')}: {one.get('verdict')}" for one in verdicts if isinstance(one, dict))


def worst(cells: Sequence[Cell]) -> Cell:
    """The cell that speaks for all of an estimator: the worst verdict, and the largest error over its allowance."""
    return min(cells, key=lambda cell: (WORST_FIRST.index(cell.verdict), -cell.excess))


def _number(scores: Mapping[str, float], name: str) -> float | None:
    value = scores.get(name) if name else None
    return None if value is None or value != value else float(value)
