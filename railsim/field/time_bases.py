"""Keys `time:` of a map: what a logger calls time."""

import re
from typing import Annotated, Any, Literal
from zoneinfo import ZoneInfo

import pydantic

from railsim.field.units import unit_of
from railsim.spec import Spec, quantity

MAP = "map"


def _column(value: Any) -> Any:
    """A number stands for the place of the column, from 1: "#3" is the third."""
    whole = isinstance(value, int) and not isinstance(value, bool) and value > 0
    return f"#{value}" if whole else value


def _columns(value: Any) -> Any:
    return [_column(one) for one in (value if isinstance(value, list | tuple) else [value])]


ColumnName = Annotated[str, pydantic.BeforeValidator(_column)]
ColumnNames = Annotated[tuple[str, ...], pydantic.BeforeValidator(_columns)]

_LOST = "values that stand for a lost time"


class Seconds(Spec, frozen=True):
    """A column of elapsed time."""

    kind: Literal["seconds"]
    column: ColumnName = quantity(unit="column", source=MAP)
    unit: Annotated[str, unit_of("s")] = quantity("s", unit="unit of time", source=MAP)
    lost: tuple[float | str, ...] = quantity((), unit=_LOST, source=MAP)


class Epoch(Spec, frozen=True):
    """A column of time since 1 January 1970, 0 h UTC."""

    kind: Literal["epoch"]
    column: ColumnName = quantity(unit="column", source=MAP)
    unit: Literal["s", "ms", "us", "ns", "excel", "datenum"] | None = quantity(
        None, unit="else by the size of the numbers; days: excel of a spreadsheet, datenum of MATLAB", source=MAP
    )
    lost: tuple[float | str, ...] = quantity((), unit=_LOST, source=MAP)


class Iso(Spec, frozen=True):
    """A column of date and time, of times of day, or of the file's own type for instants; two columns are joined."""

    kind: Literal["iso"]
    column: ColumnNames = quantity(unit="column, or columns of date and time", source=MAP, min_length=1)
    zone: str | None = quantity(None, unit="of times without one, as +02:00 or Europe/Berlin", source=MAP)
    format: str | None = quantity(None, unit='pattern of strptime, as "%d.%m.%Y %H:%M:%S.%f"', source=MAP)
    date_order: Literal["day", "month", "year"] | None = quantity(None, unit="what stands first", source=MAP)
    date: str | None = quantity(None, unit="of the first row, where the column holds times of day", source=MAP)
    lost: tuple[str, ...] = quantity((), unit=_LOST, source=MAP)

    @pydantic.field_validator("zone")
    @classmethod
    def _zone(cls, value: str | None) -> str | None:
        return check_zone(value)

    @pydantic.field_validator("date", mode="before")
    @classmethod
    def _date(cls, value: Any) -> Any:
        value = value.isoformat() if hasattr(value, "isoformat") else value
        if isinstance(value, str) and not re.fullmatch(r"\d{4}-\d\d-\d\d", value):
            raise ValueError("write it as 2024-05-03")
        return value


class Gps(Spec, frozen=True):
    """GPS week and seconds of the week; `leap_seconds` is GPS minus UTC (18 s since 2017) and has to be stated."""

    kind: Literal["gps"]
    week: str | int = quantity(unit="column, or the number of the week", source=MAP)
    seconds: str = quantity(unit="column of seconds of the week", source=MAP)
    unit: str = quantity("s", unit="unit of time", source=MAP)
    leap_seconds: int = quantity(unit="s, GPS minus UTC", source=MAP, ge=0, le=60)
    rollovers: int = quantity(0, unit="times 1024 weeks to be added", source=MAP, ge=0, le=9)
    lost: tuple[float | str, ...] = quantity((), unit=_LOST, source=MAP)


class Counter(Spec, frozen=True):
    """A counter of clock ticks or samples that wraps around."""

    kind: Literal["counter"]
    column: ColumnName = quantity(unit="column", source=MAP)
    frequency: float = quantity(unit="Hz, ticks a second", source=MAP, gt=0)
    modulus: float = quantity(unit="ticks, value at which it begins again (65536 for 16 bits)", source=MAP, gt=1)
    minimum: float | None = quantity(None, unit="ticks, lowest value (-32768 for signed 16 bits)", source=MAP)
    lost: tuple[float | str, ...] = quantity((), unit=_LOST, source=MAP)


class Rows(Spec, frozen=True):
    """No column of time: the rows follow each other at the table's rate, which has to be stated."""

    kind: Literal["rows"]


class Own(Spec, frozen=True):
    """The time axis that the format itself holds (MDF master channel, TDMS waveform)."""

    kind: Literal["own"]
    zone: str | None = quantity(None, unit="of a start in local time, as +02:00 or Europe/Berlin", source=MAP)

    @pydantic.field_validator("zone")
    @classmethod
    def _zone(cls, value: str | None) -> str | None:
        return check_zone(value)


TimeBase = Annotated[Seconds | Epoch | Iso | Gps | Counter | Rows | Own, pydantic.Field(discriminator="kind")]


def check_zone(value: str | None) -> str | None:
    """The zone itself; raises ValueError where there is none of that name."""
    if value is None or re.fullmatch(r"Z|UTC|[+-]\d\d:\d\d", value):
        return value
    try:
        ZoneInfo(value)
    except (KeyError, ValueError, OSError):
        pass
    else:
        return value
    raise ValueError('write it as "+02:00", "UTC" or by a place as "Europe/Berlin", in quotes')


def columns_of(base: object) -> list[str]:
    """Columns that a time base needs."""
    if isinstance(base, Iso):
        return list(base.column)
    if isinstance(base, Seconds | Epoch | Counter):
        return [base.column]
    if isinstance(base, Gps):
        return [base.seconds, *([base.week] if isinstance(base.week, str) else [])]
    return []


def lost_of(base: object) -> tuple[float | str, ...]:
    """Markers of a lost time."""
    return getattr(base, "lost", ())
