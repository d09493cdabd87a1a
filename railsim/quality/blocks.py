"""Long records in parts: checks compare every stretch of a record with every other, which grows with its square."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from railsim.measurements import TIME, Measurements
from railsim.quality.interface import Finding

LONGEST = 600.0
"""s; a longer record is inspected in parts."""
PART = 300.0
"""s, of a part at most."""


@dataclass(frozen=True)
class Part:
    """A part of a record.

    Attributes
    ----------
    number, count : which part of how many, from 0.
    measured : the channels there.
    firsts : number of the first row of each table, by rate.
    """

    number: int
    count: int
    measured: Measurements
    firsts: dict[float, int]

    def placed(self, one: Finding) -> Finding:
        """A finding of the part with its samples numbered as in the record."""
        if one.samples is None:
            return one
        rate = self.measured.rate(one.channel) if one.channel in self.measured else _rate_of(one.channel)
        return replace(one, samples=one.samples + self.firsts[rate])


def _rate_of(clock: str) -> float:
    return float(clock.removeprefix(f"{TIME} at ").removesuffix(" Hz"))


def parts(measured: Measurements) -> Iterator[Part]:
    """The parts of a record, of equal length, each of which views the record."""
    first, last = measured.span()
    count = max(1, int(np.ceil((last - first) / PART)))
    bounds = np.linspace(first, last, count + 1)
    bounds[-1] = np.inf
    for number in range(count):
        found = measured.between(float(bounds[number]), float(bounds[number + 1]))
        if found is not None:
            yield Part(number, count, *found)


def together(found: list[tuple[int, Finding]], count: int) -> list[Finding]:
    """Findings of parts as those of the record: what is alike in parts that follow each other is one finding.

    It holds the words and numbers of the part in which it is worst.

    Parameters
    ----------
    found : number of the part, and what was found there.
    count : number of parts.
    """
    chains: list[list[tuple[int, Finding]]] = []
    last: dict[tuple[str, str, str | None, str], list[tuple[int, Finding]]] = {}
    for number, one in found:
        key = one.kind, one.channel, one.other, one.severity
        chain = last.get(key)
        if chain is not None and number - chain[-1][0] <= 1:
            chain.append((number, one))
        else:
            last[key] = [(number, one)]
            chains.append(last[key])
    return [_one(chain, count) for chain in chains]


def _one(chain: list[tuple[int, Finding]], count: int) -> Finding:
    if len(chain) == 1:
        return chain[0][1]
    findings = [one for _, one in chain]
    worst = max(findings, key=lambda one: (abs(one.repair.amount) if one.repair else 0.0, one.end - one.start))
    samples = [one.samples for one in findings if one.samples is not None]
    held = len({number for number, _ in chain})
    alike = f"; so in {held} of {count} parts of the record, told is the worst" if held > 1 else ""
    return replace(
        worst,
        start=min(one.start for one in findings),
        end=max(one.end for one in findings),
        extent=worst.extent + alike,
        samples=np.concatenate(samples) if len(samples) == len(findings) else None,
    )


def joined(measured: Measurements, cleaned: list[Measurements]) -> Measurements:
    """The parts after each other as one record again; a row that does not come after those before it is left out."""
    tables: dict[float, dict[str, list[np.ndarray]]] = {}
    for one in cleaned:
        names: dict[float, list[str]] = {}
        for name in one:
            names.setdefault(one.rate(name), []).append(name)
        for rate, mine in names.items():
            table = tables.setdefault(rate, {})
            time = one.time(mine[0])
            before = table[TIME][-1][-1] if table and table[TIME][-1].size else -np.inf
            kept = time > before
            table.setdefault(TIME, []).append(time[kept])
            for name in mine:
                table.setdefault(name, []).append(one[name][kept])
    whole = {rate: {name: np.concatenate(pieces) for name, pieces in table.items()} for rate, table in tables.items()}
    return Measurements(measured.about, whole, measured.track)
