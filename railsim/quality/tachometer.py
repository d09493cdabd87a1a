"""Tachometer against other speed: scale, missing pulses, slip."""

from typing import ClassVar

import numpy as np
from scipy.ndimage import median_filter

from railsim.measurements import Measurements
from railsim.quality._signals import filled, kind_of, runs
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Fill, Put, Scale
from railsim.spec import quantity


class Tachometer(Check, frozen=True):
    """Speed of the rim against the receiver's, or against the other axle's.

    A wheel that slides leaves the running speed as fast as its inertia lets it; pulses that are missing change the
    speed from one sample to the next.
    """

    wear: float = quantity(0.06, unit="- of the radius", source="illustrative: wear of 55 mm in diameter", gt=0)
    jump: float = quantity(40.0, unit="m/s2", source="illustrative: no wheel's rim is braked as hard", gt=0)
    slip: float = quantity(0.06, unit="-", source="illustrative: beyond what adhesion needs", gt=0)
    slowest: float = quantity(2.0, unit="m/s", source="illustrative", gt=0)
    shortest: float = quantity(0.5, unit="s", source="illustrative", gt=0)

    stage: ClassVar[int] = 9

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a sensor and stretch."""
        speeds = [n for n in measurements if n.endswith(".speed [m/s]") and kind_of(measurements, n) == "tachometer"]
        findings = []
        for name in speeds:
            reference = _reference(measurements, name)
            if reference is not None:
                findings += self._sensor(measurements, name, reference)
        return findings

    def _sensor(self, measured: Measurements, name: str, reference: np.ndarray) -> list[Finding]:
        time, rate = measured.time(name), measured.rate(name)
        values = filled(measured[name])
        moving = (reference > self.slowest) & np.isfinite(measured[name])
        if moving.sum() < 5 * rate:
            return []
        ratio = np.where(moving, values / np.maximum(reference, self.slowest), 1.0)
        smooth = median_filter(ratio, size=2 * round(0.25 * rate) + 1, mode="nearest")
        usual = _mode(smooth[moving])
        findings = []
        if abs(usual - 1) > self.wear:
            text = f"{100 * (usual - 1):+.1f} % off the other speed throughout"
            findings.append(
                Finding(
                    "tachometer",
                    name,
                    float(time[0]),
                    float(time[-1]),
                    text,
                    "check wheel diameter and pulses a revolution; both channels are divided by the factor",
                    repair=Scale(usual),
                )
            )
        off = np.where(moving, np.abs(smooth / usual - 1), 0.0)
        for first, last in runs(off > self.slip):
            if last - first >= self.shortest * rate:
                findings.append(
                    self._stretch(
                        measured,
                        name,
                        values,
                        reference,
                        (first, last),
                        float(np.median(smooth[first:last] / usual - 1)),
                    )
                )
        return findings

    def _by_other(
        self, measured: Measurements, name: str, reference: np.ndarray, hit: np.ndarray
    ) -> tuple[str, np.ndarray] | None:
        """Another axle's tachometer that is sound at these samples, and its reading there in terms of this one's, m/s;
        None where there is none.
        """
        time, rest = measured.time(name), np.ones(reference.size, dtype=bool)
        rest[hit] = False
        rest &= (reference > self.slowest) & np.isfinite(measured[name])
        for other in measured:
            if other == name or not other.endswith(".speed [m/s]") or kind_of(measured, other) != "tachometer":
                continue
            speed = np.interp(time, measured.time(other), measured[other])
            size = 2 * round(0.25 * measured.rate(name)) + 1
            beside = median_filter(speed / np.maximum(reference, self.slowest), size=size, mode="nearest")
            fast = hit[reference[hit] > self.slowest]
            sound = fast.size and bool(np.all(np.abs(beside[fast] / _mode(beside[rest]) - 1) < self.slip))
            if sound and np.isfinite(speed).all():
                return other, speed[hit] * float(np.median(measured[name][rest] / np.maximum(speed[rest], 1e-3)))
        return None

    def _stretch(
        self,
        measured: Measurements,
        name: str,
        values: np.ndarray,
        reference: np.ndarray,
        ends: tuple[int, int],
        off: float,
    ) -> Finding:
        """A slide, or pulses that are missing."""
        time, rate = measured.time(name), measured.rate(name)
        reach = round(0.3 * rate)
        steps = np.abs(np.diff(values)) * rate
        near = [steps[max(0, at - reach) : at + reach] for at in ends]
        broken = max((float(part.max()) for part in near if part.size), default=0.0) > self.jump
        text = f"{100 * off:+.1f} % off the other speed"
        start, end = float(time[ends[0]]), float(time[min(ends[1], time.size) - 1])
        if broken:
            pad = round(0.15 * rate)
            hit = np.arange(max(0, ends[0] - pad), min(time.size, ends[1] + pad))
            advice = "speed jumps faster than a wheel can be braked: pulses are missing; "
            other = self._by_other(measured, name, reference, hit)
            if other is None:
                return Finding(
                    "tachometer", name, start, end, text, f"{advice}interpolated", repair=Fill(), samples=hit
                )
            advice += f"by {other[0]}"
            put = Put(values=other[1])
            return Finding("tachometer", name, start, end, text, advice, repair=put, other=other[0], samples=hit)
        return Finding("slip", name, start, end, text, "a wheel slides or spins: true, but not running speed", "note")


def _reference(measured: Measurements, name: str) -> np.ndarray | None:
    """Running speed at the samples of tachometer channel `name`, m/s, shape (n,); None where there is no other."""
    others = [other for other in measured if other.endswith(".speed [m/s]") and other != name]
    others.sort(key=lambda other: kind_of(measured, other) != "gnss")
    for other in others:
        values = measured[other]
        if np.isfinite(values).mean() > 0.5:
            size = 2 * round(0.5 * measured.rate(other)) + 1
            calm = median_filter(filled(values), size=size, mode="nearest")
            return np.interp(measured.time(name), measured.time(other), calm)
    return None


def _mode(ratio: np.ndarray) -> float:
    """Middle of the half of the values that lie closest together (half-sample mode, one step)."""
    ordered = np.sort(ratio)
    half = ordered.size // 2
    width = ordered[half:] - ordered[: ordered.size - half]
    first = int(np.argmin(width))
    return float(np.median(ordered[first : first + half]))
