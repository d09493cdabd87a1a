"""Placing: where along the way a signature may be, before it is run there."""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Fit, Problem
from experiments.discrepancy.screen.places import distance_at, likely_places, loudest_places, series
from experiments.discrepancy.screen.projection import SLIGHTEST, Projection, whitened

DETUNED = 1.0  # turns of a wave by the middle of the run
BESIDE = (0.0, -1 / 3, 1 / 3, -2 / 3, 2 / 3)  # the same by which a wave about a mean may be off its tone
WAVES_TRIED, WAVE_PHASES = 17, 12  # of a wave over a part of the way, and phases of each
ChangeOf = Callable[[Candidate, dict[str, float]], np.ndarray | None]


def matched(
    problem: Problem, fit: Fit, candidate: Candidate, middle: dict[str, float], change_of: ChangeOf
) -> list[dict[str, float]]:
    """Places of a short dip, or first place and spacing of many, by a matched filter with one dip at the run's end."""
    free = candidate.parameters
    name, gap, length = candidate.number("distance"), candidate.number("spacing"), candidate.number("length")
    spacing = free.get(gap)
    found: list[dict[str, float]] = []
    for alone in candidate.variants_of(middle) if spacing is None else [{**middle, gap: spacing.high}]:
        at = free[name].high - min(100.0, 0.3 * (free[name].high - free[name].low))
        if any(one.get(length) == alone.get(length) for one in found):
            continue
        change = change_of(candidate, {**alone, name: at})
        if change is None:
            continue
        places, fits, _ = likely_places(problem, fit, change, at)
        if spacing is None:
            for number in loudest_places(places, fits, 1):
                found.append({**alone, name: float(np.clip(places[number], free[name].low, free[name].high))})
        else:
            for first, metres in series(places, fits, (spacing.low, spacing.high)):
                found.append({**alone, name: float(np.clip(first, free[name].low, free[name].high)), gap: metres})
    return found


def waves_about_means(candidate: Candidate) -> list[list[dict[str, float]]]:
    """A small and a large wave at each of the residual's tones."""
    at: dict[float, list[dict[str, float]]] = {}
    length = candidate.number("wavelength")
    for values in candidate.at_tones():
        at.setdefault(values[length], []).append(values)
    return list(at.values())


def beside_tone(
    problem: Problem, candidate: Candidate, waves: Sequence[dict[str, float]], change_of: ChangeOf
) -> Iterator[tuple[dict[str, float], np.ndarray]]:
    """Numbers and change (k, f, c) of a wave about a mean at a tone and up to two thirds of a turn beside it by the
    middle of the run. A small and a large one are run; they tell the mean's change from the wave's, which is turned
    along the way.
    """
    length = candidate.number("wavelength")
    free = candidate.parameters[length]
    small, large = waves
    name = next(one for one in small if small[one] != large[one])
    changes = [change_of(candidate, values) for values in waves]
    if changes[0] is None or changes[1] is None:
        return
    wave = (changes[1] - changes[0]) / (large[name] - small[name])
    mean = changes[0] - small[name] * wave
    s = distance_at(problem, problem.frames.middles)
    for turns in BESIDE:
        number = 1.0 / small[length] + turns / float(s.mean())
        if free.low <= 1.0 / number <= free.high:
            turned = wave * np.exp(2j * np.pi * s * (number - 1.0 / small[length]))[:, None, None]
            for values in waves:
                yield {**values, length: 1.0 / number}, mean + values[name] * turned


def stretches(
    problem: Problem, fit: Fit, projection: Projection, candidate: Candidate, change_of: ChangeOf
) -> list[dict[str, float]]:
    """From where to where it may be: run over the whole way, frames before and after a stretch left out; a wave with
    any phase, and a little longer or shorter. Sections that do not train say nothing: a begin or an end there is in
    their middle, and what may last to the end does.
    """
    where, extent, length = (candidate.number(role) for role in ("distance", "length", "wavelength"))
    limits = {name: (one.low, one.high) for name, one in candidate.parameters.items()}
    at = np.append(distance_at(problem, problem.frames.starts), limits[where][1])
    first, last = np.triu_indices(len(at), 1)
    trained = np.concatenate([[0], np.cumsum(problem.train)])  # frames of the projection before each
    pairs = trained[first], trained[last]
    found: list[dict[str, float]] = []
    tones = {one[length]: one for one in reversed(list(candidate.at_tones()))} if length else {}
    for values in tones.values() if length else [next(iter(candidate.sizes()))]:
        whole = {**values, where: limits[where][0], extent: limits[extent][1]}
        change = change_of(candidate, whole)
        if change is None:
            continue
        (along,), (own,) = projection.products(whitened(problem, change)[None])
        along, size = along.sum(axis=1), own.sum(axis=1)
        best = (-math.inf, 0, whole, 0.0)
        for wave, phase, turn in _waves(problem, candidate, whole):
            parts = np.real(turn[:, None] * along), size
            sums = [np.concatenate([0.0 * part[:1], np.cumsum(part, axis=0)]) for part in parts]
            products, sizes = (one[pairs[1]] - one[pairs[0]] for one in sums)
            gain, which, *_ = projection.weighed(products[:, :-1], products[:, -1], sizes, SLIGHTEST)
            best = max(best, (gain, which, wave, phase), key=lambda one: one[0])
        _, which, wave, phase = best
        begins, ends = at[trained == pairs[0][which]], at[trained == pairs[1][which]]
        begin = float(np.clip(begins.mean(), *limits[where]))
        if length:
            begin = _in_phase(begin, wave[length], whole[where] / whole[length] - phase / (2.0 * math.pi))
        end = math.inf if ends[-1] == at[-1] else float(ends.mean())
        found.append({**wave, where: begin, extent: float(np.clip(end - begin, *limits[extent]))})
    return found


def _waves(
    problem: Problem, candidate: Candidate, whole: dict[str, float]
) -> Iterator[tuple[dict[str, float], float, np.ndarray]]:
    """Numbers, phase [rad] and the factor (t,) of the training frames that turns the signature of `whole` to them; the
    signature as it is where it has no wave.
    """
    s = distance_at(problem, problem.frames.middles)
    name = candidate.number("wavelength")
    if not name:
        yield whole, 0.0, np.ones(int(problem.train.sum()), complex)
        return
    free = candidate.parameters[name]
    for turns in np.linspace(-DETUNED, DETUNED, WAVES_TRIED):
        number = 1.0 / whole[name] + turns / float(s.mean())
        if number <= 0.0 or not free.low <= 1.0 / number <= free.high:
            continue
        for phase in 2.0 * np.pi * np.arange(WAVE_PHASES) / WAVE_PHASES:
            aside = 2.0 * np.pi * s * (number - 1.0 / whole[name]) + phase
            yield {**whole, name: 1.0 / number}, float(phase), np.exp(1j * aside)[problem.train]


def _in_phase(begin: float, wavelength: float, turns: float) -> float:
    """The first place after `begin` at which a wave has gone through a whole number of turns and these."""
    return wavelength * (turns + math.ceil(begin / wavelength - turns))
