"""True wheel-rail geometry of a run, from its own channels: conicity as a function of the lateral shift y - d.

Two conicities are told apart. The secant one is what equation (1) of Ward et al. (2011) defines, half the difference
of the rolling radii over y - d; the local one is the slope of that half difference. Both are functions of y - d only
where the gauge is constant; with gauge variation the table holds their means at each shift.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from railsim.profiles.conicity import equivalent_conicity
from railsim.truth import Truth

CELL = 2.5e-5
"""Width of the cells in which rolling radii are averaged over the shift of a wheel, m."""
BIN = 2.5e-4
"""Width of the bins of y - d in which conicity is stated, m."""
FEWEST = 20
"""Samples of the truth that a bin needs."""


@dataclass(frozen=True)
class ContactTruth:
    """Contact of one wheelset over time; all arrays (n,).

    Attributes
    ----------
    time : s. shift : y less the mean lateral position of the rails, m. gauge : deviation of the rails' distance, m.
    half_difference : half the rolling radius left less right, m. sum_of_radii : m.
    sum_of_angles, difference_of_angles : of the contact angles as positive towards the flanges, rad.
    local : slope of the half difference by the shift of the wheelset's centre, roll included (-).
    track : mean lateral position of the rails, m.
    """

    time: np.ndarray
    shift: np.ndarray
    gauge: np.ndarray
    half_difference: np.ndarray
    sum_of_radii: np.ndarray
    sum_of_angles: np.ndarray
    difference_of_angles: np.ndarray
    local: np.ndarray
    track: np.ndarray

    def effective(self, window: float) -> np.ndarray:
        """Conicity of the cone that fits best within a moving window of `window` s: sum of D x over sum of x^2 (-)."""
        count = max(1, round(window / (self.time[1] - self.time[0])))

        def moving(values: np.ndarray) -> np.ndarray:
            total = np.concatenate([[0.0], np.cumsum(values)])
            low = np.clip(np.arange(len(values)) - count // 2, 0, None)
            high = np.clip(np.arange(len(values)) + count - count // 2, None, len(values))
            return total[high] - total[low]

        return moving(self.half_difference * self.shift) / np.maximum(moving(self.shift**2), 1e-15)

    @cached_property
    def table(self) -> pd.DataFrame:
        """Columns "shift [m]", "secant [-]", "local [-]", "local_spread [-]" (by gauge), "share [-]" of the time."""
        number = np.round(self.shift / BIN).astype(int)
        rows = []
        for bin_number in np.unique(number):
            inside = number == bin_number
            if inside.sum() >= FEWEST:
                x, half, local = self.shift[inside], self.half_difference[inside], self.local[inside]
                secant = float(half @ x / (x @ x)) if bin_number else float(local.mean())
                rows.append((bin_number * BIN, secant, local.mean(), local.std(), inside.mean()))
        return pd.DataFrame(rows, columns=["shift [m]", "secant [-]", "local [-]", "local_spread [-]", "share [-]"])

    def equivalent(self, amplitude: float) -> float:
        """Equivalent conicity (EN 15302) at an amplitude in m; NaN where the run did not reach it on both sides."""
        table = self.table
        shift = table["shift [m]"].to_numpy()
        difference = 2.0 * table["secant [-]"].to_numpy() * shift
        return float(equivalent_conicity(shift, difference, np.array([amplitude]))[0])


def contact_truth(truth: Truth, wheelset: int = 1) -> ContactTruth:
    """Read one wheelset's contact.

    Raises
    ------
    InputError : the run has no such wheelset.
    """
    left, right = (f"wheel{wheelset}_{side}" for side in ("left", "right"))
    rails = [truth[f"track{wheelset}.{side}_lateral [m]"] for side in ("left", "right")]
    radius = [truth[f"{wheel}.rolling_radius [m]"] for wheel in (left, right)]
    angle = [truth[f"{wheel}.contact_angle [rad]"] for wheel in (left, right)]
    slope = [
        _slope(truth[f"{wheel}.lateral_shift [m]"], values) for wheel, values in zip((left, right), radius, strict=True)
    ]
    vehicle = truth.about["vehicle"]
    r0, arm = float(vehicle["wheel_radius [m]"]), float(vehicle["half_gauge [m]"])
    roll = (np.tan(angle[0]) - np.tan(angle[1])) / (2.0 * arm)  # by the shift of the wheels
    return ContactTruth(
        time=truth.time,
        shift=truth[f"wheelset{wheelset}.y [m]"] - (rails[0] + rails[1]) / 2.0,
        gauge=rails[0] - rails[1],
        half_difference=(radius[0] - radius[1]) / 2.0,
        sum_of_radii=radius[0] + radius[1],
        sum_of_angles=angle[0] - angle[1],
        difference_of_angles=angle[0] + angle[1],
        local=(slope[0] - slope[1]) / 2.0 / (1.0 - r0 * roll),
        track=(rails[0] + rails[1]) / 2.0,
    )


def _slope(shift: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Change of the rolling radius by the shift of the wheel, at every sample: means of narrow cells, differences."""
    cell = np.round(shift / CELL).astype(int)
    numbers, index, count = np.unique(cell, return_inverse=True, return_counts=True)
    if len(numbers) < 3:
        return np.zeros_like(shift)
    middle = np.bincount(index, shift) / count
    slope = np.gradient(np.bincount(index, radius) / count, middle)
    return np.interp(shift, middle, slope)
