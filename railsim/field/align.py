"""Shift of one run against another of the same track, by cross-correlation in windows."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import correlate

from railsim.errors import InputError

LONGEST = 25.0
"""m: longest wavelength of range D1 of EN 13848-1."""


@dataclass(frozen=True)
class Shifts:
    """What is found; the run's place `at` + `shift` is the reference's.

    Attributes
    ----------
    at : centres of the windows, m, shape (k,).
    shift : m, shape (k,).
    correlation : height of the peaks, shape (k,).
    rejected : number of windows without a clear peak.
    """

    at: np.ndarray
    shift: np.ndarray
    correlation: np.ndarray
    rejected: int

    def correct(self, distance: np.ndarray) -> np.ndarray:
        """Distances of the run on the reference's scale: shifts are linear between windows, held beyond the last."""
        return distance + np.interp(distance, self.at, self.shift)


def shifts(
    run: tuple[np.ndarray, np.ndarray],
    reference: tuple[np.ndarray, np.ndarray],
    window: float,
    largest: float,
    threshold: float,
) -> Shifts:
    """Estimate shifts from wavelengths up to `LONGEST`: longer ones are alike wherever one looks.

    Parameters
    ----------
    run, reference : (places in m, increasing; values), each of shape (n,) and (m,).
    window : m; each window overlaps the next by half.
    largest : m; no larger shift is looked for.
    threshold : correlation that a peak must reach, lest its window be left out.

    Raises
    ------
    InputError : the two do not overlap by a window, or no window has a clear peak.
    """
    step = float(min(np.median(np.diff(run[0])), np.median(np.diff(reference[0]))))
    first = max(run[0][0], reference[0][0] + largest)
    last = min(run[0][-1], reference[0][-1] - largest)
    if last - first < window:
        raise InputError(
            f"align: the runs share {max(0.0, last - first):.0f} m, less than a window of {window:g} m; "
            "shorten the window"
        )
    windows, rejected = [], 0
    for centre in np.arange(first + window / 2, last - window / 2 + 1e-9, window / 2):
        best = _shift(run, reference, (float(centre), window, largest, step))
        if best is None or best[1] < threshold:
            rejected += 1
        else:
            windows.append((float(centre), *best))
    if 2 * len(windows) < rejected + len(windows):
        raise InputError(
            f"align: the runs agree in {len(windows)} of {rejected + len(windows)} windows; is it the same track and "
            "column?"
        )
    at, shift, height = np.array(windows).T
    return Shifts(at, shift, height, rejected)


def _shift(
    run: tuple[np.ndarray, np.ndarray], reference: tuple[np.ndarray, np.ndarray], of: tuple[float, float, float, float]
) -> tuple[float, float] | None:
    """(shift, normalised correlation) of one window; None where a signal is constant or the peak is at the edge.

    The peak between the lags is that of a parabola through the three highest values.
    """
    centre, window, largest, step = of
    half, reach = int(window / 2 / step), int(np.ceil(largest / step))
    own = np.interp(centre + step * np.arange(-half, half + 1), *run)
    wide = np.interp(centre + step * np.arange(-half - reach, half + reach + 1), *reference)
    own = _short_waves(own, step)
    own = own - own.mean()
    wide = _short_waves(wide, step)
    count = own.size
    total = np.concatenate([[0.0], np.cumsum(wide)])
    square = np.concatenate([[0.0], np.cumsum(wide**2)])
    mean = (total[count:] - total[:-count]) / count
    spread = np.sqrt(np.maximum((square[count:] - square[:-count]) / count - mean**2, 0.0))
    if own.std() <= 0 or spread.max() <= 0:
        return None
    height = np.asarray(correlate(wide, own, "valid")) / count
    height = height / (own.std() * np.maximum(spread, 1e-9 * spread.max()))
    best = int(np.argmax(height))
    if not 0 < best < height.size - 1:
        return None
    before, peak, after = height[best - 1 : best + 2]
    fraction = 0.5 * (before - after) / (before - 2 * peak + after)
    return float((best - reach + fraction) * step), float(peak)


def _short_waves(values: np.ndarray, step: float) -> np.ndarray:
    """Values less their running mean over `LONGEST`."""
    return values - uniform_filter1d(values, max(1, round(LONGEST / step)), mode="nearest")
