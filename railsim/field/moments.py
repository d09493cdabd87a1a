"""Dates and times of day as people write them, as nanoseconds."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.field.durations import DAY_NS, SECOND_NS
from railsim.field.tables import Notes, Table
from railsim.field.time_bases import Iso

_CHUNK = 200_000  # rows that are read at once
_PATTERN = (
    r"^(?:(?P<a>\d{4}|\d{1,2})(?P<mark>[-./ ])(?P<b>\d{1,2}|[A-Za-z]{3,9})[-./ ](?P<c>\d{4}|\d{1,2}))?"
    r"(?:(?:^|[Tt ,_]+)(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2})(?:[.,:](?P<f>\d{1,12}))?)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)?)?$"
)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_CURE = (
    "write it as 2024-05-03T12:00:00.125, state its pattern, as 'format: \"%d.%m.%Y %H:%M:%S.%f\"' in 'time', or, "
    "where it stands for a lost time, add it to 'lost' of 'time' and 'drop_untimed' to repair"
)


@dataclass(frozen=True)
class Moments:
    """What texts say.

    Attributes
    ----------
    nanoseconds : since 1 January 1970 on the clock of `ahead`, or since midnight where not `dated`, shape (n,).
    lost : rows without a time, shape (n,).
    ahead : ns by which the row's own zone is ahead of UTC, shape (n,); `zoned` where a row states one.
    zoned : shape (n,).
    dated : whether there is a date.
    """

    nanoseconds: np.ndarray
    lost: np.ndarray
    ahead: np.ndarray
    zoned: np.ndarray
    dated: bool


def read_moments(texts: Sequence[str], base: Iso, name: str, table: Table, notes: Notes) -> Moments:
    """Dates and times of all rows.

    Raises
    ------
    InputError : a text is none, dates can be read in two ways, or some rows have a date and others not.
    """
    stripped = np.array([text.strip() for text in texts], dtype=object)
    lost = np.isin(stripped, ["", "nan", "NaN", "NaT", "NULL", "null", *base.lost])
    if base.format is not None:
        return _by_format(stripped, lost, base.format, name, table)
    parts = [_Fields(stripped[at : at + _CHUNK]) for at in range(0, stripped.size, _CHUNK)]
    fields = _Fields.joined(parts)
    found = fields.days(base.date_order, lost, name, notes)
    clock, ahead, zoned, fits = fields.clock()
    nanoseconds = found * DAY_NS + clock
    wrong = ~lost & (~fits | (found == _NONE))
    for row in np.flatnonzero(wrong):
        nanoseconds[row], ahead[row], zoned[row] = _by_standard(stripped[row], int(row), name, table)
    dated = fields.dated | wrong
    if (dated & ~lost).any() and not dated[~lost].all():
        row = int(np.argmax(~dated & ~lost))
        raise InputError(
            f"column '{name}' row {table.line(row)} holds '{stripped[row][:40]}', a time without the date that others "
            "have; mend it"
        )
    return Moments(nanoseconds, lost, ahead, zoned, bool((dated & ~lost).any()))


_NONE = np.iinfo(np.int64).min // DAY_NS


class _Fields:
    """The parts of texts that follow `_PATTERN`, shape (n,) each."""

    def __init__(self, texts: np.ndarray) -> None:
        found: Any = pd.Series(texts, dtype=object).str.extract(_PATTERN)
        self.fits = found.notna().any(axis=1).to_numpy()
        self.dated = found["a"].notna().to_numpy()
        self.years_first = (found["a"].str.len() == 4).to_numpy()
        self.named = found["b"].str.isalpha().eq(True).to_numpy()
        self.long = (found["c"].str.len() == 4).to_numpy()
        self.points = (found["mark"] == ".").to_numpy()
        months = found["b"].str.lower().str[:3].map({name: str(n) for n, name in enumerate(_MONTHS, 1)})
        found["b"] = found["b"].where(~found["b"].str.isalpha().eq(True), months)
        self.a, self.b, self.c, self.h, self.m, self.s = (_whole(found[key], -1) for key in "abchms")
        fraction = found["f"].fillna("").str[:9].str.ljust(9, "0")
        self.f = _whole(fraction, 0)
        half = found["half"].str[0].str.lower()
        self.half = np.where(half.eq("p"), 1, np.where(half.eq("a"), 0, -1))
        self.zoned = found["zone"].notna().to_numpy()
        zone = found["zone"].fillna("+00:00").replace({"Z": "+00:00", "UTC": "+00:00", "GMT": "+00:00"})
        digits = zone.str[1:].str.replace(":", "", regex=False).str.ljust(4, "0")
        minutes = _whole(digits.str[:2], 0) * 60 + _whole(digits.str[2:4], 0)
        self.ahead = np.where(zone.str[0] == "-", -1, 1) * minutes * 60 * SECOND_NS

    @staticmethod
    def joined(parts: list["_Fields"]) -> "_Fields":
        """One of all rows."""
        whole = parts[0]
        for key in vars(whole):
            setattr(whole, key, np.concatenate([getattr(part, key) for part in parts]))
        return whole

    def clock(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(ns since midnight, ns ahead of UTC, whether a zone is stated, whether it is a time)."""
        hour = np.where(self.h < 0, 0, self.h)
        hour = np.where(self.half >= 0, hour % 12 + 12 * np.maximum(self.half, 0), hour)
        minute, second = np.maximum(self.m, 0), np.maximum(self.s, 0)
        whole = (hour <= 23) & (minute <= 59) & (second <= 60) & self.fits
        ns = ((hour * 60 + minute) * 60 + second) * SECOND_NS + self.f
        return ns, self.ahead.copy(), self.zoned.copy(), whole

    def days(self, order: str | None, lost: np.ndarray, name: str, notes: Notes) -> np.ndarray:
        """Days since 1970, shape (n,); 0 without a date, `_NONE` where there is no such day."""
        plain = self.dated & ~self.years_first & ~lost
        day_first = _days(_year(self.c), self.b, self.a)
        result = np.where(self.years_first, _days(self.a, self.b, self.c), day_first)
        if plain.any() and order == "year":
            result = np.where(plain, _days(_year(self.a), self.b, self.c), result)
        elif plain.any() and order == "month":
            result = np.where(plain, _days(_year(self.c), self.a, self.b), result)
        elif plain.any() and order is None and not self.named[plain].all():
            month_first = _days(_year(self.c), self.a, self.b)
            if self._month_first(plain, day_first, month_first, name, notes):
                result = np.where(plain, month_first, result)
        return np.where(self.dated, result, 0)

    def _month_first(
        self, plain: np.ndarray, day_first: np.ndarray, month_first: np.ndarray, name: str, notes: Notes
    ) -> bool:
        """Whether dates as 05/03/2024 begin with the month."""
        readings = {"day": day_first[plain], "month": month_first[plain]}
        possible = [key for key, days in readings.items() if (days != _NONE).all()]
        reason = "as no other reading has a date in all rows"
        if len(possible) == 2 and self.points[plain].all():
            possible, reason = ["day"], "as dates with points have it"
        if len(possible) == 2:
            steady = [key for key in possible if np.abs(np.diff(readings[key])).max(initial=0) <= 1]
            possible = steady if len(np.unique(readings["day"])) > 1 else possible
            reason = "by which the date goes on from day to day"
        if len(possible) == 2 or (not possible and not self.long[plain].all()):
            raise InputError(
                f"column '{name}': dates can begin with the day or the month; state 'date_order: day' or "
                "'date_order: month' in 'time'"
            )
        if possible:
            notes.assume(f"column '{name}': dates begin with the {possible[0]}, {reason}")
        return possible == ["month"]


def _whole(texts: Any, otherwise: int) -> np.ndarray:
    """Whole numbers of a column of texts, shape (n,)."""
    found: Any = pd.to_numeric(texts, errors="coerce")
    return found.fillna(otherwise).to_numpy(dtype=np.int64)


def _year(number: np.ndarray) -> np.ndarray:
    """Years of two digits are those of this century."""
    return np.where((number >= 0) & (number < 100), number + 2000, number)


def _days(year: np.ndarray, month: np.ndarray, day: np.ndarray) -> np.ndarray:
    possible = (year > 1677) & (year < 2262) & (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    year, month, day = (np.where(possible, one, other) for one, other in ((year, 2000), (month, 1), (day, 1)))
    months = (year - 1970).astype("datetime64[Y]").astype("datetime64[M]") + (month - 1)
    days = months.astype("datetime64[D]") + (day - 1)
    return np.where(possible & (days.astype("datetime64[M]") == months), days.astype(np.int64), _NONE)


def _by_standard(text: str, row: int, name: str, table: Table) -> tuple[int, int, bool]:
    """(ns, ns ahead of UTC, whether a zone is stated) of the rarer forms of ISO 8601."""
    try:
        if not re.search(r"\d{4}", text):
            raise ValueError
        moment = datetime.fromisoformat(re.sub(r"([.,]\d{6})\d+", r"\1", text))
    except (ValueError, OverflowError):
        raise InputError(
            f"column '{name}' row {table.line(row)} holds '{text[:40]}', no ISO 8601 time; {_CURE}"
        ) from None
    offset = moment.utcoffset()
    ahead = 0 if offset is None else round(offset.total_seconds()) * SECOND_NS
    since = moment.replace(tzinfo=UTC) - datetime(1970, 1, 1, tzinfo=UTC)
    if abs(since.days) > 100_000:
        raise InputError(f"column '{name}' row {table.line(row)} holds '{text[:40]}', a date too far off; {_CURE}")
    return (since.days * 86_400 + since.seconds) * SECOND_NS + since.microseconds * 1000, ahead, offset is not None


def _by_format(texts: np.ndarray, lost: np.ndarray, pattern: str, name: str, table: Table) -> Moments:
    try:
        kept: Any = pd.Series([None if gone else text for text, gone in zip(texts, lost, strict=True)], dtype=object)
        found: Any = pd.to_datetime(kept, format=pattern, errors="coerce", utc="%z" in pattern)
    except (ValueError, TypeError) as error:
        raise InputError(
            f"time.format '{pattern}' is no pattern ({' '.join(str(error).split())[:80]}); correct it"
        ) from None
    missing = found.isna().to_numpy() & ~lost
    if missing.any():
        row = int(missing.argmax())
        raise InputError(
            f"column '{name}' row {table.line(row)} holds '{texts[row][:40]}', which is not written as '{pattern}'; "
            "correct 'format' in 'time'"
        )
    plain = found.dt.tz_localize(None) if "%z" in pattern else found
    ns = plain.to_numpy(dtype="datetime64[ns]").astype(np.int64)
    dated = any(mark in pattern for mark in ("%d", "%j", "%x", "%c", "%D", "%F", "%s"))
    zoned = np.full(texts.size, "%z" in pattern)
    return Moments(ns if dated else np.mod(ns, DAY_NS), lost, np.zeros(texts.size, dtype=np.int64), zoned, dated)
