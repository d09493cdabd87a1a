"""Dipped rail joints and voids: local vertical shapes on one or both rails."""

from collections.abc import Iterable, Sequence

import numpy as np

from railsim.errors import InputError
from railsim.track.features import Feature
from railsim.track.synthesis import rounded_ramp

RAIL_LENGTH = 18.288
"""60 ft, m."""

ROUNDING = 0.3
"""Length over which the angle at the bottom of a dip is rounded, m: the stiffness of fishplates and rail ends, and what
rows 0.1 m apart can carry without ringing of the spline (illustrative)."""

WINKLER = 1.2
"""Reciprocal length beta = (k / 4 E I)^(1/4) of a rail on its foundation, 1/m: 60E1 (E I = 6.4 MN m2) on 53 MN/m2."""


def dip(x: np.ndarray, depth: float, half_length: float, rounding: float = ROUNDING) -> np.ndarray:
    """Vertical shape of a dipped joint at the distances `x` from it, m, up +.

    Two parabolas that end level at +-L and meet in the total dip angle 2 alpha: z = -e (1 - |x| / L)^2 with
    2 alpha = 4 e / L, the geometry of a "dipped joint" of Jenkins et al. (1974), The effect of track and vehicle
    parameters on wheel/rail vertical dynamic forces, Railway Engineering Journal 3, whose forces P1 and P2 go with
    2 alpha times the speed. |x| is averaged with the raised cosine of `synthesis`, and e so chosen that the lowest
    point lies `depth` below the level.

    Raises
    ------
    InputError : a dip that is shorter than its rounding.
    """
    if not 0 <= rounding < half_length:
        raise InputError(f"half length {half_length:g} m must be longer than the rounding of {rounding:g} m")
    distance = 2 * rounded_ramp(x, rounding) - x
    inside = np.abs(x) < half_length
    shape = (1 - 2 * distance / half_length + (x / half_length) ** 2) * inside
    return -depth / _lowest(half_length, rounding) * shape


def dip_angle(depth: float, half_length: float, rounding: float = ROUNDING) -> float:
    """Total dip angle 2 alpha, rad, between the tangents on both sides of the joint (before rounding)."""
    return 4 * depth / _lowest(half_length, rounding) / half_length


def void(x: np.ndarray, depth: float, reciprocal_length: float = WINKLER) -> np.ndarray:
    """Vertical shape over a hanging sleeper, m, up +, `x` m from it: a point load's deflection of the rail.

    z = -depth exp(-b |x|) (cos b|x| + sin b|x|), a beam on Winkler's foundation (Hetenyi 1946).
    """
    u = reciprocal_length * np.abs(x)
    return -depth * np.exp(-u) * (np.cos(u) + np.sin(u))


def rail_joints(
    distances: Iterable[float], sides: Sequence[str], rng: np.random.Generator, apart: float = 0.15
) -> list[Feature]:
    """Joints of random size at `distances`, m, on each of the rails `sides`.

    Depth of the pair uniform in 2.5 to 5.5 mm, its rails' own depths `apart` (relative, one standard deviation) from
    it; half length uniform in 1.0 to 1.8 m, the same for both rails: dip angles 6 to 25 mrad (illustrative; British
    practice limits vehicles' P2 force at a total dip angle of 20 mrad).
    """
    joints = []
    for distance in distances:
        common, half_length = rng.uniform(2.5e-3, 5.5e-3), round(rng.uniform(1.0, 1.8), 3)
        for side in sides:
            depth = round(common * (1 + apart * float(np.clip(rng.standard_normal(), -2, 2))), 6)
            angle = round(dip_angle(depth, half_length), 7)
            joints.append(Feature("joint", round(float(distance), 4), side, depth, angle, half_length))
    return joints


def vertical_shapes(s: np.ndarray, features: Iterable[Feature]) -> tuple[np.ndarray, np.ndarray]:
    """Vertical of the left and the right rail, m, that the features with a depth add up to at the distances `s`.

    Voids have the rail's deflection, others with a half length the dip of a joint; the rest have no vertical shape.
    """
    rails = {"left": np.zeros(s.size), "right": np.zeros(s.size)}
    for feature in features:
        if feature.depth is None or (feature.kind != "void" and feature.half_length is None):
            continue
        near = np.abs(s - feature.s) < (feature.half_length or 12 / WINKLER)
        x = s[near] - feature.s
        shape = void(x, feature.depth) if feature.kind == "void" else dip(x, feature.depth, feature.half_length or 1.0)
        for side in ("left", "right") if feature.side == "both" else (feature.side,):
            rails[side][near] += shape
    return rails["left"], rails["right"]


def _lowest(half_length: float, rounding: float) -> float:
    """Depth of the rounded dip over that of the sharp one; 2 ramp(0) = rounding (1/4 - 1/pi^2)."""
    return 1 - 2 * rounding * (0.25 - 1 / np.pi**2) / half_length
