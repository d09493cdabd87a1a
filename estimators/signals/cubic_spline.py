"""Means of runs of samples, and cubic splines through them at even places: several rows at once, compiled."""

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.compiled import kernel

FEWEST = 4
"""Points from which both ends have a condition of their own."""


def at_even_places(places: np.ndarray, values: np.ndarray, step: float, count: int) -> np.ndarray:
    """Splines (not-a-knot, as `scipy.interpolate.CubicSpline`) at 0, `step` ..., beyond an end the value there.

    Parameters
    ----------
    places : increasing, shape (n,). values : shape (n,) or (rows, n), finite. count : of the places that are asked for.

    Returns
    -------
    Shape (count,) or (rows, count).
    """
    if len(places) < FEWEST:
        return CubicSpline(places, values, axis=-1)(np.clip(step * np.arange(count), places[0], places[-1]))
    rows = np.ascontiguousarray(np.atleast_2d(values), dtype=float)
    out, work = np.empty((len(rows), count)), np.empty((3, len(places)))
    _evaluate(np.ascontiguousarray(places, dtype=float), rows, step, work, out)
    return out if values.ndim > 1 else out[0]


def means(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Means of runs of samples; `first` : where each run begins, increasing from 0, shape (runs,).

    `values` : shape (n,) or (rows, n); the means have shape (runs,) or (rows, runs).
    """
    rows = np.ascontiguousarray(np.atleast_2d(values), dtype=float)
    out = np.empty((len(rows), len(first)))
    _means(rows, first, out)
    return out if values.ndim > 1 else out[0]


@kernel
def _means(values: np.ndarray, first: np.ndarray, out: np.ndarray) -> None:
    for row in range(len(values)):
        for run in range(len(first)):
            end = first[run + 1] if run + 1 < len(first) else values.shape[1]
            total = 0.0
            for i in range(first[run], end):
                total += values[row, i]
            out[row, run] = total / (end - first[run])


@kernel
def _evaluate(places: np.ndarray, values: np.ndarray, step: float, work: np.ndarray, out: np.ndarray) -> None:
    """Slopes at the points by elimination (de Boor 1978, chapter IV), then the cubic of each interval."""
    n, last = len(places), len(places) - 1
    upper, pivot, slope = work[0], work[1], work[2]
    pivot[0] = places[2] - places[1]
    upper[0] = (places[2] - places[0]) / pivot[0]
    for i in range(1, last):
        before, after = places[i] - places[i - 1], places[i + 1] - places[i]
        pivot[i] = 2.0 * (before + after) - after * upper[i - 1]
        upper[i] = before / pivot[i]
    end = places[last] - places[last - 2]
    pivot[last] = places[last - 1] - places[last - 2] - end * upper[last - 1]
    for row in range(len(values)):
        y = values[row]
        h, k = places[1] - places[0], places[2] - places[1]
        first, second = (y[1] - y[0]) / h, (y[2] - y[1]) / k
        slope[0] = ((h + 2.0 * (h + k)) * k * first + h * h * second) / (h + k) / pivot[0]
        for i in range(1, last):
            h, k = places[i] - places[i - 1], places[i + 1] - places[i]
            first, second = (y[i] - y[i - 1]) / h, (y[i + 1] - y[i]) / k
            slope[i] = (3.0 * (k * first + h * second) - k * slope[i - 1]) / pivot[i]
        h, k = places[last - 1] - places[last - 2], places[last] - places[last - 1]
        first, second = (y[last - 1] - y[last - 2]) / h, (y[last] - y[last - 1]) / k
        right = (k * k * first + (2.0 * (h + k) + k) * h * second) / (h + k)
        slope[last] = (right - end * slope[last - 1]) / pivot[last]
        for i in range(last - 1, -1, -1):
            slope[i] -= upper[i] * slope[i + 1]
        i = 0
        for place in range(out.shape[1]):
            x = min(max(step * place, places[0]), places[last])
            while i < n - 2 and x >= places[i + 1]:
                i += 1
            h, along = places[i + 1] - places[i], x - places[i]
            mean = (y[i + 1] - y[i]) / h
            bend = (slope[i] + slope[i + 1] - 2.0 * mean) / h
            out[row, place] = y[i] + along * (slope[i] + along * ((mean - slope[i]) / h - bend + along * bend / h))
