"""Traces of an estimate for a page: values, stated deviations, limits and earlier passes over distance, packed."""

import base64
from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np

from estimators.interface import Estimate
from experiments.maintenance.comparison import Earlier
from experiments.maintenance.condition import error_of, valid_of
from experiments.maintenance.limits import Limits, shipped, split
from experiments.maintenance.line_speed import TRAVELLED, LineSpeed
from experiments.maintenance.sections import quantities
from experiments.reporting.units import MM

STEP = 0.01  # mm or mm/m; of a packed number
LOST = -32768
"""Stands for a value that is not known."""
POINTS = 3_000_000
"""Values that a page holds of an estimate; beyond, several rows are one."""
_CELLS = {"D1": 0.25, "D2": 1.0, "D3": 2.5, "": 0.25}
"""m, the finest that each band is drawn by: a twelfth of its shortest wave or less."""


def traces(
    estimate: Estimate,
    passes: Sequence[Earlier] = (),
    limits: Limits | None = None,
    speed: LineSpeed = TRAVELLED,
    points: int = POINTS,
) -> list[dict[str, Any]]:
    """What the page draws, one entry a quantity and band.

    Each holds "name", "unit", "start [m]", "cell [m]", "values", "errors", "earlier" (packed numbers, of each cell the
    value of largest size), "shown" (at first) and "limits": [from [m], alert, intervention, immediate action] where
    they begin.

    Parameters
    ----------
    passes : earlier ones on the grid of the estimate.
    limits, speed : as for `section_rows`.
    points : values at most.
    """
    names = quantities(estimate)
    density = sum((2 + len(passes)) / _CELLS[split(name)[1]] for name in names)  # values a metre
    coarser = max(1.0, float(np.ptp(estimate.series["s [m]"])) * density / points)
    return [_trace(estimate, name, passes, limits or shipped(), speed, coarser) for name in names]


def _trace(
    estimate: Estimate, name: str, passes: Sequence[Earlier], limits: Limits, speed: LineSpeed, coarser: float
) -> dict[str, Any]:
    series = estimate.series
    distance, time = series["s [m]"].to_numpy(), series["time [s]"].to_numpy()
    spacing = float(np.median(np.diff(distance))) if len(distance) > 1 else 1.0
    count = max(1, ceil(coarser * _CELLS[split(name)[1]] / spacing - 1e-9))
    good = valid_of(series)
    quantity, band = split(name)
    entry: dict[str, Any] = {"name": " ".join([quantity.replace("_", " "), band]).strip()}
    entry |= {"unit": "mm/m" if "[m/m]" in name else "mm", "step": STEP, "start [m]": float(distance[0])}
    entry |= {"cell [m]": count * spacing, "values": _packed(np.where(good, series[name].to_numpy(), np.nan), count)}
    error = error_of(series, name)
    if np.isfinite(error).any():
        entry["errors"] = _packed(error, count)
    entry["earlier"] = [_packed(one.values[name], count) for one in passes if name in one.values]
    entry["shown"] = band in ("D1", "") and not quantity.startswith(("left_", "right_"))
    peaks = limits.peaks(name, speed.at(distance, time))
    if peaks is not None:
        entry["limits"] = _steps(distance, MM * peaks)
    return entry


def _packed(values: np.ndarray, count: int) -> str:
    """Numbers of two bytes, little endian, base64; of `count` rows that of largest size."""
    rows = -(-len(values) // count)
    padded = np.full(rows * count, np.nan)
    padded[: len(values)] = values
    cells = padded.reshape(rows, count)
    size = np.where(np.isfinite(cells), np.abs(cells), -1.0)
    chosen = cells[np.arange(rows), np.argmax(size, axis=1)]
    numbers = np.clip(np.rint(np.nan_to_num(MM * chosen) / STEP), LOST + 1, -LOST - 1)
    return base64.b64encode(np.where(np.isfinite(chosen), numbers, LOST).astype("<i2").tobytes()).decode()


def _steps(distance: np.ndarray, peaks: np.ndarray) -> list[list[float | None]]:
    """Rows at which the limits change."""
    known = np.nan_to_num(peaks, nan=-1.0)
    firsts = np.flatnonzero(np.concatenate([[True], (np.diff(known, axis=0) != 0.0).any(axis=1)]))
    return [
        [round(float(distance[row]), 3), *(None if np.isnan(one) else round(float(one), 3) for one in peaks[row])]
        for row in firsts
    ]
