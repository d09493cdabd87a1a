"""Kilometres of the line: what people on the track go by, beside the distance that the estimate counts."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

PLACES = {"from [m]": "from [km]", "to [m]": "to [km]", "s [m]": "kilometre"}
"""Columns of distance, and what the column of the line's kilometres is called beside each."""


@dataclass(frozen=True)
class Kilometre:
    """Kilometrage along the estimate.

    Attributes
    ----------
    zero : kilometre at s = 0; None: the line's kilometres are not known, and distances stand for them.
    falling : whether the vehicle ran against the kilometrage.
    """

    zero: float | None = None
    falling: bool = False

    @property
    def known(self) -> bool:
        """Whether the line's kilometres are known."""
        return self.zero is not None

    @property
    def slope(self) -> float:
        """Kilometres a metre."""
        return -1e-3 if self.falling else 1e-3

    def of(self, distance: np.ndarray) -> np.ndarray:
        """Kilometres at distances in m."""
        return (self.zero or 0.0) + self.slope * distance

    def added(self, table: pd.DataFrame) -> pd.DataFrame:
        """The table with kilometres before its distances, where they are known."""
        if not self.known:
            return table
        found = table.copy()
        for distance, name in PLACES.items():
            if distance in found.columns:
                kilometres = np.round(self.of(found[distance].to_numpy(dtype=float)), 4)
                found.insert(int(np.flatnonzero(found.columns == distance)[0]), name, kilometres)
        return found
