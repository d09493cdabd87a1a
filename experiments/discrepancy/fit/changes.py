"""Changes: what effects of a finite size do to a recording, kept with the build at which each was run.

A signature that is screened need not be of the very build that is fitted: those of the bank are the nominal one's.
"""

from collections.abc import Callable

import numpy as np

NEAR = 3.0  # standard deviations of any part's tolerance, within which a change serves again


class Changes:
    """Changes of the coefficients (k, f, c) by what effect, None where the model cannot have it."""

    def __init__(self) -> None:
        self._kept: dict[str, list[tuple[np.ndarray, np.ndarray | None]]] = {}

    def of(self, effect: str, build: np.ndarray, make: Callable[[], np.ndarray | None]) -> np.ndarray | None:
        """The change by an effect of these settings that is kept of a build (n,) near this one, else what is made
        now.
        """
        kept = self._kept.setdefault(effect, [])
        for there, change in kept:
            if np.abs(there - build).max(initial=0.0) < NEAR:
                return change
        made = make()
        kept.append((build, made if made is None else made.astype(np.complex64)))
        return kept[-1][1]
