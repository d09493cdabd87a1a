"""A file of measured channels becomes a recording."""

import io
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from railsim.errors import InputError, nearest
from railsim.field.channels import convert, from_pulses, wanted_unit
from railsim.field.clock import Clock, looks_like_epoch, read_clock
from railsim.field.guard import Guard
from railsim.field.map import RecordingMap, TableMap
from railsim.field.order import How, continued, without_strays
from railsim.field.reading import file_count, read_all
from railsim.field.regular import Series, regular
from railsim.field.rotation import turned
from railsim.field.selection import selected
from railsim.field.sheets import data_sheets
from railsim.field.tables import Notes, Table
from railsim.field.time_bases import Iso, Seconds
from railsim.field.tying import tied
from railsim.field.units import parse_unit
from railsim.measurements import TIME
from railsim.recording import write_recording
from railsim.track.files import TRACKS, format_track, read_track
from railsim.vehicles.interface import PARAMETER_SETS
from railsim.vehicles.lookup import build_vehicle, vehicle_names

_SLOWEST = 1e-3  # Hz


def import_recording(
    paths: Sequence[Path], mapped: RecordingMap, folder: Path, out: Path, notes: Notes, guard: Guard | None = None
) -> Path:
    """Write the recording.

    Parameters
    ----------
    paths : file with the measured data, or several of one recording.
    mapped : what its columns mean.
    folder : of the map, from which the name of a track is taken.
    out : folder of the recording.
    notes : takes what was assumed and repaired; it is stored in about.json.
    guard : process that reads binary formats; None: one for this file alone.

    Raises
    ------
    InputError : map and file do not fit together, or the file is damaged; one line.
    """
    vehicle = _vehicle(mapped.vehicle, folder, notes)
    _check_names(mapped)
    tables, files = read_all(paths, mapped, notes, guard)
    clocks = [_clock(one, table, notes) for one, table in zip(mapped.tables, tables, strict=True)]
    series, start = _series(mapped, tables, clocks, vehicle, notes)
    frames = _frames(series)
    rates = {name: rate for rate, frame in frames.items() for name in frame.columns[1:]}
    about: dict[str, Any] = {"origin": mapped.origin, "vehicle": vehicle}
    about["sensors"] = data_sheets(turned(mapped.sensors, frames, notes), rates, notes)
    if start is not None:
        about["start"] = start.isoformat()
    about |= _speed_source(mapped, list(rates), notes)
    track = None if mapped.track is None else _track(mapped.track, folder)
    about["import"] = files | {"map": mapped.model_dump(mode="json", exclude_unset=True)}
    about |= {"assumptions": notes.assumptions, "repairs": notes.repairs}
    return write_recording(out, frames, about, track=track)


def _check_names(mapped: RecordingMap) -> None:
    seen: set[str] = set()
    for table in mapped.tables:
        for name in table.channels:
            wanted_unit(name)
            if name in seen:
                raise InputError(f"channel '{name}' stands in two tables; keep one")
            seen.add(name)


def _clock(mapped: TableMap, table: Table, notes: Notes) -> Clock:
    rows = len(next(iter(table.columns.values())).values)
    if rows == 0:
        raise InputError("the table holds no rows at all; is it the right file?")
    return read_clock(mapped, table, rows, notes)


def _series(
    mapped: RecordingMap, tables: list[Table], clocks: list[Clock], vehicle: dict[str, Any], notes: Notes
) -> tuple[list[Series], datetime | None]:
    """The tables over one time, and the instant of its zero; `tables` are taken out one by one to spare memory."""
    labels = ["time" if len(tables) == 1 else f"table {number}: time" for number in range(1, len(tables) + 1)]
    hows = [
        replace(_how(label, one, notes), mixed=table.mixed)
        for label, one, table in zip(labels, mapped.tables, tables, strict=True)
    ]
    clocks = [_mended(clock, how) for clock, how in zip(clocks, hows, strict=True)]
    clocks = tied(mapped.tables, tables, clocks, notes)
    known = [clock.start is not None for clock in clocks]
    if any(known) and not all(known):
        raise InputError(_undated(mapped, clocks))
    start = min((_first(clock) for clock in clocks), default=None, key=_order) if all(known) else None
    if start is not None:
        notes.assume(f"time 0 is {start.isoformat()}, the first row of all tables")
    if file_count(mapped) > 1:
        _tie(clocks, start, notes, sum(table.tie is None for table in mapped.tables) > 1)
    series = []
    for mapped_table, clock, how in zip(mapped.tables, clocks, hows, strict=True):
        shift = (clock.start - start).total_seconds() if clock.start and start else 0.0
        time, columns = _filled(mapped_table, tables.pop(0), clock.seconds + shift, vehicle, how)
        series.append(regular(time, columns, 1.0 / mapped_table.rate if mapped_table.rate else None, how, series))
    return series, start


def _mended(clock: Clock, how: How) -> Clock:
    """The clock without steps back and wrong stamps, where the map says so: the first row tells time 0."""
    seconds = clock.seconds
    if "drop_outliers" in how.repairs:
        seconds = without_strays(seconds, how)
    return Clock(continued(seconds, how) if "continue" in how.repairs else seconds, clock.start)


def _tie(clocks: list[Clock], start: datetime | None, notes: Notes, untied: bool) -> None:
    """Say how the clocks of several files are one; `untied`: several are not tied by what they have seen.

    Raises
    ------
    InputError : the files have no time in common.
    """
    spans = []
    for clock in clocks:
        good = clock.seconds[np.isfinite(clock.seconds)]
        shift = (clock.start - start).total_seconds() if clock.start and start else 0.0
        if good.size:
            spans.append((float(good.min()) + shift, float(good.max()) + shift))
    if spans and max(first for first, _ in spans) > min(last for _, last in spans):
        raise InputError(
            "the files have no time in common: they begin at "
            + ", ".join(f"{first:.6g}" for first, _ in spans)
            + f" s and end at {', '.join(f'{last:.6g}' for _, last in spans)} s; add 'time_offset' to a table where "
            "its clock is off, or import them apart"
        )
    if not untied:
        return
    how = "by their dates" if start is not None else "as their times count from the same zero"
    notes.assume(f"clocks of the files are one, {how}; 'time_offset' of a table would move it, 'tie' find its offset")


def _undated(mapped: RecordingMap, clocks: list[Clock]) -> str:
    """What gives the tables without a date one."""
    for number, (table, clock) in enumerate(zip(mapped.tables, clocks, strict=True), 1):
        if clock.start is not None:
            continue
        cure = "give all tables the same kind of time"
        if isinstance(table.time, Seconds) and looks_like_epoch(clock.seconds):
            cure = f"write 'time: {{kind: epoch, column: \"{table.time.column}\"}}' in table {number}"
        elif isinstance(table.time, Iso):
            cure = f"add 'date: 2024-05-03', that of its first row, to 'time' of table {number}"
        return f"table {number} has times without a date, others have one, which cannot be brought together; {cure}"
    raise ValueError("all tables have a date")


def _how(label: str, mapped: TableMap, notes: Notes) -> How:
    base = mapped.time
    if isinstance(base, Seconds):
        return How(label, "s", mapped.repair, notes, base.column, round(1 / parse_unit(base.unit).factor, 6))
    return How(label, "s", mapped.repair, notes)


def _order(moment: datetime) -> float:
    return moment.timestamp()


def _first(clock: Clock) -> datetime:
    """The earliest instant of a clock with a date."""
    assert clock.start is not None
    good = clock.seconds[np.isfinite(clock.seconds)]
    try:
        return clock.start + timedelta(seconds=float(good.min())) if good.size else clock.start
    except OverflowError:
        raise InputError(
            f"times begin {good.min():.4g} s after {clock.start.isoformat()}; is the file damaged?"
        ) from None


def _filled(
    mapped: TableMap, table: Table, time: np.ndarray, vehicle: dict[str, Any], how: How
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and channels of the rows that the map takes."""
    table, time = selected(mapped, table, time, how)
    radius = vehicle.get("wheel_radius")
    columns: dict[str, np.ndarray] = {}
    for name, channel in mapped.channels.items():
        if channel.pulses is not None:
            nominal = float(radius) if isinstance(radius, int | float) else None
            columns[name] = from_pulses(name, channel, table, time, nominal, how.notes)
        else:
            columns[name] = convert(name, channel, table, wanted_unit(name), how.notes)
        if not any(one.column == channel.column for key, one in mapped.channels.items() if key not in columns):
            del table.columns[channel.column]
    return time, columns


def _frames(series: list[Series]) -> dict[float, pd.DataFrame]:
    """Tables by rate; those of one rate on one time are put together.

    Raises
    ------
    InputError : two tables of one rate at different times, or too slow a rate.
    """
    frames: dict[float, pd.DataFrame] = {}
    for table in series:
        rate = float(f"{1.0 / table.step:.10g}")
        if not rate >= _SLOWEST:
            raise InputError(
                f"rows every {table.step:.4g} s are too far apart for a recording; is the unit of time right?"
            )
        if rate not in frames:
            frames[rate] = pd.DataFrame({TIME: table.axis, **table.columns}, copy=False)
            continue
        other = frames[rate][TIME].to_numpy()
        if other.size != table.axis.size or not np.allclose(other, table.axis, rtol=0, atol=1e-3 * table.step):
            raise InputError(
                f"two tables have {rate:.10g} Hz but different times, which a recording cannot hold; write "
                "'repair: [resample]' in the later one, and its values are interpolated at the times of the other"
            )
        frames[rate] = pd.DataFrame({**frames[rate], **table.columns}, copy=False)
    return frames


def _vehicle(given: str | dict[str, Any], folder: Path, notes: Notes) -> dict[str, Any]:
    """Nominal parameters of a vehicle by name or file, with changes, or those that the map gives."""
    values = {"name": given} if isinstance(given, str) else dict(given)
    name = values.pop("name", None)
    if not isinstance(name, str) or not name:
        raise InputError("vehicle: give a name, with or without nominal parameters")
    known = vehicle_names()
    if name in known or name.endswith(PARAMETER_SETS.suffix):
        vehicle = build_vehicle(given, folder)
        for text in vehicle.assumptions():
            notes.assume(text)
        rest = [key for key in vehicle.nominal() if key not in values]
        if values and not vehicle.assumed and rest:
            notes.assume(f"vehicle: as of '{name}': {', '.join(rest)}")
        return {"name": vehicle.name, **vehicle.nominal()}
    if isinstance(given, str):
        raise InputError(
            f"vehicle: none is called '{given}'; {nearest(given, known)}there are: {', '.join(known)}; or give "
            "parameters"
        )
    for key, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InputError(f"vehicle.{key}: {value!r} is not a number; give SI units (text needs a point: 1.0e6)")
    notes.assume(f"vehicle '{name}' is none of ours: {len(values)} parameters as given, no others are known")
    return {"name": name, **values}


def _speed_source(mapped: RecordingMap, channels: list[str], notes: Notes) -> dict[str, Any]:
    speeds = [name for name in channels if name.endswith("speed [m/s]")]
    if mapped.speed_source is None and len(speeds) == 1 and not speeds[0].startswith("wheelset"):
        notes.assume(f"speed_source '{speeds[0]}', the only channel of speed")
        return {"speed_source": speeds[0]}
    if mapped.speed_source is None:
        notes.assume("no speed source is stated; estimators choose among the channels")
        return {}
    if mapped.speed_source not in [*channels, "refined"]:
        raise InputError(
            f"speed_source: no channel '{mapped.speed_source}'; there are: {', '.join(channels)}, or refined"
        )
    if not mapped.speed_source.endswith(("[m/s]", "[rad/s]", "refined")):
        raise InputError(f"speed_source: '{mapped.speed_source}' is no speed; name one in m/s, or a wheel's in rad/s")
    return {"speed_source": mapped.speed_source}


def _track(name: str, folder: Path) -> pd.DataFrame:
    """The stated track as columns."""
    source = name if name in TRACKS.paths() else folder / name
    return pd.read_csv(io.StringIO(format_track(read_track(source))), comment="#")
