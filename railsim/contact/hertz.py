"""Hertzian contact of two bodies with given principal curvatures (Johnson 1985, Contact Mechanics, section 4.2)."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import ellipe, ellipk

STEEL_YOUNG = 210e9  # Pa
STEEL_POISSON = 0.28
STEEL_SHEAR = STEEL_YOUNG / (2.0 * (1.0 + STEEL_POISSON))  # Pa; 82 GPa, as in Polach (2005)


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
    if min(curvature_longitudinal, curvature_lateral) <= 0.0:
        raise ValueError("Hertzian contact needs positive sums of curvatures")
    small, large = sorted((0.5 * curvature_longitudinal, 0.5 * curvature_lateral))
    ratio = _axis_ratio(large / small)
    modulus = STEEL_YOUNG / (2.0 * (1.0 - STEEL_POISSON**2))
    parameter = 1.0 - 1.0 / ratio**2
    minor = (3.0 * ellipe(parameter) / (2.0 * np.pi * ratio * modulus * (small + large))) ** (1.0 / 3.0)
    major = ratio * minor
    approach = 3.0 * ellipk(parameter) / (2.0 * np.pi * major * modulus)
    along, across = (major, minor) if curvature_longitudinal <= curvature_lateral else (minor, major)
    return HertzEllipse(float(along), float(across), float(approach**-1.5))


def _axis_ratio(curvature_ratio: float) -> float:
    """Major over minor semi-axis for B/A >= 1."""
    if curvature_ratio < 1.0 + 1e-9:
        return 1.0 + 1e-12

    def mismatch(log_ratio: float) -> float:
        ratio = np.exp(log_ratio)
        parameter = 1.0 - 1.0 / ratio**2
        first, second = ellipk(parameter), ellipe(parameter)
        return float(np.log((ratio**2 * second - first) / (first - second)) - np.log(curvature_ratio))

    return math.exp(root_scalar(mismatch, bracket=(1e-6, 12.0), xtol=1e-14).root)
