"""Changes of a channel's gain within a record, by the kinematics of the bogie as a rigid body."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._offsets import axis_of
from railsim.quality._rigid import Relation, relations, spectra_of, window_of
from railsim.quality._signals import filled, kind_of, limit
from railsim.quality.interface import Check, Finding
from railsim.quality.repair import tables_of
from railsim.spec import quantity

_COARSE = 64.0  # Hz, of the relations over time
_EDGE = 0.25  # s between the instants that are tried
_ZONE = 0.5  # s about an edge that do not count: the edge is not known better, and a step of gravity rings there
_BLIND = 2.0  # s at the record's ends, which the window of the spectra hides
_OUTSIDE = 2.0  # s within and outside a stretch, from which on their gains can be compared
_SURE = 4.0  # deviations by which a gain outside the stretch must be off to be taken for the relations' error
_BLOCK, _FEWEST = 0.25, 8  # s of a mean, and means in a stretch
_JUMP = 1.2  # m/s2 by which gravity's share never changes in service
_SEEN = 0.2  # of the window, below which a place counts as lost
_ALIKE = 0.15  # by which the quotient of the means may differ from the gain


@dataclass(frozen=True)
class Balance:
    """A relation over time, noise by the data sheets made white.

    Attributes
    ----------
    parts : what each channel adds to the sum, by name, shape (n,). total : the sum, shape (n,).
    noise : variance of each part by its channel's noise, shape (n,).
    tolerance : energy that data sheets allow. freedom : independent values.
    """

    parts: Mapping[str, np.ndarray]
    total: np.ndarray
    noise: Mapping[str, np.ndarray]
    tolerance: float
    freedom: int


@dataclass(frozen=True)
class _Stretches:
    """First and one past the last sample of every stretch that is tried, shapes (m,), in samples of the balances."""

    first: np.ndarray
    last: np.ndarray

    @classmethod
    def of(cls, count: int, shortest: float) -> "_Stretches":
        edges = np.append(np.arange(0, count, round(_EDGE * _COARSE)), count)
        first, last = (one.ravel() for one in np.meshgrid(edges, edges, indexing="ij"))
        long = last - first >= shortest * _COARSE
        return cls(first[long], last[long])

    def sums(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums of values (n,) within each stretch, and over the zones about its edges, shapes (m,)."""
        zone, count = round(_ZONE * _COARSE), values.size
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
    channel stands in; what data sheets allow for is left over anyway.
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
        frequency, spectra = spectra_of(_levelled(measurements))
        if frequency.size < 2:
            return []
        seconds = float(round((frequency.size - 1) / (frequency[-1] - frequency[0])))
        exact = [one for one in relations(measurements, frequency, spectra) if _exact(one)]
        found = [balance(one, measurements, frequency, spectra, seconds) for one in exact]
        seen = (window_of(measurements, list(spectra), seconds) > _SEEN).astype(float)
        changes = {name: self._best([one for one in found if name in one.parts], name, seen) for name in spectra}
        likely = {name: one for name, one in changes.items() if one is not None}
        if not likely:
            return []
        name = max(likely, key=lambda name: likely[name].likelihood)
        return [_finding(measurements, name, likely[name])]

    def _best(self, balances: Sequence[Balance], name: str, seen: np.ndarray) -> _Change | None:
        """The best stretch of a channel; None where it is not good enough."""
        if not balances:
            return None
        tried = _Stretches.of(balances[0].total.size, self.shortest)
        above, below, quiet = (np.zeros(tried.first.size) for _ in range(3))
        sums = []
        for one in balances:
            part, noise = one.parts[name], tried.sums(one.noise[name])[0]
            energy, inside = (tried.sums(one.total * one.total)[which] for which in (1, 0))
            energy = float(one.total @ one.total) - energy + one.tolerance  # the zones at the edges do not count
            num = tried.sums(part * one.total)[0] - noise  # a channel's own noise is in the sum, whatever its gain
            den = np.maximum(tried.sums(part * part)[0] - noise, 0.1 * noise)
            above, below = above + one.freedom * num / energy, below + one.freedom * den / energy
            sums.append((one.freedom, energy, inside, num, den))
            quiet += one.freedom * noise / energy
        share = above / np.maximum(below, 1e-30)
        likelihood, before, after = (np.zeros(share.size) for _ in range(3))
        for freedom, energy, inside, num, den in sums:
            taken = 2.0 * share * num - share**2 * den
            likelihood += 0.5 * freedom * np.log(energy / np.maximum(energy - taken, 1e-30))
            before, after = before + freedom * inside / energy, after + freedom * (inside - taken) / energy
        factor = 1.0 / np.where(share < 1.0, 1.0 - share, 1e-9)
        good = (factor > 1 / self.largest) & (factor < self.largest) & (np.abs(factor - 1.0) > self.smallest)
        good &= (after < (1.0 - self.explained) * before) & (below > self.loud * quiet)
        good &= tried.sums(seen[: balances[0].total.size])[0] > (self.shortest - 2 * _ZONE) * _COARSE
        good &= likelihood > self.gain + self.density * sum(one.freedom for one in balances)
        if not good.any():
            return None
        best = int(np.argmax(np.where(good, likelihood, -np.inf)))
        ends = _edges(balances, name, int(tried.first[best]), int(tried.last[best]), float(share[best]))
        return _Change(float(likelihood[best]), *ends, beside(balances, name, *ends) or float(factor[best]))


def beside(balances: Sequence[Balance], name: str, first: int, last: int) -> float:
    """Gain within a stretch over that outside, where relations that are not exact show one too for certain; else 0.

    Parameters
    ----------
    balances : all relations that the channel `name` stands in.
    first, last : first and one past the last sample of the stretch.
    """
    zone, count, block = round(_ZONE * _COARSE), balances[0].total.size, round(_COARSE)
    above, below = np.zeros(count), np.zeros(count)
    for one in balances:
        part, weight = one.parts[name], one.freedom / float(one.total @ one.total)
        above += weight * (part * one.total - one.noise[name])
        below += weight * (part * part - one.noise[name])
    inside, outside = np.zeros(count, dtype=bool), np.ones(count, dtype=bool)
    inside[first + zone : last - zone] = True
    outside[max(0, first - zone) : last + zone] = False
    if min(inside.sum(), outside.sum()) < _OUTSIDE * _COARSE:
        return 0.0
    share = float(above[outside].sum() / below[outside].sum())
    rest = above[outside] - share * below[outside]
    size = rest.size // block * block
    scatter = math.sqrt(float(np.sum(rest[:size].reshape(-1, block).sum(axis=1) ** 2))) / float(below[outside].sum())
    left = 1.0 - float(above[inside].sum() / below[inside].sum())
    return (1.0 - share) / left if left > 0.0 and _SURE * scatter < abs(share) < _ALIKE else 0.0


def _edges(balances: Sequence[Balance], name: str, first: int, last: int, share: float) -> tuple[int, int]:
    """The ends of a stretch, within a second, between which the gain explains most."""
    reach, taken = round(_COARSE), np.zeros(balances[0].total.size)
    for one in balances:
        part = one.parts[name]
        energy = float(one.total @ one.total) + one.tolerance
        taken += one.freedom / energy * (2.0 * share * part * one.total - share**2 * part**2)
    total = np.concatenate([[0.0], np.cumsum(taken)])
    begins, ends = (slice(max(0, at - reach), at + reach + 1) for at in (first, last))
    return begins.start + int(np.argmin(total[begins])), ends.start + int(np.argmax(total[ends]))


def _levelled(measured: Measurements) -> Measurements:
    """Vertical accelerometers without a jump of their level and back, which would ring in every band."""
    frames = tables_of(measured)
    for name in measured:
        if kind_of(measured, name) == "accelerometer" and axis_of(name) == "z":
            values, rate = filled(measured[name]), measured.rate(name)
            first, last = _jump(values, round(_BLOCK * rate))
            size = float(np.mean(values[first:last]) - np.mean(np.r_[values[:first], values[last:], values[:1]]))
            if abs(size) > _JUMP:
                frames[rate][name][first:last] -= size
    return Measurements(measured.about, frames, measured.track)


def _jump(values: np.ndarray, block: int) -> tuple[int, int]:
    """First and one past the last sample of the stretch whose mean differs most from the others', by squares."""
    count = values.size // block
    means = values[: count * block].reshape(count, block).mean(axis=1)
    total = np.concatenate([[0.0], np.cumsum(means - means.mean())])
    first, last = (one.ravel() for one in np.triu_indices(count + 1, _FEWEST))
    inside = (last - first).astype(float)
    weight = inside * (count - inside) / count
    squares = np.where(weight > 0.0, (total[last] - total[first]) ** 2 / np.maximum(weight, 1e-9), 0.0)
    best = int(np.argmax(squares))
    start, end = int(first[best]) * block, int(last[best]) * block if last[best] < count else values.size
    size = float(np.mean(values[start:end]) - np.mean(np.r_[values[:start], values[end:], values[:1]]))
    if abs(size) > _JUMP:
        over = (values - float(np.mean(values[start:end])) + size / 2) / size
        start = _edge(over, start, 2 * block) if start else 0
        end = _edge(-over, end, 2 * block) if end < values.size else end
    return start, end


def _exact(relation: Relation) -> bool:
    """Whether a relation holds in the whole band; those that hold at low frequencies only are approximate."""
    return all(np.all(weight != 0.0) for weight in relation.weights.values())


def balance(
    relation: Relation, measured: Measurements, frequency: np.ndarray, spectra: Mapping[str, np.ndarray], seconds: float
) -> Balance:
    """A relation over time, from spectra over `frequency` (Hz) of a record of `seconds`."""
    count = round(seconds * _COARSE)
    at = np.rint(frequency * seconds).astype(int)
    noise = sum(np.abs(weight) ** 2 * _density(measured, name) ** 2 for name, weight in relation.weights.items())
    white = 1.0 / np.sqrt(np.maximum(noise, 1e-30) / np.mean(noise)) if np.any(noise) else np.ones(at.size)

    def over_time(values: np.ndarray) -> np.ndarray:
        whole = np.zeros(count // 2 + 1, dtype=complex)
        whole[at] = values * white
        return np.fft.irfft(whole, count) * math.sqrt(count / 2)

    parts = {name: over_time(weight * spectra[name]) for name, weight in relation.weights.items()}
    sizes = [float(one @ one) for one in parts.values()]
    plain = [float(np.sum(np.abs(weight * spectra[name]) ** 2)) for name, weight in relation.weights.items()]
    window = window_of(measured, list(spectra), seconds)[:count] ** 2 / (2.0 * seconds * count)
    own = {
        name: float(np.sum(np.abs(weight * white) ** 2)) * _density(measured, name) ** 2 * window
        for name, weight in relation.weights.items()
    }
    tolerance = relation.tolerance * sum(sizes) / max(sum(plain), 1e-30)
    return Balance(parts, np.sum(list(parts.values()), axis=0), own, tolerance, 2 * at.size)


def _density(measured: Measurements, name: str) -> float:
    """Noise density of a channel by its data sheet, with the rounding, unit of the channel / sqrt(Hz)."""
    rounding = limit(measured, name, "resolution") / math.sqrt(6.0 * measured.rate(name))
    return math.hypot(limit(measured, name, "noise_density"), rounding)


def _finding(measured: Measurements, name: str, change: _Change) -> Finding:
    """The finding; a stretch that comes near the record's begin or end reaches it, as little is seen of these."""
    time = measured.time(name)
    start, end = (float(time[0]) + one / _COARSE for one in (change.first, change.last))
    first = 0 if start < time[0] + _BLIND else int(np.searchsorted(time, start))
    last = time.size if end > time[-1] - _BLIND else int(np.searchsorted(time, end))
    first, last, gain = _by_mean(filled(measured[name]), measured.rate(name), first, last, change.gain)
    return Finding(
        "gain change",
        name,
        float(time[first]),
        float(time[last - 1]),
        f"reads {gain:.3g} times what the other channels of the bogie say"
        f" (likelihood ratio exp({change.likelihood:.0f}))",
        "check supply, amplifier and connector; the stretch is divided by the factor",
        repair="scale",
        amount=gain,
    )


def _by_mean(values: np.ndarray, rate: float, first: int, last: int, gain: float) -> tuple[int, int, float]:
    """Edges and gain of a channel whose mean (gravity) jumps by the same factor: to the sample; else as given."""
    start, end = _jump(values, round(_BLOCK * rate))
    others = ([(end, values.size)] if start == 0 else []) + ([(0, start)] if end == values.size else [])
    for begin, stop in ((start, end), *others):
        outside = np.concatenate([values[:begin], values[stop:]])
        if min(outside.size, stop - begin) < rate or min(last, stop) <= max(first, begin):
            continue
        usual, changed = float(np.mean(outside)), float(np.mean(values[begin:stop]))
        if abs(changed - usual) > _JUMP and abs(changed / usual / gain - 1) < _ALIKE:
            return begin, stop, changed / usual
    return first, last, gain


def _edge(over: np.ndarray, near: int, reach: int) -> int:
    """Sample within `reach` of `near` that parts what lies below zero from what lies above it best."""
    start = max(0, near - reach)
    score = np.concatenate([[0.0], np.cumsum(over[start : near + reach])])
    return start + int(np.argmin(score))
