"""Swapped and inverted channels: which one exchange or sign makes the bogie a rigid body again."""

from collections.abc import Mapping
from itertools import combinations
from typing import ClassVar

import numpy as np
from scipy.ndimage import uniform_filter1d

from railsim.constants import GRAVITY
from railsim.measurements import Measurements
from railsim.quality._offsets import axis_of, speed_channel
from railsim.quality._rigid import Relation, relations, spectra_of
from railsim.quality._signals import filled, kind_of
from railsim.quality._turned import by_reading, turns
from railsim.quality.interface import Check, Finding
from railsim.quality.mounting import doubtful
from railsim.quality.repairs import Negate, Swap
from railsim.spec import quantity

_Reading = Mapping[str, tuple[str, float]]
"""By channel: from which channel, and with which sign, it is to be read."""


_DRIVING = 0.1  # m/s2: gradients and rough speed, below which the change of speed says nothing; illustrative
_SECOND = 2.0  # s, over which both are averaged


class Orientation(Check, frozen=True):
    """Likelihood of each exchange and each change of sign against that of the channels as they are.

    The likelihood is that of the residuals of the rigid-body relations with unknown levels, sum of n log energy, and of
    the mean specific force, which must be gravity's.
    """

    gain: float = quantity(20.0, unit="nepers of likelihood", source="odds of 5e8 against 40 alternatives", gt=0)
    share: float = quantity(0.1, unit="nepers a coefficient", source="illustrative: 10 % of the energy", ge=0)
    lean: float = quantity(1.0, unit="m/s2 of x and y", source="illustrative: curving and cant", gt=0)
    weight: float = quantity(0.3, unit="m/s2 of z", source="illustrative", gt=0)
    most: int = quantity(3, unit="findings", source="illustrative", ge=1)

    stage: ClassVar[int] = 6

    def find(self, measurements: Measurements) -> list[Finding]:
        """The best alternative, and on top of it the next, until nothing is to be gained."""
        frequency, spectra = spectra_of(measurements)
        related = relations(measurements, frequency, spectra)
        means = {
            name: float(np.nanmean(measurements[name])) for name in spectra if np.isfinite(measurements[name]).any()
        }
        for name in doubtful(measurements):
            means.pop(name, None)
        along = {name: one for name, one in _along(measurements, spectra).items() if name in means}
        choices = alternatives(measurements, related, means)
        seen = {name for relation in related for name in relation.weights}
        turned = by_reading([one for one in turns(measurements, set(means)) if seen & set(one.reading())])
        choices += [reading for _, reading in turned]
        read: dict[str, tuple[str, float]] = {}
        findings: list[Finding] = []
        cost = self._cost(measurements, related, spectra, means, read, along)
        while choices and len(findings) < self.most:
            costs = [self._cost(measurements, related, spectra, means, read | dict(one), along) for one in choices]
            best = int(np.argmin(costs))
            if cost - costs[best] < self.gain + self.share * _weight(related, choices[best]):
                break
            read |= dict(choices[best])
            turn = next((one for one, reading in turned if reading is choices[best]), None)
            gained = cost - costs[best]
            findings.append(
                turn.finding(measurements, gained) if turn else _finding(measurements, choices[best], gained)
            )
            cost = costs[best]
            touched = set(choices[best])
            choices = [one for one in choices if not touched & set(one)]
        return findings

    def _cost(
        self,
        measured: Measurements,
        related: list[Relation],
        spectra: Mapping[str, np.ndarray],
        means: Mapping[str, float],
        read: _Reading,
        along: Mapping[str, tuple[Mapping[str, np.ndarray], np.ndarray]],
    ) -> float:
        """Minus the logarithm of the likelihood, up to a constant."""
        total = 0.0
        for relation in related:
            count = np.count_nonzero(next(iter(relation.weights.values())))
            total += count * float(np.log(relation.residual(spectra, read) + 1e-300))
        for name, (times, change) in along.items():
            source, sign = read.get(name, (name, 1.0))
            off = sign * times[source] - change
            total += off.size / 2 * float(np.log(np.var(off) + _DRIVING**2))
        for name in means:
            if kind_of(measured, name) == "accelerometer":
                source, sign = read.get(name, (name, 1.0))
                target = GRAVITY if axis_of(name) == "z" else 0.0
                width = self.weight if target else self.lean
                total += 0.5 * ((sign * means.get(source, target) - target) / width) ** 2
        return total


def _weight(related: list[Relation], choice: _Reading) -> int:
    """Number of spectral coefficients in the relations that a choice changes."""
    touched = [one.weights for one in related if set(choice) & set(one.weights)]
    return sum(int(np.count_nonzero(next(iter(weights.values())))) for weights in touched)


def _along(
    measured: Measurements, spectra: Mapping[str, np.ndarray]
) -> dict[str, tuple[Mapping[str, np.ndarray], np.ndarray]]:
    """By longitudinal channel: means over pieces of a record of every channel of its table, and the change of speed."""
    speed = speed_channel(measured)
    by_channel: dict[str, tuple[Mapping[str, np.ndarray], np.ndarray]] = {}
    names = [name for name in spectra if kind_of(measured, name) == "accelerometer" and axis_of(name) == "x"]
    if speed is None:
        return by_channel
    for name in names:
        time = measured.time(name)
        edges = np.arange(time[0], time[-1] - _SECOND, _SECOND)
        like = [other for other in spectra if measured.rate(other) == measured.rate(name)]
        first = np.searchsorted(time, edges)
        count = round(_SECOND * measured.rate(name))
        means = {other: np.array([filled(measured[other])[at : at + count].mean() for at in first]) for other in like}
        values = np.interp([*edges, edges[-1] + _SECOND], measured.time(speed), _calm(measured, speed))
        by_channel[name] = (means, np.diff(values) / _SECOND)
    return by_channel


def _calm(measured: Measurements, speed: str) -> np.ndarray:
    """A speed channel averaged over a second."""
    size = max(1, round(measured.rate(speed)))
    return np.asarray(uniform_filter1d(filled(measured[speed]), size, mode="nearest"))


def alternatives(measured: Measurements, related: list[Relation], means: Mapping[str, float]) -> list[_Reading]:
    """Every change of sign of a channel and every exchange of two of one kind and rate that a relation can tell."""
    seen = {name for relation in related for name in relation.weights}
    seen |= {name for name in means if kind_of(measured, name) == "accelerometer" and axis_of(name) in "xz"}
    names = [name for name in means if name in seen]
    readings: list[_Reading] = [{name: (name, -1.0)} for name in names]
    for first, second in combinations(means, 2):
        alike = kind_of(measured, first) == kind_of(measured, second) and measured.rate(first) == measured.rate(second)
        if alike and (first in seen or second in seen):
            readings.append({first: (second, 1.0), second: (first, 1.0)})
    return readings


def _finding(measured: Measurements, choice: _Reading, gain: float) -> Finding:
    names = list(choice)
    time = measured.time(names[0])
    text = f"the bogie is a rigid body only otherwise (likelihood ratio exp({gain:.0f}))"
    if len(names) == 1:
        advice = "check the mounting; the sign is turned round"
        return Finding("inverted", names[0], float(time[0]), float(time[-1]), text, advice, repair=Negate())
    advice = "check cables and the logger's list of channels; the two are exchanged"
    return Finding("swapped", names[0], float(time[0]), float(time[-1]), text, advice, repair=Swap(), other=names[1])
