"""What a section of the validation report is: a table that is computed, rows that compare, a picture."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from experiments.reporting.claims import Claim, Target
from experiments.reporting.size import Size
from experiments.validation.reference import lacking
from railsim.registry import Kind


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes
    ----------
    item : number of the section. what : the quantity.
    ours, reference, difference : in `unit`; reference and difference None where the target is all there is.
    target : where ours should lie; None where nothing is claimed.
    source : of the reference or of the target.
    used : share of the room in the target that is used, 1 = all of it; None where there is no such share.
    kept : whether the target is kept, where more than ours decides that: a whole vector, for example.
    """

    item: str
    what: str
    ours: float
    reference: float | None
    difference: float | None
    unit: str
    target: Target | None
    source: str
    used: float | None = None
    kept: bool | None = None

    @property
    def held(self) -> bool | None:
        """Whether ours lies in the target; None where nothing is claimed."""
        if self.target is None or self.kept is not None:
            return self.kept
        return self.ours in self.target

    @property
    def limit(self) -> str:
        """The target in words; empty where nothing is claimed."""
        return "" if self.target is None else str(self.target)

    def claim(self) -> Claim | None:
        """The comparison as a claim; None where nothing is claimed."""
        if self.target is None:
            return None
        return replace(Claim.definite(f"{self.item} {self.what}", self.ours, self.target), held=self.held)

    def cells(self) -> dict[str, object]:
        """By the column of a table."""
        return {
            "item": self.item, "what": self.what, "ours": self.ours, "reference": self.reference,
            "difference": self.difference, "limit": self.limit, "unit": self.unit, "held": self.held,
            "source": self.source, "used": self.used,
        }  # fmt: skip


class Section(ABC):
    """One section; its name is that of the module that defines it.

    Attributes
    ----------
    item, part : number in the report, and a letter where several sections share one. title : heading.
    about : one paragraph on what is compared, and how. source : author, year, file.
    needs : files of the reference data (relative to their folder) without which nothing is checked.
    size : of the picture [inch].
    """

    item: ClassVar[int]
    part: ClassVar[str] = ""
    title: ClassVar[str]
    about: ClassVar[str]
    source: ClassVar[str]
    needs: ClassVar[tuple[str, ...]] = ()
    size: ClassVar[tuple[float, float]] = (11.0, 4.5)

    @property
    def name(self) -> str:
        """Name of the section."""
        return type(self).__module__.rpartition(".")[2]

    @property
    def number(self) -> str:
        """Item and part."""
        return f"{self.item}{self.part}"

    def lacking(self) -> list[str]:
        """Files of the reference data that are not there."""
        return lacking(self.needs)

    @abstractmethod
    def compute(self, size: Size) -> pd.DataFrame:
        """The numbers behind rows and picture; no column may be empty altogether."""

    @abstractmethod
    def rows(self, table: pd.DataFrame) -> list[Row]:
        """What is compared."""

    @abstractmethod
    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        """Fill an empty picture."""

    def listing(self, table: pd.DataFrame) -> pd.DataFrame | None:
        """A further table for the report (every deviation, for example), where there is one."""
        del table
        return None

    def agrees(
        self, what: str, ours: float, reference: float, limit: float, unit: str, source: str | None = None
    ) -> Row:
        """Ours is the reference within plus or minus `limit`."""
        shown = unit.strip("-")
        target = Target(reference - limit, reference + limit, words=f"{reference:.6g} ± {limit:g} {shown}".strip())
        return self._against(what, ours, reference, target, unit, source)

    def agrees_relatively(self, what: str, ours: float, reference: float, limit: float, unit: str) -> Row:
        """Ours is the reference within a share `limit` of it."""
        apart = limit * abs(reference)
        target = Target(reference - apart, reference + apart, words=f"{reference:.6g} ± {100.0 * limit:g} %")
        return self._against(what, ours, reference, target, unit)

    def _against(
        self, what: str, ours: float, reference: float, target: Target, unit: str, source: str | None = None
    ) -> Row:
        used, difference = _share(float(ours), target), float(ours) - float(reference)
        return Row(
            self.number, what, float(ours), float(reference), difference, unit, target, source or self.source, used
        )

    def bounded(
        self, what: str, ours: float, low: float = -math.inf, high: float = math.inf, unit: str = "-",
        source: str | None = None,
    ) -> Row:  # fmt: skip
        """Ours lies from `low` to `high`."""
        return self.aimed(what, ours, Target(low, high, unit.strip("-")), unit, source)

    def aimed(self, what: str, ours: float, target: Target, unit: str = "-", source: str | None = None) -> Row:
        """Ours lies in the target."""
        used = _share(float(ours), target)
        return Row(self.number, what, float(ours), None, None, unit, target, source or self.source, used)

    def noted(self, what: str, ours: float, reference: float | None, unit: str) -> Row:
        """A number that is told without a claim."""
        difference = None if reference is None else float(ours - reference)
        return Row(self.number, what, float(ours), reference, difference, unit, None, self.source)


SECTIONS = Kind("validation", "experiments.validation", Section)


def _share(value: float, target: Target) -> float | None:
    """Share of the room in a target that is used: distance from its middle, or the ratio to a single end."""
    low, high = target.low, target.high
    if math.isfinite(low) and math.isfinite(high):
        return abs(value - 0.5 * (low + high)) / (0.5 * (high - low))
    if math.isfinite(high):
        return value / high if value > 0.0 and high > 0.0 else None
    return low / value if value > 0.0 and low > 0.0 else None


def worst(ours: np.ndarray, reference: np.ndarray, relative: bool = False) -> int:
    """Index of the largest deviation."""
    deviation = np.abs(np.asarray(ours, float) - np.asarray(reference, float))
    return int(np.argmax(deviation / np.abs(reference) if relative else deviation))


def sections() -> list[Section]:
    """Every section in the order of the report."""
    return sorted(
        (kind() for kind in SECTIONS.classes().values()), key=lambda section: (section.item, section.part, section.name)
    )
