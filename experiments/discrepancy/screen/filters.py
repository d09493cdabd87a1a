"""Filters: what a late or a resonating channel would give, made of the signature of one such fault.

Where one filter H changes a channel by (H - 1) times its spectrum, another one G does by (G - 1) / (H - 1) times that.
"""

import itertools

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate
from railsim.effects.sensor_changes import FilterEffect

SLOW = 1e-3  # Hz, for a mean


def forms(candidate: Candidate, frequencies: np.ndarray, finely: bool) -> list[tuple[dict[str, float], np.ndarray]]:
    """Numbers of such a filter, and the factor (1, f) that makes its signature of the reference's.

    Raises
    ------
    ValueError : the candidate is no filter.
    """
    if candidate.reference is None or not issubclass(candidate.kind, FilterEffect):
        raise ValueError(f"{candidate.name} is no filter")
    at = np.maximum(frequencies, SLOW)
    own = _change(candidate, candidate.reference, at)
    free = candidate.parameters
    fine = candidate.kind.fine_trials if finely else {}
    grids = [fine.get(name, free[name].trials) for name in candidate.reference]
    found: list[tuple[dict[str, float], np.ndarray]] = []
    for numbers in itertools.product(*grids):
        values = {name: float(value) for name, value in zip(candidate.reference, numbers, strict=True)}
        if all(free[name].low <= value <= free[name].high for name, value in values.items()):
            found.append((values, (_change(candidate, values, at) / own)[None].astype(np.complex64)))
    return found


def _change(candidate: Candidate, values: dict[str, float], frequencies: np.ndarray) -> np.ndarray:
    effect = candidate.build(values)
    if not isinstance(effect, FilterEffect):
        raise TypeError(f"{candidate.name} is no filter")
    return effect.response(frequencies) - 1.0
