"""Screening: which effects, at a finite size and with the nuisances free to follow, take most of the residual away.

Three statistics, whose best are taken together: the gain of a finite signature without its best sections, its whole
gain, and the likeness of the residual's spectrum to the effect's. Signatures come from the bank; those of effects
with a place or a time of their own are run for this recording.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.noise import split
from experiments.discrepancy.baseline.parallel import in_parallel
from experiments.discrepancy.fit.candidates import Candidate, in_tune, settings_of
from experiments.discrepancy.fit.fitting import Fit, Problem
from experiments.discrepancy.fit.scores import logarithmic
from experiments.discrepancy.progress import Progress, silent
from experiments.discrepancy.screen.filters import forms
from experiments.discrepancy.screen.gusts import put_together
from experiments.discrepancy.screen.places import distance_at
from experiments.discrepancy.screen.placing import DETUNED, beside_tone, matched, stretches, waves_about_means
from experiments.discrepancy.screen.projection import RANGE, SLIGHTEST, Judgement, Projection, whitened
from railsim.errors import InputError

PHASES_TRIED = 24
MOST_BLOWS = 400  # angles of what strikes once a turn; at 24 m/s a row of truth is a hundredth of one
PLACES_TRIED = np.arange(-1.5, 1.6, 0.1)  # m
TIMES_TRIED = np.arange(-1.0, 1.1, 0.1)  # s
STRETCH_TRIED = 20.0 * TIMES_TRIED  # m, of a load along the track
TOGETHER = 32  # signatures that are judged at a time
DROPPED = 3  # sections whose gain does not count
WORTH_SIZES = 1.0  # nats at its middle size, from which what has a place is run at its other sizes
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


def screen(problem: Problem, fit: Fit, found: Sequence[Candidate], progress: Progress = silent) -> list[Screened]:
    """All candidates at all of their sizes (of what turns with a wheel at the best phase).

    Raises
    ------
    InputError : the nominal model does not run.
    """
    if problem.bank is None:
        raise ValueError("give the problem a bank first")
    projection = Projection(problem.differentiated(fit), problem.train, problem.forward.bounds)
    found = in_tune(found)
    banked = [(one, values) for one in found if not one.local for values in one.banked()]
    problem.bank.fill(banked, progress)
    turned = [job for job in banked if _turns(*job)]
    plain = [job for job in banked if not _turns(*job)]
    batches = [plain[first : first + TOGETHER] for first in range(0, len(plain), TOGETHER)]
    judged = in_parallel(lambda job: _judged_turned(problem, fit, projection, *job), turned)
    for batch in in_parallel(lambda batch: _judged_together(problem, fit, projection, batch), batches):
        judged += batch
    return [one for one in judged if one is not None] + _here(problem, fit, projection, found)


def _turns(candidate: Candidate, values: dict[str, float]) -> bool:
    """Whether the signature of a candidate without a place stands for others: at other angles, delays or waves."""
    return bool(candidate.reference or candidate.phases or (candidate.number("wavelength") and not candidate.uneven))


def _judged_turned(
    problem: Problem, fit: Fit, projection: Projection, candidate: Candidate, values: dict[str, float]
) -> Screened | None:
    """One of the bank's signatures at its best angle, delay or wavelength; None where the bank has none."""
    signature = problem.bank.signature(candidate, values) if problem.bank else None
    if signature is None:
        return None
    if candidate.sharp:
        return _blows(problem, fit, projection, candidate, signature, values)
    return judged_signature(problem, fit, projection, candidate, signature, turned_forms(problem, candidate, values))


def _judged_together(
    problem: Problem, fit: Fit, projection: Projection, batch: Sequence[tuple[Candidate, dict[str, float]]]
) -> list[Screened | None]:
    """Some of the bank's signatures as they are."""
    jobs = [(*job, problem.bank.signature(*job)) for job in batch] if problem.bank else []
    made = [(one, values, whitened(problem, change)) for one, values, change in jobs if change is not None]
    if not made:
        return []
    rows = np.stack([projection.row(white) for _, _, white in made])
    judged = projection.judge_each(rows, [_least(one) for one, *_ in made])
    return [
        _screened(problem, fit, projection, one, values, replace(here, signature=white))
        for (one, values, white), here in zip(made, judged, strict=True)
    ]


def _blows(
    problem: Problem,
    fit: Fit,
    projection: Projection,
    candidate: Candidate,
    signature: np.ndarray,
    values: dict[str, float],
) -> Screened:
    """The best angle of a blow once a turn, of all that differ by a row of truth: whole samples later as a phase, the
    rows between as signatures of their own.
    """
    white = np.stack([whitened(problem, part) for part in signature])
    forward = problem.forward
    speed = forward.registration.scale * np.interp(problem.frames.middles, *forward.evidence.speed[:2])
    metres = float(getattr(forward.evidence.scenario.vehicle, "wheel_radius", 0.5))
    rate = forward.evidence.scenario.output_rate
    name = candidate.phases[0]
    count = math.ceil(2.0 * math.pi * metres / float(speed.min()) * rate)
    angles = 2.0 * np.pi * np.arange(min(count, MOST_BLOWS)) / min(count, MOST_BLOWS)
    rows = np.round((angles[:, None] - values[name]) * metres / speed * rate).astype(int)
    found = projection.judge_later(
        white, rows, 2.0 * np.pi * problem.frames.frequencies * len(white) / rate, _least(candidate)
    )
    return _screened(problem, fit, projection, candidate, {**values, name: float(angles[found.which])}, found)


Turned = Sequence[tuple[dict[str, float], np.ndarray | None]]


def turned_forms(problem: Problem, candidate: Candidate, values: dict[str, float]) -> Turned:
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
        name, aside, metres = candidate.number("distance"), PLACES_TRIED, 1.0
    elif name := candidate.number("time"):
        aside, metres = TIMES_TRIED, 0.0
    elif candidate.kind.acts_on == "load" and (name := candidate.number("distance")):
        aside, metres = STRETCH_TRIED, 1.0
    else:
        return [(values, None), *_detuned(problem, candidate, values)]
    free = candidate.parameters[name]
    forward = problem.forward
    speed = forward.registration.scale * np.interp(problem.frames.middles, *forward.evidence.speed[:2])
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
    name = candidate.number("wavelength")
    if not name or candidate.short or candidate.uneven:
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
    says that it may be, then there at its other sizes; like the bank's with the scenario's own creep law, and whatever
    was run at a build near by serves again.
    """
    forward = problem.forward.but(law="")
    base = problem.stacked(forward.predict(fit.z, fit.effects)) if problem.forward.law else fit.stacked

    build = fit.z[[not one.of_sensor for one in problem.forward.nuisances]]

    def change_of(one: Candidate, values: dict[str, float]) -> np.ndarray | None:
        def made() -> np.ndarray | None:
            try:
                prediction = forward.predict(fit.z, (*fit.effects, effect))
            except InputError:
                return None
            change = problem.stacked(prediction) - base
            return change if np.isfinite(change).all() else None

        try:
            effect = one.build(values)
        except InputError:  # a number that it may not have, like that of a wave beside a tone
            return None
        return problem.changes.of(settings_of(effect), build, made)

    def run(job: tuple[Candidate, dict[str, float]]) -> Screened | None:
        change = change_of(*job)
        return (
            None
            if change is None
            else judged_signature(problem, fit, projection, job[0], change, turned_forms(problem, *job))
        )

    def beside(job: tuple[Candidate, list[dict[str, float]]]) -> list[Screened]:
        made = beside_tone(problem, *job, change_of)
        return [judged_signature(problem, fit, projection, job[0], change, [(at, None)]) for at, change in made]

    def products(changes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rows = np.stack([projection.row(whitened(problem, change)) for change in changes])
        return projection.along(rows), rows @ projection.residual, rows @ rows.T

    def placed(one: Candidate) -> list[dict[str, float]]:
        middle = next(iter(one.sizes()))
        if one.short:
            return matched(problem, fit, one, middle, change_of)
        if one.stretch:
            return stretches(problem, fit, projection, one, change_of)
        if not one.local:
            return list(one.at_tones())
        if one.gust:
            return put_together(problem, one, change_of, products, projection.weighed)
        return list(one.variants_of(middle))[:1]

    local = [one for one in found if one.local]
    tuned = [one for one in found if not one.local and not one.of_sensor]
    here = [*local, *(one for one in tuned if not one.uneven)]
    first = [(one, values) for one, several in zip(here, in_parallel(placed, here), strict=True) for values in several]
    judged = [one for one in in_parallel(run, first) if one is not None]
    waves = [(one, pair) for one in tuned if one.uneven for pair in waves_about_means(one)]
    judged += [one for some in in_parallel(beside, waves) for one in some]
    best = {one.candidate.label: one for one in sorted(judged, key=lambda one: one.robust)}
    more = []
    for one in best.values():
        if one.gain > WORTH_SIZES:
            free = one.candidate.parameters
            where = {name: value for name, value in one.tried.items() if free[name].absent is None}
            more += [(one.candidate, {**values, **where}) for values in list(one.candidate.sizes())[1:]]
    return judged + [one for one in in_parallel(run, more) if one is not None]


def best_of(screened: Sequence[Screened]) -> list[Screened]:
    """The best size of each variant, best first."""
    best: dict[str, Screened] = {}
    for one in screened:
        if one.candidate.label not in best or one.robust > best[one.candidate.label].robust:
            best[one.candidate.label] = one
    return sorted(best.values(), key=lambda one: -one.robust)


def _least(candidate: Candidate) -> float:
    """Smallest share of a signature's size that may stand for it."""
    return SLIGHTEST if candidate.linear else RANGE[0]


def judged_signature(
    problem: Problem,
    fit: Fit,
    projection: Projection,
    candidate: Candidate,
    change: np.ndarray,
    turned: Turned,
) -> Screened:
    """The best of some phases (places, wavelengths) of one size, made of one signature (k, f, c)."""
    white = whitened(problem, change)
    factors = [np.ones((1, 1)) if factor is None else factor for _, factor in turned]
    found = projection.judge_turned(white, np.stack(np.broadcast_arrays(*factors)), _least(candidate))
    return _screened(problem, fit, projection, candidate, turned[found.which][0], found)


def _screened(
    problem: Problem,
    fit: Fit,
    projection: Projection,
    candidate: Candidate,
    values: dict[str, float],
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
        _likeness(problem, fit.residual, split(found.signature)) if found.signature is not None else 0.0,
        _size(candidate, values),
        0.5 * found.power,
    )


def scaled(candidate: Candidate, values: dict[str, float], scale: float) -> dict[str, float]:
    """The numbers that say how large it is, where what is measured is so many times larger."""
    moved = dict(values)
    for name, one in candidate.parameters.items():
        if one.absent is not None and not logarithmic(one):
            factor = scale ** (1.0 / candidate.kind.growth.get(name, 1.0))
            moved[name] = float(np.clip(one.absent + factor * (values[name] - one.absent), one.low, one.high))
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
