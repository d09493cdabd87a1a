"""Filters: what a late or a resonating channel would give, made of the signature of one such fault.

A channel through a filter H differs from itself by (H - 1) times its spectrum, so that of any other filter G is
(G - 1) / (H - 1) times that.
"""

import itertools

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate
from railsim.effects.sensor_changes import FilterEffect

TRIED = {
    "delay": np.concatenate([np.geomspace(0.001, 0.02, 10), np.arange(0.025, 1.0, 0.01)]),  # s
    "period": np.concatenate([[0.003, 0.006, 0.01], np.geomspace(1.0 / 60.0, 0.06, 8)]),  # s
    "damping": np.array([0.03, 0.07, 0.15, 0.27]),
}
"""A channel is like itself a little later only within a part of a turn of its loudest wave; resonances beyond the
frames' highest frequency show by their foot only."""
FINELY = {"period": np.geomspace(0.003, 0.06, 30), "damping": np.array([0.02, 0.04, 0.07, 0.11, 0.16, 0.22, 0.29])}
SLOW = 1e-3  # Hz, for a mean


def forms(candidate: Candidate, frequencies: np.ndarray, finely: bool) -> list[tuple[dict[str, float], np.ndarray]]:
    """Numbers of such a filter, and the factor (1, f) that makes its signature of the reference's.

    Raises
    ------
    ValueError : the candidate is no filter.
    """
    if candidate.reference is None:
        raise ValueError(f"{candidate.name} is no filter")
    at = np.maximum(frequencies, SLOW)
    own = _change(candidate, candidate.reference, at)
    free = candidate.parameters
    grids = [{**TRIED, **(FINELY if finely else {})}[name] for name in candidate.reference]
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
