"""Logs of GNSS receivers by NMEA 0183: RMC, GGA, VTG and ZDA, whatever else stands in the lines.

Columns: `latitude`, `longitude`, `course` (deg), `altitude` (m), `speed` (m/s, by RMC, else VTG), `quality`,
`satellites`, `hdop`, and `time` (instants). A row is one time of the receiver.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import date
from functools import reduce
from itertools import pairwise
from operator import xor
from pathlib import Path

import numpy as np

from railsim.errors import InputError
from railsim.field.durations import DAY, DAY_NS, HOUR, SECOND_NS
from railsim.field.readers.interface import Wanted, from_fixes
from railsim.field.tables import Table

UNITS = {
    "latitude": "deg", "longitude": "deg", "altitude": "m", "speed": "m/s", "course": "deg", "quality": "-",
    "satellites": "-", "hdop": "-",
}  # fmt: skip
_SENTENCE = re.compile(rb"\$([A-Z]{2}(RMC|GGA|VTG|ZDA),[ -#%-)+-~]*)(?:\*([0-9A-Fa-f]{2}))?")
_BEGUN = re.compile(rb"\$[A-Z]{2}(?:RMC|GGA|VTG|ZDA)")
_KNOT = 1852 / HOUR


@dataclass
class _Fix:
    """What the sentences of one time say; NaN where they say nothing."""

    clock: float
    day: date | None = None
    values: dict[str, float] = field(default_factory=dict)


def read(path: Path, wanted: list[Wanted]) -> list[Table]:
    """Fixes of the log.

    Raises
    ------
    InputError : a column that the log has not, or no whole sentence with a time.
    """
    data = path.read_bytes()
    sentences, told = _whole(data)
    fixes, void = _fixes(sentences)
    if not fixes:
        raise InputError("no whole RMC or GGA sentence with a time stands in the log; is it cut or garbled?")
    if void:
        told.append(
            f"{void} of {len(fixes)} fixes are void by the receiver's own word: position and speed are lost there"
        )
    seconds, start = _instants(fixes)
    columns = {name: np.array([one.values.get(name, np.nan) for one in fixes]) for name in UNITS}
    return [from_fixes(one, seconds, start, columns, UNITS, "an NMEA log", told) for one in wanted]


def _whole(data: bytes) -> tuple[list[list[str]], list[str]]:
    """Fields of all sentences whose checksum holds, and what was left out."""
    kept: list[list[str]] = []
    wrong, bare = 0, []
    for found in _SENTENCE.finditer(data):
        fields = found[1].decode("ascii").split(",")
        if found[3] is None:
            bare.append(fields)
        elif reduce(xor, found[1]) == int(found[3], 16):
            kept.append(fields)
        else:
            wrong += 1
    begun = len(_BEGUN.findall(data))
    if not kept and not wrong and bare:
        return bare, [f"none of the {len(bare)} sentences has a checksum: damage would not be seen"]
    lost = max(begun - len(kept), wrong + len(bare))
    told = [f"{lost} of {begun} sentences are damaged, by their checksum or end, and left out"] if lost else []
    return kept, told


def _fixes(sentences: list[list[str]]) -> tuple[list[_Fix], int]:
    """Fixes in the order of the log, and how many of them are void."""
    fixes: list[_Fix] = []
    voids: set[int] = set()
    for fields in sentences:
        kind = fields[0][2:]
        if kind != "VTG":
            clock = _clock(fields[1] if len(fields) > 1 else "")
            if clock is None:
                continue
            if not fixes or fixes[-1].clock != clock:
                fixes.append(_Fix(clock))
        elif not fixes:
            continue
        if not _READ[kind](fixes[-1], fields):
            voids.add(len(fixes))
    return fixes, len(voids)


def _rmc(fix: _Fix, fields: list[str]) -> bool:
    if len(fields) < 10:
        return True
    fix.day = _day(fields[9][:2], fields[9][2:4], fields[9][4:6]) or fix.day
    if fields[2] != "A":
        return False
    _put(fix, "latitude", _angle(fields[3], fields[4], 2))
    _put(fix, "longitude", _angle(fields[5], fields[6], 3))
    _put(fix, "speed", _number(fields[7]) * _KNOT)
    _put(fix, "course", _number(fields[8]))
    return True


def _gga(fix: _Fix, fields: list[str]) -> bool:
    if len(fields) < 11:
        return True
    quality = _number(fields[6])
    _put(fix, "quality", quality)
    _put(fix, "satellites", _number(fields[7]))
    if not quality > 0:
        return False
    _put(fix, "hdop", _number(fields[8]))
    _put(fix, "altitude", _number(fields[9]))
    for name, at, digits in (("latitude", 2, 2), ("longitude", 4, 3)):
        if name not in fix.values:
            _put(fix, name, _angle(fields[at], fields[at + 1], digits))
    return True


def _vtg(fix: _Fix, fields: list[str]) -> bool:
    if len(fields) > 8 and fields[8].upper() == "K" and "speed" not in fix.values:
        _put(fix, "speed", _number(fields[7]) / 3.6)
    if len(fields) > 2 and "course" not in fix.values:
        _put(fix, "course", _number(fields[1]))
    return True


def _zda(fix: _Fix, fields: list[str]) -> bool:
    if len(fields) > 4:
        fix.day = _day(fields[2], fields[3], fields[4]) or fix.day
    return True


_READ: dict[str, Callable[[_Fix, list[str]], bool]] = {"RMC": _rmc, "GGA": _gga, "VTG": _vtg, "ZDA": _zda}


def _put(fix: _Fix, name: str, value: float) -> None:
    if np.isfinite(value):
        fix.values[name] = value


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _angle(text: str, side: str, digits: int) -> float:
    """Degrees of "dddmm.mmmm" and N, E, S or W; NaN where it is none."""
    if not re.fullmatch(rf"\d{{{digits}}}\d\d(\.\d*)?", text) or side not in ("N", "E", "S", "W"):
        return np.nan
    value = float(text[:digits]) + float(text[digits:]) / 60.0
    if value > (90.0 if digits == 2 else 180.0):
        return np.nan
    return -value if side in ("S", "W") else value


def _clock(text: str) -> float | None:
    """Seconds of the day of "hhmmss.ss"."""
    found = re.fullmatch(r"(\d\d)(\d\d)(\d\d(?:\.\d*)?)", text)
    if not found or int(found[1]) > 23 or int(found[2]) > 59 or float(found[3]) >= 61.0:
        return None
    return HOUR * int(found[1]) + 60.0 * int(found[2]) + float(found[3])


def _day(day: str, month: str, year: str) -> date | None:
    try:
        number = int(year)
        full = number if len(year) == 4 else number + (1900 if number >= 80 else 2000)
        return date(full, int(month), int(day))
    except ValueError:
        return None


def _instants(fixes: list[_Fix]) -> tuple[np.ndarray, str | None]:
    """Seconds after the first fix, and its instant; None where no sentence has a date.

    A fix without a date has that of the one before; a time that goes back by more than half a day is the next day's.
    """
    days = list(_days(fixes))
    times = [DAY_NS * day + round(SECOND_NS * fix.clock) for day, fix in zip(days, fixes, strict=True)]
    stamps = np.array(times, np.int64)
    dated = any(fix.day is not None for fix in fixes)
    return (stamps - stamps[0]) * 1e-9, f"{np.datetime64(int(stamps[0]), 'ns')}Z" if dated else None


def _days(fixes: list[_Fix]) -> Iterator[int]:
    """Number of each fix's day, from 1970, or from the first one's where none has a date."""
    known = next((n for n, fix in enumerate(fixes) if fix.day is not None), None)
    day = 0
    if known is not None:
        clocks = [fix.clock for fix in fixes[: known + 1]]
        day = _since(fixes[known]) - sum(after < before - 0.5 * DAY for before, after in pairwise(clocks))
    for number, fix in enumerate(fixes):
        if number and fix.clock < fixes[number - 1].clock - 0.5 * DAY:
            day += 1
        if fix.day is not None:
            day = _since(fix)
        yield day


def _since(fix: _Fix) -> int:
    assert fix.day is not None
    return (fix.day - date(1970, 1, 1)).days
