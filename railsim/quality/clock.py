"""Time stamps: jitter against an even grid."""

from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._signals import NORMAL
from railsim.quality.interface import Check, Finding
from railsim.spec import quantity

_ROUNDING = 1e-3
_LOOK = 15  # rows on either side of a wide step, by which a late stamp is told from missing rows
WIDEST = 1.5
"""Steps; a wider one is a gap."""


class Clock(Check, frozen=True):
    """Stamps that leave the grid of the stated rate."""

    jitter: float = quantity(0.02, unit="steps, largest deviation", source="illustrative: a delay of 0.08 ms at 256 Hz")

    stage: ClassVar[int] = 0

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a table whose times scatter about the grid."""
        found = []
        for rate, time in tables(measurements).items():
            off = deviation(time, rate)
            wrong = np.flatnonzero(np.abs(off) > self.jitter)
            if wrong.size < 4:
                continue
            size = float(np.sqrt(np.mean(off[wrong[0] : wrong[-1] + 1] ** 2))) / rate
            on_grid = gridded(time, rate)
            found.append(
                Finding(
                    "clock",
                    f"time [s] at {rate:g} Hz",
                    float(on_grid[wrong[0]]),
                    float(on_grid[wrong[-1]]),
                    f"stamps scatter by {1e3 * size:.2g} ms about an even grid ({wrong.size} of {time.size})",
                    "use even times where the sensor's own clock samples, resample where the stamps are right",
                    repair="regrid",
                )
            )
        return found


def tables(measured: Measurements) -> dict[float, np.ndarray]:
    """Times of each table by rate."""
    return {measured.rate(name): measured.time(name) for name in measured}


def numbers(time: np.ndarray, rate: float) -> np.ndarray:
    """Number of the grid's place of each row, shape (n,); gaps count."""
    at = np.arange(time.size, dtype=float)
    phase = time * rate - at
    for row in np.flatnonzero(np.diff(time) * rate > WIDEST) + 1:
        jump = np.median(phase[row : row + _LOOK]) - np.median(phase[max(0, row - _LOOK) : row])
        jump = round(float(jump)) if jump > 0.75 else 0
        at[row:] += jump
        phase[row:] -= jump
    return at


def gridded(time: np.ndarray, rate: float) -> np.ndarray:
    """The even times, s, that the stamps scatter about: the real clock's rate, robust against scattered stretches."""
    at = numbers(time, rate)
    step = 1.0 / rate
    if at[-1] > 0:
        half = at.size // 2
        slope = float(np.median((time[half:] - time[: at.size - half]) / (at[half:] - at[: at.size - half])))
        step = slope if abs(slope * rate - 1) > _ROUNDING / at[-1] else step
    return float(np.median(time - at * step)) + at * step


def deviation(time: np.ndarray, rate: float) -> np.ndarray:
    """Of the stamps from the even grid, in steps, shape (n,)."""
    off = (time - gridded(time, rate)) * rate
    floor = 3 * NORMAL * float(np.median(np.abs(off - np.median(off))))
    return np.where(np.abs(off) < min(floor, _ROUNDING), 0.0, off)
