"""Starts: from which numbers of an effect a fit sets out, beside those that screening found."""

import math
from collections.abc import Iterator

import numpy as np

from experiments.discrepancy.candidates import DISTANCES, LENGTHS, STRETCHES, TIMES
from experiments.discrepancy.screening import Screened

ENDS = (-30.0, -15.0, 15.0, 30.0)  # m that a stretch may begin or end elsewhere


def all_sizes(one: Screened) -> list[dict[str, float]]:
    """All sizes of a candidate where the signature has its place, phase or wavelength."""
    free = one.candidate.parameters
    where = {name: value for name, value in one.tried.items() if free[name].absent is None}
    return [{**values, **where} for values in one.candidate.sizes()]


def stretched(one: Screened) -> list[dict[str, float]]:
    """Begins and ends around those of a stretch that screening found to a section only, and those of the whole way."""
    if one.candidate.name in LENGTHS and one.candidate.kind.acts_on == "load":
        return list(_longer_and_shorter(one))
    if one.candidate.name not in STRETCHES:
        return []
    place, length = one.candidate.parameters["place"], one.candidate.parameters["length"]
    first, last = one.values["place"], one.values["place"] + one.values["length"]
    pairs = [(first + metres, last) for metres in ENDS] + [(first, last + metres) for metres in ENDS]
    pairs += [(first, math.inf), (-math.inf, last), (-math.inf, math.inf)]
    found = []
    for begin, end in pairs:
        where = float(np.clip(begin, place.low, place.high))
        found.append({**one.values, "place": where, "length": float(np.clip(end - where, length.low, length.high))})
    return found


def _longer_and_shorter(one: Screened) -> Iterator[dict[str, float]]:
    """A gust that is longer or shorter with its begin, its middle or its end where they were."""
    where = next(name for name in (*DISTANCES, *TIMES) if name in one.values)
    begin, length = one.candidate.parameters[where], LENGTHS[one.candidate.name][0]
    free = one.candidate.parameters[length]
    for factor in (0.6, 1.6):
        changed = float(np.clip(factor * one.values[length], free.low, free.high))
        for share in (0.0, 0.5, 1.0):
            at = one.values[where] + share * (one.values[length] - changed)
            yield {**one.values, where: float(np.clip(at, begin.low, begin.high)), length: changed}
