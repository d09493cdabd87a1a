"""Priors of the logs of levels: cost (minus log density), slope and a positive curvature, each normalised."""

import math
from dataclasses import dataclass
from typing import Protocol

LEAST_CURVATURE = 0.5  # of a half-normal level far below its scale, where the density is flat but for the log


class Prior(Protocol):
    """Of psi, the log of an amplitude."""

    @property
    def middle(self) -> float:
        """A psi to begin with."""
        ...

    def cost(self, psi: float) -> tuple[float, float, float]:
        """Minus log density, its slope and curvature."""
        ...


@dataclass(frozen=True)
class LogNormal:
    """Amplitude with `median`, and sd `spread` of its log."""

    median: float
    spread: float

    @property
    def middle(self) -> float:
        """Log of the median."""
        return math.log(self.median)

    def cost(self, psi: float) -> tuple[float, float, float]:
        """Minus log density, its slope and curvature."""
        apart = (psi - self.middle) / self.spread
        value = 0.5 * apart * apart + math.log(self.spread) + 0.5 * math.log(2.0 * math.pi)
        return value, apart / self.spread, 1.0 / self.spread**2


@dataclass(frozen=True)
class HalfNormal:
    """Amplitude as the absolute value of a normal number with sd `scale`: small ones are as likely as any."""

    scale: float

    @property
    def middle(self) -> float:
        """Log of the scale."""
        return math.log(self.scale)

    def cost(self, psi: float) -> tuple[float, float, float]:
        """Minus log density of psi (the amplitude's times exp(psi)), its slope and curvature."""
        apart = psi - self.middle
        square = math.exp(min(2.0 * apart, 60.0))
        value = -apart + 0.5 * square + 0.5 * math.log(0.5 * math.pi)
        return value, square - 1.0, max(2.0 * square, LEAST_CURVATURE)
