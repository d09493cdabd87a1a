"""Kalker's linear creep coefficients over the axis ratio of the contact ellipse (Kalker 1990, table E.3)."""

from functools import lru_cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from railsim.contact.hertz import STEEL_POISSON

_POISSON = np.array([0.0, 0.25, 0.5])
_RATIO = np.arange(1, 11) / 10.0
# Rows: axis ratio 0.1 ... 1.0; columns: Poisson's ratio 0, 0.25, 0.5.
_A_OVER_B = {
    "c11": """2.51 3.31 4.85  2.59 3.37 4.81  2.68 3.44 4.80  2.78 3.53 4.82  2.88 3.62 4.83
              2.98 3.72 4.91  3.09 3.81 4.97  3.19 3.91 5.05  3.29 4.01 5.12  3.40 4.12 5.20""",
    "c22": """2.51 2.52 2.53  2.59 2.63 2.66  2.68 2.75 2.81  2.78 2.88 2.98  2.88 3.01 3.14
              2.98 3.14 3.31  3.09 3.28 3.48  3.19 3.41 3.65  3.29 3.54 3.82  3.40 3.67 3.98""",
    "c23": """0.334 0.473 0.731  0.483 0.603 0.809  0.607 0.715 0.889  0.720 0.823 0.977  0.827 0.929 1.07
              0.930 1.03 1.18  1.03 1.14 1.29  1.13 1.25 1.40  1.23 1.36 1.51  1.33 1.47 1.63""",
}
_B_OVER_A = {
    "c11": """10.7 11.7 12.9  6.96 7.78 8.82  5.57 6.34 7.34  4.84 5.57 6.57  4.37 5.10 6.11
              4.06 4.78 5.80  3.82 4.54 5.58  3.65 4.36 5.42  3.51 4.22 5.30  3.40 4.12 5.20""",
    "c22": """10.7 12.8 16.0  6.96 8.14 9.79  5.57 6.40 7.51  4.84 5.48 6.31  4.37 4.90 5.56
              4.06 4.50 5.04  3.82 4.21 4.67  3.65 3.99 4.39  3.51 3.81 4.16  3.40 3.67 3.98""",
    "c23": """12.2 14.6 18.0  5.72 6.63 7.89  3.79 4.32 5.01  2.88 3.24 3.70  2.35 2.62 2.96
              2.01 2.23 2.50  1.76 1.95 2.18  1.58 1.75 1.94  1.44 1.59 1.77  1.33 1.47 1.63""",
}


def kalker_coefficients(axis_ratio: float, poisson: float = STEEL_POISSON) -> tuple[float, float, float]:
    """C11, C22, C23 for semi-axis ratio a/b (longitudinal over lateral), monotone in a/b, quadratic in Poisson's ratio.

    Ratios beyond 0.1 ... 10 take the value at the end of the table.
    """
    c11, c22, c23 = (float(c) for c in kalker_table(np.array([axis_ratio]), poisson)[0])
    return c11, c22, c23


def kalker_table(axis_ratio: np.ndarray, poisson: float = STEEL_POISSON) -> np.ndarray:
    """(ratios, 3) C11, C22, C23 of many ratios; see `kalker_coefficients`."""
    ratio = np.clip(axis_ratio, 0.1, 10.0)
    return np.column_stack([_coefficient(name, ratio, poisson) for name in ("c11", "c22", "c23")])


def _coefficient(name: str, ratio: np.ndarray, poisson: float) -> np.ndarray:
    by_poisson = _interpolator(name)(np.log(ratio))
    return np.exp(np.polyval(np.polyfit(_POISSON, by_poisson.T, 2), poisson))


@lru_cache
def _interpolator(name: str) -> PchipInterpolator:
    """Logarithm of a coefficient over that of the axis ratio, for the three Poisson's ratios; built once."""
    narrow = np.array(_A_OVER_B[name].split(), float).reshape(10, 3)
    wide = np.array(_B_OVER_A[name].split(), float).reshape(10, 3)
    log_ratio = np.log(np.concatenate((_RATIO, 1.0 / _RATIO[8::-1])))
    table = np.concatenate((narrow, wide[8::-1]))
    return PchipInterpolator(log_ratio, np.log(table), axis=0)
