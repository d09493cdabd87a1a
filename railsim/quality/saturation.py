"""Values at the end of the range, by the data sheet or by a flat top."""

import math
from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._signals import limit, runs
from railsim.quality.interface import ChannelCheck, Finding
from railsim.quality.repairs import Restore
from railsim.spec import quantity

_STUCK = 0.25  # s; one run that is longer is a sensor that is stuck, or a vehicle at rest


class Saturation(ChannelCheck, frozen=True):
    """An unlimited signal takes its extreme value about once; a limited one takes it often."""

    fewest: int = quantity(6, unit="samples at the extreme value", source="illustrative", ge=3)
    width: float = quantity(
        5.0, unit="standard deviations above the next two values' largest count", source="Poisson", gt=1
    )
    close: float = quantity(0.999, unit="of the range of the data sheet", source="illustrative", gt=0, le=1)

    stage: ClassVar[int] = 3

    def channel(self, measured: Measurements, name: str) -> Finding | None:
        """One finding for a channel: from the first to the last sample at an end."""
        values = measured[name]
        good = values[np.isfinite(values)]
        top = limit(measured, name, "range")
        ended = np.zeros(values.size, dtype=bool)
        if top:
            ended |= np.abs(values) >= self.close * top
        if good.size > 100:
            levels, counts = np.unique(good, return_counts=True)
            for level, count, others in ((levels[-1], counts[-1], counts[-3:-1]), (levels[0], counts[0], counts[1:3])):
                if others.size and count > max(self.fewest, others.max() + self.width * math.sqrt(others.max())):
                    flat = values == level
                    longest = max(last - first for first, last in runs(flat))
                    if longest < _STUCK * measured.rate(name) or len(runs(flat)) > 2:
                        ended |= flat
        if not ended.any():
            return None
        at, time = np.flatnonzero(ended), measured.time(name)
        return Finding(
            "saturation",
            name,
            float(time[at[0]]),
            float(time[at[-1]]),
            f"{at.size} samples ({100 * ended.mean():.2g} %) at the end of the range, {values[at[0]]:.4g}",
            "use a larger range; what lies beyond is lost, short runs are estimated and long ones left out",
            repair=Restore(),
            samples=at,
        )
