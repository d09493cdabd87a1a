"""What a report needs of a sweep's table, read part by part: of 10 000 runs a tenth of the whole."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from experiments.sweep.analysis import RESPONSE, Frame, is_scored, needs_a_word, with_response
from experiments.sweep.table import table_parts

STATUS = ("estimator", "status", "message")


@dataclass(frozen=True)
class Contents:
    """Rows by status, their number, estimators in their order.

    Attributes
    ----------
    scored : rows that hold a number: "point", the factors, "sensors", "estimator", "value" and `analysis.RESPONSE`.
    bad : rows that failed or say something: "point", "estimator", "status" and "message".
    """

    status: dict[str, int]
    estimators: list[str]
    scored: Frame
    bad: Frame

    @property
    def rows(self) -> int:
        """Of the table."""
        return sum(self.status.values())


def read_contents(path: Path, factors: Sequence[str]) -> Contents:
    """Read a sweep's table.

    Raises
    ------
    InputError : there is no table, or it is not whole.
    """
    status: Counter[str] = Counter()
    estimators: dict[str, None] = {}
    scored, bad = [], []
    wanted = ("point", *factors, "sensors", "estimator", "score", "unit", "value", "status", "message")
    for part in table_parts(path, wanted):
        status.update(part["status"])
        estimators |= dict.fromkeys(part["estimator"])
        bad.append(part.loc[needs_a_word(part), ["point", *STATUS]])
        rows = with_response(part.loc[is_scored(part)])
        scored.append(rows[["point", *factors, "sensors", "estimator", RESPONSE, "value"]])
    found = [pd.concat(one, ignore_index=True) for one in (scored, bad)]
    return Contents(dict(status.most_common()), list(estimators), *found)
