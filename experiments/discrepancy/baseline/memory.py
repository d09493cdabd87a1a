"""Truth that stays in memory: one run of the compiled engine, as the sensors read it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.truth import TIME, Truth


class MemoryTruth(Truth):
    """The rows of a run by channel name, as the engine gave them piece by piece; never written to disk."""

    def __init__(self, names: list[str], pieces: Sequence[np.ndarray], rate: float, about: dict[str, Any]) -> None:
        super().__init__(Path(), rate, sum(len(one) for one in pieces), names, about)
        self._place = {name: number for number, name in enumerate(names)}
        self._pieces = pieces

    def later(self, rows: int) -> "MemoryTruth":
        """The same so many rows later, the first row held before; raises InputError where there is no such row."""
        if rows < 0 or rows >= len(self):
            raise InputError(f"a run of {len(self)} rows cannot come {rows} rows later")
        table = np.concatenate([np.repeat(self._pieces[0][:1], rows, axis=0), *self._pieces])[: len(self)]
        table[:, self._place[TIME]] = self[TIME]
        return MemoryTruth(list(self._place), [table], self.rate, self.about)

    def __getitem__(self, name: str) -> np.ndarray:
        """Channel `name`, shape (n,); raises InputError where there is none."""
        if name not in self._place:
            raise InputError(f"the model has no channel '{name}'; leave that sensor out")
        return np.concatenate([one[:, self._place[name]] for one in self._pieces])
