"""Time stamps: jitter against an even grid."""

from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._grid import ROUNDING, gridded, times
from railsim.quality._signals import NORMAL
from railsim.quality.draft import clock_name
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Regrid
from railsim.spec import quantity
from railsim.stamps import resolution_of

HALF = 0.51  # of the last digit: by which rounding moves a stamp, and what the grid's own error adds


class Clock(Check, frozen=True):
    """Stamps that leave the grid of the stated rate, by more than they are rounded by."""

    jitter: float = quantity(0.02, unit="steps, largest deviation", source="illustrative: a delay of 0.08 ms at 256 Hz")

    stage: ClassVar[int] = 0

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a table whose times scatter about the grid."""
        findings = []
        for rate, time in times(measurements).items():
            off = deviation(time, rate)
            wrong = np.flatnonzero(np.abs(off) > self.jitter)
            if wrong.size < 4:
                continue
            size = float(np.sqrt(np.mean(off[wrong[0] : wrong[-1] + 1] ** 2))) / rate
            on_grid = gridded(time, rate)
            if float(np.abs(off).max()) / rate <= HALF * (rounding := resolution_of(time)):
                findings.append(_rounded(rate, on_grid, rounding))
                continue
            findings.append(
                Finding(
                    "clock",
                    clock_name(rate),
                    float(on_grid[wrong[0]]),
                    float(on_grid[wrong[-1]]),
                    f"stamps scatter by {1e3 * size:.2g} ms about an even grid ({wrong.size} of {time.size})",
                    "use even times where the sensor's own clock samples, resample where the stamps are right",
                    repair=Regrid(),
                )
            )
        return findings


def _rounded(rate: float, on_grid: np.ndarray, rounding: float) -> Finding:
    """A note that stamps are even but for their last digit."""
    return Finding(
        "rounded",
        clock_name(rate),
        float(on_grid[0]),
        float(on_grid[-1]),
        f"stamps are rounded to {rounding:g} s and lie on an even grid but for that",
        "'repair: [snap]' in the map puts them on it, which matters only where phases between tables do",
        severity="note",
    )


def deviation(time: np.ndarray, rate: float) -> np.ndarray:
    """Of the stamps from the even grid, in steps, shape (n,)."""
    off = (time - gridded(time, rate)) * rate
    floor = 3 * NORMAL * float(np.median(np.abs(off - np.median(off))))
    return np.where(np.abs(off) < min(floor, ROUNDING), 0.0, off)
