"""The map: what a file's columns mean. Read from YAML and checked before the file is opened."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pydantic

from railsim.errors import InputError
from railsim.field.units import converter, parse_unit
from railsim.settings import MOST_CHARACTERS, load_yaml
from railsim.spec import Spec, quantity

MAP = "map"
ENCODINGS = (
    "utf-8", "utf-16", "utf-16-le", "utf-16-be", "latin-1", "cp1250", "cp1251", "cp1252", "iso8859-15", "gb18030",
    "gbk", "big5", "shift_jis", "euc-kr", "ascii",
)  # fmt: skip
Repair = Literal["sort", "drop_duplicates", "drop_untimed", "snap", "resample", "fill"]


class Csv(Spec, frozen=True):
    """How a text table is written; what is not given is found by a rule, and said."""

    encoding: str | None = quantity(None, unit="name of an encoding", source=MAP)
    undecodable: Literal["refuse", "replace"] = quantity("refuse", unit="-", source=MAP)
    separator: str | None = quantity(None, unit="one character", source=MAP, min_length=1, max_length=1)
    decimal: Literal[".", ","] | None = quantity(None, unit="-", source=MAP)
    thousands: Literal[".", ",", " ", "'"] | None = quantity(None, unit="-", source=MAP)
    skip: int = quantity(0, unit="lines before the header", source=MAP, ge=0, le=10_000)
    units_row: bool = quantity(False, unit="whether the line below the header holds units", source=MAP)
    comment: str = quantity("#", unit="first character of comment lines", source=MAP, min_length=1, max_length=1)

    @pydantic.field_validator("encoding")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None and value.lower() not in ENCODINGS:
            raise ValueError(f"unknown encoding; known are {', '.join(ENCODINGS)}")
        return value.lower() if value else None


class Seconds(Spec, frozen=True):
    """A column of elapsed time."""

    kind: Literal["seconds"]
    column: str = quantity(unit="column", source=MAP)
    unit: str = quantity("s", unit="unit of time", source=MAP)

    @pydantic.field_validator("unit")
    @classmethod
    def _time(cls, value: str) -> str:
        converter(value, "s", "unit")
        return value


class Iso(Spec, frozen=True):
    """A column of ISO 8601 date and time, or of the file's own type for instants."""

    kind: Literal["iso"]
    column: str = quantity(unit="column", source=MAP)
    zone: str | None = quantity(None, unit="offset from UTC of times without one, as +02:00", source=MAP)

    @pydantic.field_validator("zone")
    @classmethod
    def _offset(cls, value: str | None) -> str | None:
        if value is not None and not re.fullmatch(r"Z|UTC|[+-]\d\d:\d\d", value):
            raise ValueError('write it as "+02:00", "-05:30" or "UTC", in quotes')
        return value


class Gps(Spec, frozen=True):
    """GPS week and seconds of the week; `leap_seconds` is GPS minus UTC (18 s since 2017) and has to be stated."""

    kind: Literal["gps"]
    week: str | int = quantity(unit="column, or the number of the week", source=MAP)
    seconds: str = quantity(unit="column of seconds of the week", source=MAP)
    unit: str = quantity("s", unit="unit of time", source=MAP)
    leap_seconds: int = quantity(unit="s, GPS minus UTC", source=MAP, ge=0, le=60)
    rollovers: int = quantity(0, unit="times 1024 weeks to be added", source=MAP, ge=0, le=9)


class Counter(Spec, frozen=True):
    """A counter of clock ticks or samples that wraps around."""

    kind: Literal["counter"]
    column: str = quantity(unit="column", source=MAP)
    frequency: float = quantity(unit="Hz, ticks a second", source=MAP, gt=0)
    modulus: float = quantity(unit="ticks, value at which it begins again (65536 for 16 bits)", source=MAP, gt=1)


class Rows(Spec, frozen=True):
    """No column of time: the rows follow each other at the table's rate, which has to be stated."""

    kind: Literal["rows"]


class Own(Spec, frozen=True):
    """The time axis that the format itself holds (MDF4 master channel, TDMS waveform)."""

    kind: Literal["own"]


TimeBase = Annotated[Seconds | Iso | Gps | Counter | Rows | Own, pydantic.Field(discriminator="kind")]


class Pulses(Spec, frozen=True):
    """A tachometer's count of pulses, which wraps around: becomes the speed between two rows."""

    per_revolution: float = quantity(unit="pulses", source=MAP, gt=0)
    modulus: float = quantity(unit="counts, value at which it begins again", source=MAP, gt=1)
    radius: float | None = quantity(None, unit="m, of the wheel; else the vehicle's wheel_radius", source=MAP, gt=0.1)
    fastest: float = quantity(120.0, unit="m/s; beyond, a count is lost", source="railsim.speed.FASTEST", gt=0)


class Chord(Spec, frozen=True):
    """Versine over a chord: offset of the rail from the straight line between two points of it."""

    behind: float = quantity(unit="m, from the measuring point to the chord's rear end", source=MAP, gt=0, le=100)
    ahead: float = quantity(unit="m, from the measuring point to the chord's front end", source=MAP, gt=0, le=100)
    shortest: float = quantity(3.0, unit="m, wavelength", source="EN 13848-1, range D1", gt=0)
    longest: float = quantity(70.0, unit="m, wavelength", source="EN 13848-1, end of range D2", gt=0)
    floor: float = quantity(
        0.03,
        unit="-, chord's gain below which its inverse is held back",
        source="trial: docs/field_data.md",
        gt=0,
        lt=1,
    )


class Channel(Spec, frozen=True):
    """One column: SI value = sign * unit(scale * value + offset)."""

    column: str = quantity(unit="column", source=MAP)
    unit: str | None = quantity(None, unit="name of a unit; else the file's own", source=MAP)
    other_unit_in_file: bool = quantity(False, unit="whether the file's own unit is known to be wrong", source=MAP)
    sign: Literal[1, -1] = quantity(1, unit="-", source=MAP)
    scale: float = quantity(1.0, unit="stated unit per unit of the column's values", source=MAP)
    offset: float = quantity(0.0, unit="stated unit", source=MAP)
    lost: tuple[float | str, ...] = quantity((), unit="values that stand for a lost sample", source=MAP)
    unwrap: float | None = quantity(None, unit="column's values, modulus at which it begins again", source=MAP, gt=0)
    pulses: Pulses | None = quantity(None, unit="-", source=MAP)

    @pydantic.field_validator("unit")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None:
            parse_unit(value)
        return value


class TableMap(Spec, frozen=True):
    """Columns that are sampled together."""

    group: str | int | None = quantity(None, unit="name or number (from 0) of the file's group", source=MAP)
    time: TimeBase = quantity(unit="-", source=MAP)
    time_offset: float = quantity(0.0, unit="s, added to the times", source=MAP)
    rate: float | None = quantity(None, unit="Hz; else from the times", source=MAP, gt=0, le=1e6)
    rows: Literal["all", "filled"] = quantity("all", unit="filled: rows without any value are left out", source=MAP)
    repair: tuple[Repair, ...] = quantity((), unit="-", source=MAP)
    channels: dict[str, Channel] = quantity(unit="by channel, <sensor>.<quantity> [unit]", source=MAP, min_length=1)

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Self:
        _check_repairs(self.repair)
        if isinstance(self.time, Rows) and self.rate is None:
            raise ValueError("time of kind 'rows' needs a 'rate'; add it")
        return self


class RecordingMap(Spec, frozen=True):
    """A file of measured channels."""

    kind: Literal["recording"] = "recording"
    origin: str = quantity(unit="where and how it was measured", source=MAP, min_length=1)
    format: Literal["csv", "parquet", "mdf4", "tdms"] | None = quantity(None, unit="-", source=MAP)
    csv: Csv = quantity(Csv(), unit="-", source=MAP)
    vehicle: str | dict[str, Any] = quantity(unit="shipped vehicle, or nominal parameters in SI units", source=MAP)
    speed_source: str | None = quantity(None, unit="channel that estimators take the speed from", source=MAP)
    track: str | None = quantity(None, unit="track file, from the map's folder, or shipped track", source=MAP)
    tables: tuple[TableMap, ...] = quantity(unit="-", source=MAP, min_length=1)
    sensors: tuple[dict[str, Any], ...] = quantity((), unit="-", source=MAP)


class Kilometrage(Spec, frozen=True):
    """The column of place; `direction` is how the car ran, `towards` how the track file shall run."""

    column: str = quantity(unit="column", source=MAP)
    unit: str = quantity("m", unit="unit of length", source=MAP)
    direction: Literal["up", "down"] = quantity(unit="of the kilometrage as the car ran", source=MAP)
    towards: Literal["up", "down"] | None = quantity(None, unit="of the track file; else as the car ran", source=MAP)
    zero: float | None = quantity(None, unit="m, kilometrage at which s is 0; else the track's beginning", source=MAP)
    sides: Literal["running", "kilometrage"] | None = quantity(
        None, unit="left and right as seen in the running direction, or looking up the kilometrage", source=MAP
    )

    @pydantic.field_validator("unit")
    @classmethod
    def _length(cls, value: str) -> str:
        converter(value, "m", "unit")
        return value


class TrackColumn(Channel, frozen=True):
    """One column of track geometry."""

    chord: Chord | None = None


class Registration(Spec, frozen=True):
    """Shift of this run against another one of the same track, by cross-correlation."""

    reference: str = quantity(unit="track file, from the map's folder", source=MAP)
    column: str = quantity(unit='column of both, as "vertical [m]"', source=MAP)
    window: float = quantity(200.0, unit="m", source="illustrative: tens of wavelengths of range D1", ge=20)
    largest: float = quantity(20.0, unit="m, largest shift", source="illustrative", gt=0)
    threshold: float = quantity(0.6, unit="-, correlation below which a window is left out", source=MAP, gt=0, lt=1)


class TrackMap(Spec, frozen=True):
    """A file of a track-recording car."""

    kind: Literal["track"]
    origin: str = quantity(unit="where and how it was measured", source=MAP, min_length=1)
    format: Literal["csv", "parquet", "mdf4", "tdms"] | None = quantity(None, unit="-", source=MAP)
    csv: Csv = quantity(Csv(), unit="-", source=MAP)
    group: str | int | None = quantity(None, unit="name or number (from 0) of the file's group", source=MAP)
    kilometrage: Kilometrage = quantity(unit="-", source=MAP)
    spacing: float | None = quantity(None, unit="m; else from the kilometrage", source=MAP, gt=0)
    repair: tuple[Repair, ...] = quantity((), unit="-", source=MAP)
    columns: dict[str, TrackColumn] = quantity(unit='by track column, as "vertical [m]"', source=MAP, min_length=1)
    align: Registration | None = quantity(None, unit="-", source=MAP)

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Self:
        _check_repairs(self.repair)
        return self


def load_map(path: Path | str) -> RecordingMap | TrackMap:
    """Read and check a map.

    Raises
    ------
    InputError : no such file, not YAML, an unknown key or unit, a value out of bounds; one line that names the key.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = file.read(4 * MOST_CHARACTERS + 1)
    except OSError as error:
        raise InputError(f"cannot read map '{path}': {error.strerror}; give a YAML file") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"map '{path}': byte {error.start} is not UTF-8 text; save the map as UTF-8") from None
    values = load_yaml(text, f"map '{path}'")
    if not isinstance(values, dict) or not all(isinstance(key, str) for key in values):
        raise InputError(f"map '{path}' must hold keys and values; begin with 'origin: ...' and 'tables:'")
    kind = TrackMap if values.get("kind") == "track" else RecordingMap
    try:
        return kind.build(values)
    except InputError as error:
        raise InputError(f"map '{path}': {error}") from None


def _check_repairs(repairs: tuple[str, ...]) -> None:
    if {"snap", "resample"} <= set(repairs):
        raise ValueError("repair: 'snap' moves times, 'resample' interpolates values; name one of the two")
