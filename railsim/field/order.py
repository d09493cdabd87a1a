"""Rows whose time (or place) goes back or appears twice: the likeliest cause by its signs, and its own repair.

Time goes back where packets came out of order (`sort`), where a clock was set back, by an hour in autumn or by a
synchronisation (`continue`, or the zone's name), where a stamp is wrong (`drop_outliers`), where a counter wraps and
where a recording began again. A time appears twice where a row was written twice (`drop_duplicates`) or where several
samples share a stamp (`spread`).
"""

from dataclasses import dataclass

import numpy as np

from railsim.errors import InputError
from railsim.field.durations import DAY, HOUR
from railsim.field.tables import Notes
from railsim.stamps import resolution_of, row_numbers, usual_step

_OVERLAP = 0.2  # steps that are shorter than usual after sorting, a row that is out of order
_SHARED = 0.1  # of all rows; where more have the stamp of the row before and other values, samples share stamps
_FEW, _RUN = 3, 3  # stamps that may be wrong in a short record; rows in a row
_SAME = 0.95  # share of rows that came twice with the same values
_GROUPS = 50  # packets, at most, over which a packet's usual duration is taken


@dataclass(frozen=True)
class How:
    """How an axis is treated and what it is called.

    Attributes
    ----------
    label : in messages ("table 1: time").
    unit : "s" or "m".
    repairs : that are allowed.
    notes : take what is assumed and repaired.
    column : of the time, for the lines of the map that a message proposes; None where it is not one column of numbers.
    ticks : of that column, a second.
    mixed : line of the map that takes the rows of one sensor, where those of several seem to be mixed.
    """

    label: str
    unit: str
    repairs: tuple[str, ...]
    notes: Notes
    column: str | None = None
    ticks: float = 1.0
    mixed: str | None = None


Rows = tuple[np.ndarray, np.ndarray]
"""Axis, shape (n,), and values, shape (columns, n)."""


def ordered(axis: np.ndarray, values: np.ndarray, how: How) -> Rows:
    """Rows on an axis that increases.

    Raises
    ------
    InputError : it goes back or stands still where the map allows no repair that fits the cause.
    """
    return _distinct(*_forward(axis, values, how), how)


def _forward(axis: np.ndarray, values: np.ndarray, how: How) -> Rows:
    back = np.flatnonzero(np.diff(axis) < 0)
    if not back.size:
        return axis, values
    if "continue" in how.repairs:
        return continued(axis, how), values
    strays = _strays(axis, back)
    if strays is not None and "drop_outliers" in how.repairs:
        how.notes.repair(
            f"{how.label}: {int(strays.sum())} rows whose time stands apart from their neighbours' left out"
        )
        return axis[~strays], values[:, ~strays]
    cause, cure = _cause(axis, values, back, how)
    row = int(back[0])
    if how.mixed is not None:
        cause, cure = _MIXED, f"write '{how.mixed}' in the table"
    elif strays is not None and _better_without(axis, strays):
        cause = ", as single stamps that are wrong do"
        cure = "add 'drop_outliers' to repair, and these rows are left out"
    elif "sort" in how.repairs and cause != _HOUR:
        how.notes.repair(
            f"{how.label}: rows sorted; it went back at {back.size} places, first at row {row + 2} of the data"
        )
        order = np.argsort(axis, kind="stable")
        return axis[order], values[:, order]
    raise InputError(
        f"{how.label} goes back from {axis[row]:.10g} to {axis[row + 1]:.10g} {how.unit} at row {row + 2} of the data "
        f"({back.size} such places){cause}; {cure}"
    )


def without_strays(axis: np.ndarray, how: How) -> np.ndarray:
    """Times, NaN in rows whose time stands apart from their neighbours', shape (n,)."""
    good = np.flatnonzero(np.isfinite(axis))
    back = np.flatnonzero(np.diff(axis[good]) < 0)
    strays = _strays(axis[good], back) if back.size else None
    if strays is None:
        return axis
    how.notes.repair(f"{how.label}: {int(strays.sum())} times that stand apart from their neighbours' count as lost")
    left = axis.copy()
    left[good[strays]] = np.nan
    return left


def _strays(axis: np.ndarray, back: np.ndarray) -> np.ndarray | None:
    """Rows whose time stands apart while those about them go on, shape (n,); None where that is not so everywhere."""
    steps = np.diff(axis)
    if not (steps > 0).any() or back.size > max(_FEW, 0.01 * axis.size):
        return None
    usual = float(np.median(steps[steps > 0]))
    strays = np.zeros(axis.size, dtype=bool)
    for row in back:
        low = row + 2 < axis.size and 0 < axis[row + 2] - axis[row] <= 3 * usual
        high = [
            count for count in range(1, _RUN + 1)
            if row >= count and 0 < axis[row + 1] - axis[row - count] <= 1.5 * (count + 1) * usual
        ]  # fmt: skip
        if high:
            strays[row - high[0] + 1 : row + 1] = True
        elif low:
            strays[row + 1] = True
        else:
            return None
    return strays if (np.diff(axis[~strays]) > 0).all() else None


def _better_without(axis: np.ndarray, strays: np.ndarray) -> bool:
    """Whether the rows are more even without these than when they are sorted."""
    return _uneven(axis[~strays]) < _uneven(np.sort(axis))


def _uneven(axis: np.ndarray) -> int:
    """Steps that are not the usual one."""
    steps = np.diff(axis)
    usual = float(np.median(steps))
    return int((np.abs(steps - usual) > 0.5 * usual).sum())


_MIXED = ", as rows of several sensors in one file do"
_HOUR = ", by an hour, as clocks do at the end of summer time"


def _cause(axis: np.ndarray, values: np.ndarray, back: np.ndarray, how: How) -> tuple[str, str]:
    """The likeliest cause and what mends it, in words."""
    steps = np.diff(axis)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    sizes = usual - steps[back]
    go_on = "add 'continue' to repair, and time goes on from the row before"
    if how.unit == "s" and _near(sizes, HOUR, usual):
        return _HOUR, f"give the zone's name, as 'zone: Europe/Berlin', in 'time', or {go_on}"
    if how.unit == "s" and _near(sizes, DAY, usual):
        return ", by a day, as a time of day does at midnight", _counter(DAY, how) or go_on
    if _came_twice(axis, values, usual):
        return ", as packets that came twice do", "write 'repair: [sort, drop_duplicates]'"
    if _only_out_of_order(axis, usual):
        return ", as rows that are out of order do", "mend it, or add 'sort' to repair"
    if back.size > 1 and np.ptp(sizes) <= 2 * usual and np.ptp(axis[back + 1]) <= 2 * usual:
        cure = _counter(float(np.median(sizes)), how) or go_on
        return f", each time by {np.median(sizes):.10g} {how.unit}, as a counter that wraps does", cure
    row = int(back[0]) + 1
    if abs(axis[row] - axis[0]) <= 2 * usual and back.size < 10:
        return (
            ", to where it began, as a recording that was started again does",
            f"import each part by itself: 'rows: {{last: {row}}}' and 'rows: {{first: {row + 1}}}', or, where nothing "
            f"lies between them, {go_on}",
        )
    if how.unit != "s":
        return "", "mend it, or add 'sort' to repair where rows are out of order"
    return f", by {sizes[0] - usual:.6g} s, as a clock that is set does", go_on


def _near(sizes: np.ndarray, amount: float, usual: float) -> bool:
    return bool((np.abs(sizes - amount) <= max(2 * usual, 1.0)).all())


def _counter(modulus: float, how: How) -> str | None:
    """The line of the map that reads the column as a counter."""
    if how.column is None:
        return None
    ticks = round(modulus * how.ticks, 6)
    return (
        f"write 'time: {{kind: counter, column: \"{how.column}\", frequency: {how.ticks:.10g}, modulus: {ticks:.10g}}}'"
    )


def _came_twice(axis: np.ndarray, values: np.ndarray, usual: float) -> bool:
    """Whether rows that go back hold what stands there already, and the rest is as even as usual when sorted."""
    order = np.argsort(axis, kind="stable")
    stamps, sorted_values = axis[order], values[:, order]
    double = np.diff(stamps, prepend=-np.inf) == 0
    if not double.any():
        return False
    before = sorted_values[:, np.flatnonzero(double) - 1]
    again = sorted_values[:, double]
    same = ((again == before) | (np.isnan(again) & np.isnan(before))).all(axis=0)
    return bool(same.mean() > _SAME and (np.diff(stamps[~double]) > 0.5 * usual).mean() > _SAME)


def _only_out_of_order(axis: np.ndarray, usual: float) -> bool:
    """Whether the rows are as evenly spaced as usual when sorted: stretches that overlap are not."""
    order = np.argsort(axis, kind="stable")
    displaced = int((order != np.arange(axis.size)).sum())
    short = int((np.diff(axis[order]) < 0.5 * usual).sum()) - int((np.diff(axis) == 0).sum())
    return short <= _OVERLAP * displaced


def continued(axis: np.ndarray, how: How) -> np.ndarray:
    """Times that go on by a usual step after each step back, shape (n,); rows without a time stay so."""
    good = np.flatnonzero(np.isfinite(axis))
    steps = np.diff(axis[good])
    back = np.flatnonzero(steps < 0)
    if not back.size:
        return axis
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    added = np.zeros(axis.size)
    added[good[back + 1]] = usual - steps[back]
    how.notes.repair(
        f"{how.label}: goes on from the row before at {back.size} places where it went back (row "
        f"{good[back[0] + 1] + 1} of the data first), {added.sum():.10g} {how.unit} added in all"
    )
    return axis + np.cumsum(added)


def _distinct(axis: np.ndarray, values: np.ndarray, how: How) -> Rows:
    double = np.diff(axis, prepend=-np.inf) == 0
    if not double.any():
        return axis, values
    first = np.maximum.accumulate(np.where(double, 0, np.arange(axis.size)))
    same = ((values == values[:, first]) | (np.isnan(values) & np.isnan(values[:, first]))).all(axis=0)
    differing = int((double & ~same).sum())
    shared = differing > _SHARED * axis.size
    if "spread" in how.repairs and how.mixed is None:
        return _spread(axis, how), values
    if "drop_duplicates" in how.repairs and not shared:
        how.notes.repair(
            f"{how.label}: {int(double.sum())} rows with the one before left out, {differing} of them with other values"
        )
        return axis[~double], values[:, ~double]
    row = int(double.argmax())
    where = (
        f"{how.label} {axis[row]:.10g} {how.unit} appears twice ({int(double.sum())} such rows, row {row + 1} of the "
        "data first)"
    )
    if shared and how.mixed is None:
        raise InputError(
            f"{where}, {differing} of them with other values: {_why_shared(axis, double, how)}; add 'spread' to "
            "repair, and they are spread evenly; where a column names the sensor of each row, 'rows: {where: ...}' "
            "takes those of one"
        )
    if how.mixed is not None and differing:
        raise InputError(f"{where}{_MIXED}; write '{how.mixed}' in the table")
    alike = "with the same values" if not differing else f"{differing} with other values"
    raise InputError(f"{where}, {alike}; mend it, or add 'drop_duplicates' to repair: the first row stays")


def _why_shared(axis: np.ndarray, double: np.ndarray, how: How) -> str:
    """Whether stamps are coarser than the rows, or packets have one each."""
    distinct = axis[~double]
    usual = float(np.median(np.diff(distinct))) if distinct.size > 1 else 0.0
    resolution = resolution_of(axis)
    if resolution and usual <= 1.5 * resolution:
        return f"stamps of {resolution:g} {how.unit} are coarser than the rows, or packets have one each"
    return "several samples share the stamp of their packet"


def _spread(axis: np.ndarray, how: How) -> np.ndarray:
    """Even places for rows that share stamps; missing packets count.

    The first row of each packet has the packet's stamp. All rows have the step that fits these best.
    """
    heads = np.flatnonzero(np.diff(axis, prepend=-np.inf) > 0)
    if heads.size < 3:
        raise InputError(
            f"{how.label}: {heads.size} different stamps are too few to spread rows between them; "
            "name a column with more stamps"
        )
    lag = max(1, min(_GROUPS, heads.size // 10))
    step = float(np.median((axis[heads[lag:]] - axis[heads[:-lag]]) / (heads[lag:] - heads[:-lag])))
    packet = float(np.median(np.diff(heads)))
    free = axis[heads] - step * (heads - packet * np.arange(heads.size))
    gone = (row_numbers(free, packet * step) - np.arange(heads.size)) * packet if (np.diff(free) > 0).all() else 0.0
    numbers = heads + np.rint(gone)
    middle = numbers.mean()
    slope, start = np.polyfit(numbers - middle, axis[heads], 1)
    own = np.zeros(axis.size)
    own[heads] = np.diff(np.rint(gone), prepend=0.0) if np.ndim(gone) else 0.0
    rows = np.arange(axis.size) + np.cumsum(own)
    spread = start + slope * (rows - middle)
    how.notes.repair(
        f"{how.label}: rows that share a stamp spread evenly, {slope:.10g} {how.unit} apart (stamps scatter by "
        f"{np.std(spread[heads] - axis[heads]):.3g} {how.unit}); a packet's stamp belongs to its first row"
    )
    return spread


def numbered(axis: np.ndarray, step: float) -> np.ndarray:
    """Number of each row on a grid of `step`, shape (n,), by the real step where that is close."""
    found = usual_step(axis)
    return found.numbers if abs(found.size / step - 1) < 0.2 else row_numbers(axis, step)
