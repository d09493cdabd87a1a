"""A recording's tables as they are changed."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from railsim.measurements import TIME, Measurements

if TYPE_CHECKING:
    from railsim.quality.interface import Finding

Columns = dict[str, np.ndarray]


def clock_name(rate: float) -> str:
    """What findings call the times of the table at `rate` Hz: "time [s] at 256 Hz", from which the rate comes back."""
    short = f"{rate:g}"
    return f"{TIME} at {short if float(short) == rate else repr(rate)} Hz"


def tables_of(measured: Measurements) -> dict[float, Columns]:
    """Copies of a recording's tables, times first, by sample rate."""
    tables: dict[float, Columns] = {}
    for name in measured:
        table = tables.setdefault(measured.rate(name), {TIME: measured.time(name).copy()})
        table[name] = measured[name].copy()
    return tables


@dataclass
class Draft:
    """A recording that is being repaired.

    Attributes
    ----------
    measured : as it was.
    tables : its tables by sample rate, as far as they are repaired.
    even : rates of the tables that are on their even grid.
    """

    measured: Measurements
    tables: dict[float, Columns]
    even: set[float] = field(default_factory=set)

    def rate(self, finding: "Finding") -> float:
        """Sample rate of the table that is concerned, Hz."""
        if finding.channel.startswith(TIME):
            return float(finding.channel.removeprefix(f"{TIME} at ").removesuffix(" Hz"))
        return self.measured.rate(finding.channel)

    def table(self, finding: "Finding") -> Columns:
        """The table that is concerned."""
        return self.tables[self.rate(finding)]

    def samples(self, finding: "Finding") -> np.ndarray:
        """Numbers of the samples that are concerned, shape (n,)."""
        if finding.samples is not None:
            return finding.samples
        time = self.table(finding)[TIME]
        half = 0.5 * float(np.median(np.diff(time)))
        return np.flatnonzero((time > finding.start - half) & (time < finding.end + half))

    def result(self) -> Measurements:
        """The recording with its tables as they are now."""
        return Measurements(self.measured.about, self.tables, self.measured.track)
