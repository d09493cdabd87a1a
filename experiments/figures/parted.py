"""A figure whose numbers are computed in parts: on all cores, each kept as it ends."""

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import pandas as pd

from experiments.figures.interface import Figure
from experiments.reporting.size import Size

Parts = Mapping[str, Callable[[], pd.DataFrame]]
Rows = Iterable[Mapping[str, Any]]


class PartedFigure(Figure):
    """A figure of many runs that do not need each other's results."""

    @abstractmethod
    def parts(self, size: Size) -> Parts:
        """What computes each part, by a name that may be a file's; asked for in every process, so it computes nothing.

        Parts in their order make the table; the dearest of them takes as long as the figure on many cores.
        """

    def join(self, tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
        """The figure's table of the parts' tables, in the order of `parts`: one below the other."""
        return pd.concat(tables, ignore_index=True)

    def compute(self, size: Size) -> pd.DataFrame:
        """All parts, one after the other."""
        return self.join([part() for part in self.parts(size).values()])


def parts_of(figure: Figure, size: Size) -> Parts:
    """Its parts; none where it is computed in one go."""
    return figure.parts(size) if isinstance(figure, PartedFigure) else {}


def table_of(rows: Callable[..., Rows], *arguments: Any, **options: Any) -> Callable[[], pd.DataFrame]:
    """A part whose table is the rows that a function gives of its arguments."""
    return partial(_table, partial(rows, *arguments, **options))


def _table(rows: Callable[[], Rows]) -> pd.DataFrame:
    return pd.DataFrame(list(rows()))
