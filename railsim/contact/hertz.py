"""Hertzian contact of two bodies with given principal curvatures (Johnson 1985, Contact Mechanics, section 4.2)."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import elementwise
from scipy.special import ellipe, ellipk

STEEL_YOUNG = 210e9  # Pa
STEEL_POISSON = 0.28
STEEL_SHEAR = STEEL_YOUNG / (2.0 * (1.0 + STEEL_POISSON))  # Pa; 82 GPa, as in Polach (2005)

TOLERANCES = {"xatol": 1e-12, "xrtol": 0.0}
"""Of the axis ratio's logarithm: above its rounding errors, in which the search divides noise by noise and warns."""


@dataclass(frozen=True)
class HertzEllipse:
    """Contact of unit load: semi-axes grow with N^(1/3), approach with N^(2/3).

    Attributes
    ----------
    longitudinal, lateral : semi-axes at 1 N [m/N^(1/3)].
    stiffness : C in N = C * approach^1.5 [N/m^1.5].
    """

    longitudinal: float
    lateral: float
    stiffness: float


def hertz_ellipse(curvature_longitudinal: float, curvature_lateral: float) -> HertzEllipse:
    """Ellipse for the sums of both bodies' curvatures in the two directions [1/m], both positive (Johnson 1985, eq.
    4.26).

    Raises
    ------
    ValueError : a sum of curvatures is not positive (the pair is conformal: no Hertzian contact).
    """
    along, across, stiffness = hertz_ellipses(np.array([curvature_longitudinal]), np.array([curvature_lateral]))
    return HertzEllipse(float(along[0]), float(across[0]), float(stiffness[0]))


def hertz_ellipses(
    curvature_longitudinal: np.ndarray, curvature_lateral: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Semi-axes along and across at 1 N [m/N^(1/3)] and stiffness [N/m^1.5] of many contacts; see `hertz_ellipse`."""
    small = 0.5 * np.minimum(curvature_longitudinal, curvature_lateral)
    large = 0.5 * np.maximum(curvature_longitudinal, curvature_lateral)
    if not (small > 0.0).all():
        raise ValueError("Hertzian contact needs positive sums of curvatures")
    ratio = _axis_ratio(large / small)
    modulus = STEEL_YOUNG / (2.0 * (1.0 - STEEL_POISSON**2))
    parameter = 1.0 - 1.0 / ratio**2
    minor = (3.0 * ellipe(parameter) / (2.0 * np.pi * ratio * modulus * (small + large))) ** (1.0 / 3.0)
    major = ratio * minor
    approach = 3.0 * ellipk(parameter) / (2.0 * np.pi * major * modulus)
    lengthwise = curvature_longitudinal <= curvature_lateral
    return np.where(lengthwise, major, minor), np.where(lengthwise, minor, major), approach**-1.5


def _axis_ratio(curvature_ratio: np.ndarray) -> np.ndarray:
    """Major over minor semi-axis for B/A >= 1."""

    def mismatch(log_ratio: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        ratio = np.exp(log_ratio)
        parameter = 1.0 - 1.0 / ratio**2
        first, second = ellipk(parameter), ellipe(parameter)
        return np.log((ratio**2 * second - first) / (first - second)) - np.log(wanted)

    circular = curvature_ratio < 1.0 + 1e-9
    wanted = np.where(circular, 2.0, curvature_ratio)
    solution = elementwise.find_root(mismatch, (1e-6, 12.0), args=(wanted,), tolerances=TOLERANCES)
    return np.where(circular, 1.0 + 1e-12, np.exp(solution.x))
