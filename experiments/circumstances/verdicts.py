"""Verdicts on an estimate of which the truth is known: right, says so, or silently wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from estimators.interface import Estimate
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


def judge(check: Check, scores: Mapping[str, float], words: str) -> Judgement:
    """The verdict on one quantity.

    Right: the error is allowed, and two stated deviations cover 0.85 of the errors, where deviations are stated. Says
    so: nothing is given; or the error is larger, but the stated deviations cover it, or the estimate warns in words,
    where words excuse. Silently wrong: all else.
    """
    error, coverage = _number(scores, check.error), _number(scores, check.within)
    answered = _number(scores, check.answered)
    withheld = error is None or (answered is not None and answered < check.enough)
    covered = coverage is None or coverage >= COVERED
    within = error is not None and error <= check.allowance
    says = words
    if error is None or (withheld and within):
        verdict, says = SAYS_SO, words or "gives no verdict" * (check.enough >= 1.0) or "calls no sample valid"
    elif within and covered:
        verdict = RIGHT
    elif not within and coverage is not None and covered:
        verdict, says = SAYS_SO, words or "its stated deviation is as large as the error"
    elif words and check.excused:
        verdict = SAYS_SO
    else:
        verdict = SILENT
    return Judgement(verdict, error, coverage, answered, says)


def words_of(estimate: Estimate) -> str:
    """What an estimate says against itself: its warnings."""
    warnings = estimate.about.get("warnings", [])
    texts = [str(one) for one in warnings] if isinstance(warnings, list | tuple) else [str(warnings)]
    return "; ".join(dict.fromkeys(text for text in texts if text))


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
