"""One value for too long: stuck, or null where it is zero."""

import math
from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._signals import kind_of, runs, standing
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Blank
from railsim.spec import quantity


class Stuck(Check, frozen=True):
    """Runs of one value longer than chance gives, by the share of equal neighbours in the rest of the record."""

    shortest: float = quantity(0.25, unit="s", source="illustrative", gt=0)
    fewest: int = quantity(12, unit="samples", source="illustrative", ge=2)
    chance: float = quantity(1e-6, unit="- of a false alarm a channel", source="illustrative", gt=0)
    jump: float = quantity(40.0, unit="m/s2", source="illustrative: no wheel's rim is braked as hard", gt=0)

    stage: ClassVar[int] = 2

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for each run."""
        still = standing(measurements)
        findings = []
        for name in measurements:
            findings += self._channel(measurements, name, still)
        return findings

    def _channel(self, measured: Measurements, name: str, still: np.ndarray | None) -> list[Finding]:
        values, time, rate = measured[name], measured.time(name), measured.rate(name)
        equal = values[1:] == values[:-1]
        spells = [(first, last + 1) for first, last in runs(equal)]
        long = [(a, b) for a, b in spells if b - a >= max(self.fewest, self.shortest * rate)]
        inside = sum(b - a - 1 for a, b in long)
        share = (float(equal.sum()) - inside + 1) / max(1.0, equal.size - inside + 1)
        need = math.log(self.chance / values.size) / math.log(min(share, 0.99))
        findings = []
        for first, last in long:
            start, end = float(time[first]), float(time[last - 1])
            rest = still is not None and _rests(still, start, end)
            if last - first < need or (rest and not self._cut(measured, name, first, last)):
                continue
            if kind_of(measured, name) == "tachometer" and not self._cut(measured, name, first, last):
                continue
            null = values[first] == 0.0
            findings.append(
                Finding(
                    "null" if null else "stuck",
                    name,
                    start,
                    end,
                    f"{last - first} samples of {'zero' if null else f'{values[first]:.6g}'}",
                    "check connection and logger; treat the stretch as a gap",
                    repair=Blank(),
                )
            )
        return findings

    def _cut(self, measured: Measurements, name: str, first: int, last: int) -> bool:
        """Whether a tachometer jumps into or out of the run faster than a wheel can be braked."""
        if kind_of(measured, name) != "tachometer":
            return False
        radius = 1.0 if name.endswith("[m/s]") else float(measured.vehicle.get("wheel_radius", 0.45))
        values = measured[name] * radius
        edges = [abs(values[i] - values[i - 1]) for i in (first, last) if 0 < i < values.size]
        return any(edge * measured.rate(name) > self.jump for edge in edges)


def _rests(still: np.ndarray, start: float, end: float) -> bool:
    """Whether the vehicle stands at both ends and between."""
    inside = still[(still >= start) & (still <= end)]
    return inside.size > 1 and inside[-1] - inside[0] > 0.8 * (end - start)
