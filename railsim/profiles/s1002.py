"""The wheel profile S1002: polynomial and circular sections (EN 13715, UIC 510-2; constants as widely restated)."""

import numpy as np

from railsim.profiles.profile import Profile

_BOUNDS = (-70.0, -62.764705882, -49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796, 60.0)
"""Limits of sections H, G, F, E, D, C, B, A over y [mm] from the taping line, flange side negative."""

_B = (0.0, -3.358537058e-2, 1.565681624e-3, -2.810427944e-5, 5.844240864e-8, -1.562379023e-8, 5.309217349e-15,
      -5.957839843e-12, 2.646656573e-13)  # fmt: skip
_C = (-4.320221063e3, -1.038384026e3, -1.065501873e2, -6.051367875, -2.054332446e-1, -4.169739389e-3,
      -4.687195829e-5, -2.252755540e-7)  # fmt: skip


def s1002(spacing: float = 2e-4) -> Profile:
    """New S1002 wheel, flange height 28 mm, from the flange back to the end of the tread, every `spacing` of y [m].

    The flange's back and tip are sampled four times as densely.
    """
    flange = np.arange(_BOUNDS[0], _BOUNDS[5], 250.0 * spacing)
    tread = np.arange(_BOUNDS[5], _BOUNDS[8] + 500.0 * spacing, 1000.0 * spacing)
    y = np.concatenate((flange, tread))
    return Profile("wheel", 1e-3 * y, -1e-3 * depth(y), "s1002")


def depth(y: np.ndarray) -> np.ndarray:
    """Depth below the running circle's lowest point [mm], positive at the flange, over y [mm] (-70 ... 60)."""
    pieces = [
        lambda v: _arc(v, 9.519259302, 20.5, -49.5),
        lambda v: _arc(v, 16.0, 12.0, -55.0),
        lambda v: _arc(v, 8.834924130, 20.0, -58.558326413),
        lambda v: -93.576667419 - 2.747477419 * v,
        lambda v: 16.446 - (_arc(v, 0.0, 13.0, -26.210665)),
        np.polynomial.Polynomial(_C),
        np.polynomial.Polynomial(_B),
        lambda v: 1.364323640 - 0.066666667 * v,
    ]
    section = np.clip(np.searchsorted(_BOUNDS, y, side="right") - 1, 0, len(pieces) - 1)
    height = np.empty_like(y, dtype=float)
    for number, piece in enumerate(pieces):
        here = section == number
        height[here] = piece(y[here])
    return height


def _arc(y: np.ndarray, level: float, radius: float, centre: float) -> np.ndarray:
    return level + np.sqrt(radius**2 - (y - centre) ** 2)
