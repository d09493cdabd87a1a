"""What the inference sees of the railway: measured channels in frames, data sheets, track file, speed.

Frames are sorted into sections of like speed: what errors do to the channels depends on it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.discrepancy.core.frames import Frames
from experiments.discrepancy.railway.clock import Clock
from experiments.discrepancy.railway.registration import Registration, ideal, register
from experiments.discrepancy.railway.survey import Surveyed
from experiments.discrepancy.recording.evidence import Evidence
from experiments.discrepancy.recording.speed import STANDING
from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.sensors.inertial import InertialSensor
from railsim.sensors.interface import Sensor
from railsim.track.track import Track

LEFT_OUT = {"acceleration_x": "it follows from the change of speed, which the speed signal tells only roughly"}
"""Quantities that are not compared."""
WINDOW, LOW, HIGH = 2.0, 0.6, 40.0  # s, Hz, Hz: of the frames
USED = 0.35  # of the rate of the slowest channel
DROPPED = 2.0  # s at the beginning, where nobody knows the state from which the vehicle came
SLOW = 5.0  # m/s; slower frames are not compared: creep forces ask for ever finer steps
ALIKE = 1.2  # largest speed of a section over its smallest
VALUES = 96_000  # complex ones of all channels over wheelsets: two and ten channels 1 min, four and 22 channels 14 s
FRAMES = 12  # of them at least, whatever the number of channels
MARGIN = 40.0  # m; of the track on both sides of what the vehicle passes
COURSE = 128.0  # Hz; of the course in time of what frames hold
FEWEST = 4  # frames of a section; fewer go to a neighbour


@dataclass(frozen=True, eq=False)
class Record:
    """A recording's evidence as its frames."""

    evidence: Evidence

    @property
    def scenario(self) -> Scenario:
        """The nominal one."""
        return self.evidence.scenario

    @cached_property
    def channels(self) -> dict[str, Sensor]:
        """Compared channels, and the sensor of each."""
        found = {
            name: one
            for one in self.evidence.sensors
            for name in one.channels()
            if name in self.evidence.channels and _quantity(name) not in LEFT_OUT
        }
        if not found:
            raise InputError("recording: no channel can be compared; record a vertical or lateral acceleration or rate")
        return found

    @property
    def left_out(self) -> tuple[str, ...]:
        """Channels that are not compared, with the reason."""
        skipped = [f"{n}: {LEFT_OUT[_quantity(n)]}" for n in self.evidence.channels if _quantity(n) in LEFT_OUT]
        return (*self.evidence.left_out, *skipped)

    @cached_property
    def ideal(self) -> tuple[Sensor, ...]:
        """The sensors with filter and latency alone; inertial ones with all axes, as any of them may be turned."""
        found = []
        for one in dict.fromkeys(self.channels.values()):
            axes = {"axes": one.axis_names} if isinstance(one, InertialSensor) and self.mounted(one) else {}
            found.append(one.but(errors=ideal(one.errors), **axes))
        return tuple(found)

    @staticmethod
    def mounted(sensor: Sensor) -> bool:
        """Whether its mounting may be turned."""
        return isinstance(sensor, InertialSensor) and sensor.errors.misalignment_std > 0.0

    @cached_property
    def registration(self) -> Registration:
        """Where the recording began and the scale of its speed, roughly."""
        return register(self.evidence)

    @cached_property
    def duration(self) -> float:
        """Whole half windows that every channel has [s], until frames enough are seen of a moving vehicle."""
        moving = np.cumsum(self._moves(self.whole))
        frames = self.frames_at(1e3, self.whole)
        values = VALUES / len(self.scenario.model.wheelsets)
        most = max(FRAMES, round(values / len(self.channels) / len(frames.frequencies)))
        return float(DROPPED + 0.5 * WINDOW * (np.searchsorted(moving, most) + 2)) if moving[-1] > most else self.whole

    @cached_property
    def whole(self) -> float:
        """Whole half windows that every channel has [s]."""
        ends = min(len(self.evidence.samples[name]) / self.evidence.rates[name] for name in self.channels)
        duration = np.floor(ends / (0.5 * WINDOW) + 1e-9) * 0.5 * WINDOW
        if duration < DROPPED + 2.0 * WINDOW:
            raise InputError(f"recording: {ends:.1f} s are too short; give {DROPPED + 2.0 * WINDOW:g} s or more")
        return float(duration)

    def frames(self, rate: float) -> Frames:
        """Of the samples that are compared of a channel at `rate`."""
        return self.frames_at(rate, self.duration)

    def frames_at(self, rate: float, end: float) -> Frames:
        """Of the samples until `end` [s]."""
        return Frames(round((end - DROPPED) * rate), rate, WINDOW, LOW, min(HIGH, USED * self.evidence.slowest))

    def framed(self, values: np.ndarray, rate: float) -> np.ndarray:
        """(F, kept frames) of samples from the record's beginning, without their mean; mean square = density of white
        noise at any rate.
        """
        first, last = round(DROPPED * rate), round(self.duration * rate)
        if len(values) < last:
            raise InputError(f"recording: a channel ends after {len(values) / rate:.2f} s")
        part = values[first:last]
        part = part - part.mean() if np.isfinite(part).all() else np.nan_to_num(part - np.nanmean(part))
        return (self.frames(rate).analyse(part[None])[..., 0] / np.sqrt(rate))[:, self.kept]

    def course(self, frames: np.ndarray) -> np.ndarray:
        """(n,) at `COURSE` of kept frames (F, frames), without half a window at both ends; 0 where one was left out."""
        of = self.frames(COURSE)
        whole = np.zeros((len(frames), len(of.places), 1), complex)
        whole[:, self.kept, 0] = frames
        aside = of.size // 2  # where one window alone reaches
        return of.synthesise(whole)[0, aside : of.places[-1, -1] + 1 - aside] * np.sqrt(COURSE)

    @cached_property
    def clock(self) -> Clock:
        """Of the model."""
        return Clock.of(*self.speed, SLOW)

    def modelled(self, values: np.ndarray, rate: float) -> np.ndarray:
        """`framed` of samples of a run, in the model's time; windows begin between samples by a turn of the phase."""
        if not len(self.clock.stretches):
            return self.framed(values, rate)
        frames, begins = self.frames(rate), self.clock.model(DROPPED + 0.5 * WINDOW * self.kept)
        first = np.round(begins * rate).astype(int)
        windows = values[first[:, None] + np.arange(frames.size)] - values[round(DROPPED * rate) :].mean()
        spectra = np.fft.rfft(windows * frames.sine, axis=-1)[:, frames.kept].T
        return spectra * np.exp(2j * np.pi * frames.frequencies[:, None] * (begins - first / rate)) / np.sqrt(rate)

    @cached_property
    def kept(self) -> np.ndarray:
        """Frames in which every channel has all samples and the vehicle moves."""
        good = self._moves(self.duration)
        for name in self.channels:
            rate = self.evidence.rates[name]
            part = self.evidence.samples[name][round(DROPPED * rate) : round(self.duration * rate)]
            good = good & np.isfinite(part)[self.frames(rate).places].all(axis=1)
        if good.sum() < FEWEST:
            raise InputError("recording: no stretch of 6 s has all channels at more than 5 m/s; give a longer one")
        return np.flatnonzero(good)

    @cached_property
    def _speeds(self) -> np.ndarray:
        """(frames,) lowest speed within each frame [m/s]."""
        return self._lowest(self.duration)

    def _lowest(self, end: float) -> np.ndarray:
        time = self._begins(end)[:, None] + WINDOW * np.linspace(0.0, 1.0, 9)
        return np.interp(time, *self.evidence.speed[:2]).min(axis=1)

    def _moves(self, end: float) -> np.ndarray:
        """(frames,) whether the vehicle moves; it has for `DROPPED`: after a slow stretch the model comes from another
        state.
        """
        slow = Clock.of(*self.evidence.speed[:2], SLOW).stretches
        since = self._begins(end)[:, None] - slow[:, 1]
        return (self._lowest(end) > SLOW) & ~((since >= 0.0) & (since < DROPPED)).any(axis=1)

    @staticmethod
    def _begins(end: float) -> np.ndarray:
        """(frames,) [s]."""
        return DROPPED + 0.5 * WINDOW * np.arange(round((end - DROPPED) / (0.5 * WINDOW)) - 1)

    @cached_property
    def sections(self) -> tuple[np.ndarray, ...]:
        """Places of the kept frames, by speed: what has few frames goes to the neighbour of the most alike speed."""
        speeds = self._speeds[self.kept]
        steps = max(1, int(np.ceil(np.log(speeds.max() / speeds.min()) / np.log(ALIKE))))
        edges = np.linspace(0.0, 1.0, steps + 1)[1:-1] * np.log(speeds.max() / speeds.min())
        numbers = np.searchsorted(edges, np.log(speeds / speeds.min()))
        parts = [np.flatnonzero(numbers == number) for number in np.unique(numbers)]
        while len(parts) > 1 and min(len(part) for part in parts) < FEWEST:
            few = min(range(len(parts)), key=lambda number: len(parts[number]))
            apart = {near: abs(np.log(speeds[parts[near]].mean() / speeds[parts[few]].mean()))
                     for near in (few - 1, few + 1) if 0 <= near < len(parts)}  # fmt: skip
            first = min(few, min(apart, key=apart.__getitem__))
            parts[first : first + 2] = [np.sort(np.concatenate(parts[first : first + 2]))]
        return tuple(parts)

    def speed_of(self, section: int) -> float:
        """Mean speed of a section [m/s]."""
        return float(self._speeds[self.kept][self.sections[section]].mean())

    @cached_property
    def seen(self) -> np.ndarray:
        """(F, kept frames, channels)."""
        samples, rates = self.evidence.samples, self.evidence.rates
        return np.stack([self.framed(samples[name], rates[name]) for name in self.channels], axis=-1)

    @cached_property
    def frequencies(self) -> np.ndarray:
        """(F,) [Hz]."""
        return self.frames(self.evidence.rates[next(iter(self.channels))]).frequencies

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

    @property
    def stated(self) -> bool:
        """Whether the recording states the errors of its track file."""
        return self.evidence.track_errors_stated

    @cached_property
    def surveyed(self) -> Surveyed:
        """The measured track."""
        return Surveyed(self.evidence.track, self.evidence.track_errors, self.evidence.track_estimated)

    @property
    def extent(self) -> str:
        """What is compared, in words."""
        return f"{len(self.channels)} channels, {self.duration:.0f} of {self.whole:.0f} s"

    @cached_property
    def way(self) -> float:
        """Length of what is compared [m]."""
        time, speed = self.speed
        inner = np.append(time[time < self.duration], self.duration)
        return float(np.trapezoid(np.interp(inner, time, speed), inner))

    def passed(self, track: Track) -> Track:
        """The part of a track that the vehicle may come over."""
        reach = MARGIN + max(abs(one.position[0]) for one in self.scenario.model.bodies)
        first, last = self.registration.start - reach, self.registration.start + 1.02 * self.way + reach
        inside = (track.s >= first) & (track.s <= last)
        return Track(track.s[inside], {name: one[inside] for name, one in track.columns().items()}, track.name)

    @cached_property
    def speed(self) -> tuple[np.ndarray, np.ndarray]:
        """Time and speed [m/s], as registered; a vehicle that stands stays where it is."""
        time, speed = self.evidence.speed[:2]
        return time, np.where(speed > STANDING, self.registration.speed(speed), 0.0)


def _quantity(channel: str) -> str:
    return channel.partition(" [")[0].rpartition(".")[2]
