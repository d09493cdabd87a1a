"""A table of one sample rate that runs ahead of or behind the others, by the kinematics of the bogie."""

from collections.abc import Mapping
from itertools import combinations
from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._rigid import Relation, relations, spectra_of
from railsim.quality.clock import tables
from railsim.quality.interface import Check, Finding
from railsim.quality.orientation import alternatives
from railsim.spec import quantity

_STEP = 5e-4  # s between the shifts that are tried


class ClockShift(Check, frozen=True):
    """The shift that makes sums over channels of two tables vanish which do not vanish with the stamps as they are.

    Tables in which no inertial sensor or transducer stands (tachometers, receiver) have no such sums and are not looked
    at. An exchange or a change of sign that explains the sums better is left to the check of these.
    """

    gain: float = quantity(40.0, unit="nepers of likelihood", source="odds against 2000 shifts", gt=0)
    density: float = quantity(0.1, unit="nepers a coefficient", source="illustrative: 10 % of the energy", ge=0)
    smallest: float = quantity(
        5e-3, unit="s", source="illustrative: above the delays of the sensors' own low-passes", gt=0
    )
    largest: float = quantity(0.5, unit="s", source="illustrative: a longer one shows in the speed", gt=0)

    stage: ClassVar[int] = 5

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a pair of tables."""
        frequency, spectra = spectra_of(measurements)
        related = relations(measurements, frequency, spectra)
        rates = sorted({measurements.rate(name) for name in spectra}, reverse=True)
        found = []
        for moved, fixed in combinations(rates, 2):
            rate = {name: measurements.rate(name) for name in spectra}
            both = [one for one in related if {rate[name] for name in one.weights} == {moved, fixed}]
            if both:
                found += self._pair(measurements, (moved, fixed), both, frequency, spectra)
        return found

    def _pair(
        self,
        measured: Measurements,
        rates: tuple[float, float],
        related: list[Relation],
        frequency: np.ndarray,
        spectra: Mapping[str, np.ndarray],
    ) -> list[Finding]:
        shifts = np.arange(-self.largest, self.largest + _STEP / 2, _STEP)
        turn = np.exp(2j * np.pi * np.outer(shifts, frequency))
        still, total, count = 0.0, np.zeros(shifts.size), 0
        for one in related:
            moving = sum(w * spectra[n] for n, w in one.weights.items() if measured.rate(n) == rates[0])
            rest = sum(w * spectra[n] for n, w in one.weights.items() if measured.rate(n) == rates[1])
            freedom = int(np.count_nonzero(next(iter(one.weights.values()))))
            total += freedom * np.log(np.sum(np.abs(turn * moving + rest) ** 2, axis=1) + one.tolerance + 1e-300)
            still += freedom * float(np.log(one.residual(spectra, {}) + 1e-300))
            count += freedom
        best = int(np.argmin(total))
        gained = still - float(total[best])
        if gained < self.gain + self.density * count or abs(shifts[best]) < self.smallest:
            return []
        if gained < still - _best_reading(measured, related, spectra):
            return []
        early = float(shifts[best])
        time = tables(measured)[rates[0]]
        word = "early" if early < 0 else "late"
        return [
            Finding(
                "clock shift",
                f"time [s] at {rates[0]:g} Hz",
                float(time[0]),
                float(time[-1]),
                f"{1e3 * abs(early):.3g} ms {word} beside the table at {rates[1]:g} Hz"
                f" (likelihood ratio exp({gained:.0f}))",
                "check how the loggers are triggered; the table is moved",
                repair="shift",
                amount=-early,
                other=f"time [s] at {rates[1]:g} Hz",
            )
        ]


def _best_reading(measured: Measurements, related: list[Relation], spectra: Mapping[str, np.ndarray]) -> float:
    """Smallest cost that a single exchange or change of sign makes of the same sums."""
    means = dict.fromkeys(spectra, 0.0)
    costs = [
        sum(
            np.count_nonzero(next(iter(one.weights.values()))) * float(np.log(one.residual(spectra, choice) + 1e-300))
            for one in related
        )
        for choice in alternatives(measured, related, means)
    ]
    return min(costs, default=np.inf)
