"""Starts: from which nuisances and numbers of an effect a fit sets out, beside those that screening found."""

import math
from collections.abc import Iterable

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Fit, Problem
from experiments.discrepancy.screen.screening import Screened

ENDS = (-30.0, -15.0, 15.0, 30.0)  # m that a stretch may begin or end elsewhere
FAR_ENDS = (-160.0, -80.0, -40.0, 40.0, 80.0, 160.0)  # the same of one that is fitted and leaves something
VALLEYS = 2  # other gusts from which a fit is begun
SAME = 0.1  # of the shorter one's length, by which two gusts that are no different may begin or end apart


def at_home(problem: Problem, fit: Fit) -> np.ndarray:
    """The nominal build at the place and speed, and with the offsets, that were found: nuisances that are bent to
    explain what is no nuisance are a bad place to start from.
    """
    kept = [one.kind in ("start", "speed", "bias") for one in problem.forward.nuisances]
    return np.where(kept, np.clip(fit.z, -1.0, 1.0), 0.0)


def all_sizes(one: Screened) -> list[dict[str, float]]:
    """All sizes of a candidate where the signature has its place, phase or wavelength; of a blow, whose sizes lie close
    and whose runs are slow, those that screening found.
    """
    if one.candidate.sharp:
        return [one.values, one.tried]
    free = one.candidate.parameters
    where = {name: value for name, value in one.tried.items() if free[name].absent is None}
    return [{**values, **where} for values in one.candidate.sizes()]


def stretched(one: Screened) -> list[dict[str, float]]:
    """Begins and ends around those of a stretch that screening found to a section only, and those of the whole way."""
    if not one.candidate.stretch:
        return []
    first, last = ends(one.candidate, one.values)
    whole = [(first, math.inf), (-math.inf, last), (-math.inf, math.inf)]
    return [_between(one.candidate, one.values, *pair) for pair in (*_moved(first, last, ENDS), *whole)]


def with_other_ends(candidate: Candidate, values: dict[str, float]) -> list[dict[str, float]]:
    """A fitted stretch with one end elsewhere, near and far: further off than a section a fit does not find it. A wave
    stays in phase. Nothing of what is no stretch.
    """
    if not candidate.stretch:
        return []
    wave = values.get(candidate.number("wavelength"), 0.0)
    moves = [round(metres / wave) * wave if wave else metres for metres in FAR_ENDS]
    return [_between(candidate, values, *pair) for pair in _moved(*ends(candidate, values), moves)]


def ends(candidate: Candidate, values: dict[str, float]) -> tuple[float, float]:
    """Where, or when, what has a place or a time and a length begins and ends."""
    begin = values[candidate.number("distance", "time")]
    return begin, begin + values[candidate.number("length", "duration")]


def _moved(first: float, last: float, moves: Iterable[float]) -> list[tuple[float, float]]:
    """Either end so many metres further on."""
    return [pair for metres in moves for pair in ((first + metres, last), (first, last + metres))]


def _between(candidate: Candidate, values: dict[str, float], first: float, last: float) -> dict[str, float]:
    """The same from there to there, as far as the run goes."""
    where, length = candidate.number("distance"), candidate.number("length")
    limits = {name: (one.low, one.high) for name, one in candidate.parameters.items()}
    begin = float(np.clip(first, *limits[where]))
    return {**values, where: begin, length: float(np.clip(last - begin, *limits[length]))}


def elsewhere(one: Screened, screened: Iterable[Screened]) -> list[Screened]:
    """Other gusts of the same kind that promise something too, the best first: when it blows and for how long have more
    than one valley.
    """
    if not one.candidate.gust:
        return []
    same = [other for other in screened if other.candidate.label == one.candidate.label and other.gain > 0.0]
    found = [one]
    for other in sorted(same, key=lambda other: -other.gain):
        if all(_apart(other, before) for before in found):
            found.append(other)
    return found[1 : 1 + VALLEYS]


def _apart(one: Screened, other: Screened) -> bool:
    """Whether two gusts begin or end at different times."""
    own, others = ends(one.candidate, one.values), ends(other.candidate, other.values)
    length = one.candidate.number("length", "duration")
    far = SAME * min(one.values[length], other.values[length])
    return any(abs(a - b) > far for a, b in zip(own, others, strict=True))
