"""Packets that appear twice in a record on an even grid."""

from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality.interface import Check, Finding
from railsim.quality.packets import Joins, copies, joins, sensors, unlikely
from railsim.quality.repairs import Blank, Close, Repair
from railsim.spec import quantity


class Repeated(Check, frozen=True):
    """Stretches in which all channels of a sensor have the very values of an earlier one.

    Noise makes that impossible by chance. Where the rows after a copy go on from it, the packet was put in beside the
    right ones, and all later rows came too late; else it stands in the place of a packet that is lost.
    """

    smooth: float = quantity(4.0, unit="mean square of innovations after a copy", source="1 where rows go on", gt=1)
    after: int = quantity(4, unit="rows after a copy", source="illustrative: what a jump rings for at least", ge=1)

    stage: ClassVar[int] = 2

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for each channel of a sensor."""
        return [one for names in sensors(measurements) for one in self._sensor(measurements, names)]

    def _sensor(self, measured: Measurements, names: list[str]) -> list[Finding]:
        found = copies(np.array([measured[name] for name in names]))
        if not found:
            return []
        time, rate = measured.time(names[0]), measured.rate(names[0])
        samples = np.unique(np.concatenate([np.arange(first, last) for first, last, _ in found]))
        put_in = self._goes_on(joins(measured, names), found)
        repair: Repair = Close() if put_in else Blank()
        what = "beside the right rows: all later ones came too late" if put_in else "in the place of others"
        done = "the rows after them are moved back" if put_in else "treat the stretch as a gap"
        extent = f"{len(found)} packets of {(found[0][1] - found[0][0]) / rate:.3g} s appear twice, {what}"
        advice = f"drop packets whose number came before; {done}"
        return [
            Finding(
                "repeated",
                name,
                float(time[samples[0]]),
                float(time[samples[-1]]),
                extent,
                advice,
                repair=repair,
                samples=samples,
            )
            for name in names
        ]

    def _goes_on(self, model: Joins | None, found: list[tuple[int, int, int]]) -> bool:
        """Whether the rows after the copies follow from them."""
        if model is None:
            return False
        count = next(iter(model.rows.values())).size
        places = np.array([last for _, last, _ in found if last + self.after <= count])
        if not places.size:
            return False
        cost = model.cost(np.arange(count), places, self.after)
        return cost / (places.size * self.after * len(model.rows)) < float(unlikely(np.sqrt([self.smooth]))[0])
