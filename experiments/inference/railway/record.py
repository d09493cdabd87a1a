"""What the inference sees of the railway: measured vertical channels in frames, data sheets, track file, speed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.inference.frames import Frames
from experiments.inference.railway.survey import USUAL, Surveyed
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.sensors.errors import SensorErrors
from railsim.sensors.interface import Sensor
from railsim.sensors.suite import build_sensor
from railsim.track.survey import TrackErrors
from railsim.track.track import Track

QUANTITIES = ("acceleration_z", "displacement")
"""Channels that are compared."""
WINDOW, LOW, HIGH = 2.0, 0.6, 40.0  # s, Hz, Hz: of the frames
DROPPED = 2.0  # s at the beginning, where nobody knows the state from which the vehicle came


@dataclass(frozen=True, eq=False)
class Record:
    """A recording and its nominal scenario."""

    measured: Measurements
    scenario: Scenario

    @cached_property
    def sensors(self) -> tuple[Sensor, ...]:
        """With what shapes their signals and nothing random, as their data sheets say."""
        found = []
        for sheet in self.measured.about["sensors"]:
            settings = {key: value for key, value in sheet.items() if key != "channels"}
            sensor = build_sensor(settings)
            if any(_quantity(name) in QUANTITIES and name in self.measured for name in sensor.channels()):
                found.append(sensor)
        if not found:
            raise InputError(f"recording: none of its channels is one of {', '.join(QUANTITIES)}; record one of these")
        return tuple(found)

    @property
    def ideal(self) -> tuple[Sensor, ...]:
        """The sensors with filter and latency alone."""
        return tuple(
            one.but(
                errors=SensorErrors(
                    bandwidth=one.errors.bandwidth, bandwidth_order=one.errors.bandwidth_order,
                    latency=one.errors.latency,
                )
            )
            for one in self.sensors
        )  # fmt: skip

    @cached_property
    def channels(self) -> dict[str, Sensor]:
        """Compared channels, and the sensor of each."""
        return {
            name: one
            for one in self.sensors
            for name in one.channels()
            if _quantity(name) in QUANTITIES and name in self.measured and np.isfinite(self.measured[name]).all()
        }

    @cached_property
    def duration(self) -> float:
        """Whole half windows that every channel has [s]."""
        ends = [len(self.measured[name]) / self.measured.rate(name) for name in self.channels]
        duration = np.floor(min(ends) / (0.5 * WINDOW) + 1e-9) * 0.5 * WINDOW
        if duration < DROPPED + 2.0 * WINDOW:
            raise InputError(f"recording: {min(ends):.1f} s are too short; give {DROPPED + 2.0 * WINDOW:g} s or more")
        return float(duration)

    def framed(self, name: str, values: np.ndarray, rate: float) -> np.ndarray:
        """(F, frames) of samples from the record's beginning; mean square = density of white noise at any rate."""
        first, last = round(DROPPED * rate), round(self.duration * rate)
        if len(values) < last:
            raise InputError(f"recording: '{name}' ends after {len(values) / rate:.2f} s")
        return frames(rate, self.duration).analyse(values[None, first:last])[..., 0] / np.sqrt(rate)

    @cached_property
    def seen(self) -> np.ndarray:
        """(F, frames, channels)."""
        parts = [self.framed(name, self.measured[name], self.measured.rate(name)) for name in self.channels]
        return np.stack(parts, axis=-1)

    @cached_property
    def frequencies(self) -> np.ndarray:
        """(F,) [Hz]."""
        return frames(self.measured.rate(next(iter(self.channels))), self.duration).frequencies

    @property
    def densities(self) -> np.ndarray:
        """(channels,) mean square of each sensor's noise in the frames, by its data sheet."""
        sheets = [one.errors for one in self.channels.values()]
        rates = [one.rate for one in self.channels.values()]
        found = [
            0.5 * one.noise_density**2 + one.resolution**2 / 12.0 / rate
            for one, rate in zip(sheets, rates, strict=True)
        ]
        return np.maximum(np.array(found), 1e-12 * np.mean(np.abs(self.seen) ** 2, axis=(0, 1)))

    @cached_property
    def stated(self) -> bool:
        """Whether the recording states the errors of its track file."""
        errors = self.measured.about.get("track", {}).get("errors")
        return errors is not None and any(errors.values())

    @cached_property
    def surveyed(self) -> Surveyed:
        """The measured track."""
        table = self.measured.track
        if table is None:
            raise InputError("recording: it has no track.csv; add the track as it was measured")
        columns = {key.partition(" [")[0]: table[key].to_numpy(float) for key in table.columns[1:]}
        errors = TrackErrors(**self.measured.about["track"]["errors"]) if self.stated else USUAL
        return Surveyed(Track(table.iloc[:, 0].to_numpy(float), columns, "measured"), errors)

    @cached_property
    def speed(self) -> tuple[np.ndarray, np.ndarray]:
        """Time and speed [m/s] of the nominal scenario."""
        time = np.arange(0.0, self.duration + 1.0, 0.25)
        return time, np.interp(time, *self.scenario.setup.speed.knots(self.scenario.duration))


def frames(rate: float, duration: float) -> Frames:
    """Of the samples that are compared of a channel at `rate`."""
    return Frames(round((duration - DROPPED) * rate), rate, WINDOW, LOW, HIGH)


def _quantity(channel: str) -> str:
    return channel.split(".")[1].split(" ")[0]
