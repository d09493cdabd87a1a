"""Packets that changed places in a record on an even grid."""

from itertools import combinations
from typing import ClassVar

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.signal import lfilter

from railsim.measurements import Measurements
from railsim.quality.interface import Check, Finding
from railsim.quality.packets import Joins, joins, odds, sensors, unlikely
from railsim.quality.repairs import Reorder
from railsim.spec import quantity

_A_SECOND = 8  # rows of the largest surprise that are looked at
_FADING = 0.7  # a row, by which the surprises after a row count for it
_BESIDE = 2  # rows beside a join that are taken for the same


class Reordered(Check, frozen=True):
    """Two neighbouring stretches of as many rows that, exchanged, go on from each other, where as they are they do not.

    Three places where rows do not go on from those before bound the two stretches. The likelihood is that of the
    innovations after these places under the channels' autoregressive models, of all channels of the sensor together.
    """

    longest: float = quantity(1.0, unit="s, of both stretches", source="illustrative: buffers of loggers", gt=0)
    after: int = quantity(8, unit="rows after a join", source="illustrative: what a jump rings for at least", ge=1)
    smooth: float = quantity(4.0, unit="mean square of innovations once exchanged", source="1 where rows go on", gt=1)

    stage: ClassVar[int] = 3

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for each channel of a sensor, or of a table whose logger's packets hold all sensors."""
        single = sensors(measurements)
        tables: dict[float, list[list[str]]] = {}
        for names in single:
            tables.setdefault(measurements.rate(names[0]), []).append(names)
        findings: list[Finding] = []
        for groups in tables.values():
            together = self._sensor(measurements, [one for names in groups for one in names]) if groups[1:] else []
            alone = [one for names in groups for one in self._sensor(measurements, names)]
            all_of_them = len({one.channel for one in alone}) != sum(len(names) for names in groups[:1])
            findings += together if together and all_of_them else alone
        return findings

    def _sensor(self, measured: Measurements, names: list[str]) -> list[Finding]:
        model = joins(measured, names)
        rate = measured.rate(names[0])
        pairs = [] if model is None else self._exchanges(model, rate)
        if not pairs:
            return []
        time = measured.time(names[0])
        order = np.arange(time.size)
        for first, middle, last in pairs:
            order[first:last] = np.r_[middle:last, first:middle]
        samples = np.flatnonzero(order != np.arange(time.size))
        extent = f"{len(pairs)} times packets changed places, the first of {(pairs[0][1] - pairs[0][0]) / rate:.3g} s"
        return [
            Finding(
                "reordered",
                name,
                float(time[samples[0]]),
                float(time[samples[-1]]),
                extent,
                "sort packets by their number; they are put back in their order",
                repair=Reorder(order=order[samples]),
                samples=samples,
            )
            for name in names
        ]

    def _exchanges(self, model: Joins, rate: float) -> list[tuple[int, int, int]]:
        """First row, first of the second stretch, and one past the last, of each exchange."""
        count, now = model.surprise.size, model.now(self.after)
        reach = round(self.longest * rate)
        usual = float(np.median(model.surprise))
        places = _peaks(model.surprise - usual, round(_A_SECOND * count / rate), self.after)
        need = odds(count * reach)
        found = []
        for number, first in enumerate(places):
            near = [one for one in places[number + 1 :] if one - first <= reach]
            alike = [pair for pair in combinations(near, 2) if abs(first + pair[1] - 2 * pair[0]) <= _BESIDE]
            for middle, last in alike:
                before = now[first] + now[middle] + now[last]
                if before - 3 * self.after * usual < need or middle - first < self.after:
                    continue
                left = self._at_joins(model, first, middle, last)
                if before - left > need:
                    gain = self._gain(model, first, middle, last)
                    found += [(gain, (first, middle, last))] if gain > need else []
        sharp = [self._sharpened(model, one[0], one[2]) for one in _apart(found)]
        return _apart([*sharp, *self._alike(model, [one for _, one in sharp])])

    def _at_joins(self, model: Joins, first: int, middle: int, last: int) -> float:
        """Cost after the three joins with the stretches exchanged; infinite where a channel does not go on there.

        A shock stays rough wherever it is put.
        """
        order, at = self._exchanged(model, first, middle, last)
        each = model.costs(order, np.array([0, last - middle, last - first]) + at, self.after)
        smooth = float(unlikely(np.sqrt([self.smooth]))[0]) * 3 * self.after
        return float(each.sum()) if float(each.max()) < smooth else float("inf")

    def _gain(self, model: Joins, first: int, middle: int, last: int) -> float:
        """Gain of likelihood over all rows that the exchange touches, those after it included that look back to it."""
        order, at = self._exchanged(model, first, middle, last)
        now = float(model.surprise[first : int(order[-1]) + 1].sum())
        return now - model.cost(order, np.array([at]), order.size)

    def _exchanged(self, model: Joins, first: int, middle: int, last: int) -> tuple[np.ndarray, int]:
        """Order of the rows about an exchange, and where in it the first stretch begins."""
        order = model.near(first, last)
        at = int(np.searchsorted(order, first))
        order[at : at + last - first] = np.r_[middle:last, first:middle]
        return order, at

    def _sharpened(self, model: Joins, first: int, last: int) -> tuple[float, tuple[int, int, int]]:
        """The best places within some rows."""
        beside = range(-_BESIDE, _BESIDE + 1)
        size = (last - first) // 2
        tried = [(first + a, first + a + size + b, first + a + 2 * (size + b)) for a in beside for b in beside]
        count = next(iter(model.rows.values())).size
        inside = [one for one in tried if 0 < one[0] < one[1] < one[2] < count]
        return max((self._gain(model, *one), one) for one in inside)

    def _alike(self, model: Joins, known: list[tuple[int, int, int]]) -> list[tuple[float, tuple[int, int, int]]]:
        """Further exchanges of packets of the usual size, on their grid: fewer places, so less is needed of each."""
        if not known:
            return []
        sizes = [middle - first for first, middle, _ in known]
        size = max(set(sizes), key=sizes.count)
        start = next(first for (first, middle, _) in known if middle - first == size) % size
        count = next(iter(model.rows.values())).size
        tried = [(one, one + size, one + 2 * size) for one in range(start or size, count - 2 * size, size)]
        smooth = [one for one in tried if np.isfinite(self._at_joins(model, *one))]
        gains = [(self._gain(model, *one), one) for one in smooth]
        bounds = {edge for first, _, last in known for edge in (first, last)}
        return [(gain, one) for gain, one in gains if gain > odds(len(tried)) and not {one[0], one[2]} & bounds]


def _apart(found: list[tuple[float, tuple[int, int, int]]]) -> list[tuple[int, int, int]]:
    """The exchanges of the largest gain that do not overlap, in order."""
    chosen: list[tuple[int, int, int]] = []
    for _, one in sorted(found, reverse=True):
        if all(one[2] <= other[0] or one[0] >= other[2] for other in chosen):
            chosen.append(one)
    return sorted(chosen)


def _peaks(surprise: np.ndarray, most: int, after: int) -> list[int]:
    """The `most` rows in which the largest surprises begin, each the largest within `after` rows, in order."""
    fading = np.asarray(lfilter([1.0], [1.0, -_FADING], surprise[::-1]))[::-1]
    places = np.flatnonzero((fading == maximum_filter1d(fading, after + 1)) & (fading > 0.0))
    largest = places[np.argsort(fading[places])[-most:]]
    return [int(one) for one in np.sort(largest)]
