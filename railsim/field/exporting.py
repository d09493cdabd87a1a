"""`export`: a recording or an estimate as one file that other programs read."""

import importlib
import os
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError, nearest
from railsim.field.writers.interface import Content, Sheet, split_name
from railsim.field.writers.mat import field_names, identifiers
from railsim.files import new_file
from railsim.measurements import TIME, Measurements

FORMATS = {".csv": "csv", ".parquet": "parquet", ".mat": "mat", ".mf4": "mdf4", ".mcap": "mcap"}
"""Writer by the file's ending."""
READABLE = (".csv", ".parquet", ".mat", ".mf4")
"""Endings of which `railsim import` makes a recording again."""
MAPS = (".geojson", ".html")
"""Endings of an estimate on a map, which experiments/maintenance makes."""


def recording_content(seen: Measurements) -> Content:
    """All measured channels, a sheet for each rate."""
    sheets: dict[float, dict[str, np.ndarray]] = {}
    for name in seen.channels:
        sheets.setdefault(seen.rate(name), {TIME: seen.time(name)})[name] = seen[name]
    start = seen.about.get("start")
    return Content(
        str(seen.about["origin"]),
        [Sheet(f"{rate:.10g} Hz", columns) for rate, columns in sheets.items()],
        datetime.fromisoformat(start) if isinstance(start, str) else None,
    )


def export(content: Content, path: Path | str, overwrite: bool = False) -> None:
    """Write the content in the format of the file's ending; the file appears whole or not at all.

    Raises
    ------
    InputError : an unknown ending, a file that is there already, a place that cannot be written, or what the writer
        says.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in FORMATS:
        guess = nearest(ending, [*FORMATS, *MAPS])
        known = f"{', '.join(FORMATS)}, or, for an estimate on a map, {', '.join(MAPS)}"
        raise InputError(f"--to: no format '{ending or path.name}'; {guess}write to {known}")
    writer = importlib.import_module(f"railsim.field.writers.{FORMATS[ending]}")
    write_whole(path, lambda aside: writer.write(content, aside), overwrite)


def write_whole(path: Path, write: Callable[[Path], None], overwrite: bool) -> None:
    """Let `write` make a file aside and rename it to `path` where it is complete.

    Raises
    ------
    InputError : the file is there already and is not to be replaced, or the place cannot be written.
    """
    check_free(path, overwrite)
    with new_file(path) as aside:
        write(aside)
        with suppress(OSError):
            os.chmod(aside, 0o666 & ~_mask())
        if not overwrite:
            check_free(path, overwrite)  # another program may have made it meanwhile


def check_free(path: Path, overwrite: bool) -> None:
    """Raise `InputError` where a file may not be written to `path`."""
    if path.is_dir():
        raise InputError(f"'{path}' is a folder; name a file, as '{path / 'data.csv'}'")
    if path.exists() and not overwrite:
        raise InputError(f"'{path}' is there already; name another file, or add --overwrite")
    if not path.parent.is_dir():
        raise InputError(f"there is no folder '{path.parent}'; make it, or name a file elsewhere")


def check_readable(path: Path) -> None:
    """Raise `InputError` where `railsim import` does not read what is written to `path`."""
    ending = path.suffix.lower()
    if ending in FORMATS and ending not in READABLE:
        cure = f"leave it out, or export to {', '.join(READABLE)}"
        raise InputError(f"--map: 'railsim import' does not read {ending}; {cure}")


def import_map(seen: Measurements, path: Path) -> dict[str, Any]:
    """The map by which `railsim import` makes the recording of the file again, as it stands in YAML.

    Parameters
    ----------
    seen : the recording's measured channels.
    path : the file, of which the ending tells the format.

    Raises
    ------
    InputError : `railsim import` does not read the format.
    """
    check_readable(path)
    content = recording_content(seen)
    ending = path.suffix.lower()
    labels = identifiers(sheet.label for sheet in content.sheets)
    tables = [_table(sheet, label, ending, len(labels)) for sheet, label in zip(content.sheets, labels, strict=True)]
    mapped: dict[str, Any] = {"origin": content.origin, "vehicle": _vehicle(seen.vehicle), "tables": tables}
    kept = [{key: value for key, value in sheet.items() if key != "rate"} for sheet in seen.about["sensors"]]
    mapped |= {"sensors": kept} if kept else {}
    source = seen.about.get("speed_source")
    return mapped | ({"speed_source": source} if isinstance(source, str) else {})


def _table(sheet: Sheet, label: str, ending: str, count: int) -> dict[str, Any]:
    """One entry of the map's tables."""
    time, *names = sheet.columns
    fields = field_names(sheet)
    table: dict[str, Any] = {"rate": float(sheet.label.removesuffix(" Hz"))}
    shown: Callable[[str], str] = str
    base: dict[str, Any] = {"kind": "seconds", "column": time}
    if ending == ".mat":
        table["group"], shown, base["column"] = label, fields.__getitem__, fields[time]
    elif ending == ".mf4":
        table["group"], shown, base = sheet.label, lambda one: split_name(one)[0], {"kind": "own"}
    elif count > 1:
        table["rows"] = "filled"
    channels = {name: {"column": shown(name), "unit": split_name(name)[1]} for name in names}
    return {**table, "time": base, "channels": channels}


def _vehicle(stated: dict[str, Any]) -> str | dict[str, Any]:
    """The shipped vehicle's name where its parameters are those, else name and parameters."""
    from railsim.vehicles.lookup import build_vehicle, vehicle_names

    name = str(stated.get("name"))
    if name not in vehicle_names():
        return dict(stated)
    with suppress(InputError):
        vehicle = build_vehicle(name, Path())
        if {"name": vehicle.name, **vehicle.nominal()} == stated:
            return name
    return {**stated, "name": f"{name} as exported"}


def _mask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
