"""Screening: which effects, at a finite size and with the nuisances free to follow, take most of the residual away.

Three statistics, whose best are taken together: the gain of a finite signature without its best sections, its whole
gain, and the likeness of the residual's spectrum to the effect's. Signatures come from the bank; those of effects
with a place or a time of their own are run for this recording.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.discrepancy.candidates import DISTANCES, STRETCHES, Candidate, in_tune
from experiments.discrepancy.filters import forms
from experiments.discrepancy.fitting import WEIGHT, Fit, Problem, normal_equations
from experiments.discrepancy.gusts import put_together
from experiments.discrepancy.noise import split
from experiments.discrepancy.parallel import in_parallel
from experiments.discrepancy.places import distance_at, likely_places, loudest_places, series
from experiments.discrepancy.scores import TOLERATED, Shares, at_bound, logarithmic
from railsim.errors import InputError

RANGE = (0.3, 2.5)  # of the signature's size that may be scaled linearly
PHASES_TRIED = 24
PLACES_TRIED = np.arange(-1.5, 1.6, 0.1)  # m
TIMES_TRIED = np.arange(-1.0, 1.1, 0.1)  # s
STRETCH_TRIED = 20.0 * TIMES_TRIED  # m, of a load along the track
DETUNED = 1.0  # turns of a wave by the middle of the run
TOGETHER = 32  # signatures that are judged at a time
DROPPED = 3  # sections whose gain does not count
SHORTLIST = (5, 4, 2)  # effects that each statistic contributes


@dataclass(frozen=True)
class Screened:
    """One signature against the residual.

    Attributes
    ----------
    tried : the numbers that were run. values : the same, scaled as it fits best. z : where the nuisances go with it.
    gain : of the logarithm of the posterior on training frames [nats]. robust : without its best sections. likeness :
    cosine between the spectra of residual and signature. size, detect : distance of the first number from absence,
    and the gain that is expected of it there [nats].
    """

    candidate: Candidate
    tried: dict[str, float]
    values: dict[str, float]
    z: np.ndarray
    gain: float
    robust: float
    likeness: float
    size: float
    detect: float


class Projection:
    """Linear model of all that is fitted so far, over some frames: what of a signature it cannot take.

    Numbers at the edge of their tolerance are held there, or come back if the signature lets them. All in double
    precision: what is left of a gain of a sensor that feels gravity is a millionth of its signature.
    """

    def __init__(self, fit: Fit, frames: np.ndarray, bounds: np.ndarray | None = None) -> None:
        shares = Shares(fit.candidates)
        normal, gradient = normal_equations(fit.jacobian, fit.residual, frames)
        matrix, downhill, self.at = shares.scaled(normal, gradient, fit.z, fit.shares)
        n, m = len(fit.z), len(fit.shares)
        scale = np.concatenate([np.ones(n), np.full(m, 0.5 / TOLERATED)])
        flat = (WEIGHT * fit.jacobian[:, frames].astype(float)).reshape(n + m, -1)
        self.flat = flat * scale[:, None]
        self.frames = frames
        self.residual = (WEIGHT * fit.residual[frames]).ravel()
        self.bound = at_bound(self.at, bounds)
        self._sets: list[tuple[np.ndarray, np.ndarray, float]] = []
        for held in [self.bound, np.zeros_like(self.bound)] if self.bound.any() else [self.bound]:
            inverse = np.zeros_like(matrix)
            free = np.flatnonzero(held == 0)
            inverse[np.ix_(free, free)] = np.linalg.inv(matrix[np.ix_(free, free)])
            own = inverse @ downhill
            self._sets.append((inverse, own, 0.5 * float(downhill @ own)))

    def cleaned(self, signature: np.ndarray) -> np.ndarray:
        """What of a signature (n,) the numbers cannot take."""
        return signature - (self._sets[0][0] @ (self.flat @ signature)) @ self.flat

    def row(self, white: np.ndarray) -> np.ndarray:
        """(n,) of a complex whitened signature (k, f, c)."""
        return WEIGHT * split(white[self.frames].astype(complex)).ravel()

    def along(self, signatures: np.ndarray) -> np.ndarray:
        """(p, numbers) products of signatures (p, n) with the derivatives."""
        return (self.flat @ signatures.T).T

    def judge(self, signatures: np.ndarray, along: np.ndarray | None = None) -> "Judgement":
        """The best of some signatures (p, n), scaled as it is best, the numbers following.

        With d = J r - x / std^2, M = J J^T + 1 / std^2: gain(a) = d M^-1 d / 2 + a s (r - J^T M^-1 d) - a^2 (s s - s
        J^T M^-1 J s) / 2; what the numbers could gain by themselves is no gain.
        """
        along = self.along(signatures) if along is None else along
        across, size = signatures @ self.residual, np.einsum("pn,pn->p", signatures, signatures)
        gain, which, factor, moved, left = self.weighed(along, across, size)
        taken = factor * signatures[which] + moved @ self.flat
        return Judgement(which, factor, gain, moved, taken, left)

    def stretches(self, signature: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Products of a signature (n,) with derivatives (t + 1, numbers), residual (t + 1,) and itself (t + 1,), summed
        up to each frame: differences are those of the signature between two frames.
        """
        count = int(self.frames.sum())
        rows = signature.reshape(count, -1)
        along = np.einsum("mtn,tn->tm", self.flat.reshape(len(self.flat), count, -1), rows)
        parts = along, (rows * self.residual.reshape(count, -1)).sum(axis=1), (rows**2).sum(axis=1)
        along, across, size = (np.concatenate([0.0 * part[:1], np.cumsum(part, axis=0)]) for part in parts)
        return along, across, size

    def weighed(
        self, along: np.ndarray, across: np.ndarray, size: np.ndarray
    ) -> tuple[float, int, float, np.ndarray, float]:
        """Gain of the best of some signatures, which it is, its scale, how the numbers move, and its power left, from
        products with the derivatives (p, numbers), with the residual (p,) and with itself (p,).
        """
        best = (-np.inf, 0, 1.0, np.zeros(0), 0.0)
        for inverse, own, relief in self._sets:
            follow = along @ inverse
            power = np.maximum(size - np.einsum("pi,pi->p", along, follow), 1e-9)
            slope = across - along @ own
            scale = np.clip(slope / power, *RANGE)
            gain = relief - self._sets[0][2] + scale * slope - 0.5 * scale**2 * power
            move = own - scale[:, None] * follow
            gain[(move * self.bound > 1e-9).any(axis=1)] = -np.inf
            top = int(np.argmax(gain))
            if gain[top] > best[0]:
                best = float(gain[top]), top, float(scale[top]), move[top], float(power[top])
        return best


@dataclass(frozen=True)
class Judgement:
    """Which signature at which scale, gain [nats], move of the numbers, what leaves the residual (n,), power left."""

    which: int
    scale: float
    gain: float
    move: np.ndarray
    taken: np.ndarray
    power: float


def screen(
    problem: Problem, fit: Fit, found: Sequence[Candidate], tell: Callable[[str], None] = lambda text: None
) -> list[Screened]:
    """All candidates at all of their sizes (of what turns with a wheel at the best phase).

    Raises
    ------
    InputError : the nominal model does not run.
    """
    if problem.bank is None:
        raise ValueError("give the problem a bank first")
    projection = Projection(fit, problem.train, problem.forward.bounds)
    found = in_tune(found)
    banked = [(one, values) for one in found if not one.local for values in one.banked()]
    problem.bank.fill(banked, tell)
    judged: list[Screened] = []
    waiting: list[tuple[Candidate, dict[str, float], np.ndarray]] = []
    for one, values in banked:
        signature = problem.bank.signature(one, values)
        if signature is None:
            continue
        turned = _turned(problem, one, values)
        if len(turned) > 1:
            judged.append(judged_signature(problem, fit, projection, one, signature, turned))
        else:
            waiting.append((one, values, _white(problem, signature)))
    for first in range(0, len(waiting), TOGETHER):
        batch = waiting[first : first + TOGETHER]
        rows = np.stack([projection.row(white) for _, _, white in batch])
        along = projection.along(rows)
        for number, (one, values, white) in enumerate(batch):
            found_here = projection.judge(rows[number : number + 1], along[number : number + 1])
            judged.append(_screened(problem, fit, projection, one, values, split(white), found_here))
    return judged + _here(problem, fit, projection, found)


Turned = Sequence[tuple[dict[str, float], np.ndarray | None]]


def _turned(problem: Problem, candidate: Candidate, values: dict[str, float]) -> Turned:
    """Numbers and the factor (k, f) that makes their signature of that of `values`: of what turns with a wheel at all
    phases, of what is short at places around it, of a wave at wavelengths around it.
    """
    if candidate.reference:
        return forms(candidate, problem.frames.frequencies, finely=False)
    if candidate.phases:
        name = candidate.phases[0]
        aside = 2.0 * np.pi * np.arange(PHASES_TRIED) / PHASES_TRIED - values[name]
        metres = float(getattr(problem.evidence.scenario.vehicle, "wheel_radius", 0.5))
    elif candidate.short:
        name, aside, metres = next(one for one in DISTANCES if one in values), PLACES_TRIED, 1.0
    elif "begin" in values:
        name, aside, metres = "begin", TIMES_TRIED, 0.0
    elif "place" in values and candidate.kind.acts_on == "load":
        name, aside, metres = "place", STRETCH_TRIED, 1.0
    else:
        return [(values, None), *_detuned(problem, candidate, values)]
    free = candidate.parameters[name]
    forward = problem.forward
    speed = forward.alignment.scale * np.interp(problem.frames.middles, *forward.evidence.speed[:2])
    found: list[tuple[dict[str, float], np.ndarray | None]] = []
    for change in aside:
        late = change * metres / speed if metres else np.full(len(speed), change)
        phase = np.exp(-2j * np.pi * problem.frames.frequencies * late[:, None]).astype(np.complex64)
        found.append(({**values, name: float(np.clip(values[name] + change, free.low, free.high))}, phase))
    return found


def _detuned(
    problem: Problem, candidate: Candidate, values: dict[str, float]
) -> Iterator[tuple[dict[str, float], Any]]:
    """Wavelengths whose waves are up to `DETUNED` turns ahead or behind by the middle of the run."""
    name = next((one for one in values if one == "wavelength"), None)
    if name is None or candidate.short or candidate.uneven:
        return
    free = candidate.parameters[name]
    s = distance_at(problem, problem.frames.middles)
    for turns in np.linspace(-DETUNED, DETUNED, 2 * PHASES_TRIED + 1):
        number = 1.0 / values[name] + turns / float(s.mean())
        if turns and number > 0.0 and free.low <= 1.0 / number <= free.high:
            phase = np.exp(2j * np.pi * s * (number - 1.0 / values[name]))[:, None]
            yield {**values, name: 1.0 / number}, phase.astype(np.complex64)


def _here(problem: Problem, fit: Fit, projection: Projection, found: Sequence[Candidate]) -> list[Screened]:
    """What has a place, a time or a wavelength is run for this recording, first at its middle size where the residual
    says that it may be, then there at its other sizes; like the bank's with the scenario's own creep law.
    """
    forward = problem.forward.but(law="")
    base = problem.stacked(forward.predict(fit.z, fit.effects)) if problem.forward.law else fit.stacked

    def change_of(one: Candidate, values: dict[str, float]) -> np.ndarray | None:
        try:
            prediction = forward.predict(fit.z, (*fit.effects, one.build(values)))
        except InputError:
            return None
        change = problem.stacked(prediction) - base
        return change if np.isfinite(change).all() else None

    def run(job: tuple[Candidate, dict[str, float]]) -> Screened | None:
        change = change_of(*job)
        return (
            None
            if change is None
            else judged_signature(problem, fit, projection, job[0], change, _turned(problem, *job))
        )

    def products(changes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rows = np.stack([projection.row(_white(problem, change)) for change in changes])
        return projection.along(rows), rows @ projection.residual, rows @ rows.T

    def placed(one: Candidate) -> list[dict[str, float]]:
        middle = next(iter(one.sizes()))
        if one.short:
            return _matched(problem, fit, one, middle, change_of)
        if one.name in STRETCHES:
            return _stretches(problem, fit, projection, one, change_of)
        if not one.local:
            return list(one.at_tones())
        usual = list(one.variants_of(middle))[: None if one.gust else 1]
        return usual + (put_together(problem, one, change_of, products, projection.weighed) if one.gust else [])

    local = [one for one in found if one.local]
    tuned = [one for one in found if not one.local and not one.of_sensor]
    first = [(one, values) for one in (*local, *tuned) for values in placed(one)]
    judged = [one for one in in_parallel(run, first) if one is not None]
    best = {one.candidate.label: one for one in sorted(judged, key=lambda one: one.robust)}
    more = []
    for one in best.values():
        if one.gain > 0.0:
            free = one.candidate.parameters
            where = {name: value for name, value in one.tried.items() if free[name].absent is None}
            more += [(one.candidate, {**values, **where}) for values in list(one.candidate.sizes())[1:]]
    return judged + [one for one in in_parallel(run, more) if one is not None]


ChangeOf = Callable[[Candidate, dict[str, float]], np.ndarray | None]


def _matched(
    problem: Problem, fit: Fit, candidate: Candidate, middle: dict[str, float], change_of: ChangeOf
) -> list[dict[str, float]]:
    """Places of a short dip, or first place and spacing of many, by a matched filter with one dip at the run's end."""
    free = candidate.parameters
    name = next(one for one in DISTANCES if one in free)
    spacing = free.get("spacing")
    found: list[dict[str, float]] = []
    for alone in candidate.variants_of(middle) if spacing is None else [{**middle, "spacing": spacing.high}]:
        at = free[name].high - min(100.0, 0.3 * (free[name].high - free[name].low))
        if any(one.get("length") == alone.get("length") for one in found):
            continue
        change = change_of(candidate, {**alone, name: at})
        if change is None:
            continue
        places, fits, _ = likely_places(problem, fit, change, at)
        if spacing is None:
            for number in loudest_places(places, fits, 1):
                found.append({**alone, name: float(np.clip(places[number], free[name].low, free[name].high))})
        else:
            for first, gap in series(places, fits, (spacing.low, spacing.high)):
                found.append({**alone, name: float(np.clip(first, free[name].low, free[name].high)), "spacing": gap})
    return found


def _stretches(
    problem: Problem, fit: Fit, projection: Projection, candidate: Candidate, change_of: ChangeOf
) -> list[dict[str, float]]:
    """From where to where it may be: run over the whole way, frames before and after a stretch left out. Sections that
    do not train say nothing: a begin or an end there is in their middle, and what may last to the end does.
    """
    free = candidate.parameters
    at = np.append(distance_at(problem, problem.frames.starts), free["place"].high)
    first, last = np.triu_indices(len(at), 1)
    trained = np.concatenate([[0], np.cumsum(problem.train)])  # frames of the projection before each
    found: list[dict[str, float]] = []
    tried = list(candidate.at_tones()) if "wavelength" in free else [next(iter(candidate.sizes()))]
    for values in tried:
        whole = {**values, "place": free["place"].low, "length": free["length"].high}
        change = change_of(candidate, whole)
        if change is None:
            continue
        sums = projection.stretches(projection.row(_white(problem, change)))
        _, which, *_ = projection.weighed(*(one[trained[last]] - one[trained[first]] for one in sums))
        begins, ends = at[trained == trained[first[which]]], at[trained == trained[last[which]]]
        begin = float(np.clip(begins.mean(), free["place"].low, free["place"].high))
        end = math.inf if ends[-1] == at[-1] else float(ends.mean())
        length = float(np.clip(end - begin, free["length"].low, free["length"].high))
        found.append({**whole, "place": begin, "length": length})
    return found


def best_of(screened: Sequence[Screened]) -> list[Screened]:
    """The best size of each variant, best first."""
    best: dict[str, Screened] = {}
    for one in screened:
        if one.candidate.label not in best or one.robust > best[one.candidate.label].robust:
            best[one.candidate.label] = one
    return sorted(best.values(), key=lambda one: -one.robust)


def judged_signature(
    problem: Problem,
    fit: Fit,
    projection: Projection,
    candidate: Candidate,
    change: np.ndarray,
    turned: Turned,
) -> Screened:
    """The best of some phases (places, wavelengths) of one size, made of one signature (k, f, c)."""
    white = _white(problem, change)
    signatures = [white if factor is None else white * factor[..., None] for _, factor in turned]
    found = projection.judge(np.stack([projection.row(one) for one in signatures]))
    return _screened(problem, fit, projection, candidate, turned[found.which][0], split(signatures[found.which]), found)


def _white(problem: Problem, change: np.ndarray) -> np.ndarray:
    if problem.white is None:
        raise ValueError("state the noise first")
    return problem.white.complex(change).astype(np.complex64)


def _screened(
    problem: Problem,
    fit: Fit,
    projection: Projection,
    candidate: Candidate,
    values: dict[str, float],
    signature: np.ndarray,
    found: Judgement,
) -> Screened:
    left = projection.residual - found.taken
    frames = 0.5 * (projection.residual**2 - left**2).reshape(int(projection.frames.sum()), -1).sum(axis=1)
    loudest = np.sort(frames)[::-1][:DROPPED]
    robust = found.gain - (0.0 if candidate.speaks_in_places else float(np.clip(loudest, 0.0, None).sum()))
    n = len(fit.z)
    return Screened(
        candidate,
        values,
        scaled(candidate, values, found.scale),
        np.clip(fit.z + found.move[:n], *problem.forward.bounds),
        found.gain,
        robust,
        _likeness(problem, fit.residual, signature),
        _size(candidate, values),
        0.5 * found.power,
    )


def scaled(candidate: Candidate, values: dict[str, float], scale: float) -> dict[str, float]:
    """The numbers that say how large it is, by a factor from where they say that it is absent."""
    moved = dict(values)
    for name, one in candidate.parameters.items():
        if one.absent is not None and not logarithmic(name, one):
            moved[name] = float(np.clip(one.absent + scale * (values[name] - one.absent), one.low, one.high))
    return moved


def _size(candidate: Candidate, values: dict[str, float]) -> float:
    sized = [(name, one.absent) for name, one in candidate.parameters.items() if one.absent is not None]
    return values[sized[0][0]] - sized[0][1] if sized else 0.0


def _likeness(problem: Problem, residual: np.ndarray, signature: np.ndarray) -> float:
    """Cosine of the excess spectra by channel and frequency."""
    excess = np.clip((residual[problem.train] ** 2).mean(axis=0) - 1.0, 0.0, None)
    own = (signature[problem.train] ** 2).mean(axis=0)
    size = float(np.linalg.norm(excess) * np.linalg.norm(own))
    return float(np.sum(excess * own)) / size if size > 0.0 else 0.0


def shortlist(screened: Sequence[Screened]) -> list[Screened]:
    """The best by each statistic together; one variant of an effect counts once a statistic."""
    best = best_of(screened)
    orders = (
        best,
        sorted(best, key=lambda one: -one.gain),
        sorted((one for one in best if one.gain > 0.0), key=lambda one: -one.likeness),
    )
    chosen: dict[str, Screened] = {}
    for order, count in zip(orders, SHORTLIST, strict=True):
        names: list[str] = []
        for one in order:
            if one.candidate.name not in names and len(names) < count:
                names.append(one.candidate.name)
                chosen.setdefault(one.candidate.label, one)
    return sorted(chosen.values(), key=lambda one: -one.gain)
