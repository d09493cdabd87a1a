"""A table of one sample rate that runs ahead of or behind the others, by the kinematics of the bogie."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations
from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._balance import whitening
from railsim.quality._grid import times
from railsim.quality._rigid import Relation, relations, spectra_of
from railsim.quality.draft import clock_name
from railsim.quality.interface import Check, Finding
from railsim.quality.orientation import alternatives
from railsim.quality.repair import repaired
from railsim.quality.repairs import Shift
from railsim.spec import quantity

_STEP = 5e-4  # s between the shifts that are tried
_CLOSE, _FINE = 0.02, 5e-5  # s about the first, and between those that are tried then
_TAPER = 1.0  # s at both ends of the record; Hann's window over all of it would see a stop in the middle most


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
        frequency, spectra = spectra_of(measurements, _TAPER)
        related = relations(measurements, frequency, spectra)
        rates = sorted({measurements.rate(name) for name in spectra}, reverse=True)
        findings = []
        for moved, fixed in combinations(rates, 2):
            both = between(measurements, related, (moved, fixed))
            if both:
                findings += self._pair(measurements, (moved, fixed), both, frequency, spectra)
        return findings

    def _pair(
        self,
        measured: Measurements,
        rates: tuple[float, float],
        related: list[Relation],
        frequency: np.ndarray,
        spectra: Mapping[str, np.ndarray],
    ) -> list[Finding]:
        shifts = np.arange(-self.largest, self.largest + _STEP / 2, _STEP)
        shifts[np.argmin(np.abs(shifts))] = 0.0
        total, count = costs(measured, rates[0], related, frequency, spectra, shifts)
        best = int(np.argmin(total))
        gained = float(total[shifts == 0.0][0] - total[best])
        if gained < self.gain + self.density * count or abs(shifts[best]) < self.smallest:
            return []
        if gained < best_reading(measured, related, spectra):
            return []
        early = float(shifts[best])
        time = times(measured)[rates[0]]
        word = "early" if early < 0 else "late"
        finding = Finding(
            "clock shift",
            clock_name(rates[0]),
            float(time[0]),
            float(time[-1]),
            f"{1e3 * abs(early):.3g} ms {word} beside the table at {rates[1]:g} Hz"
            f" (likelihood ratio exp({gained:.0f}))",
            "check how the loggers are triggered; the table is moved",
            repair=Shift(-early),
            other=clock_name(rates[1]),
        )
        return [replace(finding, repair=Shift(-early - _residual_shift(repaired(measured, [finding]), rates)))]


def between(measured: Measurements, related: list[Relation], rates: tuple[float, float]) -> list[Relation]:
    """The relations over tables of these two rates."""
    return [one for one in related if {measured.rate(name) for name in one.weights} == set(rates)]


def costs(
    measured: Measurements,
    moved: float,
    related: list[Relation],
    frequency: np.ndarray,
    spectra: Mapping[str, np.ndarray],
    shifts: np.ndarray,
) -> tuple[np.ndarray, int]:
    """Cost of each shift [s] of the table of rate `moved`, shape (n,), noise by the data sheets made white; freedom."""
    rotation = np.exp(2j * np.pi * np.outer(shifts, frequency))
    total, count = np.zeros(shifts.size), 0
    for relation in related:
        white = whitening(relation, measured, frequency)
        parts = {name: weight * spectra[name] for name, weight in relation.weights.items()}
        plain, sizes = (sum(float(np.sum(np.abs(w * one) ** 2)) for one in parts.values()) for w in (1.0, white))
        moving = white * sum(part for name, part in parts.items() if measured.rate(name) == moved)
        rest = white * sum(part for name, part in parts.items() if measured.rate(name) != moved)
        allowed = relation.tolerance * sizes / max(plain, 1e-30) + 1e-300
        freedom = int(np.count_nonzero(next(iter(relation.weights.values()))))
        total += freedom * np.log(np.sum(np.abs(rotation * moving + rest) ** 2, axis=1) + allowed)
        count += freedom
    return total, count


def _residual_shift(measured: Measurements, rates: tuple[float, float]) -> float:
    """Shift [s] that the moved table still has: the windows of both now lie over the same samples."""
    frequency, spectra = spectra_of(measured, _TAPER)
    both = between(measured, relations(measured, frequency, spectra), rates)
    shifts = np.arange(-_CLOSE, _CLOSE, _FINE)
    return float(shifts[np.argmin(costs(measured, rates[0], both, frequency, spectra, shifts)[0])])


def best_reading(measured: Measurements, related: list[Relation], spectra: Mapping[str, np.ndarray]) -> float:
    """Largest gain in cost that a single exchange or change of sign makes of the same sums."""
    means = dict.fromkeys(spectra, 0.0)

    def cost(choice: Mapping[str, tuple[str, float]]) -> float:
        return sum(
            np.count_nonzero(next(iter(one.weights.values()))) * float(np.log(one.residual(spectra, choice) + 1e-300))
            for one in related
        )

    return max((cost({}) - cost(choice) for choice in alternatives(measured, related, means)), default=-np.inf)
