"""From time to distance: how far the vehicle has come, where that is trusted, and channels on a grid of distance.

Distance is the integral of a speed: of the channel that the recording states (`speed_source` in about.json), else of a
tachometer's, or of the refined speed from the bogie's own motion. It goes on over a standstill and over lost samples,
but what lies there is marked: nothing is made up.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import resample_poly

from estimators.interface import Missing
from estimators.signals.bands import settled, stretches
from estimators.signals.cubic_spline import at_even_places, means
from estimators.speed.smoothed_speed import smooth_speed
from estimators.speed.speed_refined import SpeedRefined
from estimators.vehicle.parameters import given
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements

SPACING = 0.125
"""Grid of distance, m (Ward et al. 2011, section 3.2)."""
FINEST = 64
"""Most fine cells in a cell of the grid."""
BLUR = 1.25
"""Reach of the anti-aliasing filter, m: ten cells."""
LONGEST_STEP = 0.05
"""Samples farther apart than this, s, have a gap between them (or 2.5 sample intervals where that is longer)."""
FLEETING = 1.0
"""A refined speed that is known for less than this, s, is not used."""
DISAGREE = 0.2
"""Share of the tachometer's speed by which the refined one may differ (slip, flats, a sensor that is wrong)."""
SURE = 0.01
"""Relative standard deviation of the refined speed up to which it is used beside a tachometer."""
STEADY = 3.0
"""Standard deviation of the weights over time, s, by which the ratio of refined speed and tachometer is smoothed: it is
the wheel's radius; after a standstill the refined speed swings by 4 % for three seconds."""
SpeedSource = Literal["tachometer", "refined"]
"""What an estimator takes the speed from; "tachometer" also stands for the source that the recording states."""
_STATED = "speed_source"  # key of about.json
NO_SPEED = (
    "a speed: add a tachometer ('wheelset1.speed [m/s]'), or name another channel by 'speed_source' in the map or "
    "--speed-source CHANNEL, or take --speed-source refined"
)
"""What is missing where no speed is there, and how to give it."""


@dataclass(frozen=True)
class Speeds:
    """A speed over time.

    Attributes
    ----------
    time : s, shape (n,).
    speed : m/s, NaN where it is not known, shape (n,).
    speed_std : m/s, shape (n,); None where the source states none.
    means : whether each speed is the mean since the sample before (pulses counted and timed), or that of the instant.
    """

    time: np.ndarray
    speed: np.ndarray
    speed_std: np.ndarray | None = None
    means: bool = True


@dataclass(frozen=True)
class Odometry:
    """Distance over time, and the grid.

    Attributes
    ----------
    knots : times, s, shape (k,), increasing.
    distance : at the knots, m, from 0 at the first, never decreasing, shape (k,).
    speed_at_knots : m/s, shape (k,).
    trusted : at the knots, whether the speed is measured and not below `slowest`, shape (k,).
    slowest : m/s.
    spacing : of the grid, m.
    speed_std : standard deviation of the speed at the knots, m/s, shape (k,); None where the source states none.
    source : what the speed is taken from: a channel, or "refined".
    """

    knots: np.ndarray
    distance: np.ndarray
    speed_at_knots: np.ndarray
    trusted: np.ndarray
    slowest: float
    spacing: float = SPACING
    speed_std: np.ndarray | None = field(default=None)
    source: str = ""

    @cached_property
    def s(self) -> np.ndarray:
        """The grid: 0, 0.125 ... m, shape (n,)."""
        return self.spacing * np.arange(int(np.floor(self.distance[-1] / self.spacing + 1e-9)) + 1)

    @cached_property
    def time(self) -> np.ndarray:
        """When the reference was at each place of the grid, s, shape (n,)."""
        forward = np.concatenate([[True], np.diff(self.distance) > 1e-9])
        return np.interp(self.s, self.distance[forward], self.knots[forward])

    @cached_property
    def speed(self) -> np.ndarray:
        """At each place of the grid, m/s, not below `slowest` (where it is, `valid` is False), shape (n,)."""
        return np.maximum(np.interp(self.time, self.knots, self.speed_at_knots), self.slowest)

    def speed_behind(self, distance: float) -> np.ndarray:
        """Speed at the places `distance` m before those of the grid, shape (n,); at an end that of the end."""
        return np.interp(self.s - distance, self.s, self.speed) if distance else self.speed

    @cached_property
    def valid(self) -> np.ndarray:
        """Whether the speed is measured and not too low around each place of the grid, shape (n,)."""
        return self.mark(self.knots, self.trusted)

    def stated(self) -> dict[str, object]:
        """For about.json: source of the speed and its standard deviation; nothing where the source states no error."""
        if self.speed_std is None:
            return {}
        return {"speed_source": self.source, "speed_std [m/s]": float(np.median(self.speed_std))}

    def distance_at(self, time: np.ndarray) -> np.ndarray:
        """Distance at any time, m."""
        return np.interp(time, self.knots, self.distance)

    def mark(self, time: np.ndarray, good: np.ndarray) -> np.ndarray:
        """Places of the grid at which samples at `time` are all `good` as far as the anti-aliasing filter reaches."""
        fault = np.zeros(len(self.s), dtype=bool)
        bad = ~np.asarray(good, dtype=bool)
        distance = self.distance_at(time)
        if bad.any():
            before = np.maximum(np.flatnonzero(bad) - 1, 0)
            after = np.minimum(np.flatnonzero(bad) + 1, len(time) - 1)
            low = np.floor(distance[before] / self.spacing).astype(int)
            high = np.ceil(distance[after] / self.spacing).astype(int) + 1
            change = np.zeros(len(self.s) + 1)
            np.add.at(change, np.clip(low, 0, len(self.s)), 1.0)
            np.add.at(change, np.clip(high, 0, len(self.s)), -1.0)
            fault = np.cumsum(change[:-1]) > 0.5
        inside = (self.s >= distance[0] - 1e-9) & (self.s <= distance[-1] + 1e-9)
        return settled(~fault & inside, self.spacing, BLUR)

    def channel(
        self, measurements: Measurements, name: str, ahead: float = 0.0, values: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """A measured channel on the grid, and where it is all measured; delays of the data sheet are taken out.

        Parameters
        ----------
        ahead : how far before the vehicle's reference the sensor stands, m: what it feels belongs to that place.
        values : what was made of the samples, to be taken in their stead; shape as they, or (rows, n) for several.
        """
        time = measurements.time(name) - data_sheet(measurements.about, name).delay
        samples = measurements[name]
        if values is None:
            return self.resample(time, samples, ahead)
        there = np.isfinite(samples)
        return self.resample(time, values if there.all() else np.where(there, values, np.nan), ahead)

    def resample(self, time: np.ndarray, values: np.ndarray, ahead: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Samples over time to the grid, without aliasing: values, and where they are valid, shape (n,).

        Lost samples (NaN, or missing in time) are bridged by a line or spline, and marked.

        Parameters
        ----------
        values : shape (k,), or (rows, k) for several at the same times; a sample that one row lacks is lost to all.
            Those on the grid have shape (n,) or (rows, n).
        """
        good = np.isfinite(values).reshape(-1, len(time)).all(axis=0)
        if good.sum() < 4:
            return np.zeros((*values.shape[:-1], len(self.s))), np.zeros(len(self.s), dtype=bool)
        apart = np.diff(time)
        usual = float(np.median(apart))
        wide = np.concatenate([[False], apart > max(LONGEST_STEP, 2.5 * usual)])
        fine = self._fineness(usual)
        distance, kept = self.distance_at(time), values
        if not good.all():
            distance, kept = distance[good], values[..., good]
        places, levels = _cells(distance + ahead, kept, self.spacing / fine)
        resampled = at_even_places(places, levels, self.spacing / fine, (len(self.s) - 1) * fine + 1)
        if fine > 1:
            resampled = resample_poly(resampled, 1, fine, axis=-1, window=_low_pass(fine), padtype="line")
        marked = self._shifted(self.mark(time, good & ~wide), ahead)
        return resampled[..., : len(self.s)], marked & self.valid

    @cached_property
    def _lowest(self) -> float:
        """Lowest speed that counts, m/s."""
        moving = self.speed_at_knots[self.trusted]
        return max(float(np.quantile(moving, 0.01)) if moving.size else self.slowest, self.slowest)

    def _fineness(self, step: float) -> int:
        """How many cells of one sample each (a `step` of time, s), at the lowest speed, make one of the grid."""
        return int(np.clip(np.ceil(self.spacing / (self._lowest * step)), 1, FINEST))

    def _shifted(self, mark: np.ndarray, ahead: float) -> np.ndarray:
        count = round(ahead / self.spacing)
        moved = np.roll(mark, count)
        if count > 0:
            moved[:count] = False
        elif count < 0:
            moved[count:] = False
        return moved


def integrate_speed(
    measurements: Measurements, source: SpeedSource = "tachometer", slowest: float = 1.0, spacing: float = SPACING
) -> Odometry:
    """How far the vehicle came.

    Parameters
    ----------
    source : "tachometer": the channel that the recording states as `speed_source`, else the first tachometer (its
        wheel radius errors stay in); "refined": estimator `speed_refined` on the same record, and where that gives
        nothing (below 3 m/s, at the start) that channel scaled to agree, if there is one.
    slowest : below this speed (m/s) places are marked invalid.

    Raises
    ------
    InputError : no such source in the recording, or no sample of it.
    """
    source = _resolved(measurements, source)
    speeds = _SOURCES[source](measurements)
    time, speed = speeds.time, speeds.speed
    good = np.isfinite(speed)
    if good.sum() < 2:
        raise InputError(f"the {source} gives no speed; check that channel, or use another 'speed_source'")
    step = np.diff(time)
    longest = max(LONGEST_STEP, 2.5 * float(np.median(step)))
    filled = np.interp(time, time[good], speed[good])
    mean = filled[1:] if speeds.means else (filled[1:] + filled[:-1]) / 2
    mean = np.where(step > longest, (filled[1:] + filled[:-1]) / 2, mean)
    distance = np.concatenate([[0.0], np.cumsum(np.maximum(mean, 0.0) * step)])
    trusted = good & (filled >= slowest)
    lost = step > longest
    trusted[1:] &= ~lost
    trusted[:-1] &= ~lost
    if distance[-1] < 4 * spacing:
        raise InputError(f"the vehicle moves by {distance[-1]:.2f} m only; give a record of a moving vehicle")
    name = "refined" if source == "refined" else str(speed_channel(measurements))
    return Odometry(time, distance, filled, trusted, slowest, spacing, speeds.speed_std, name)


def missing_speed(measurements: Measurements, source: SpeedSource = "tachometer") -> Missing:
    """What `integrate_speed` needs for that source and the recording does not have."""
    if _resolved(measurements, source) == "refined":
        return SpeedRefined().missing(measurements)
    name = speed_channel(measurements)
    if name is None:
        return Missing(others=(NO_SPEED,))
    turns = name.endswith("[rad/s]")
    return Missing(parameters=("wheel_radius",) if turns and not given(measurements.vehicle, ("wheel_radius",)) else ())


def speed_channel(measurements: Measurements) -> str | None:
    """The channel that the recording states as its speed source, else the first tachometer's; None where none is.

    Raises
    ------
    InputError : the stated one is not there, or is no speed.
    """
    stated = measurements.about.get(_STATED)
    if stated is None or stated == "refined":
        return _tachometer_channel(measurements)
    if stated not in measurements:
        raise InputError(f"{_STATED}: no channel '{stated}'; there are: {', '.join(measurements.channels)}, or refined")
    if not str(stated).endswith(("[m/s]", "[rad/s]")):
        raise InputError(f"{_STATED}: '{stated}' is no speed; give a channel in m/s, or a wheel's in rad/s")
    return str(stated)


def states_speed(measurements: Measurements) -> bool:
    """Whether the recording itself states a channel that the speed is to be taken from."""
    return measurements.about.get(_STATED) not in (None, "refined") and speed_channel(measurements) is not None


def _resolved(measurements: Measurements, source: SpeedSource) -> SpeedSource:
    """The recording's statement goes before the estimator's default."""
    return "refined" if measurements.about.get(_STATED) == "refined" else source


def _tachometer_channel(measurements: Measurements) -> str | None:
    names = [name for name in measurements.channels if name.startswith("wheelset")]
    speeds = [name for name in names if name.endswith(".speed [m/s]")]
    spins = [name for name in names if name.endswith(".wheel_speed [rad/s]")]
    return next(iter(speeds + spins), None)


def channel_speeds(measurements: Measurements) -> Speeds:
    """Speed by `speed_channel`.

    A tachometer's are taken as they are. Samples of a receiver, or of any other column, are smoothed: their standard
    deviation is the data sheet's `speed_std` or noise, else what they scatter by.

    Raises
    ------
    InputError : there is no such channel.
    """
    name = speed_channel(measurements)
    if name is None:
        raise InputError(f"the distance needs {NO_SPEED}")
    sheet = data_sheet(measurements.about, name)
    time, values = measurements.time(name), np.asarray(measurements[name])
    if name.endswith("[rad/s]"):
        values = values * float(measurements.vehicle.get("wheel_radius", np.nan))
    if name.startswith("wheelset") or sheet.kind == "tachometer":
        return Speeds(time, values)
    given = sheet.stated.get("speed_std")
    std = float(given) if isinstance(given, int | float) else None
    if std is None and sheet.states("noise_density"):
        std = float(np.sqrt(sheet.variance(measurements.rate(name))))
    longest = 2.5 / measurements.rate(name)
    smooth = smooth_speed(time - sheet.delay, values, LONGEST_STEP, longest, std)
    return Speeds(smooth.time, smooth.speed, smooth.speed_std, means=False)


def _refined(measurements: Measurements) -> Speeds:
    """The refined speed; with another channel of speed, that one times how much the refined speed is of it.

    Where the refined speed is not sure (around a standstill), the ratio goes on from one sure place to the next, so
    that nothing jumps there: a jump would be read as an acceleration, which pitches the bogie.
    """
    series = SpeedRefined().estimate(measurements).series
    time = series["time [s]"].to_numpy()
    speed = np.where(series["valid [-]"].to_numpy() > 0.5, series["speed [m/s]"].to_numpy(), np.nan)
    speed = _lasting(time, speed)
    if speed_channel(measurements) is None:
        return Speeds(time, speed)
    other = channel_speeds(measurements)
    wheel = np.interp(time, other.time, other.speed)
    sure = np.isfinite(speed) & (wheel > 3.0) & (series["speed_std [m/s]"].to_numpy() < SURE * speed)
    if not sure.any():
        return Speeds(time, wheel)
    ratio = np.divide(speed, wheel, out=np.ones(len(time)), where=sure)
    scale = float(np.median(ratio[sure]))
    sure &= np.abs(ratio - scale) <= DISAGREE * scale
    weight = np.divide(speed, series["speed_std [m/s]"].to_numpy(), out=np.zeros(len(time)), where=sure) ** 2
    reach = STEADY * (len(time) - 1) / (time[-1] - time[0])
    mean = gaussian_filter1d(weight * ratio, reach)[sure] / gaussian_filter1d(weight, reach)[sure]
    return Speeds(time, wheel * np.interp(time, time[sure], mean))


def _lasting(time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Speeds less those known for less than `FLEETING`: at standstill, noise may look like a speed for a moment."""
    kept = speed.copy()
    for first, last in stretches(np.isfinite(speed)):
        if time[last - 1] - time[first] < FLEETING:
            kept[first:last] = np.nan
    return kept


_SOURCES: dict[str, Callable[[Measurements], Speeds]] = {
    "tachometer": channel_speeds,
    "refined": _refined,
}


def _cells(distance: np.ndarray, values: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean place and value of the samples in every cell that has some; places increase strictly."""
    cell = np.floor(distance / width).astype(np.int64)
    first = np.flatnonzero(np.diff(cell, prepend=cell[0] - 1))
    if len(first) == len(cell):
        return distance, values
    return means(distance, first), means(values, first)


@lru_cache(maxsize=FINEST)
def _low_pass(fine: int) -> np.ndarray:
    """Anti-aliasing filter by which `fine` cells make one of the grid: that of `scipy.signal.resample_poly`."""
    length = 20 * fine + 1
    places = np.arange(length) - 10 * fine
    taps = np.sinc(places / fine) * np.kaiser(length, 5.0)
    return taps / taps.sum()
