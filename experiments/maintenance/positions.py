"""Where an estimate's rows lie on the earth: latitude and longitude of its recording over time."""

from dataclasses import dataclass

import numpy as np

from railsim.errors import InputError
from railsim.measurements import Measurements

RADIUS = 6_371_000.0
"""m, mean radius of the earth (IUGG)."""
LONGEST_GAP = 20.0
"""s between fixes over which nothing is known of the place; a straight line between them may leave the track."""
JITTER = 25.0
"""m from the last counted fix, below which a fix is no movement: a receiver's position wanders at a standstill."""
_ENDS = (".latitude [deg]", ".longitude [deg]")


@dataclass(frozen=True)
class Positions:
    """Fixes of a receiver.

    Attributes
    ----------
    source : name of the sensor.
    time : s, increasing, shape (n,).
    latitude, longitude : deg, known at all times; longitudes go on beyond 180 deg, shape (n,).
    """

    source: str
    time: np.ndarray
    latitude: np.ndarray
    longitude: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """(longitude, latitude) at times, deg, NaN where no fix is near, shape (m, 2)."""
        found = np.column_stack([np.interp(time, self.time, self.longitude), np.interp(time, self.time, self.latitude)])
        after = np.clip(np.searchsorted(self.time, time), 1, self.time.size - 1)
        before = after - 1
        near = np.minimum(np.abs(time - self.time[before]), np.abs(self.time[after] - time)) <= 1e-6
        inside = (time >= self.time[0]) & (time <= self.time[-1])
        known = near | (inside & (self.time[after] - self.time[before] <= LONGEST_GAP))
        found[~known] = np.nan
        found[:, 0] = (found[:, 0] + 180.0) % 360.0 - 180.0
        return found

    def distance(self, time: np.ndarray) -> np.ndarray:
        """Way at times from the first fix, m, by fixes that lie at least `JITTER` apart, shape (m,)."""
        x = np.radians(self.longitude) * np.cos(np.radians(self.latitude.mean())) * RADIUS
        y = np.radians(self.latitude) * RADIUS
        places, steps, last = [0], [0.0], 0
        for row in range(1, x.size):
            step = float(np.hypot(x[row] - x[last], y[row] - y[last]))
            if step >= JITTER or row == x.size - 1:
                places.append(row)
                steps.append(step)
                last = row
        return np.interp(time, self.time[places], np.cumsum(steps))


def positions_of(seen: Measurements) -> Positions:
    """Latitude and longitude of the first sensor that has both.

    Raises
    ------
    InputError : no sensor has both, or fewer than two fixes are known.
    """
    heads = [name.removesuffix(_ENDS[0]) for name in seen.channels if name.endswith(_ENDS[0])]
    source = next((head for head in heads if head + _ENDS[1] in seen), None)
    if source is None:
        raise InputError(
            "the recording holds no latitude and longitude, so nothing can be drawn on a map; map "
            "'gnss.latitude [deg]' and 'gnss.longitude [deg]' on import (docs/field_data.md), or export to .csv"
        )
    latitude, longitude = seen[source + _ENDS[0]], seen[source + _ENDS[1]]
    time = seen.time(source + _ENDS[0])
    if longitude.size != latitude.size:
        raise InputError(f"'{source}' has latitude and longitude at different rates; map them in one table")
    good = np.isfinite(latitude) & np.isfinite(longitude) & (np.abs(latitude) <= 90) & (np.abs(longitude) <= 360)
    if good.sum() < 2:
        raise InputError(f"'{source}' knows its place {int(good.sum())} times only; a map needs two fixes or more")
    return Positions(source, time[good], latitude[good], np.unwrap(longitude[good], period=360.0))
