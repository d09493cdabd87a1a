"""Truth that stays in memory: one run of the compiled engine, as the sensors read it."""

from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.truth import Truth


class MemoryTruth(Truth):
    """The rows of a run by channel name; never written to disk."""

    def __init__(self, names: list[str], rows: np.ndarray, rate: float, about: dict[str, Any]) -> None:
        super().__init__(Path(), rate, len(rows), names, about)
        self._place = {name: number for number, name in enumerate(names)}
        self._table = rows

    def __getitem__(self, name: str) -> np.ndarray:
        """Channel `name`, shape (n,); raises InputError where there is none."""
        if name not in self._place:
            raise InputError(f"the model has no channel '{name}'; leave that sensor out")
        return self._table[:, self._place[name]].copy()
