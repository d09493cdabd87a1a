"""Statistics of errors that scores, figures and estimators share."""

import numpy as np
from numpy.typing import ArrayLike


def root_mean_square(values: ArrayLike) -> float:
    """Root mean square, unit of the values; NaN where one of them is."""
    return float(np.sqrt(np.mean(np.square(values))))
