"""Zero of a sensor over the whole record against its data sheet."""

import math
from typing import ClassVar

import numpy as np

from railsim.constants import GRAVITY
from railsim.measurements import Measurements
from railsim.quality._offsets import axis_of, expected, heading_rate, lean_rate, still_mean, tolerance
from railsim.quality._signals import kind_of, limit, sheet
from railsim.quality.interface import Check, Finding
from railsim.quality.mounting import doubtful
from railsim.quality.repairs import Subtract
from railsim.spec import quantity

_FARTHEST = 0.5 * GRAVITY  # m/s2; an accelerometer's mean that is farther off is no matter of its zero


class Offset(Check, frozen=True):
    """Means against gravity, rest, the path's heading and a second sensor on the same body."""

    width: float = quantity(5.0, unit="standard deviations", source="1e-6 a channel, normal distribution", gt=0)

    stage: ClassVar[int] = 7

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a channel."""
        offsets: dict[str, float] = {}
        unclear = doubtful(measurements)
        for name in measurements:
            if name in unclear:
                continue
            off = self._alone(measurements, name)
            if off is not None:
                offsets[name] = off
        for first, second in _pairs(measurements):
            if not {first, second} & unclear and first not in offsets and second not in offsets:
                offsets |= self._pair(measurements, first, second)
        return [_finding(measurements, name, size) for name, size in offsets.items()]

    def _alone(self, measured: Measurements, name: str) -> float | None:
        """Offset, where it is beyond what data sheet and running allow."""
        kind = kind_of(measured, name)
        if kind not in ("accelerometer", "gyro", "displacement") or not np.isfinite(measured[name]).any():
            return None
        allowed = tolerance(measured, name)
        off = float(np.nanmean(measured[name])) - expected(measured, name)
        running = allowed.running
        if kind == "gyro":
            rest = still_mean(measured, name)
            heading = heading_rate(measured) if axis_of(name) == "yaw" else None
            if rest is not None:
                off, running = rest, 0.0
            elif heading is not None:
                off, running = off - heading[0], self.width * heading[1]
            elif axis_of(name) == "roll" and (lean := lean_rate(measured, name)) is not None:
                off, running = lean[0], min(running, self.width * lean[1])
        return off if allowed.deviation and abs(off) > self.width * allowed.deviation + running else None

    def _pair(self, measured: Measurements, first: str, second: str) -> dict[str, float]:
        """The one of two like channels on a body that is further from what is expected, where they disagree."""
        first_offset, second_offset = (
            float(np.nanmean(measured[name])) - expected(measured, name) for name in (first, second)
        )
        deviation = math.hypot(tolerance(measured, first).deviation, tolerance(measured, second).deviation)
        if not deviation or not abs(first_offset - second_offset) > self.width * deviation:
            return {}
        inclined = _leaning(measured) if axis_of(first) == "y" else 0.0
        return (
            {first: first_offset - second_offset}
            if abs(first_offset - inclined) > abs(second_offset - inclined)
            else {second: second_offset - first_offset}
        )


def _pairs(measured: Measurements) -> list[tuple[str, str]]:
    """Accelerometer channels of one axis on one body."""
    by_axis: dict[tuple[object, str], list[str]] = {}
    for name in measured:
        if kind_of(measured, name) == "accelerometer":
            by_axis.setdefault((sheet(measured, name).get("body"), axis_of(name)), []).append(name)
    return [(names[0], other) for names in by_axis.values() for other in names[1:]]


def _leaning(measured: Measurements) -> float:
    """Mean lateral specific force of the path, m/s2: speed times yaw rate and gravity by the roll since the start."""
    roll, yaw = (next((n for n in measured if n.endswith(f"rate_{a} [rad/s]")), None) for a in ("roll", "yaw"))
    speed = next((n for n in measured if n.endswith(".speed [m/s]")), None)
    if roll is None or yaw is None or speed is None:
        return 0.0
    angle = np.nancumsum(measured[roll]) / measured.rate(roll)
    return float(np.nanmedian(measured[speed]) * np.nanmean(measured[yaw]) + GRAVITY * angle.mean())


def _finding(measured: Measurements, name: str, off: float) -> Finding:
    time = measured.time(name)
    bias = limit(measured, name, "bias_std")
    far = kind_of(measured, name) == "accelerometer" and abs(off) > _FARTHEST
    advice = "set the zero anew at standstill; the mean is brought to what is expected"
    if far:
        advice = "no zero is so far off: check the unit, the mounting and the coupling; the samples stay"
    return Finding(
        "offset",
        name,
        float(time[0]),
        float(time[-1]),
        f"the zero is {off:+.3g} off{f', {abs(off) / bias:.0f} times the data sheet' if bias else ''}",
        advice,
        repair=None if far else Subtract(off),
    )
