"""Rows on a regular axis: jittering times (or places) and gaps stay as they are, or are repaired as the map asks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.errors import InputError
from railsim.field.order import How, Rows, numbered, ordered
from railsim.stamps import WIDEST, Step, usual_step

__all__ = ["How", "Series", "regular"]

_JITTER = 1e-3  # of a step; less is rounding
_DRIFT = 0.25  # steps over the record by which a stated rate may be off
_EVEN, _JITTERY = 0.01, 0.2  # by how much rows' usual distance may differ from the stated one
_CRYSTAL = 2e-4  # by how much loggers' clocks are off
_SAME = 1e-9  # by which steps may differ and are one
_FARTHEST = 0.5  # steps by which a row may move
_PART = 10  # rows on either side of a change of rate
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


def regular(
    axis: np.ndarray,
    columns: dict[str, np.ndarray],
    step: float | None,
    how: How,
    others: Sequence[Series] = (),
) -> Series:
    """Bring rows into order.

    Parameters
    ----------
    axis : times or places as they stand in the file, shape (n,).
    columns : values, each of shape (n,); they are taken out one by one, so that a day's data stand in memory once.
    step : stated distance of the rows; None: the median of those found.
    how : names, repairs and notes.
    others : tables that are done; rows that are resampled come to the axis of one that has the same step.

    Raises
    ------
    InputError : fewer than two rows; rows without time, unsorted or doubled where no repair is allowed; the stated step
        does not fit the rows.
    """
    names, values = list(columns), np.empty((len(columns), axis.size))
    for row, name in enumerate(names):
        values[row] = columns.pop(name)
    axis, values = _timed(axis, values, how)
    axis, values = ordered(axis, values, how)
    if axis.size < 2:
        raise InputError(f"{how.label}: {axis.size} rows are left; a table needs two")
    found = usual_step(axis)
    allowed = _JITTERY if {"snap", "resample"} & set(how.repairs) else _EVEN
    if step is not None and not found.fits(step, allowed):
        raise InputError(
            f"{how.label}: rows are stated {step:.6g} {how.unit} apart and are {found.size:.6g} {how.unit} apart; "
            f"{_cure(step, found.size, how)}"
        )
    if step is None:
        step = _round_step(found, how.unit)
        every = f"{1 / step:.10g} Hz" if how.unit == "s" else f"{step:.10g} {how.unit}"
        rounded = f", stamps are rounded to {found.resolution:g} {how.unit}" if _is_rounded(axis, found) else ""
        how.notes.assume(
            f"{how.label}: rows every {every}, by all rows without gaps ({found.size:.10g} {how.unit}){rounded}"
        )
    if "snap" in how.repairs:
        axis, values, step = _snapped(axis, values, step, how)
    elif "resample" in how.repairs:
        same = [one.axis for one in others if abs(one.step / step - 1) < _SAME]
        axis, values, step = _resampled(axis, values, step, how, same[0] if same else None)
    else:
        _describe(axis, step, how)
    return Series(axis, dict(zip(names, values, strict=True)), step)


def _cure(stated: float, real: float, how: How) -> str:
    """What mends a stated distance that the rows do not have."""
    if how.unit != "s":
        return f"correct the spacing ('spacing: {real:.6g}'), or add 'snap' to repair where places jitter"
    right = f"correct the rate ('rate: {1 / real:.10g}')"
    if stated > 1.9 * real:
        return (
            f"{right}, or add 'rows: filled' where rows of slower channels are empty, 'rows: changed' where these "
            "repeat their last value"
        )
    if abs(real / stated - 1) < _JITTERY:
        return f"{right}, or add 'snap' to repair where times jitter"
    return right


def _timed(axis: np.ndarray, values: np.ndarray, how: How) -> Rows:
    lost = ~np.isfinite(axis)
    if not lost.any():
        return axis, values
    if not {"drop_untimed", "drop_outliers"} & set(how.repairs):
        raise InputError(
            f"{how.label}: {int(lost.sum())} rows have none, the first is row {int(lost.argmax()) + 1} of the data; "
            "mend them, or add 'drop_untimed' to repair"
        )
    how.notes.repair(f"{how.label}: {int(lost.sum())} rows without it left out")
    return axis[~lost], values[:, ~lost]


def _round_step(found: Step, unit: str) -> float:
    """A whole number of Hz, where the clock's tolerance or the stamps' rounding leaves it open; else as found."""
    if unit != "s" or found.size <= 0:
        return found.size
    rate = round(1 / found.size)
    return 1.0 / rate if rate >= 1 and found.fits(1.0 / rate, _CRYSTAL) else found.size


def _is_rounded(axis: np.ndarray, found: Step) -> bool:
    """Whether steps differ by the resolution of the stamps."""
    steps = np.diff(axis)
    usual = steps[steps <= WIDEST * found.size]
    return bool(found.resolution > 1e-3 * found.size and usual.size and np.ptp(usual) > 0.5 * found.resolution)


def _grid(axis: np.ndarray, step: float, how: How) -> tuple[np.ndarray, float, float]:
    """(number of each row on the grid, first place, step): the grid that fits the rows best."""
    count = numbered(axis, step)
    if count[-1] > _MOST_ROWS:
        raise InputError(
            f"{how.label} spans {axis[-1] - axis[0]:.4g} {how.unit}, too long for rows every {step:.4g} {how.unit}; "
            "check the unit of that column"
        )
    count = count.astype(np.int64)
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
    """Rows on the even grid.

    Raises
    ------
    InputError : a row would move by more than half a step.
    """
    count, first, step = _grid(axis, step, how)
    moved = first + step * count - axis
    if np.abs(moved).max() > _FARTHEST * step:
        raise InputError(_too_far(axis, moved, step, how))
    grid = first + step * np.arange(count[-1] + 1)
    filled = np.full((len(values), grid.size), np.nan)
    filled[:, count] = values
    how.notes.repair(
        f"{how.label}: rows put on a grid of {step:.10g} {how.unit}; moved by {np.std(moved):.3g} {how.unit} rms, at "
        f"most {np.abs(moved).max():.3g} {how.unit}; {grid.size - count.size} missing rows left empty"
    )
    return grid, filled, step


def _too_far(axis: np.ndarray, moved: np.ndarray, step: float, how: How) -> str:
    """Why rows leave the grid, and the lines of the map that mend it."""
    row = int(np.abs(moved).argmax())
    head = (
        f"{how.label}: 'snap' would move row {row + 1} of the data by {abs(moved[row]):.3g} {how.unit}, more than half "
        f"a step ({step:.4g} {how.unit})"
    )
    cure = "write 'repair: [resample]' in place of snap"
    change = _change(axis)
    if change is None or how.unit != "s":
        return f"{head}; {cure}"
    at, before, after = change
    return (
        f"{head}: the rate changes from {before:.4g} to {after:.4g} Hz at row {at + 1}; {cure}, or import two "
        f"recordings, one with 'rows: {{last: {at}}}', one with 'rows: {{first: {at + 1}}}'"
    )


def _change(axis: np.ndarray) -> tuple[int, float, float] | None:
    """(row, rate before, rate after) where the rate changes most, by two straight lines; None where it does not."""
    steps = np.diff(axis)
    usual = np.minimum(steps, WIDEST * float(np.median(steps)))
    if steps.size < 2 * _PART:
        return None
    total, rows = np.cumsum(usual), np.arange(1, steps.size + 1)
    inner = slice(_PART - 1, -_PART)
    before = total[inner] / rows[inner]
    after = (total[-1] - total[inner]) / (steps.size - rows[inner])
    gain = rows[inner] * (steps.size - rows[inner]) * (before - after) ** 2
    best = int(gain.argmax())
    if abs(before[best] / after[best] - 1) < _EVEN:
        return None
    return best + _PART, 1 / float(before[best]), 1 / float(after[best])


def _resampled(
    axis: np.ndarray, values: np.ndarray, step: float, how: How, onto: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, float]:
    if (axis[-1] - axis[0]) / step > _MOST_ROWS:
        raise InputError(
            f"{how.label} spans {axis[-1] - axis[0]:.4g} {how.unit}, too long for rows every {step:.4g} {how.unit}; "
            "check the unit of that column"
        )
    grid = axis[0] + step * np.arange(int((axis[-1] - axis[0]) / step + 1e-6) + 1) if onto is None else onto
    resampled = np.array([_interpolated(axis, column, grid, step) for column in values])
    empty = int(np.isnan(resampled).all(axis=0).sum())
    how.notes.repair(
        f"{how.label}: values interpolated (cubic spline) at {'a grid' if onto is None else 'the other table'} of "
        f"{step:.10g} {how.unit}; {empty} rows in gaps left empty"
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
