"""One value for too long: stuck, or null where it is zero."""

import math
from typing import ClassVar

import numpy as np

from railsim.held import held_rows
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
        """One finding for each run; a note where values of a slower sensor are repeated all along."""
        still = standing(measurements)
        findings = []
        for name in measurements:
            rows = held_rows(measurements[name])
            findings += [_held(measurements, name, rows)] if rows else []
            findings += self._channel(measurements, name, still, rows or 1)
        return findings

    def _channel(self, measured: Measurements, name: str, still: np.ndarray | None, every: int) -> list[Finding]:
        """Runs of one channel; of one whose values are held, `every` so many rows are one sample."""
        values, time, rate = measured[name][::every], measured.time(name)[::every], measured.rate(name) / every
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
            if last - first < need or (rest and not self._cut(measured, name, values, rate, first, last)):
                continue
            if kind_of(measured, name) == "tachometer" and not self._cut(measured, name, values, rate, first, last):
                continue
            null = values[first] == 0.0
            findings.append(
                Finding(
                    "null" if null else "stuck",
                    name,
                    start,
                    end,
                    f"{every * (last - first)} samples of {'zero' if null else f'{values[first]:.6g}'}",
                    "check connection and logger; treat the stretch as a gap",
                    repair=Blank(),
                )
            )
        return findings

    def _cut(self, measured: Measurements, name: str, values: np.ndarray, rate: float, first: int, last: int) -> bool:
        """Whether a tachometer jumps into or out of the run faster than a wheel can be braked."""
        if kind_of(measured, name) != "tachometer":
            return False
        radius = 1.0 if name.endswith("[m/s]") else float(measured.vehicle.get("wheel_radius", 0.45))
        edges = [abs(values[i] - values[i - 1]) * radius for i in (first, last) if 0 < i < values.size]
        return any(edge * rate > self.jump for edge in edges)


def _held(measured: Measurements, name: str, rows: int) -> Finding:
    """A note that a channel repeats its values."""
    time = measured.time(name)
    return Finding(
        "held",
        name,
        float(time[0]),
        float(time[-1]),
        f"each value stands in {rows} rows, as those of a slower sensor that are repeated",
        "import it as a table of its own with 'rows: changed', which takes each value once",
        severity="note",
    )


def _rests(still: np.ndarray, start: float, end: float) -> bool:
    """Whether the vehicle stands at both ends and between."""
    inside = still[(still >= start) & (still <= end)]
    return inside.size > 1 and inside[-1] - inside[0] > 0.8 * (end - start)
