"""MATLAB files of version 5: a struct for each sheet with a vector a channel, its units and its names."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from railsim.errors import InputError
from railsim.field.writers.interface import Content, Sheet, split_name
from railsim.progress import counting

_MOST = 2**31 - 1  # bytes of a variable of version 5 that MATLAB reads
_LONGEST = 63  # characters of a name in MATLAB
_OWN = ("units", "names")


def write(content: Content, path: Path) -> None:
    """Write every sheet as a struct, as `hz_256.bogie_rate_pitch` with `hz_256.units.bogie_rate_pitch`.

    Raises
    ------
    InputError : a sheet is too large for version 5.
    """
    from scipy.io import savemat

    for sheet in content.sheets:
        if sheet.size > _MOST:
            raise InputError(
                f"'{sheet.label}' takes {sheet.size / 2**30:.1f} GiB, a MATLAB file of version 5 holds 2 GiB in a "
                "variable; export to .parquet, which MATLAB reads by parquetread"
            )
    labels = identifiers(sheet.label for sheet in content.sheets)
    variables: dict[str, Any] = {name: _struct(sheet) for name, sheet in zip(labels, content.sheets, strict=True)}
    about = {"origin": content.origin} | ({} if content.start is None else {"start": content.start.isoformat()})
    with counting(None, f"writing {path.name}", "s", by_clock=True):
        savemat(path, variables | {"about": about}, appendmat=False, long_field_names=True, oned_as="column")


def field_names(sheet: Sheet) -> dict[str, str]:
    """Field of the struct by the column's full name."""
    return dict(zip(sheet.columns, identifiers((split_name(name)[0] for name in sheet.columns), _OWN), strict=True))


def _struct(sheet: Sheet) -> dict[str, Any]:
    fields = field_names(sheet)
    vectors = {fields[name]: values for name, values in sheet.columns.items()}
    units = {field: split_name(name)[1] for name, field in fields.items()}
    return {**vectors, "units": units, "names": {field: name for name, field in fields.items()}}


def identifiers(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Names that MATLAB takes, all different: "bogie_rate_pitch" for "bogie.rate_pitch", "hz_256" for "256 Hz"."""
    found: list[str] = []
    used = set(taken)
    for name in names:
        rate = re.fullmatch(r"(\S+) Hz", name)
        plain = re.sub(r"\W", "_", f"hz_{rate[1]}" if rate else name, flags=re.ASCII).lstrip("_")
        plain = (plain if plain[:1].isalpha() else f"x_{plain}")[:_LONGEST]
        number, chosen = 2, plain
        while chosen in used:
            chosen = f"{plain[: _LONGEST - 4]}_{number}"
            number += 1
        used.add(chosen)
        found.append(chosen)
    return found
