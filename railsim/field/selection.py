"""Which rows of a file belong to a table: those that are filled, changed, of one sensor, or from one row to another."""

from dataclasses import replace

import numpy as np

from railsim.errors import InputError
from railsim.field.channels import numbers
from railsim.field.map import TableMap
from railsim.field.order import How
from railsim.field.tables import Column, Table, same_cell
from railsim.held import held_rows

_LONGEST_HOLD = 3.5  # periods over which a value that stays the same is taken as measured again
_FIRST = 50_000  # rows by which a held channel is told


def selected(mapped: TableMap, table: Table, time: np.ndarray, how: How) -> tuple[Table, np.ndarray]:
    """The table's rows and their times, as `rows` of the map says.

    Raises
    ------
    InputError : no row is left, or a marker of lost samples is missing.
    """
    rows = mapped.rows
    keep = np.ones(time.size, dtype=bool)
    if rows.where:
        keep = _holding(mapped, table)
        how.notes.assume(f"{how.label}: {int(keep.sum())} of {keep.size} rows, by 'rows: where'")
    if rows.keep == "filled":
        raw = _numbers(mapped, table)
        filled = np.asarray(np.isfinite(raw).any(axis=0))
        how.notes.assume(f"{how.label}: {int((keep & ~filled).sum())} rows without any value belong to other tables")
        keep &= filled
    elif rows.keep == "changed":
        keep &= _changed(_numbers(mapped, table), time, mapped.rate, how)
    if rows.first > 1 or rows.last is not None:
        number = np.cumsum(keep)
        keep &= (number >= rows.first) & (number <= (rows.last or time.size))
        how.notes.assume(f"{how.label}: rows {rows.first} to {int(min(rows.last or number[-1], number[-1]))} alone")
    if not keep.any():
        raise InputError(f"{how.label}: 'rows' leaves no row; correct it")
    if keep.all():
        _name_held(mapped, _numbers(mapped, table, _FIRST), how)
        return table, time
    return _kept(table, keep), time[keep]


def _numbers(mapped: TableMap, table: Table, most: int | None = None) -> np.ndarray:
    """Numbers of the channels' columns, of all rows or the first ones, shape (channels, n)."""
    found = []
    for channel in mapped.channels.values():
        column = table.columns[channel.column]
        values = column.values[:most]
        found.append(numbers(replace(column, values=values), table, channel.lost))
    return np.array(found)


def _holding(mapped: TableMap, table: Table) -> np.ndarray:
    """Rows that hold the stated values."""
    keep = np.ones(len(next(iter(table.columns.values())).values), dtype=bool)
    for name, value in mapped.rows.where.items():
        keep &= [same_cell(cell, value) for cell in table.columns[name].values]
    return keep


def _changed(raw: np.ndarray, time: np.ndarray, rate: float | None, how: How) -> np.ndarray:
    """Rows in which a value differs from the one before; rows a period after another where it stays the same."""
    with np.errstate(invalid="ignore"):
        new = (raw[:, 1:] != raw[:, :-1]) & np.isfinite(raw[:, 1:])
    keep = np.concatenate([[True], new.any(axis=0)])
    at = np.flatnonzero(keep)
    if at.size < 3:
        raise InputError(
            f"{how.label}: values change {at.size - 1} times, too few for 'rows: changed'; leave 'rows' out"
        )
    if at[1] < 0.9 * np.median(np.diff(at[1:])):
        keep[0] = False  # the first hold was cut: its beginning is not known
        at = at[1:]
    period = 1.0 / rate if rate else float(np.median(np.diff(time[at])))
    again, half = 0, 0.5 * float(np.median(np.diff(time)))
    for first, last in zip(at[:-1], at[1:], strict=True):
        span = (time[last] - time[first]) / period
        if 1.5 < span <= _LONGEST_HOLD:
            places = time[first] + period * np.arange(1, int(span + 0.5))
            rows = first + np.searchsorted(time[first:last], places - half)
            keep[rows] = True
            again += rows.size
    how.notes.assume(
        f"{how.label}: {int(keep.sum())} of {keep.size} rows have a new value, the others repeat the last one"
        + (f"; {again} values are taken as measured again, a period after an equal one" if again else "")
    )
    return keep


def _name_held(mapped: TableMap, raw: np.ndarray, how: How) -> None:
    """Say which channels repeat their last value while others do not, and the lines that make them a table."""
    lengths = [held_rows(one) for one in raw]
    if all(lengths) or not any(lengths):
        return
    for name, length in zip(mapped.channels, lengths, strict=True):
        if length:
            how.notes.assume(
                f"{name}: each value stands in {length} rows, as one of a slower sensor that is repeated; a table of "
                "its own with 'rows: changed' would take each once"
            )


def _kept(table: Table, keep: np.ndarray) -> Table:
    """Some rows of a table."""
    labels = np.flatnonzero(keep) + table.first_row if table.lines is None else table.lines[keep]
    return replace(table, columns={name: _rows(one, keep) for name, one in table.columns.items()}, lines=labels)


def _rows(column: Column, keep: np.ndarray) -> Column:
    if isinstance(column.values, np.ndarray):
        return replace(column, values=column.values[keep])
    texts = [column.values[row] for row in np.flatnonzero(keep)]
    return replace(column, values=texts, fault=None)
