"""Stiffness of a stretch of windows: what of the spectra may be used, the fit, and whether it may be believed."""

from typing import NamedTuple

import numpy as np

from estimators.signals.bands import stretches
from estimators.track.stiffness_likelihood import Likelihood, State
from estimators.track.stiffness_model import Common, Springs, acceleration_over_roughness
from estimators.track.stiffness_windows import TAPERS, Windows

CLEAR = 3.0
"""Times the noise's power that a bin must have in half of the windows."""
STEEP, THIRD = 10.0, 2.0 ** (1.0 / 3.0)
"""A fall to noise by more than that factor within a third of an octave: the waves end there."""
CLIFF = 64.0
"""A fall of the power by more than that factor within a third of an octave: no resonance falls so steeply (at 60 % of
the usual damping by 46), the waves end there."""
OCTAVES = 1.3
"""Least width of what is used: a resonance and what lies on both sides of it."""
FEWEST = 4
"""Windows that can tell how they differ."""
KNEE = 4.0
"""Deviations of a bend of the common roughness from which it is no roughness: waves end there, or a filter begins."""
ROUNDS = 4
LINE = 5.0
"""Deviations by which a bin stands out in all windows: a wheel out of round, a corrugation all along."""
BESIDE = 2
"""Bins beside such a line that are not used either."""
MANY = 8
"""Windows from which on lines can be told."""
EVIDENCE, ALONE = 0.5, 10.0
"""Logarithm of the posterior over that of rails that do not give: for each window, and for the record. In 50 simulated
runs on rigid rails (12 to 60 m/s, 23 and 30 windows) it was 4 to 21, on rails of 40 to 170 MN/m 19 to 1200."""
UNLIKELY = 3.0
"""Deviations from which on no wheelset and no track has such a mass, damping or foundation."""
INSIDE = 1.3
"""Least ratio of a resonance to both ends of the frequencies in use: its flanks must be seen, 2 zeta of 0.1 to 0.4."""
BEYOND = "the resonance of the wheelset on its track lies beyond the frequencies in use"
POOR = 1.6
"""Mean misfit of the windows from which on the model does not describe the record."""
EDGE = 0.25
"""Deviation over the difference of both neighbours: stiffness that changes within a window."""
MODEL, MODEL_SHARE = 0.05, 0.1
"""Deviations of the logarithm by the beam on two layers in place of a track: of all windows alike (8 % at 50 Hz and
16 % at 100 Hz lie between a beam on single sleepers and a lumped one), and of a window's distance from the others."""


class Section(NamedTuple):
    """What was found in windows.

    Attributes
    ----------
    log_stiffness : shape (windows,). covariance : of these, shape (windows, windows).
    inside : whether the resonance lies within the frequencies in use, shape (windows,).
    common : what all have in common. wavelengths : shortest and longest that were used, m.
    reason : why nothing may be believed; empty where it may.
    """

    log_stiffness: np.ndarray
    covariance: np.ndarray
    inside: np.ndarray
    common: Common
    wavelengths: tuple[float, float]
    reason: str

    def std(self) -> np.ndarray:
        """Of the logarithm of the stiffness."""
        return np.sqrt(np.diag(self.covariance) + MODEL**2)

    def ratio(self, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithm of the stiffness over the geometric mean of the windows that are known, and its deviation."""
        count = int(known.sum())
        apart = np.eye(count) - 1.0 / max(count, 1)
        off = apart @ self.log_stiffness[known]
        covariance = apart @ self.covariance[np.ix_(known, known)] @ apart
        return off, np.sqrt(np.diag(covariance) + (MODEL_SHARE * off) ** 2)


def section(windows: Windows, expected: Common, springs: Springs) -> Section:
    """Fit windows that all have bins in use."""
    windows = clear_of_noise(windows, expected.noise)
    for left in reversed(range(ROUNDS)):
        if reason := too_little(windows):
            return nothing(windows, expected, reason)
        likelihood = Likelihood(windows, expected, springs)
        state = likelihood.fit()
        spoilt = lines(likelihood, state)
        if not spoilt.any():  # lines fall steeply and bend the shape, so that ends and bends are judged without them
            spoilt = beyond_waves(windows)
        if not spoilt.any():
            spoilt = knee(likelihood, state)
        if not spoilt.any():
            return judged(likelihood, state)
        if not left:
            break
        windows = windows.without(spoilt)
    return nothing(windows, expected, "the spectrum has lines or bends that no roughness has")


def judged(likelihood: Likelihood, state: State) -> Section:
    """What a fit gives, and whether it is to be believed."""
    windows, expected, springs = likelihood.windows, likelihood.expected, likelihood.springs
    rigid = Likelihood(windows, expected, springs, gives=False)
    evidence = rigid.objective(rigid.fit()) - likelihood.objective(state)
    misfit = likelihood.misfit(state)
    covariance = likelihood.normal(state).covariance()
    own = np.maximum(misfit, 1.0) - 1.0
    x = state.own[:, 0]
    beside = np.abs(np.concatenate([x[1:2], x[2:], x[-1:]]) - np.concatenate([x[:1], x[:-2], x[-2:-1]]))
    covariance = covariance + np.diag(own * np.diag(covariance) + (EDGE * beside) ** 2)
    values = likelihood.values(state.common)
    inside = resonates(windows, x, values, springs)
    far = float(np.abs(state.common[:-1] / likelihood.open[:-1]).max())
    why = doubt(evidence, misfit, far) or ("" if inside.any() else BEYOND)
    return Section(x, covariance, inside, values, used_waves(windows), why)


def resonates(windows: Windows, log_stiffness: np.ndarray, common: Common, springs: Springs) -> np.ndarray:
    """Whether the resonance of the wheelset on its track lies well within what is used of each window."""
    hertz = np.geomspace(5.0, 400.0, 300)
    omega = 2.0 * np.pi * hertz
    gain = acceleration_over_roughness(omega, np.exp(log_stiffness)[:, None], common, springs) / omega**4
    peak = hertz[gain.argmax(axis=1)]
    frequency = windows.speed[:, None] * windows.wave_number
    low = np.where(windows.used, frequency, np.inf).min(axis=1)
    high = np.where(windows.used, frequency, 0.0).max(axis=1)
    return (low * INSIDE <= peak) & (peak <= high / INSIDE)


def clear_of_noise(windows: Windows, noise: float) -> Windows:
    """Without bins that are no more than noise in half of the windows, and those beyond them; noise in (m/s2)^2/Hz.

    What is left is one stretch of frequencies, the longest one. Where the power falls steeply to noise at its end, the
    upper half of it is left out as well.
    """
    k, some = windows.wave_number, windows.used.any(axis=0)
    over = np.where(windows.used, windows.power / (noise * windows.speed[:, None]), np.nan)
    middle = np.zeros(len(k))
    middle[some] = np.nanmedian(over[:, some], axis=0)
    width = 2 * TAPERS + 1
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(middle, width // 2, mode="edge"), width), axis=1)
    clear = stretches(some & np.greater_equal(smooth, CLEAR))
    kept = np.zeros(len(k), dtype=bool)
    if clear:
        begin, end = max(clear, key=lambda one: one[1] - one[0])
        kept[begin:end] = True
        before = int(np.abs(np.log(k * THIRD / k[end - 1])).argmin())
        if np.flatnonzero(some)[-1] >= end and smooth[before] > STEEP * smooth[end - 1]:
            kept &= k <= k[end - 1] / 2.0
    return windows.without(~kept)


def too_little(windows: Windows) -> str:
    """Why windows cannot be fitted; empty where they can."""
    used = windows.used.any(axis=0)
    if not used.any():
        return "no roughness is clear of noise between the lowest and the highest frequency"
    low, high = windows.wave_number[np.flatnonzero(used)[[0, -1]]]
    if np.log2(high / low) < OCTAVES or np.mean(windows.used.sum(axis=1) >= 2 * TAPERS) < 1.0:
        return f"roughness is clear of noise and smooth only from {1.0 / high:.2g} to {1.0 / low:.2g} m"
    return ""


def beyond_waves(windows: Windows) -> np.ndarray:
    """Bins from half the wave number on at which the power has fallen off a cliff, shape (bins,)."""
    k, there = windows.wave_number, np.flatnonzero(windows.used.any(axis=0))
    power = np.where(windows.used[:, there], np.log(windows.power[:, there]), np.nan)
    level = np.nanmedian(power, axis=0)
    steady = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(level, 1, mode="edge"), 3), axis=1)
    before = np.abs(np.log(k[there] * THIRD / k[there][:, None])).argmin(axis=1)
    fallen = np.flatnonzero(steady[before] - steady > np.log(CLIFF))
    return k > k[there[fallen[0]]] / 2.0 if fallen.size else np.zeros(len(k), dtype=bool)


def knee(likelihood: Likelihood, state: State) -> np.ndarray:
    """Bins beyond the sharpest bend of the common roughness, on its shorter side, shape (bins,)."""
    windows, bends = likelihood.windows, np.abs(likelihood.bends(state))
    sharpest = int(bends.argmax())
    if bends[sharpest] <= KNEE:
        return np.zeros(len(windows.wave_number), dtype=bool)
    log_k, knots = np.log(windows.wave_number), likelihood.knots
    place = sharpest + 1
    if place >= len(knots) // 2:
        return log_k > knots[max(place - 2, 0)]
    return log_k < knots[min(place + 2, len(knots) - 1)]


def lines(likelihood: Likelihood, state: State) -> np.ndarray:
    """Bins that stand out in all windows, and those beside them, shape (bins,)."""
    windows = likelihood.windows
    count = windows.used.sum(axis=0)
    if len(windows.s) < MANY:
        return np.zeros(len(count), dtype=bool)
    ratio = np.where(windows.used, windows.power / likelihood.mean(state), 0.0).sum(axis=0) / np.maximum(count, 1)
    out = (ratio - 1.0) * np.sqrt(TAPERS * count) > LINE
    wide = np.convolve(out, np.ones(2 * BESIDE + 1), mode="same") > 0.0
    return wide & (count > 0)


def doubt(evidence: float, misfit: np.ndarray, far: float) -> str:
    """Why a fit is not to be believed; empty where it is."""
    if misfit.mean() > POOR:
        return f"wheel, track and a smooth roughness do not describe the spectra: chi-square {misfit.mean():.1f} of 1"
    if far > UNLIKELY:
        return "what fits the spectra best has masses, springs or dampers that no wheelset on a track has"
    if evidence < EVIDENCE * len(misfit) + ALONE:
        return "no resonance of the wheelset on its track shows: rigid rails explain the spectra as well"
    return ""


def used_waves(windows: Windows) -> tuple[float, float]:
    """Shortest and longest wavelength in use, m."""
    used = windows.wave_number[windows.used.any(axis=0)]
    return (float(1.0 / used[-1]), float(1.0 / used[0])) if used.size else (np.nan, np.nan)


def nothing(windows: Windows, expected: Common, reason: str) -> Section:
    """What is given where there is nothing to fit."""
    count = len(windows.s)
    none = np.zeros(count, dtype=bool)
    return Section(np.full(count, np.nan), np.full((count, count), np.nan), none, expected, used_waves(windows), reason)
