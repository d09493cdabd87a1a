"""Wheel tachometer: pulses of the real rotation of the axle, so that slip and wheel wear show as they do in service."""

from typing import ClassVar

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.sensors.interface import Sensor
from railsim.spec import quantity
from railsim.truth import Truth


class Tachometer(Sensor, frozen=True):
    """Speed from pulses by count and time (Ohmae et al., 1982, "M/T method").

    At each sample: angle between the last pulse of this interval and the last one before it, over the time between the
    two by a clock of finite rate. Without a new pulse the speed is what it was, or one pulse over the time since the
    last where that is less; after `timeout` it is zero. Pulses do not tell the direction. Before the record the wheel
    is taken to have turned steadily. Noise, resolution and range act on the wheel speed.
    """

    pulses: int = quantity(100, unit="pulses a revolution", source="illustrative", ge=1)
    clock: float = quantity(1e6, unit="Hz", source="illustrative", gt=0)
    timeout: float = quantity(1.0, unit="s", source="illustrative", gt=0)
    radius_error: float = quantity(0.0, unit="- (nominal over true wheel radius, minus 1)", source="scenario", gt=-1)

    hidden: ClassVar[frozenset[str]] = frozenset({"radius_error"})
    without: ClassVar[frozenset[str]] = frozenset(
        {
            "bandwidth",
            "bias",
            "bias_instability",
            "bias_std",
            "misalignment",
            "misalignment_std",
            "overload",
            "rectification",
            "scale_error",
            "scale_error_std",
            "temperature_bias",
            "warming",
            "warming_time",
        }
    )

    def channels(self) -> list[str]:
        """Speed of rotation, and the running speed that follows from it with the nominal wheel radius."""
        return [f"{self.name}.wheel_speed [rad/s]", f"{self.name}.speed [m/s]"]

    def measure(self, truth: Truth, rng: np.random.Generator) -> pd.DataFrame:
        """Count and time pulses; the phase of the pulse wheel is random.

        Raises
        ------
        InputError : the body does not spin, or the run does not state a wheel radius.
        """
        self.need(truth, f"{self.body}.spin_angle [rad]")
        radius = truth.about.get("vehicle", {}).get("wheel_radius [m]")
        if radius is None:
            raise InputError(f"sensor '{self.name}': the run's vehicle states no 'wheel_radius [m]'; simulate it again")
        phase, noise = rng.spawn(2)
        sampled = truth.time[:: self.step(truth)]
        instants = self.instants(truth, rng)
        lead = np.arange(-np.ceil(2 * self.timeout * self.rate), 0) / self.rate
        taken = sampled if instants is None else sampled[0] + instants
        at = np.concatenate([sampled[0] + lead, taken]) - self.errors.latency
        speed = self._speed(at, *self._last_pulses(truth, at, float(phase.uniform())))[-sampled.size :]
        speed = self.errors.digitise(self.errors.disturb(speed, self.rate, noise))
        if instants is not None:
            speed = np.where(taken > truth.time[-1], np.nan, speed)
        return self.table(truth, [speed, speed * float(radius) * (1 + self.radius_error)])

    def _last_pulses(self, truth: Truth, at: np.ndarray, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """(number, clocked time in s) of the last pulse at or before each instant `at`, s."""
        time, angle = truth.time, truth[f"{self.body}.spin_angle [rad]"]
        pulses = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(angle)))]) * self.pulses / (2 * np.pi) + phase
        lead = time[0] - at[0] + self.timeout
        pulse_rate = (pulses[1] - pulses[0]) * truth.rate if pulses.size > 1 else 0.0  # 1/s, at the start
        time = np.concatenate([[time[0] - lead], time])
        pulses = np.concatenate([[pulses[0] - pulse_rate * lead], pulses])
        count = np.floor(np.interp(at, time, pulses))
        edge = np.interp(count, pulses, time)
        if pulse_rate > 0.0:  # a pulse before the lead: so slow a wheel gives none for seconds
            edge = np.where(count < pulses[0], time[0] - (pulses[0] - count) / pulse_rate, edge)
        return count, np.floor(edge * self.clock) / self.clock

    def _speed(self, at: np.ndarray, count: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Angular speed at the instants `at`, rad/s, shape (n,)."""
        pitch = 2 * np.pi / self.pulses
        counted = np.diff(count, prepend=count[0])
        apart = np.maximum(np.diff(edge, prepend=edge[0]), 1 / self.clock)
        fresh = np.where(counted > 0, counted * pitch / apart, 0.0)
        held = fresh[np.maximum.accumulate(np.where(counted > 0, np.arange(at.size), 0))]
        waited = np.maximum(at - edge, 1 / self.clock)
        speed = np.where(counted > 0, fresh, np.minimum(held, pitch / waited))
        return np.where(waited > self.timeout, 0.0, speed)
