"""Where along the way and in the spectrum: tones of the residual, and places of short dips by a matched filter."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter

from experiments.discrepancy.baseline.frames import Frames
from experiments.discrepancy.fit.fitting import Fit, Problem

RATE = 128.0  # Hz, of signals put together again from their frames
TONES = 3
OUTSTANDING = 25.0  # power over the neighbourhood's median, in any channel, from which a line is a tone
SURROUNDINGS = 61  # lines of the whole run's spectrum
THIRDS = 31  # the same of a third's: what lasts no longer is a broad line
OF_THIRDS = 2  # tones that only they have
LOWEST = 0.5  # Hz
IMPACTS = 30  # loudest places that a series of joints is made of
TEETH = 8  # joints that may lie between two of them
TOLERANCE = 0.6  # m that a joint may be off its place in the series


def in_time(frames: Frames, white: np.ndarray) -> np.ndarray:
    """(n, c) samples at `RATE` of coefficients (k, f, c), from the first frame's start on.

    The sine window is its own inverse at half overlap.
    """
    count = round(frames.length * RATE)
    window = np.sin(np.pi * (np.arange(count) + 0.5) / count)
    spectrum = np.zeros((len(white), count // 2 + 1, white.shape[-1]), complex)
    spectrum[:, : white.shape[1]] = white * np.sqrt(0.5 * RATE * float(window @ window))
    pieces = np.fft.irfft(spectrum, count, axis=1) * window[:, None]
    hop = round((frames.starts[1] - frames.starts[0]) * RATE)
    signal = np.zeros((hop * (len(white) - 1) + count, white.shape[-1]))
    for number, piece in enumerate(pieces):
        signal[number * hop : number * hop + count] += piece
    return signal


def distance_at(problem: Problem, times: np.ndarray) -> np.ndarray:
    """Distance along the track [m] at times of the recording [s]."""
    forward = problem.forward
    knots, speed, _ = forward.evidence.speed
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(knots))])
    return forward.registration.start + forward.registration.scale * np.interp(times, knots, way)


def distance_of(problem: Problem, count: int) -> np.ndarray:
    """(count,) distance along the track [m] of samples of `in_time`."""
    return distance_at(problem, problem.frames.starts[0] + np.arange(count) / RATE)


def left(problem: Problem, fit: Fit) -> np.ndarray:
    """(k, f, c) complex whitened residual."""
    if problem.white is None:
        raise ValueError("state the noise first")
    return problem.white.complex(problem.measured - fit.stacked)


def tones(problem: Problem, fit: Fit) -> tuple[tuple[float, float], ...]:
    """(frequency at the run's mean speed [Hz], wavelength [m]) of the strongest lines in the residual's spectrum over
    distance, the strongest first, then those that only one of its overlapping thirds has: over the whole run the window
    fades what is near an end, and noise of elsewhere hides what is short.
    """
    signal = in_time(problem.frames, left(problem, fit))
    s = distance_of(problem, len(signal))
    speed = (s[-1] - s[0]) / (len(s) - 1) * RATE
    most, sixth = float(problem.frames.frequencies[-1]), len(s) // 6
    thirds = [slice(first * sixth, (first + 2) * sixth) for first in range(5)]
    whole = _lines(signal, s, most, SURROUNDINGS)
    short = [one for third in thirds for one in _lines(signal[third], s[third], most, THIRDS)]
    found: list[float] = []
    for lines, count in ((whole, TONES), (short, OF_THIRDS)):
        room = len(found) + count
        for _, wavelength in sorted(lines, reverse=True):
            if len(found) < room and all(abs(other / wavelength - 1.0) > 0.03 for other in found):
                found.append(wavelength)
    return tuple((speed / wavelength, wavelength) for wavelength in found)


def _lines(signal: np.ndarray, s: np.ndarray, most: float, near: int) -> list[tuple[float, float]]:
    """(power, wavelength [m]) of lines up to a frequency [Hz] that stand out of as many near ones, in samples (n, c)
    at distances s (n,); between lines by a parabola.
    """
    speed = (s[-1] - s[0]) / (len(s) - 1) * RATE
    even = np.linspace(s[0], s[-1], len(s))
    window = np.hanning(len(s))
    window /= np.linalg.norm(window)
    power, ratio = np.zeros(len(s) + 1), np.zeros(len(s) + 1)
    for one in signal.T:
        own = np.abs(np.fft.rfft(window * np.interp(even, s, one), 2 * len(s))) ** 2
        power += own
        ratio = np.maximum(ratio, own / (median_filter(own, near) + 1e-12 * own.max() + 1e-300))
    line = np.arange(len(power)) * RATE / (2.0 * len(s))  # Hz
    ratio[(line <= LOWEST) | (line >= most)] = 0.0
    found: list[tuple[float, float]] = []
    for place in np.flatnonzero(ratio > OUTSTANDING):
        if not 0 < place < len(power) - 1 or power[place] < max(power[place - 1], power[place + 1]):
            continue
        before, top, after = np.log(power[place - 1 : place + 2])
        between = 0.5 * (before - after) / (before - 2.0 * top + after)
        found.append((float(power[place]), speed / float(line[place] + between * line[1])))
    return found


def likely_places(problem: Problem, fit: Fit, change: np.ndarray, place: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Distances [m], by how much a short signature (k, f, c) that was made at a place fits there (1 = as it is), and
    the signature's power: a matched filter.
    """
    if problem.white is None:
        raise ValueError("state the noise first")
    residual = in_time(problem.frames, left(problem, fit))
    own = in_time(problem.frames, problem.white.complex(change))
    count = len(residual)
    spectrum = np.fft.rfft(residual, 2 * count, axis=0) * np.fft.rfft(own, 2 * count, axis=0).conj()
    along = np.fft.irfft(spectrum.sum(axis=1), 2 * count)
    power = float((own**2).sum())
    shift = np.concatenate([np.arange(count), np.arange(-count, 0)])
    order = np.argsort(shift)
    s = distance_of(problem, count)
    middle = float(np.interp(place, s, np.arange(count)))
    places = np.interp(middle + shift[order], np.arange(count), s, left=np.nan, right=np.nan)
    kept = np.isfinite(places)
    return places[kept], along[order][kept] / max(power, 1e-12), power


def loudest_places(places: np.ndarray, fits: np.ndarray, count: int, apart: float = 1.0) -> list[int]:
    """Indices of the largest local maxima, so far apart [m]."""
    found: list[int] = []
    for number in np.argsort(-fits):
        if fits[number] <= 0.0 or len(found) == count:
            break
        if all(abs(places[number] - places[other]) > apart for other in found):
            found.append(int(number))
    return found


def series(
    places: np.ndarray, fits: np.ndarray, spacing: tuple[float, float], count: int = 2
) -> list[tuple[float, float]]:
    """(first, spacing) [m] of the series of equal dips that gain most, from the first on to the end of the run."""
    peaks = sorted(float(places[number]) for number in loudest_places(places, fits, IMPACTS))
    reach = max(1, round(TOLERANCE / max(float(np.median(np.diff(places))), 1e-3)))
    best = np.max([np.roll(fits, shift) for shift in range(-reach, reach + 1)], axis=0)
    tried: list[tuple[float, float, float]] = []
    for number, first in enumerate(peaks):
        gaps: Sequence[float] = [spacing[1]]
        gaps = [*gaps, *((other - first) / n for other in peaks[number + 1 :] for n in range(1, TEETH))]
        for gap in gaps:
            if spacing[0] <= gap <= spacing[1]:
                teeth = np.interp(np.arange(first, places[-1], gap), places, best)
                total = float(teeth.sum())
                tried.append((total * abs(total) / len(teeth), first, gap))
    tried.sort(reverse=True)
    found: list[tuple[float, float]] = []
    for _, first, gap in tried:
        if len(found) < count and all(abs(first - a) > 1.0 or abs(gap / b - 1.0) > 0.02 for a, b in found):
            found.append((first, gap))
    return found
