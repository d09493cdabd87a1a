"""Level of the noise in a record, from its own quietest frequencies."""

from itertools import pairwise

import numpy as np
from scipy.signal import welch


def noise_floor(values: np.ndarray, rate: float) -> float:
    """Density of the quietest tenth-octave of a spectrum above an eighth of the rate, unit^2/Hz: noise has no more."""
    frequency, density = welch(values - np.mean(values), rate, nperseg=min(len(values), round(2.0 * rate)))
    edges = np.geomspace(rate / 8.0, 0.45 * rate, 19)
    inside = [(frequency >= low) & (frequency < high) for low, high in pairwise(edges)]
    means = [float(np.mean(density[one])) for one in inside if one.any()]
    return min(means, default=0.0)
