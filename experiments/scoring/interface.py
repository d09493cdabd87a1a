"""What a scorer is: a plug-in that compares columns of an estimate with the truth of its run."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Literal, NamedTuple

from estimators.interface import Estimate
from railsim.errors import InputError
from railsim.registry import Kind
from railsim.truth import Truth

ANY = 1e-9
"""Least share of an estimate's samples that must count for it to have answered."""


class Check(NamedTuple):
    """What a scored quantity must be good for, by the names of its scores.

    Attributes
    ----------
    quantity : in words. subject : "health" of components and adhesion levels, whose mistakes count apart; or "value".
    error : score, `"score [unit]"`, that must be at most `allowance`; `source` : where that comes from.
    within : score of the share of errors within two stated deviations; empty where there is none.
    answered : score of the share that the estimate answers at all; below `enough` it is withheld.
    excused : whether a warning in words may excuse a mistake.
    """

    quantity: str
    error: str
    allowance: float
    source: str
    within: str = ""
    answered: str = ""
    enough: float = ANY
    subject: Literal["value", "health"] = "value"
    excused: bool = True

    @property
    def unit(self) -> str:
        """Of the error and the allowance."""
        return self.error.rpartition(" [")[2].removesuffix("]")


class Scorer(ABC):
    """Scores of one kind of estimated quantity.

    Attributes
    ----------
    columns : columns of an estimate, `"name [unit]"`, that are scored here. The scorer is asked where the estimate has
        any of them.
    needs : columns without which it cannot score them.
    checks : what its quantities must be good for; `railsim circumstances` judges by them.
    """

    columns: ClassVar[tuple[str, ...]]
    needs: ClassVar[tuple[str, ...]] = ()
    checks: ClassVar[tuple[Check, ...]] = ()

    @abstractmethod
    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Values by `"score [unit]"`.

        Samples that the estimate calls invalid, or where it is NaN (before it has found anything), do not count as
        errors; their share is a score of its own. Where no sample is valid, that share is the only score.

        Raises
        ------
        InputError : the estimate lies outside the truth in time, or the run does not state what is needed.
        """

    def columns_of(self, estimate: Estimate) -> list[str]:
        """Those of the estimate's columns that are scored here."""
        return [name for name in self.columns if name in estimate.series.columns]

    def lacking(self, estimate: Estimate) -> list[str]:
        """What the estimate has not of what is needed."""
        return [name for name in self.needs if name not in estimate.series.columns]


SCORERS = Kind("scorers", "experiments.scoring", Scorer)


def stated(estimate: Estimate, *keys: str) -> float:
    """A number that the estimate's about must hold, by its keys from outside inwards; raises `InputError` otherwise."""
    value: Any = estimate.about
    for key in keys:
        value = value.get(key) if isinstance(value, Mapping) else None
    if not isinstance(value, int | float):
        raise InputError(f"the about of estimate '{estimate.name}' has no number {' > '.join(keys)}; add it there")
    return float(value)
