"""Ride comfort on the floor of the body: EN 12299's continuous and mean comfort, and Sperling's index."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from estimators.interface import Estimate, Estimator
from estimators.ride.weighting import HORIZONTAL, VERTICAL, sperling, sperling_index
from estimators.signals.frequency_response import filter_time
from estimators.signals.noise import noise_floor
from estimators.speed.samples import on_grid
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

BLOCK = 5.0
"""s of a weighted rms value (EN 12299, continuous comfort)."""
FAST = 200.0
"""Samples a second with which the whole weighting, up to 100 Hz, can be seen."""
Gain = Callable[[np.ndarray], np.ndarray]


def weightings(axis: str) -> dict[str, Gain]:
    """Weightings of an axis by name, from frequencies in Hz: "comfort" by EN 12299, "sperling" but along the track."""
    known: dict[str, Gain] = {"comfort": (VERTICAL if axis == "z" else HORIZONTAL).response}
    if axis != "x":
        known["sperling"] = lambda frequency: sperling(frequency, axis == "z") + 0j
    return known


def block_rms(values: np.ndarray, rate: float, gain: Gain) -> np.ndarray:
    """Rms of the weighted values in each block of 5 s, shape (blocks,); values without NaN."""
    weighted = filter_time(values - np.mean(values), rate, lambda omega: gain(omega / (2.0 * np.pi)), False)
    size = round(BLOCK * rate)
    count = len(values) // size
    return np.sqrt(np.mean(weighted[: count * size].reshape(count, size) ** 2, axis=1))


class RideComfort(Estimator, frozen=True):
    """Ride comfort in the body: weighted accelerations every 5 s, mean comfort N_MV (EN 12299), Sperling's Wz.

    N_MV = 6 sqrt(a_x95^2 + a_y95^2 + a_z95^2), the 95th percentiles of the rms values of 5 s over five minutes on the
    floor. The latest five minutes count at each time; no N_MV is given before. The index is of the sensor's place.
    """

    sensor: str = quantity("body", unit="name of the accelerometer", source="EN 12299: on the floor", pattern=r"^\w+$")
    period: float = quantity(300.0, unit="s, of the mean comfort", source="EN 12299: five minutes", ge=BLOCK)

    requires: ClassVar[tuple[str, ...]] = ("body.acceleration_y [m/s2]", "body.acceleration_z [m/s2]")
    adds: ClassVar[Mapping[str, str]] = MappingProxyType({"body.acceleration_x [m/s2]": "the mean comfort N_MV"})

    def needed(self) -> tuple[str, ...]:
        """The lateral and the vertical channel of `sensor`."""
        return tuple(self._channel(axis) for axis in "yz")

    def estimate(self, measurements: Measurements) -> Estimate:
        """A row each 5 s.

        Raises
        ------
        InputError : a channel is missing.
        """
        self.need(measurements)
        axes = [axis for axis in "xyz" if self._channel(axis) in measurements]
        samples = {axis: on_grid(measurements, self._channel(axis)) for axis in axes}
        columns: dict[str, np.ndarray] = {}
        for axis in axes:
            across = [samples[one][0] for one in axes if one != axis]
            for kind, gain in weightings(axis).items():
                true, std = self._rms(measurements, axis, samples[axis][0], across, gain)
                if kind == "comfort":
                    columns |= {f"comfort_{axis} [m/s2]": true, f"comfort_{axis}_std [m/s2]": std}
                else:
                    index = sperling_index(true)
                    columns |= {f"wz_{axis} [-]": index, f"wz_{axis}_std [-]": 0.3 * index * std / _positive(true)}
        good = [self._whole(measurements, axis, seen) for axis, (_, seen) in samples.items()]
        count = min(len(one) for one in [*columns.values(), *good])
        valid = np.all([one[:count] for one in good], axis=0)
        series = pd.DataFrame({"time [s]": measurements.time(self._channel("z"))[0] + BLOCK * (np.arange(count) + 1.0)})
        for name, values in columns.items():
            series[name] = np.where(valid, values[:count], np.nan)
        if "x" in axes:
            series["mean_comfort [-]"], series["mean_comfort_std [-]"] = self._mean(series)
        series["valid [-]"] = valid.astype(float)
        return Estimate(self.name, series, self._about(measurements, series, axes))

    def _channel(self, axis: str) -> str:
        return f"{self.sensor}.acceleration_{axis} [m/s2]"

    def _whole(self, measurements: Measurements, axis: str, seen: np.ndarray) -> np.ndarray:
        """Which blocks were measured whole."""
        size = round(BLOCK * measurements.rate(self._channel(axis)))
        return np.asarray(seen[: len(seen) // size * size].reshape(-1, size).all(axis=1))

    def _rms(
        self, measurements: Measurements, axis: str, values: np.ndarray, across: Sequence[np.ndarray], gain: Gain
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rms in blocks without the noise's share, and its deviation.

        That is by the sensor's scale, by what a misaligned sensor takes from the other axes, and by noise: that of the
        data sheet, and what may be noise beyond it.
        """
        name = self._channel(axis)
        rate, sheet = measurements.rate(name), data_sheet(measurements.about, name)
        frequency = np.linspace(0.0, rate / 2.0, 2049)[1:]
        power = np.abs(gain(frequency)) ** 2
        whole, density = float(np.trapezoid(power, frequency)), sheet.density(rate)
        rms = block_rms(values, rate, gain)
        square = rms**2 - density**2 * whole
        true = np.sqrt(np.maximum(square, 0.0))
        crossed = 2.0 * true**2 * density**2 * power.max()  # of signal and noise at one frequency, the worst
        scatter = crossed + density**4 * float(np.trapezoid(power**2, frequency))  # of the square, over a block's time
        by_noise = np.sqrt(scatter / BLOCK) / (2.0 * np.maximum(true, (scatter / BLOCK) ** 0.25 + 1e-12))
        misaligned = sheet.error("misalignment_std")
        turned = [misaligned * block_rms(_resampled(one, len(values)), rate, gain) for one in across]
        unstated = max(noise_floor(values, rate) - density**2, 0.0) * whole / (2.0 * _positive(rms))
        parts = [
            sheet.error("scale_error_std") * rms,
            by_noise,
            unstated,
            self._beyond(values, rate, gain, rms),
            *turned,
        ]
        return true, np.sqrt(np.sum([one**2 for one in parts], axis=0))

    def _beyond(self, values: np.ndarray, rate: float, gain: Gain, rms: np.ndarray) -> np.ndarray:
        """What slow samples miss, m/s2: as much as their highest octave holds is taken to lie beyond it."""
        if rate >= FAST:
            return np.zeros(len(rms))
        octave = block_rms(values, rate, lambda frequency: gain(frequency) * (frequency > rate / 4.0))
        return octave**2 / (2.0 * _positive(rms))

    def _mean(self, series: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
        """N_MV of the latest period and its deviation; NaN before a period has passed, or with a block lost in it."""
        blocks = round(self.period / BLOCK)
        values = np.stack([series[f"comfort_{axis} [m/s2]"].to_numpy() for axis in "xyz"])
        errors = np.stack([series[f"comfort_{axis}_std [m/s2]"].to_numpy() for axis in "xyz"])
        mean, std = np.full(len(series), np.nan), np.full(len(series), np.nan)
        for last in range(blocks, len(series) + 1):
            part = values[:, last - blocks : last]
            if np.isfinite(part).all():
                highest = np.percentile(part, 95.0, axis=1)
                share = np.max(errors[:, last - blocks : last] / _positive(part), axis=1)  # mostly scale: alike
                mean[last - 1] = 6.0 * np.sqrt(np.sum(highest**2))
                std[last - 1] = 36.0 / mean[last - 1] * np.sqrt(np.sum((highest**2 * share) ** 2))
        return mean, std

    def _about(self, measurements: Measurements, series: pd.DataFrame, axes: list[str]) -> dict[str, Any]:
        sheet = data_sheet(measurements.about, self._channel("z"))
        warnings = []
        lowest = min(measurements.rate(self._channel(axis)) for axis in axes)
        if lowest < FAST:
            missing = f"vibration above {lowest / 2:g} Hz is missing; the deviations hold a guess of it"
            warnings.append(f"samples at {lowest:g} Hz: {missing}")
        if "x" not in axes:
            warnings.append(f"no mean comfort: it needs '{self._channel('x')}' too")
        elif len(series) * BLOCK < self.period:
            warnings.append(f"no mean comfort: it needs {self.period:g} s of record")
        place = {"body": str(sheet.stated.get("body", "body")), "position [m]": list(sheet.position)}
        return {"settings": self.model_dump(mode="json"), **place, "warnings": warnings}


def _resampled(values: np.ndarray, count: int) -> np.ndarray:
    """The same course with so many samples."""
    return (
        values
        if len(values) == count
        else np.interp(np.linspace(0, len(values) - 1, count), np.arange(len(values)), values)
    )


def _positive(values: np.ndarray) -> np.ndarray:
    return np.maximum(values, 1e-9)
