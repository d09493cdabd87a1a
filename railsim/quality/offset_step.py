"""Steps of the zero of a sensor within a record."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._offsets import axis_of, expected, speed_channel, tolerance
from railsim.quality._outliers import fitted, peaks, significance, step_pattern
from railsim.quality._signals import Whitened, chance, kind_of, whitened
from railsim.quality.companions import sized_beside
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Subtract
from railsim.spec import quantity

_Step = tuple[int, float]
"""Sample and size."""
_SURE = 0.25  # of a step, by which the means before and after may be uncertain: a shock at an end is no level
_CHANGE = 0.15  # m/s2: change of the train's acceleration that passengers do not notice, illustrative


@dataclass(frozen=True)
class _Look:
    """A whitened channel and the deviate of a step at each of its samples, shape (n,)."""

    white: Whitened
    deviate: np.ndarray


class OffsetStep(Check, frozen=True):
    """Level shifts of the autoregressive model: sharper than the vehicle moves, and they stay."""

    clean: float = quantity(4.0, unit="mean square of innovations that remain", source="1 without step", gt=1)
    least: float = quantity(5.0, unit="standard deviations of the data sheet's bias", source="illustrative", ge=0)
    same: float = quantity(0.25, unit="- difference of two steps that are one offset", source="illustrative", gt=0)

    alone: float = quantity(3.0, unit="- times the largest deviate of another channel", source="illustrative", gt=1)
    near: float = quantity(0.05, unit="s within which another channel speaks for a real event", source="illustrative")
    rest: float = quantity(0.1, unit="- of their mean square with the step", source="illustrative", gt=0, lt=1)
    stays: float = quantity(3.0, unit="s over which the mean must have moved", source="illustrative", gt=0)

    stage: ClassVar[int] = 5

    def find(self, measurements: Measurements) -> list[Finding]:
        """One finding for each offset that comes, and goes or stays."""
        looks = {}
        for name in measurements:
            if kind_of(measurements, name) not in ("tachometer", "gnss"):
                white = whitened(measurements[name], measurements.rate(name))
                if white is not None:
                    looks[name] = _Look(white, significance(white, step_pattern(white.filter)))
        return [one for name in looks for one in self._channel(measurements, name, looks)]

    def _channel(self, measured: Measurements, name: str, looks: Mapping[str, "_Look"]) -> list[Finding]:
        every = self._steps(measured, name, looks[name], strict=False)
        steps = [one for one in self._steps(measured, name, looks[name]) if self._single(measured, name, one[0], looks)]
        steps = lasting(measured, name, steps, self.stays)
        last = measured[name].size
        stretches: list[tuple[int, int, float]] = []
        while steps:
            at, size = steps.pop(0)
            back = next((one for one in steps if self._undoes(one[1], size)), None)
            if back is not None:
                steps.remove(back)
            else:
                weak = [one for one in every if self._undoes(one[1], size)]
                weak = [one for one in weak if len(lasting(measured, name, sorted([one, (at, size)]), self.stays)) == 2]
                back = min(weak, key=lambda one: abs(one[1] + size), default=None)
            if back is not None:
                first, second = sorted([(at, size), back])
                stretches.append((first[0], second[0], first[1] if first[0] == at else -size))
            elif self._later_is_wrong(measured, name, at):
                stretches.append((at, last, size))
            else:
                stretches.append((0, at, -size))
        return [
            self._finding(measured, name, a, b, sized_beside(measured, name, a, b, size)) for a, b, size in stretches
        ]

    def _undoes(self, first: float, second: float) -> bool:
        """Whether two steps cancel."""
        return abs(first + second) < self.same * abs(second)

    def _steps(self, measured: Measurements, name: str, look: "_Look", strict: bool = True) -> list[_Step]:
        white, deviate = look.white, look.deviate
        pattern = step_pattern(white.filter)
        norm = float(np.sqrt(pattern @ pattern))
        outlier = significance(white, white.filter)
        least = self.least * tolerance(measured, name).deviation
        steps = []
        for at in peaks(deviate, chance(deviate.size, len(measured)), pattern.size):
            size = float(deviate[at] * white.scale[at]) / norm
            before, after, _ = fitted(white, pattern[: pattern.size // 4], [at])
            sharp = abs(deviate[at]) > abs(outlier[at]) and after < max(self.clean, self.rest * before)
            if (sharp or not strict) and abs(size) > least and 8 < at < deviate.size - pattern.size:
                steps.append((at, size))
        return steps

    def _single(self, measured: Measurements, name: str, at: int, looks: Mapping[str, "_Look"]) -> bool:
        """Whether no other channel has a step of its own at that moment: what several see is real."""
        when = measured.time(name)[at]
        if axis_of(name) == "x" and _changes_speed(measured, float(when)):
            return False
        size = abs(looks[name].deviate[at])
        for other, look in looks.items():
            if other != name:
                first, last = np.searchsorted(measured.time(other), [when - self.near, when + self.near])
                if self.alone * np.max(np.abs(look.deviate[first:last]), initial=0.0) > size:
                    return False
        return True

    def _later_is_wrong(self, measured: Measurements, name: str, at: int) -> bool:
        """Whether the mean before the step is nearer to what is expected than that after it."""
        values, target = measured[name], expected(measured, name)
        before, after = float(np.nanmean(values[:at])), float(np.nanmean(values[at:]))
        return abs(before - target) <= abs(after - target)

    def _finding(self, measured: Measurements, name: str, first: int, last: int, size: float) -> Finding:
        time = measured.time(name)
        return Finding(
            "offset step",
            name,
            float(time[first]),
            float(time[last - 1]),
            f"the zero is {size:+.3g} off",
            "check the supply and temperature of the sensor; the step is taken out",
            repair=Subtract(size),
            samples=np.arange(first, last),
        )


def lasting(measured: Measurements, name: str, steps: list[_Step], length: float) -> list[_Step]:
    """The steps after which the mean has moved by about their size."""
    values, reach = measured[name], round(length * measured.rate(name))
    edges = [0, *(at for at, _ in steps), values.size]
    lasting = []
    for number, (at, size) in enumerate(steps, 1):
        before = values[max(edges[number - 1], at - reach) : at]
        after = values[at : min(edges[number + 1], at + reach)]
        if np.isfinite(before).sum() < 16 or np.isfinite(after).sum() < 16:
            continue
        moved = float(np.nanmean(after) - np.nanmean(before))
        unsure = float(np.hypot(*(np.nanstd(one) / np.sqrt(np.isfinite(one).sum()) for one in (before, after))))
        if 0.5 < moved / size < 1.6 and unsure < _SURE * abs(size):
            lasting.append((at, size))
    return lasting


def _changes_speed(measured: Measurements, when: float) -> bool:
    """Whether the train's acceleration changes at that moment by its speed channel: driver or brake, not a sensor."""
    name = speed_channel(measured)
    if name is None:
        return False
    time, values = measured.time(name), measured[name]
    slopes = []
    for first, last in ((when - 2.0, when), (when, when + 2.0)):
        inside = (time >= first) & (time <= last) & np.isfinite(values)
        if inside.sum() < 8:
            return False
        slopes.append(float(np.polyfit(time[inside], values[inside], 1)[0]))
    return abs(slopes[1] - slopes[0]) > _CHANGE
