"""True wheel-rail geometry of a run, from its own channels: conicity as a function of the lateral shift on the rails.

The shift is that of the wheels where they touch the rails, u = y + r roll - d: a wheel of radius r hangs below the
axle, so a roll carries its tread to the left by r roll. Rolling radii follow from u alone where the gauge is constant,
whatever the cross level, which rolls wheelset and rails together and moves y by -r roll. Without slip u' = V yaw and
yaw' = -V D / (r l), D half the difference of the rolling radii and l half the contacts' distance, so that a cone of
slope lambda runs in Klingel's wave, 2 pi sqrt(r l / lambda): D / u is the conicity that guides (Klingel 1883; Wickens
2003, section 2.5). y - d in the place of u, as if the axle lay on the rails, makes it larger by 1 / (1 - r delta / l),
delta the contact angle, and with cross level it is no function of y - d at all.

Two conicities are told apart. The secant one is half the difference of the rolling radii over u, as equation (1) of
Ward et al. (2011) has it; the local one is the slope of that half difference. With gauge variation the table holds
their means at each shift.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.profiles.conicity import equivalent_conicity
from railsim.truth import Truth

CELL = 2.5e-5
"""Width of the cells in which rolling radii are averaged over the shift of a wheel, m."""
BIN = 2.5e-4
"""Width of the bins of the shift in which conicity is stated, m."""
FEWEST = 20
"""Samples of the truth that a bin needs."""


@dataclass(frozen=True)
class ContactTruth:
    """Contact of one wheelset over time; all arrays (n,).

    Attributes
    ----------
    time : s. shift : of the wheels on the rails, `contact_shift`, m. gauge : deviation of the rails' distance, m.
    half_difference : half the rolling radius left less right, m. sum_of_radii : m.
    sum_of_angles, difference_of_angles : of the contact angles as positive towards the flanges, rad.
    local : slope of the half difference by the shift (-).
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
    return ContactTruth(
        time=truth.time,
        shift=contact_shift(truth, wheelset),
        gauge=rails[0] - rails[1],
        half_difference=(radius[0] - radius[1]) / 2.0,
        sum_of_radii=radius[0] + radius[1],
        sum_of_angles=angle[0] - angle[1],
        difference_of_angles=angle[0] + angle[1],
        local=(slope[0] - slope[1]) / 2.0,
        track=(rails[0] + rails[1]) / 2.0,
    )


def contact_shift(truth: Truth, wheelset: int = 1) -> np.ndarray:
    """Lateral shift of a wheelset's wheels on the rails where they touch, m, (n,).

    Raises
    ------
    InputError : the run has no such wheelset, or does not state its wheels' radius.
    """
    radius = truth.about.get("vehicle", {}).get("wheel_radius [m]")
    if radius is None:
        raise InputError("the run's vehicle states no 'wheel_radius [m]'; simulate it again")
    left, right = (truth[f"track{wheelset}.{side}_lateral [m]"] for side in ("left", "right"))
    hanging = truth[f"wheelset{wheelset}.y [m]"] + float(radius) * truth[f"wheelset{wheelset}.roll [rad]"]
    return hanging - (left + right) / 2.0


def cone_of(shift: np.ndarray, half_difference: np.ndarray) -> float:
    """Slope of the cone that fits best (-), a mean shift and difference left aside; NaN where nothing shifts."""
    moved = shift - shift.mean()
    power = float(moved @ moved)
    return float(moved @ half_difference) / power if power > 0.0 else float("nan")


def _slope(shift: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Change of the rolling radius by the shift of the wheel, at every sample: means of narrow cells, differences."""
    cell = np.round(shift / CELL).astype(int)
    numbers, index, count = np.unique(cell, return_inverse=True, return_counts=True)
    if len(numbers) < 3:
        return np.zeros_like(shift)
    middle = np.bincount(index, shift) / count
    slope = np.gradient(np.bincount(index, radius) / count, middle)
    return np.interp(shift, middle, slope)
