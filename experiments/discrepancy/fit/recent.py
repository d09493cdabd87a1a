"""Recent: the last whitened derivatives, so that the same fit does not whiten them again and memory stays bounded."""

from collections.abc import Callable

import numpy as np

from experiments.discrepancy.baseline.noise import Whitener

RECENT = 2  # fits whose whitened derivatives are kept


class Recent:
    """The last few whitened derivatives that were asked for, by the columns that they are of: those of all fits would
    fill the memory.
    """

    def __init__(self) -> None:
        self._kept: list[tuple[Whitener, np.ndarray, np.ndarray]] = []

    def of(self, white: Whitener, columns: np.ndarray, make: Callable[[], np.ndarray]) -> np.ndarray:
        """What is kept of these very columns and this very noise, else what is made of them now."""
        for one in self._kept:
            if one[0] is white and one[1] is columns:
                return one[2]
        made = make()
        self._kept = [*self._kept[1 - RECENT :], (white, columns, made)]
        return made
