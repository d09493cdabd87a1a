"""Kinds of fault, put into a recording at random; each says what it did, where and how large it is."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.measurements import TIME, Measurements
from railsim.quality.draft import tables_of

ACCELEROMETERS = [f"{place}.acceleration_{axis} [m/s2]" for place in ("bogie", "bogie_lead") for axis in "xyz"]
GYROS = [f"bogie.rate_{axis} [rad/s]" for axis in ("roll", "pitch", "yaw")]
TRANSDUCERS = [f"primary1_{side}.displacement [m]" for side in ("left", "right")]
BOXES = [f"axlebox{box}.acceleration_{axis} [m/s2]" for box in ("1_left", "1_right", "2_left") for axis in "yz"]
TACHOMETERS = ["wheelset1", "wheelset2"]
CHANNELS = [*ACCELEROMETERS, *GYROS, *TRANSDUCERS, *BOXES]
SWAPS = [
    *(
        (ACCELEROMETERS[i], ACCELEROMETERS[j])
        for i, j in ((0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (4, 5), (2, 5), (1, 4))
    ),
    *((GYROS[i], GYROS[j]) for i, j in ((0, 1), (0, 2), (1, 2))),
    (TRANSDUCERS[0], TRANSDUCERS[1]),
    (BOXES[1], BOXES[3]),
    (BOXES[0], BOXES[1]),
]
"""Exchanges that are made: two axes of a sensor, or two sensors."""


@dataclass(frozen=True)
class Fault:
    """What was done: kind as `railsim inspect` names it, channels, s from and to, size in words."""

    kind: str
    channels: tuple[str, ...]
    start: float
    end: float
    size: str


class Spoiler:
    """A recording's tables, to be spoilt; `rng` chooses channel, place and size."""

    def __init__(self, measured: Measurements, rng: np.random.Generator) -> None:
        self.measured, self.rng = measured, rng
        self.tables = tables_of(measured)

    def choose(self, names: list[str]) -> tuple[str, np.ndarray, float]:
        """One of the names, its samples (to be changed in place) and its rate."""
        name = str(self.rng.choice(names))
        rate = self.measured.rate(name)
        return name, self.tables[rate][name], rate

    def stretch(self, rate: float, shortest: float, longest: float) -> slice:
        """A stretch of random length [s] that leaves 3 s at both ends of the record."""
        length = self.rng.uniform(shortest, longest)
        total = min(t[TIME].size / r for r, t in self.tables.items())
        start = self.rng.uniform(3.0, total - length - 3.0)
        return slice(round(start * rate), round((start + length) * rate))

    def errors(self, name: str, key: str) -> float:
        """A number of the data sheet."""
        return data_sheet(self.measured.about, name).error(key)

    def done(self, kind: str, names: tuple[str, ...], part: slice | np.ndarray, size: str) -> Fault:
        """The fault in the first of the channels at these samples."""
        name = names[0]
        time = self.measured.time(name) if name in self.measured else next(iter(self.tables.values()))[TIME]
        inside = time[part]
        return Fault(kind, names, float(inside[0]), float(inside[-1]), size)

    def result(self) -> Measurements:
        """The spoilt recording."""
        return Measurements(self.measured.about, self.tables, self.measured.track)


def _zero(spoiler: Spoiler, name: str) -> float:
    """An offset: 12 to 25 standard deviations of the data sheet (bias and gravity by misalignment), 10 to 20 mm."""
    size = spoiler.rng.uniform(12.0, 25.0) * float(spoiler.rng.choice([-1.0, 1.0]))
    if name in TRANSDUCERS:
        return size * 8e-4
    tilt = spoiler.errors(name, "misalignment_std") * GRAVITY if name not in GYROS else 0.0
    return size * float(np.hypot(spoiler.errors(name, "bias_std"), tilt))


def offset(spoiler: Spoiler) -> Fault:
    """The zero is off throughout."""
    name, values, _ = spoiler.choose([*ACCELEROMETERS, *GYROS, *TRANSDUCERS])
    size = _zero(spoiler, name)
    values += size
    return spoiler.done("offset", (name,), slice(None), f"{size:+.3g}")


def offset_step(spoiler: Spoiler) -> Fault:
    """The zero is off from somewhere to somewhere, or to the end."""
    name, values, rate = spoiler.choose([*ACCELEROMETERS, *GYROS, *TRANSDUCERS])
    part = spoiler.stretch(rate, 3.5, 15.0)
    if spoiler.rng.uniform() < 0.5:
        part = slice(part.start, values.size)
    size = _zero(spoiler, name)
    values[part] += size
    return spoiler.done("offset step", (name,), part, f"{size:+.3g}")


def gain_change(spoiler: Spoiler) -> Fault:
    """Half to 0.8 or 1.25 to 2 times the true value, from somewhere to somewhere, or to the end."""
    name, values, rate = spoiler.choose([*ACCELEROMETERS, *GYROS, *TRANSDUCERS, BOXES[1], BOXES[3]])
    part = spoiler.stretch(rate, 3.5, 15.0)
    if spoiler.rng.uniform() < 0.5:
        part = slice(part.start, values.size)
    factor = spoiler.rng.uniform(1.25, 2.0) ** float(spoiler.rng.choice([-1.0, 1.0]))
    values[part] *= factor
    return spoiler.done("gain change", (name,), part, f"times {factor:.3g}")


def noise(spoiler: Spoiler) -> Fault:
    """White noise of 6 to 20 times the quietest density of the channel's upper spectrum, or of the data sheet's."""
    name, values, rate = spoiler.choose(CHANNELS)
    part = spoiler.stretch(rate, 3.0, 12.0)
    size = spoiler.rng.uniform(6.0, 20.0) * max(spoiler.errors(name, "noise_density"), _quietest(values, rate))
    values[part] += size * np.sqrt(rate / 2) * spoiler.rng.standard_normal(values[part].size)
    return spoiler.done("noise", (name,), part, f"{size:.3g}/sqrt(Hz)")


def _quietest(values: np.ndarray, rate: float) -> float:
    """Smallest amplitude density above 30 % of half the rate, in tenths of the band."""
    power = (
        np.abs(np.fft.rfft((values - values.mean()) * np.hanning(values.size))) ** 2 * 2 / (0.375 * rate * values.size)
    )
    return float(np.sqrt(min(part.mean() for part in np.array_split(power[int(0.3 * power.size) : -8], 10))))


def stuck(spoiler: Spoiler) -> Fault:
    """The last value is held."""
    name, values, rate = spoiler.choose(CHANNELS)
    part = spoiler.stretch(rate, 0.5, 6.0)
    first = part.start - int(np.argmax(values[part.start :: -1] != 0.0))  # a value held at zero would be null
    values[first : part.stop] = values[first]
    return spoiler.done("stuck", (name,), slice(first, part.stop), "held")


def null(spoiler: Spoiler) -> Fault:
    """Zeros."""
    name, values, rate = spoiler.choose(CHANNELS)
    part = spoiler.stretch(rate, 0.5, 6.0)
    values[part] = 0.0
    return spoiler.done("null", (name,), part, "zero")


def drop_out(spoiler: Spoiler) -> Fault:
    """Samples of a channel are lost, or rows of a table."""
    name, values, rate = spoiler.choose(CHANNELS)
    part = spoiler.stretch(rate, 0.1, 4.0)
    fault = spoiler.done("drop-out", (name,), part, "lost samples")
    if spoiler.rng.uniform() < 0.5:
        values[part] = np.nan
        return fault
    table = spoiler.tables[rate]
    for column in list(table):
        table[column] = np.delete(table[column], part)
    return Fault("drop-out", (f"{TIME} at {rate:g} Hz",), fault.start, fault.end, "missing rows")


def spikes(spoiler: Spoiler) -> Fault:
    """3 to 8 single samples, 8 to 15 standard deviations of the channel off."""
    name, values, rate = spoiler.choose(CHANNELS)
    part = spoiler.stretch(rate, 2.0, 15.0)
    count = int(spoiler.rng.integers(3, 9))
    at = np.sort(spoiler.rng.choice(np.arange(part.start, part.stop), count, replace=False))
    size = spoiler.rng.uniform(8.0, 15.0) * float(values.std())
    values[at] += size * spoiler.rng.choice([-1.0, 1.0], count)
    return spoiler.done("spikes", (name,), at, f"{size:.3g}")


def saturation(spoiler: Spoiler) -> Fault:
    """A range too small: 0.5 to 3 % of the samples are cut off on one side or on both."""
    name, values, _ = spoiler.choose(CHANNELS)
    share = spoiler.rng.uniform(0.005, 0.03)
    low, high = np.quantile(values, [share / 2, 1 - share / 2])
    side = int(spoiler.rng.integers(3))
    cut = np.clip(values, -np.inf if side == 1 else low, np.inf if side == 2 else high)
    changed = np.flatnonzero(cut != values)
    values[:] = cut
    return spoiler.done("saturation", (name,), changed, f"{100 * changed.size / values.size:.2g} %")


def clock(spoiler: Spoiler) -> Fault:
    """Time stamps of a table scatter by 8 to 25 % of a step; the samples are where they were."""
    rate = float(spoiler.rng.choice([256.0, 1024.0, 64.0]))
    table = spoiler.tables[rate]
    part = spoiler.stretch(rate, 3.0, 12.0)
    size = spoiler.rng.uniform(0.08, 0.25)
    scatter = np.clip(size * spoiler.rng.standard_normal(table[TIME][part].size), -0.48, 0.48)
    inside = table[TIME][part]
    fault = Fault("clock", (f"{TIME} at {rate:g} Hz",), float(inside[0]), float(inside[-1]), f"{size:.2g} steps")
    table[TIME][part] += scatter / rate
    table[TIME] = np.maximum.accumulate(table[TIME] + 1e-9 * np.arange(table[TIME].size))
    return fault


def clock_shift(spoiler: Spoiler) -> Fault:
    """The axleboxes' logger begins 20 to 300 ms late and stamps from zero on, so that all of it comes too early."""
    rate = spoiler.measured.rate(BOXES[0])
    table = spoiler.tables[rate]
    count = round(spoiler.rng.uniform(0.02, 0.3) * rate)
    for column in list(table):
        table[column] = table[column][:-count] if column == TIME else table[column][count:]
    ends = float(table[TIME][0]), float(table[TIME][-1])
    return Fault("clock shift", (f"{TIME} at {rate:g} Hz",), *ends, f"{1e3 * count / rate:.0f} ms early")


def swapped(spoiler: Spoiler) -> Fault:
    """Two channels exchanged."""
    first, second = SWAPS[int(spoiler.rng.integers(len(SWAPS)))]
    table = spoiler.tables[spoiler.measured.rate(first)]
    table[first], table[second] = table[second], table[first]
    return spoiler.done("swapped", (first, second), slice(None), "-")


def inverted(spoiler: Spoiler) -> Fault:
    """The sign turned round; of the bogie centre's longitudinal axis only where the speed changes, else it measures
    nothing but noise.
    """
    speed = spoiler.measured["gnss.speed [m/s]"]
    driven = float(np.ptp(speed)) > 3.0
    name, values, _ = spoiler.choose([one for one in CHANNELS if driven or one != ACCELEROMETERS[0]])
    values *= -1.0
    return spoiler.done("inverted", (name,), slice(None), "-")


def tachometer(spoiler: Spoiler) -> Fault:
    """Wrong diameter, 9 to 25 % off throughout; or 20 to 60 % of the pulses missing for a while."""
    sensor = str(spoiler.rng.choice(TACHOMETERS))
    name = f"{sensor}.speed [m/s]"
    table = spoiler.tables[spoiler.measured.rate(name)]
    part, factor = slice(None), 1 + spoiler.rng.uniform(0.09, 0.25) * float(spoiler.rng.choice([-1.0, 1.0]))
    if spoiler.rng.uniform() < 0.5:
        factor = 1 - spoiler.rng.uniform(0.2, 0.6)
        moving = np.flatnonzero(table[name] > 5.0)
        length = round(spoiler.rng.uniform(1.5, 6.0) * 64)
        first = int(spoiler.rng.choice(moving[(moving > 192) & (moving < table[name].size - 192 - length)]))
        part = slice(first, first + length)
    for column in (name, f"{sensor}.wheel_speed [rad/s]"):
        table[column][part] *= factor
    return spoiler.done("tachometer", (name,), part, f"times {factor:.3g}")


FAULTS: dict[str, Callable[[Spoiler], Fault]] = {
    "offset": offset,
    "offset step": offset_step,
    "gain change": gain_change,
    "noise": noise,
    "stuck": stuck,
    "null": null,
    "drop-out": drop_out,
    "spikes": spikes,
    "saturation": saturation,
    "clock": clock,
    "clock shift": clock_shift,
    "swapped": swapped,
    "inverted": inverted,
    "tachometer": tachometer,
}
"""By kind: what puts it in."""
