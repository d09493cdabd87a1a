"""The map: what a file's columns mean. Read from YAML and checked before the file is opened."""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pydantic

from railsim.errors import InputError
from railsim.field.time_bases import MAP, ColumnName, Rows, TimeBase
from railsim.field.units import parse_unit, unit_of
from railsim.settings import MOST_CHARACTERS, load_yaml
from railsim.spec import Spec, quantity

ENCODINGS = (
    "utf-8", "utf-16", "utf-16-le", "utf-16-be", "latin-1", "cp1250", "cp1251", "cp1252", "iso8859-15", "gb18030",
    "gbk", "big5", "shift_jis", "euc-kr", "ascii",
)  # fmt: skip
Repair = Literal[
    "sort", "continue", "drop_duplicates", "spread", "drop_untimed", "drop_outliers", "snap", "resample", "fill"
]

Format = Literal["csv", "parquet", "mdf4", "tdms", "mat", "hdf5", "nmea", "gpx"]


class Csv(Spec, frozen=True):
    """How a text table is written; what is not given is found by a rule, and said."""

    encoding: str | None = quantity(None, unit="name of an encoding", source=MAP)
    undecodable: Literal["refuse", "replace"] = quantity("refuse", unit="-", source=MAP)
    separator: str | None = quantity(None, unit="one character", source=MAP, min_length=1, max_length=1)
    decimal: Literal[".", ","] | None = quantity(None, unit="-", source=MAP)
    thousands: Literal[".", ",", " ", "'"] | None = quantity(None, unit="-", source=MAP)
    skip: int = quantity(0, unit="lines before the header", source=MAP, ge=0, le=10_000)
    header: Literal["none"] | None = quantity(None, unit="none: columns go by number", source=MAP)
    names: tuple[str, ...] = quantity((), unit="of the columns, where the file has none", source=MAP)
    units_row: bool | int = quantity(
        False, unit="whether a line below the names holds units, or which of them, from 1", source=MAP, ge=0, le=20
    )
    broken: Literal["refuse", "drop"] = quantity("refuse", unit="lines with too many or too few cells", source=MAP)
    comment: str = quantity("#", unit="first character of comment lines", source=MAP, min_length=1, max_length=1)

    @pydantic.field_validator("encoding")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None and value.lower() not in ENCODINGS:
            raise ValueError(f"unknown encoding; known are {', '.join(ENCODINGS)}")
        return value.lower() if value else None


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

    column: ColumnName = quantity(unit="column", source=MAP)
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


class Selection(Spec, frozen=True):
    """Rows of the file that belong to a table."""

    keep: Literal["all", "filled", "changed"] = quantity(
        "all", unit="filled: rows with a value; changed: rows with another value than the one before", source=MAP
    )
    where: dict[ColumnName, str | float] = quantity({}, unit="value by column that a row must hold", source=MAP)
    first: int = quantity(1, unit="row of the table, counted from 1", source=MAP, ge=1)
    last: int | None = quantity(None, unit="row of the table, counted from 1", source=MAP, ge=1)


class Tie(Spec, frozen=True):
    """How the clock of a table is tied to that of a table before it."""

    kind: Literal["motion", "event"] = quantity(
        unit="motion: by correlation; event: the largest jolt of both is one", source=MAP
    )
    channel: str = quantity(unit="channel of this table", source=MAP)
    to: str = quantity(unit="channel of a table before it that feels the same", source=MAP)
    largest: float | None = quantity(None, unit="s, largest offset beside that of dates; else any", source=MAP, gt=0)
    threshold: float = quantity(0.5, unit="-, correlation that motions must reach", source="illustrative", gt=0, lt=1)


class TableMap(Spec, frozen=True):
    """Columns that are sampled together."""

    file: str | None = quantity(None, unit="name of its file, beside the one that is named to the command", source=MAP)
    csv: Csv | None = quantity(None, unit="how its file is written; else the map's csv", source=MAP)
    group: str | int | None = quantity(None, unit="name or number (from 0) of the file's group", source=MAP)
    time: TimeBase = quantity(unit="-", source=MAP)
    time_offset: float = quantity(0.0, unit="s, added to the times", source=MAP)
    tie: Tie | None = quantity(None, unit="how its clock is tied to that of a table before it", source=MAP)
    rate: float | None = quantity(None, unit="Hz; else from the times", source=MAP, gt=0, le=1e6)
    rows: Selection = quantity(Selection(), unit="all, filled, changed, or keys of Selection", source=MAP)
    repair: tuple[Repair, ...] = quantity((), unit="-", source=MAP)
    channels: dict[str, Channel] = quantity(unit="by channel, <sensor>.<quantity> [unit]", source=MAP, min_length=1)

    @pydantic.field_validator("rows", mode="before")
    @classmethod
    def _short(cls, value: Any) -> Any:
        return {"keep": value} if isinstance(value, str) else value

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
    format: Format | None = quantity(None, unit="-", source=MAP)
    csv: Csv = quantity(Csv(), unit="-", source=MAP)
    vehicle: str | dict[str, Any] = quantity(unit="shipped vehicle, or nominal parameters in SI units", source=MAP)
    speed_source: str | None = quantity(None, unit="channel that gives the speed, or refined", source=MAP)
    track: str | None = quantity(None, unit="track file, from the map's folder, or shipped track", source=MAP)
    tables: tuple[TableMap, ...] = quantity(unit="-", source=MAP, min_length=1)
    sensors: tuple[dict[str, Any], ...] = quantity((), unit="-", source=MAP)


class Post(Spec, frozen=True):
    """A column that counts kilometres, miles or the like, to which the place within one is added."""

    column: str = quantity(unit="column", source=MAP)
    unit: Annotated[str, unit_of("m")] = quantity("km", unit="unit of length, from one post to the next", source=MAP)


class Kilometrage(Spec, frozen=True):
    """The column of place; `direction` is how the car ran, `towards` how the track file shall run."""

    column: str = quantity(unit="column", source=MAP)
    unit: Annotated[str, unit_of("m")] = quantity("m", unit="unit of length", source=MAP)
    scale: float = quantity(1.0, unit="units of length per unit of the column, as of a count of rows", source=MAP, gt=0)
    post: Post | None = quantity(None, unit="-", source=MAP)
    lost: tuple[float | str, ...] = quantity((), unit="values that stand for a lost place", source=MAP)
    direction: Literal["up", "down"] = quantity(unit="of the kilometrage as the car ran", source=MAP)
    towards: Literal["up", "down"] | None = quantity(None, unit="of the track file; else as the car ran", source=MAP)
    zero: float | None = quantity(None, unit="m, kilometrage at which s is 0; else the track's beginning", source=MAP)
    sides: Literal["running", "kilometrage"] | None = quantity(
        None, unit="left and right as seen in the running direction, or looking up the kilometrage", source=MAP
    )


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
    format: Format | None = quantity(None, unit="-", source=MAP)
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
