"""Changes of a channel's gain within a record, by the kinematics of the bogie as a rigid body."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._balance import COARSE, Balance, balance, exact
from railsim.quality._change_point import edges, interval
from railsim.quality._rigid import relations, spectra_of, window_of
from railsim.quality._signals import filled
from railsim.quality.agreement import agreement
from railsim.quality.draft import tables_of
from railsim.quality.gravity import by_mean, levelled, weighed
from railsim.quality.interface import Check, Finding
from railsim.quality.repairs import Scale
from railsim.spec import quantity

_PASSES = 3
_END = 1.0  # s at the record's ends, where a change cannot be told from none
_EDGE = 0.25  # s between the instants that are tried
_ZONE = 0.5  # s about an edge that do not count: the edge is not known better, and a step of gravity rings there
_SEEN = 0.2  # of the window, below which a place counts as lost


@dataclass(frozen=True)
class _Stretches:
    """First and one past the last sample of every stretch that is tried, shapes (m,), in samples of the balances."""

    first: np.ndarray
    last: np.ndarray

    @classmethod
    def of(cls, count: int, shortest: float) -> "_Stretches":
        edges = np.append(np.arange(0, count, round(_EDGE * COARSE)), count)
        first, last = (one.ravel() for one in np.meshgrid(edges, edges, indexing="ij"))
        long = last - first >= shortest * COARSE
        return cls(first[long], last[long])

    def sums(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums of values (n,) within each stretch, and over the zones about its edges, shapes (m,)."""
        zone, count = round(_ZONE * COARSE), values.size
        total = np.concatenate([[0.0], np.cumsum(values)])

        def over(first: np.ndarray, last: np.ndarray) -> np.ndarray:
            return total[np.clip(last, 0, count)] - total[np.clip(first, 0, count)]

        begins, ends = over(self.first - zone, self.first + zone), over(self.last - zone, self.last + zone)
        return over(self.first + zone, self.last - zone), begins + ends


@dataclass(frozen=True)
class _Change:
    """A factor between two instants: logarithm of the likelihood ratio, first and last sample, gain."""

    likelihood: float
    first: int
    last: int
    gain: float


class GainChange(Check, frozen=True):
    """A channel that reads too much or too little for a while, beside other channels of the same rigid body.

    In a sum of channels that should vanish, a channel whose gain is g from some instant on leaves (1 - 1/g) of itself.
    The stretch, the channel and the gain that explain best what is left are sought together over all sums that the
    channel stands in; what data sheets allow for is left over anyway. Noise, spikes or a step in the channel leave
    something over as well, and a factor takes part of it away by making the channel small; but then the channel does
    not read g times what the others predict any better than it reads that itself. So a gain is named only where it is
    more likely than just more variance in the same stretch, of whatever kind.
    """

    gain: float = quantity(40.0, unit="nepers of likelihood", source="odds against 7000 stretches, 20 channels", gt=0)
    density: float = quantity(0.05, unit="nepers a coefficient", source="illustrative: 5 % of the energy", ge=0)
    explained: float = quantity(0.6, unit="- of what is left over in the stretch", source="illustrative", gt=0, lt=1)
    loud: float = quantity(3.0, unit="- power over noise by the data sheet", source="illustrative", gt=0)
    smallest: float = quantity(0.1, unit="- of the gain", source="illustrative: ten times a data sheet's", gt=0)
    largest: float = quantity(2.5, unit="-, the gain or its inverse", source="illustrative", gt=1)
    shortest: float = quantity(2.0, unit="s", source="illustrative", gt=1.5)

    stage: ClassVar[int] = 5

    def find(self, measurements: Measurements) -> list[Finding]:
        """At most one finding: the most likely."""
        heavy = weighed(measurements)
        if heavy is not None:
            return [_finding(measurements, *heavy, "by gravity and its innovations")]
        level = levelled(measurements)
        frequency, spectra = spectra_of(level)
        if frequency.size < 2:
            return []
        seconds = float(round((frequency.size - 1) / (frequency[-1] - frequency[0])))
        mine = [one for one in relations(measurements, frequency, spectra) if exact(one)]
        balances = [balance(one, measurements, frequency, spectra, seconds) for one in mine]
        seen = (window_of(measurements, list(spectra), seconds) > _SEEN).astype(float)
        changes = {name: self._best([one for one in balances if name in one.parts], name, seen) for name in spectra}
        likely = {name: one for name, one in changes.items() if one is not None}
        if not likely:
            return []
        name = max(likely, key=lambda name: likely[name].likelihood)
        return [_placed(measurements, level, name, likely[name])]

    def _best(self, balances: Sequence[Balance], name: str, seen: np.ndarray) -> _Change | None:
        """The best stretch of a channel; None where it is not good enough."""
        if not balances:
            return None
        tried = _Stretches.of(balances[0].total.size, self.shortest)
        above, below, quiet = (np.zeros(tried.first.size) for _ in range(3))
        sums = []
        for term in balances:
            part, noise = term.parts[name], tried.sums(term.noise[name])[0]
            square = tried.sums(part * part)[0]
            energy, inside = (tried.sums(term.total * term.total)[which] for which in (1, 0))
            energy = float(term.total @ term.total) - energy + term.tolerance  # the zones at the edges do not count
            num = tried.sums(part * term.total)[0] - noise  # a channel's own noise is in the sum, whatever its gain
            den = np.maximum(square - noise, 0.1 * noise)
            above, below = above + term.freedom * num / energy, below + term.freedom * den / energy
            sums.append((term.freedom, energy, inside, num, den, noise))
            quiet += term.freedom * noise / energy
        share = above / np.maximum(below, 1e-30)
        likelihood, before, after, beside = (np.zeros(share.size) for _ in range(4))
        for freedom, energy, inside, num, den, noise in sums:
            left = inside - 2.0 * share * (num + noise) + share**2 * (den + noise)
            beside += freedom * np.log(np.maximum(inside, 1e-30) / np.maximum(left, 1e-30))
            taken = 2.0 * share * num - share**2 * den
            likelihood += 0.5 * freedom * np.log(energy / np.maximum(energy - taken, 1e-30))
            before, after = before + freedom * inside / energy, after + freedom * (inside - taken) / energy
        factor = 1.0 / np.where(share < 1.0, 1.0 - share, 1e-9)
        beside -= 2.0 * np.log(factor) * sum(one.freedom for one in balances)
        beside *= 0.5 * (tried.last - tried.first) / balances[0].total.size  # of these values, those in the stretch
        good = (factor > 1 / self.largest) & (factor < self.largest) & (np.abs(factor - 1.0) > self.smallest)
        good &= (after < (1.0 - self.explained) * before) & (below > self.loud * quiet)
        good &= tried.sums(seen[: balances[0].total.size])[0] > (self.shortest - 2 * _ZONE) * COARSE
        good &= beside > self.gain
        good &= likelihood > self.gain + self.density * sum(one.freedom for one in balances)
        if not good.any():
            return None
        best = int(np.argmax(np.where(good, likelihood, -np.inf)))
        return _Change(float(likelihood[best]), int(tried.first[best]), int(tried.last[best]), float(factor[best]))


def _placed(measured: Measurements, level: Measurements, name: str, change: _Change) -> Finding:
    """The finding: by gravity where that jumps too, else by what all relations together and the channel itself say."""
    values, rate = filled(measured[name]), measured.rate(name)
    known = by_mean(measured, name, change.first / COARSE, change.last / COARSE, change.gain)
    if known is not None:
        return _finding(measured, name, *known, f"likelihood ratio exp({change.likelihood:.0f})")
    frames = tables_of(level)
    frames[rate][name] = measured[name]
    own = Measurements(measured.about, frames, measured.track)
    first, last, gain = change.first, change.last, change.gain
    for _ in range(_PASSES):
        agreed = agreement(own, name, first, last, gain)
        first, last = interval(agreed.gained(first, last, gain), first, last, round(_END * COARSE))
        gain = agreed.gain(values, rate, round(first / COARSE * rate), round(last / COARSE * rate), gain)
    agreed = agreement(own, name, first, last, gain)
    begin, end = edges(measured[name], rate, agreed, first, last, gain)
    bounds = begin.at if begin else 0, end.at if end else values.size
    doubt = max(((one.latest - one.earliest) / rate for one in (begin, end) if one), default=0.0)
    why = f"likelihood ratio exp({change.likelihood:.0f}), edges certain within {1e3 * doubt:.0f} ms"
    return _finding(measured, name, *bounds, agreed.gain(values, rate, *bounds, gain), why)


def _finding(measured: Measurements, name: str, first: int, last: int, gain: float, why: str) -> Finding:
    time = measured.time(name)
    return Finding(
        "gain change",
        name,
        float(time[first]),
        float(time[last - 1]),
        f"reads {gain:.3g} times what the other channels of the bogie say ({why})",
        "check supply, amplifier and connector; the stretch is divided by the factor",
        repair=Scale(gain),
    )
