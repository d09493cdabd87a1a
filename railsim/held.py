"""Channels of a slower sensor that repeat their last value until the next one comes."""

import numpy as np

_FEWEST_CHANGES = 6  # by which a held channel is told
_SHORTEST = 4  # rows; a shorter stay is chance
_ALIKE = 0.8  # share of the stays that are a whole number of the usual one


def held_rows(values: np.ndarray) -> int:
    """Rows for which a value usually stays, of samples of shape (n,) that may hold NaN; 0 where it is not held."""
    changes = np.flatnonzero(np.diff(values) != 0)
    if changes.size < _FEWEST_CHANGES or np.isnan(values).any():
        return 0
    stays = np.diff(changes)
    usual = float(np.median(stays))
    if usual < _SHORTEST:
        return 0
    off = np.abs(stays - usual * np.maximum(1, np.rint(stays / usual)))
    return int(usual) if np.mean(off <= np.maximum(1, 0.1 * usual)) >= _ALIKE else 0
