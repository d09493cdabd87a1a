"""A table whose clock runs fast or slow beside another's, by the kinematics of the bogie in parts of the record."""

from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np

from railsim.measurements import TIME, Measurements
from railsim.quality._grid import stretched, times
from railsim.quality._rigid import relations, spectra_of
from railsim.quality.clock_shift import best_reading, between, costs
from railsim.quality.draft import clock_name, tables_of
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Stretch
from railsim.spec import quantity

_PART, _HOP, _TAPER = 4.0, 2.0, 0.75  # s: parts in which a shift is constant, between them, and at their ends
_COARSE, _FINE = 2e-3, 1e-4  # s between shifts that are tried first, and then
_CLOSE = 0.02  # s about the first, where those of the second step are tried
_FEWEST, _MOST = 4, 14  # parts
_PASSES = 3
_FIRST = 0.03  # s of shift at the start, at most, that is tried beside each rate


@dataclass(frozen=True)
class _Local:
    """Costs of shifts in parts of a record.

    Attributes
    ----------
    middles : of the parts, s after the first stamp, shape (m,).
    shifts : s, shape (s,).
    costs : nepers, shape (m, s).
    count : independent values in all parts.
    """

    middles: np.ndarray
    shifts: np.ndarray
    costs: np.ndarray
    count: int

    def along(self, rates: np.ndarray, firsts: np.ndarray) -> np.ndarray:
        """Cost of shifts that begin at `firsts` s, (f,), and grow by `rates` s/s, (r,); shape (r, f).

        Shifts beyond what was tried count as the worst.
        """
        total = np.zeros((rates.size, firsts.size))
        step = self.shifts[1] - self.shifts[0]
        for middle, cost in zip(self.middles, self.costs, strict=True):
            at = (firsts + rates[:, None] * middle - self.shifts[0]) / step
            low = np.clip(np.floor(at).astype(int), 0, self.shifts.size - 2)
            part = at - low
            value = (1 - part) * cost[low] + part * cost[low + 1]
            total += np.where((part >= 0.0) & (part <= 1.0), value, cost.max())
        return total


class ClockRate(Check, frozen=True):
    """The shift of one table against another that grows steadily and makes the sums over both vanish in every part.

    Which of the two clocks is wrong is not known: the table of the higher rate is brought to the other's time.
    """

    gain: float = quantity(40.0, unit="nepers of likelihood", source="odds against 2000 rates", gt=0)
    density: float = quantity(0.1, unit="nepers a coefficient", source="illustrative: 10 % of the energy", ge=0)
    largest: float = quantity(0.025, unit="s/s", source="illustrative: 1 to 2 % of oscillators in sensors", gt=0)
    smallest: float = quantity(2e-4, unit="s/s", source="illustrative: above the 1e-4 of poor quartz", gt=0)

    stage: ClassVar[int] = 5

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for a pair of tables."""
        frequency, spectra = spectra_of(measurements)
        related = relations(measurements, frequency, spectra)
        rates = sorted({measurements.rate(name) for name in spectra}, reverse=True)
        reading = best_reading(measurements, related, spectra)
        found = [
            self._pair(measurements, pair, reading)
            for pair in combinations(rates, 2)
            if between(measurements, related, pair)
        ]
        return [one for one in found if one is not None]

    def _pair(self, measured: Measurements, rates: tuple[float, float], reading: float) -> Finding | None:
        local = _local(measured, rates, _span(measured, self.largest), _COARSE)
        if local is None:
            return None
        tried = np.arange(-self.largest, self.largest, 0.5 * _COARSE / float(local.middles[-1]))
        rate, first, cost = _best(local, tried, np.arange(-_FIRST, _FIRST, _COARSE))
        as_it_is = _best(local, np.zeros(1), local.shifts)[2]
        if as_it_is - cost < self.gain:
            return None
        for _ in range(_PASSES):
            rest = _local(_mended(measured, rates[0], rate, first), rates, _CLOSE, _FINE)
            if rest is None:
                break
            close = _CLOSE / float(rest.middles[-1])
            more = _best(rest, np.linspace(-close, close, 401), np.arange(-_CLOSE, _CLOSE, _FINE))
            rate, first, cost = rate + more[0], first + more[1], more[2]
        gained = as_it_is - cost  # a shift that grows within a part blurs it, until the table is mended
        if gained < max(self.gain + self.density * local.count, reading) or abs(rate) < self.smallest:
            return None
        time = times(measured)[rates[0]]
        word = "fast" if rate > 0 else "slow"
        return Finding(
            "clock rate",
            clock_name(rates[0]),
            float(time[0]),
            float(time[-1]),
            f"{100 * abs(rate):.3g} % {word} beside the table at {rates[1]:g} Hz (likelihood ratio exp({gained:.0f}))",
            "stamp by one clock, or state the real rate; the table is resampled",
            repair=Stretch(-rate, first=-first),
            other=clock_name(rates[1]),
        )


def _span(measured: Measurements, largest: float) -> float:
    """Largest shift that is looked for, s."""
    first, last = measured.span()
    return min(1.0, max(0.1, largest * (last - first)))


def _local(measured: Measurements, rates: tuple[float, float], span: float, step: float) -> _Local | None:
    """Costs of shifts up to `span` s, `step` s apart, in parts of the record; None where there are too few."""
    first, last = measured.span()
    shifts = np.arange(-span, span + step / 2, step)
    hop = max(_HOP, (last - first - _PART) / (_MOST - 1))
    middles, found, total = [], [], 0
    for begin in np.arange(first, last - _PART + 1e-6, hop):
        piece = measured.between(float(begin), float(begin + _PART))
        if piece is None:
            continue
        frequency, spectra = spectra_of(piece[0], _TAPER)
        both = between(piece[0], relations(piece[0], frequency, spectra), rates)
        if not both:
            continue
        cost, count = costs(piece[0], rates[0], both, frequency, spectra, shifts)
        middles.append(begin + _PART / 2 - first)
        found.append(cost)
        total += count
    if len(middles) < _FEWEST:
        return None
    return _Local(np.array(middles), shifts, np.array(found), total)


def _best(local: _Local, rates: np.ndarray, firsts: np.ndarray) -> tuple[float, float, float]:
    """Rate, s/s, shift at the start, s, and cost."""
    total = local.along(rates, firsts)
    rate, first = np.unravel_index(int(np.argmin(total)), total.shape)
    return float(rates[rate]), float(firsts[first]), float(total[rate, first])


def _mended(measured: Measurements, moved: float, rate: float, first: float) -> Measurements:
    tables = tables_of(measured)
    latest = max(float(table[TIME][-1]) + 1.0 / one for one, table in tables.items())
    tables[moved] = stretched(tables[moved], -rate, -first, latest)
    return Measurements(measured.about, tables, measured.track)
