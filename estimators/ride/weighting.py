"""Weightings of ride comfort: EN 12299:2009 (W_b, W_d), and Sperling's index W_z (Garg and Dukkipati 1984)."""

from typing import NamedTuple

import numpy as np


class Weighting(NamedTuple):
    """A weighting of EN 12299, annex C: band limits f1, f2 (Q1), a step f3, f4 (Q2) and, of W_b, another f5, f6.

    Attributes
    ----------
    corners : f3, f4 and, where there is a second step, f5, f6, Hz.
    qualities : Q2 and, where there is a second step, Q3, Q4.
    level : K.
    """

    corners: tuple[float, ...]
    qualities: tuple[float, ...]
    level: float

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """Complex response at frequencies in Hz (not negative)."""
        s = 2j * np.pi * np.asarray(frequency, dtype=float)
        low, high, damping = 2.0 * np.pi * LIMITS[0], 2.0 * np.pi * LIMITS[1], LIMITS[2]
        band = s**2 * high**2 / (_quadratic(s, low, damping) * _quadratic(s, high, damping))
        w3, w4 = (2.0 * np.pi * one for one in self.corners[:2])
        step = (s + w3) / _quadratic(s, w4, self.qualities[0]) * w4**2 / w3
        if len(self.corners) > 2:
            w5, w6 = (2.0 * np.pi * one for one in self.corners[2:])
            step *= _quadratic(s, w5, self.qualities[1]) / _quadratic(s, w6, self.qualities[2]) * (w6 / w5) ** 2
        return self.level * band * step


LIMITS = (0.4, 100.0, 0.71)  # f1, f2 in Hz, Q1
VERTICAL = Weighting((16.0, 16.0, 2.5, 4.0), (0.63, 0.8, 0.8), 0.4)
"""W_b of EN 12299, for the vertical direction."""
HORIZONTAL = Weighting((2.0, 2.0), (0.63,), 1.0)
"""W_d of EN 12299, for the longitudinal and the lateral direction."""


def sperling(frequency: np.ndarray, vertical: bool) -> np.ndarray:
    """Weighting B of Sperling's comfort index at frequencies in Hz, magnitude (Garg and Dukkipati 1984, chapter 3)."""
    f2 = np.asarray(frequency, dtype=float) ** 2
    above = 1.911 * f2 + (0.25 * f2) ** 2
    below = (1.0 - 0.277 * f2) ** 2 + f2 * (1.563 - 0.0368 * f2) ** 2
    return (0.588 if vertical else 0.737) * np.sqrt(above / below)


def sperling_index(weighted_rms: np.ndarray) -> np.ndarray:
    """W_z from the rms of the weighted acceleration, m/s2: 4.42 a^0.3 (Garg and Dukkipati 1984)."""
    return 4.42 * np.maximum(weighted_rms, 0.0) ** 0.3


def _quadratic(s: np.ndarray, corner: float, quality: float) -> np.ndarray:
    return s**2 + corner / quality * s + corner**2
