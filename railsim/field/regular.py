"""Rows in order: unsorted, doubled and jittering times (or places) are refused, or repaired as the map asks."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.errors import InputError
from railsim.field.tables import Notes

WIDEST = 1.5  # steps; a wider one is a gap
_JITTER = 1e-3  # of a step; less is rounding
_DRIFT = 0.25  # steps over the record by which a stated rate may be off
_EVEN, _JITTERY = 0.01, 0.2  # by how much rows' median distance may differ from the stated one
_MOST_ROWS = 200_000_000


@dataclass(frozen=True)
class Series:
    """Columns over an axis that increases.

    Attributes
    ----------
    axis : s or m, shape (n,).
    columns : by name, shape (n,).
    step : usual distance of the rows.
    """

    axis: np.ndarray
    columns: dict[str, np.ndarray]
    step: float


@dataclass(frozen=True)
class How:
    """What the axis is called in messages ("table 1: time", "s"), the repairs that are allowed, the notes."""

    label: str
    unit: str
    repairs: tuple[str, ...]
    notes: Notes


_Rows = tuple[np.ndarray, np.ndarray]
"""Axis, shape (n,), and values, shape (columns, n)."""


def regular(axis: np.ndarray, columns: Mapping[str, np.ndarray], step: float | None, how: How) -> Series:
    """Bring rows into order.

    Parameters
    ----------
    axis : times or places as they stand in the file, shape (n,).
    columns : values, each of shape (n,).
    step : stated distance of the rows; None: the median of those found.
    how : names, repairs and notes.

    Raises
    ------
    InputError : fewer than two rows; rows without time, unsorted or doubled where no repair is allowed; the stated step
        does not fit the rows.
    """
    axis, values = _timed(axis, np.array(list(columns.values())), how)
    axis, values = _sorted(axis, values, how)
    axis, values = _distinct(axis, values, how)
    if axis.size < 2:
        raise InputError(f"{how.label}: {axis.size} rows are left; a table needs two")
    usual = float(np.median(np.diff(axis)))
    allowed = _JITTERY if {"snap", "resample"} & set(how.repairs) else _EVEN
    if step is not None and abs(usual / step - 1) > allowed:
        raise InputError(
            f"{how.label}: rows are stated {step:.6g} {how.unit} apart and are {usual:.6g} {how.unit} apart; {_CURE}"
        )
    known = step is not None
    step = step if step is not None else _round_step(usual, how.unit)
    if not known:
        every = f"{1 / step:.10g} Hz" if how.unit == "s" else f"{step:.10g} {how.unit}"
        how.notes.assume(f"{how.label}: rows every {every}, by the median of their distances ({usual:.6g} {how.unit})")
    if "snap" in how.repairs:
        axis, values, step = _snapped(axis, values, step, how)
    elif "resample" in how.repairs:
        axis, values, step = _resampled(axis, values, step, how)
    else:
        _describe(axis, step, how)
    return Series(axis, dict(zip(columns, values, strict=True)), step)


_CURE = (
    "correct the rate or spacing, add 'rows: filled' where rows of slower channels are empty, or 'snap' to repair "
    "where times jitter"
)


def _timed(axis: np.ndarray, values: np.ndarray, how: How) -> _Rows:
    lost = ~np.isfinite(axis)
    if not lost.any():
        return axis, values
    if "drop_untimed" not in how.repairs:
        raise InputError(
            f"{how.label}: {int(lost.sum())} rows have none, the first is row {int(lost.argmax()) + 1} of the data; "
            "mend them, or add 'drop_untimed' to repair"
        )
    how.notes.repair(f"{how.label}: {int(lost.sum())} rows without it left out")
    return axis[~lost], values[:, ~lost]


def _sorted(axis: np.ndarray, values: np.ndarray, how: How) -> _Rows:
    back = np.diff(axis) < 0
    if not back.any():
        return axis, values
    row = int(back.argmax())
    if "sort" not in how.repairs:
        raise InputError(
            f"{how.label} goes back from {axis[row]:.10g} to {axis[row + 1]:.10g} {how.unit} at row {row + 2} of the "
            f"data ({int(back.sum())} such places); mend it, or add 'sort' to repair where rows are out of order"
        )
    how.notes.repair(
        f"{how.label}: rows sorted; it went back at {int(back.sum())} places, first at row {row + 2} of the data"
    )
    order = np.argsort(axis, kind="stable")
    return axis[order], values[:, order]


def _distinct(axis: np.ndarray, values: np.ndarray, how: How) -> _Rows:
    double = np.diff(axis, prepend=-np.inf) == 0
    if not double.any():
        return axis, values
    row = int(double.argmax())
    if "drop_duplicates" not in how.repairs:
        raise InputError(
            f"{how.label} {axis[row]:.10g} {how.unit} stands twice ({int(double.sum())} such rows, row {row + 1} of "
            "the data first); mend it, or add 'drop_duplicates' to repair"
        )
    first = np.maximum.accumulate(np.where(double, 0, np.arange(axis.size)))
    other = ~((values == values[:, first]) | (np.isnan(values) & np.isnan(values[:, first]))).all(axis=0)
    differing = int((other & double).sum())
    how.notes.repair(
        f"{how.label}: {int(double.sum())} rows with the one before left out, {differing} of them with other values"
    )
    return axis[~double], values[:, ~double]


def _round_step(usual: float, unit: str) -> float:
    """A whole number of Hz, where that is within 0.1 % of the median; else the median."""
    if unit != "s" or usual <= 0:
        return usual
    rate = round(1 / usual)
    return 1.0 / rate if rate >= 1 and abs(usual * rate - 1) < 1e-3 else usual


def _row_numbers(axis: np.ndarray, step: float, how: How) -> tuple[np.ndarray, float, float]:
    """(number of each row on the grid, first place, step): the grid that fits the rows best.

    Numbers are counted from row to row, so that neither jitter nor a slightly wrong step adds up.
    """
    count = np.concatenate([[0], np.cumsum(np.maximum(1, np.rint(np.diff(axis) / step)))]).astype(np.int64)
    if count[-1] > _MOST_ROWS:
        raise InputError(
            f"{how.label} spans {axis[-1] - axis[0]:.4g} {how.unit}, too long for rows every {step:.4g} {how.unit}"
        )
    slope, first = np.polyfit(count - count.mean(), axis, 1)
    first = first - slope * count.mean()
    if abs(slope / step - 1) * count[-1] > _DRIFT and abs(slope / step - 1) < 0.01:
        how.notes.repair(
            f"{how.label}: the clock's real step is {slope:.10g} {how.unit}, not {step:.10g} {how.unit}; the grid "
            "follows it"
        )
        return count, float(first), float(slope)
    return count, float(np.mean(axis - step * count)), step


def _snapped(axis: np.ndarray, values: np.ndarray, step: float, how: How) -> tuple[np.ndarray, np.ndarray, float]:
    count, first, step = _row_numbers(axis, step, how)
    moved = first + step * count - axis
    grid = first + step * np.arange(count[-1] + 1)
    filled = np.full((len(values), grid.size), np.nan)
    filled[:, count] = values
    how.notes.repair(
        f"{how.label}: rows put on a grid of {step:.10g} {how.unit}; moved by {np.std(moved):.3g} {how.unit} rms, at "
        f"most {np.abs(moved).max():.3g} {how.unit}; {grid.size - count.size} missing rows left empty"
    )
    return grid, filled, step


def _resampled(axis: np.ndarray, values: np.ndarray, step: float, how: How) -> tuple[np.ndarray, np.ndarray, float]:
    if (axis[-1] - axis[0]) / step > _MOST_ROWS:
        raise InputError(
            f"{how.label} spans {axis[-1] - axis[0]:.4g} {how.unit}, too long for rows every {step:.4g} {how.unit}"
        )
    grid = axis[0] + step * np.arange(int((axis[-1] - axis[0]) / step + 1e-6) + 1)
    resampled = np.array([_interpolated(axis, column, grid, step) for column in values])
    empty = int(np.isnan(resampled).all(axis=0).sum())
    how.notes.repair(
        f"{how.label}: values interpolated (cubic spline) at a grid of {step:.10g} {how.unit}; {empty} rows in "
        "gaps left empty"
    )
    return grid, resampled, step


def _interpolated(axis: np.ndarray, column: np.ndarray, grid: np.ndarray, step: float) -> np.ndarray:
    """Cubic spline through the finite values; NaN where the neighbours are more than `WIDEST` steps apart."""
    good = np.isfinite(column)
    result = np.full(grid.size, np.nan)
    if good.sum() < 2:
        return result
    x, y = axis[good], column[good]
    smooth = CubicSpline(x, y)(grid) if x.size > 3 else np.interp(grid, x, y)
    at = np.clip(np.searchsorted(x, grid, side="right"), 1, x.size - 1)
    near = np.minimum(np.abs(grid - x[at - 1]), np.abs(x[at] - grid)) < 1e-6 * step
    inside = (grid >= x[0] - 1e-6 * step) & (grid <= x[-1] + 1e-6 * step)
    use = inside & (near | (x[at] - x[at - 1] <= WIDEST * step))
    result[use] = smooth[use]
    return result


def _describe(axis: np.ndarray, step: float, how: How) -> None:
    """Note gaps and jitter that stay."""
    steps = np.diff(axis) / step
    gaps = steps > WIDEST
    if gaps.any():
        how.notes.assume(
            f"{how.label}: {int(gaps.sum())} gaps of up to {steps.max() * step:.4g} {how.unit} stay as they are"
        )
    jitter = float(np.std(steps[~gaps] - 1)) if (~gaps).any() else 0.0
    if jitter > _JITTER:
        how.notes.assume(
            f"{how.label}: steps jitter by {100 * jitter:.2g} % and stay; 'snap' or 'resample' in repair would even "
            "them out"
        )
