"""What a reader is asked for, and what its module must hold."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.tables import Column, Table, missing

MOST_NAMES = 100_000


@dataclass(frozen=True)
class Wanted:
    """Columns of one group.

    Attributes
    ----------
    group : name or number from 0; None where the file has only one.
    columns : their names.
    clock : whether the group's own time axis is needed.
    """

    group: str | int | None
    columns: tuple[str, ...]
    clock: bool = False


Reader = Callable[[Path, list[Wanted]], list[Table]]


def pick_group(wanted: str | int | None, names: list[str], contents: Sequence[Sequence[str]] = ()) -> int:
    """Place of the group in `names`; `contents`, the channels of each, stand in messages.

    Raises
    ------
    InputError : no such group, or none is named and there are several.
    """
    if wanted is None:
        if len(names) == 1:
            return 0
        raise InputError(
            f"the file has {len(names)} groups ({_listed(names, contents)}); name one by 'group:' in the map, as "
            "'group: 0'"
        )
    if isinstance(wanted, int):
        if not 0 <= wanted < len(names):
            raise InputError(f"no group {wanted}; the file has {len(names)}, counted from 0")
        return wanted
    if names.count(wanted) > 1:
        numbers = [number for number, name in enumerate(names) if name == wanted]
        raise InputError(
            f"the file has {len(numbers)} groups '{wanted}' ({_listed(names, contents, numbers)}); name one by its "
            f"number, as 'group: {numbers[0]}'"
        )
    if wanted not in names:
        raise missing(wanted, names, "group")
    return names.index(wanted)


def _listed(names: list[str], contents: Sequence[Sequence[str]], numbers: Sequence[int] | None = None) -> str:
    """Groups with their numbers, and the first channels of each."""
    shown = list(range(len(names)) if numbers is None else numbers)[:20]
    parts = [f"{number} '{names[number][:40]}'" for number in shown]
    if contents:
        parts = [f"{part}: {' '.join(contents[n][:6])[:80]}" for part, n in zip(parts, shown, strict=True)]
    return ", ".join(parts) or "none"


def column(name: str, values: Any, unit: str | None) -> Column:
    """A column from whatever a library returned.

    Raises
    ------
    InputError : neither numbers nor texts nor instants, or more than one value a row.
    """
    array = np.asarray(values)
    unit = unit.strip() or None if unit else None
    if array.ndim != 1:
        raise InputError(f"column '{name}' holds {array.ndim}-dimensional values; choose one with a number a row")
    if array.dtype.kind in "fiub":
        return Column(name, array.astype(np.float64, copy=False), unit)
    if array.dtype.kind in "SUO":
        texts = [_text(value) for value in array.tolist()]
        return Column(name, texts, unit)
    raise InputError(f"column '{name}' holds values of type {array.dtype}; choose one with numbers")


def from_fixes(
    wanted: Wanted,
    seconds: np.ndarray,
    start: str | None,
    columns: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    kind: str,
    told: Sequence[str],
) -> Table:
    """The wanted columns of a receiver's fixes.

    Parameters
    ----------
    wanted : columns, "time" and the clock among them; there are no groups.
    seconds : after `start` (UTC), shape (n,), NaN where a fix has no time.
    columns, units : all columns and their units by name.
    kind : what the file is, for messages.
    told : what was left out.

    Raises
    ------
    InputError : a column that is not there or holds nothing, or a group.
    """
    if wanted.group is not None:
        raise InputError(f"{kind} has no groups; leave 'group' out")
    found: dict[str, Column] = {}
    there = [name for name, values in columns.items() if np.isfinite(values).any()]
    for name in wanted.columns:
        if name == "time":
            found[name] = Column(name, seconds, "s", start is not None)
        elif name in there:
            found[name] = Column(name, columns[name], units.get(name))
        else:
            raise missing(name, ["time", *there], "column")
    return Table(found, seconds if wanted.clock else None, start, told=tuple(told))


def instants(name: str, nanoseconds: np.ndarray, lost: np.ndarray) -> tuple[Column, str]:
    """A column of instants in s after the first, and that one as ISO text (UTC); `nanoseconds` since 1970."""
    if lost.all():
        return Column(name, np.full(nanoseconds.size, np.nan), "s", True), "1970-01-01T00:00:00Z"
    first = nanoseconds[~lost][0]
    seconds = np.where(lost, np.nan, (nanoseconds - first).astype(np.float64) * 1e-9)
    return Column(name, seconds, "s", True), f"{np.datetime64(int(first), 'ns')}Z"


def _text(value: Any) -> str:
    if value is None:
        return ""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
