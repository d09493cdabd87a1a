"""Lost samples and missing rows."""

from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._grid import numbers, times
from railsim.quality._signals import kind_of, runs
from railsim.quality.draft import clock_name
from railsim.quality.interface import Check, Finding, Severity
from railsim.quality.repairs import Regrid

_KEEP = "treat the stretch as a gap: estimators mark it as not valid"


class DropOuts(Check, frozen=True):
    """Stretches without samples; a receiver's outage is noted only, because tunnels and cuttings make them."""

    stage: ClassVar[int] = 1

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a stretch and channel, or for a gap in a table's rows."""
        findings = [one for rate, time in times(measurements).items() for one in _gaps(time, rate)]
        for name in measurements:
            findings += _lost(measurements, name)
        return findings


def _gaps(time: np.ndarray, rate: float) -> list[Finding]:
    at = numbers(time, rate)
    wide = np.flatnonzero(np.diff(at) > 1)
    return [
        Finding(
            "drop-out",
            clock_name(rate),
            float(time[row] + 1 / rate),
            float(time[row + 1] - 1 / rate),
            f"{int(at[row + 1] - at[row]) - 1} rows are missing",
            _KEEP,
            repair=Regrid(),
        )
        for row in wide
    ]


def _lost(measured: Measurements, name: str) -> list[Finding]:
    time, rate = measured.time(name), measured.rate(name)
    lost = runs(np.isnan(measured[name]))
    if not lost:
        return []
    severity: Severity = "note" if kind_of(measured, name) == "gnss" else "fault"
    joined = [lost[0]]
    for first, last in lost[1:]:
        if first - joined[-1][1] < rate:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    findings = []
    for first, last in joined:
        count = int(np.isnan(measured[name][first:last]).sum())
        text = f"{count} samples are lost" if count < time.size else "holds no samples at all"
        findings.append(
            Finding("drop-out", name, float(time[first]), float(time[last - 1]), text, _KEEP, severity=severity)
        )
    return findings
