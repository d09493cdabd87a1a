"""Claims: a value, where it should lie, and whether it does: held, not held, or undecided."""

import math
from dataclasses import dataclass
from typing import Self

from experiments.reporting.intervals import Interval


@dataclass(frozen=True)
class Target:
    """Where a value should lie.

    Attributes
    ----------
    low, high : ends; infinite where there is none.
    unit : of both.
    open : whether the ends do not belong to it.
    words : how it is written where the ends alone do not say it.
    """

    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    open: bool = False
    words: str = ""

    def __contains__(self, value: float) -> bool:
        """Whether a value lies there; NaN does not."""
        if not self.open:
            return self.low <= value <= self.high
        return (self.low < value or math.isinf(self.low)) and (value < self.high or math.isinf(self.high))

    def __str__(self) -> str:
        """In words, for example "<= 0.2 mm" or "0.9 to 0.97"."""
        if self.words:
            return self.words
        equal = "" if self.open else "="
        text = f"{self.low:.5g} to {self.high:.5g}"
        if self.low == self.high:
            text = f"{self.low:.5g}"
        elif math.isinf(self.low):
            text = f"<{equal} {self.high:.5g}"
        elif math.isinf(self.high):
            text = f">{equal} {self.low:.5g}"
        return f"{text} {self.unit}".strip()

    def outcome(self, low: float, high: float) -> bool | None:
        """True where all from `low` to `high` lies there, False where nothing does, None where the target is reached
        by a part only.
        """
        if low in self and high in self:
            return True
        beyond = high <= self.low or low >= self.high if self.open else high < self.low or low > self.high
        return False if beyond else None


def at_most(high: float, unit: str = "", meaning: str = "") -> Target:
    """Up to `high`; `meaning`: what it means to lie there."""
    target = Target(high=high, unit=unit)
    return Target(high=high, unit=unit, words=f"{target}: {meaning}" if meaning else "")


def at_least(low: float, unit: str = "", meaning: str = "") -> Target:
    """From `low` on; `meaning`: what it means to lie there."""
    target = Target(low=low, unit=unit)
    return Target(low=low, unit=unit, words=f"{target}: {meaning}" if meaning else "")


def below(high: float, unit: str = "") -> Target:
    """Less than `high`."""
    return Target(high=high, unit=unit, open=True)


def above(low: float, unit: str = "") -> Target:
    """More than `low`."""
    return Target(low=low, unit=unit, open=True)


def between(low: float, high: float, unit: str = "") -> Target:
    """From `low` to `high`."""
    return Target(low, high, unit)


def exactly(value: float, unit: str = "") -> Target:
    """Nothing else."""
    return Target(value, value, unit)


def near(value: float, apart: float, unit: str = "") -> Target:
    """At most `apart` from `value`."""
    return Target(value - apart, value + apart, unit, words=f"{value:g} ± {apart:g} {unit}".strip())


HONEST = between(0.90, 0.97)
"""Share of errors within two stated standard deviations, 0.954 of normal ones: neither too bold nor too cautious."""


@dataclass(frozen=True)
class Claim:
    """A statement, by the paper or by this program; made by `definite` or by `sampled`.

    Attributes
    ----------
    claim : what the value is. value : what was found; None where it is infinite or nothing could be found.
    target : where it should lie, in words.
    held : whether it lies there; None where that is undecided.
    low, high : 95 % interval of the value where it comes from a sample of cases; None where it has no such end.
    cases : independent cases, runs for example, that the value comes from; None where it does not come from any.
    """

    claim: str
    value: float | None
    target: str
    held: bool | None
    low: float | None = None
    high: float | None = None
    cases: int | None = None

    @classmethod
    def definite(
        cls, claim: str, value: float | None, target: Target, cases: int | None = None, enough: bool = True
    ) -> Self:
        """Of a value without sampling error: closed form, one run that is shown, the largest of the cases made.

        Parameters
        ----------
        enough : False where less was computed than the claim is about, a shorter run for example. A value that is not
            yet where it should be then decides nothing.

        A value that could not be found (None or NaN) is not where it should be.
        """
        number = math.nan if value is None else float(value)
        held = number in target
        return cls(claim, _plain(number), str(target), held if held or enough else None, cases=cases)

    @classmethod
    def sampled(cls, claim: str, value: float | None, target: Target, interval: Interval, enough: bool = True) -> Self:
        """Of a value that other cases of the same kind would have given otherwise; held or not where its whole
        interval says the same. `enough` as in `definite`.
        """
        number = math.nan if value is None else float(value)
        held = None if math.isnan(number) else target.outcome(interval.low, interval.high)
        low, high = (float(end) if math.isfinite(end) else None for end in interval[:2])
        return cls(claim, _plain(number), str(target), held if held or enough else None, low, high, interval.cases)

    @property
    def outcome(self) -> str:
        """In words."""
        return {True: "held", False: "NOT HELD", None: "undecided"}[self.held]

    @property
    def interval(self) -> str:
        """In words: the interval, and the number of cases."""
        if self.cases is None:
            return ""
        ends = "" if self.low is None and self.high is None else f"{_number(self.low)} to {_number(self.high)}, "
        return f"{ends}{self.cases} case{'s' if self.cases != 1 else ''}"


def _plain(number: float) -> float | None:
    """As JSON knows numbers: neither infinite nor NaN."""
    return number if math.isfinite(number) else None


def _number(end: float | None) -> str:
    return "..." if end is None else f"{end:.3g}"
