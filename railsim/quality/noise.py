"""Noise against the data sheet, in the part of the spectrum where the vehicle is quietest."""

from typing import ClassVar

import numpy as np
from scipy.ndimage import median_filter

from railsim.measurements import Measurements
from railsim.quality._offsets import axis_of
from railsim.quality._signals import filled, kind_of, limit, runs, sheet
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Mask
from railsim.spec import quantity

_BLOCK = 0.25  # s
_BANDS = 5
_LOWEST = 0.3
"""Of half the sample rate: where the quiet bands begin."""


class Noise(Check, frozen=True):
    """White noise fills every band of the spectrum; vibration of the vehicle does not, and it reaches all channels.

    Suspicious is a stretch in which even the quietest band of a channel is `factor` times the data sheet's density and
    `factor` times this channel's usual level, and more so than in the other channels of the same body; and than in any
    that is alike and along the same axis, for vibration along an axis reaches all of them.
    """

    factor: float = quantity(2.5, unit="- of the amplitude", source="illustrative: 16 dB above chance", gt=1)
    shortest: float = quantity(1.5, unit="s", source="illustrative", gt=0)
    whole: float = quantity(30.0, unit="- of the amplitude, for a whole record", source="illustrative", gt=1)

    stage: ClassVar[int] = 5

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a stretch."""
        floors = {name: floor for name in measurements if (floor := _floor(measurements, name)) is not None}
        findings = []
        for name, floor in floors.items():
            beside = [
                other for other in floors if other != name and _body(measurements, other) == _body(measurements, name)
            ]
            along = [floors[other] for other in beside if _alike(measurements, other, name)]
            findings += self._channel(measurements, name, floor, [floors[other] for other in beside], along)
        return findings

    def _channel(
        self, measured: Measurements, name: str, floor: np.ndarray, others: list[np.ndarray], along: list[np.ndarray]
    ) -> list[Finding]:
        """`others`: floors of all other channels of the body. `along`: of those that feel the same vibration."""
        usual = max(1.0, float(np.quantile(floor, 0.3)))
        rise = floor / usual
        common = np.ones(floor.size)
        for other in others:
            level = np.interp(np.linspace(0, 1, floor.size), np.linspace(0, 1, other.size), other)
            common = np.maximum(common, level / max(1.0, float(np.quantile(other, 0.3)))) if len(others) < 2 else common
        if len(others) > 1:
            levels = [
                np.interp(
                    np.linspace(0, 1, floor.size), np.linspace(0, 1, o.size), o / max(1.0, float(np.quantile(o, 0.3)))
                )
                for o in others
            ]
            common = np.maximum(1.0, np.quantile(levels, 0.75, axis=0))
        for other in along:
            common = np.maximum(common, _rise(other, floor.size))
        loud = rise > self.factor * common
        if usual > self.whole:
            loud |= True
        findings = []
        time, rate = measured.time(name), measured.rate(name)
        for first, last in runs(loud):
            if (last - first) * _BLOCK < self.shortest:
                continue
            ends = [min(time.size - 1, round(at * _BLOCK * rate)) for at in (first, last)]
            findings.append(
                Finding(
                    "noise",
                    name,
                    float(time[ends[0]]),
                    float(time[ends[1]]),
                    f"{float(np.median(floor[first:last])):.3g} times the data sheet's noise density",
                    "check screen and supply; the samples stay: give them less weight",
                    repair=Mask(),
                )
            )
        return findings


def _alike(measured: Measurements, first: str, second: str) -> bool:
    """Whether both are of one kind and axis: vibration of a body along an axis reaches every sensor of that axis."""
    return kind_of(measured, first) == kind_of(measured, second) and axis_of(first) == axis_of(second)


def _rise(floor: np.ndarray, count: int) -> np.ndarray:
    """A channel's floor over its usual level, at `count` places, shape (count,)."""
    level = np.interp(np.linspace(0, 1, count), np.linspace(0, 1, floor.size), floor)
    return level / max(1.0, float(np.quantile(floor, 0.3)))


def _body(measured: Measurements, name: str) -> object:
    """Body of a channel's sensor."""
    return sheet(measured, name).get("body")


def _floor(measured: Measurements, name: str) -> np.ndarray | None:
    """Amplitude density of the quietest band over the data sheet's, a value a block, shape (blocks,)."""
    density = limit(measured, name, "noise_density")
    rate, values = measured.rate(name), measured[name]
    size = round(_BLOCK * rate)
    count = values.size // max(1, size)
    if not density or size < 32 or count < 8 or kind_of(measured, name) in ("tachometer", "gnss"):
        return None
    lost = np.isnan(values[: count * size]).reshape(count, size).any(axis=1)
    blocks = filled(values)[: count * size].reshape(count, size)
    window = np.hanning(size)
    power = np.abs(np.fft.rfft((blocks - blocks.mean(axis=1, keepdims=True)) * window, axis=1)) ** 2
    power *= 2 / (rate * float(window @ window))
    bands = np.array_split(power[:, int(_LOWEST * size / 2) : -1], _BANDS, axis=1)
    quiet = np.sqrt(np.min([band.mean(axis=1) for band in bands], axis=0)) / density
    if lost.all():
        return None
    quiet[lost] = np.median(quiet[~lost])
    return np.asarray(median_filter(quiet, size=5, mode="nearest"))
