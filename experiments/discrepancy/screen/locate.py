"""Locate: where the residual is larger than the stated noise, by channel, band, place, speed and regime."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import gamma

from experiments.discrepancy.baseline.frames import REDUNDANCY
from experiments.discrepancy.fit.fitting import Fit, Problem

BANDS = (0.0, 0.8, 2.0, 4.0, 8.0, 16.0, 32.0, 60.0)  # Hz
MISFIT = 1.25  # mean square that the noise model itself may be wrong by
FALSE_SHARE = 0.01  # of the cells that are called significant (Benjamini and Hochberg 1995)
DROPPED = 3  # loudest frames that do not count
CURVED = 1e-4  # 1/m
BENT = 2  # strained nuisances from which these may have been bent to explain what is none,
FAR = 3  # and from which they have: two parts at the end of their tolerance are no fault
LOUD = 2.0  # mean square of a significant cell that no error of the noise model makes up for
OUTRIGHT = 4.9  # deviations of a sensor's own error, from which it is no data sheet's
LONE = 60.0  # nats by which a band of one frame is louder than the same band of the others, from which it is no chance
VERTICAL = ("acceleration_z [m/s2]", "rate_pitch [rad/s]", "displacement [m]")
"""Channels of which that is asked: a flange that touches is one loud frame of the lateral ones (up to 61 nats in 34
healthy recordings, 10 in these)."""


@dataclass(frozen=True)
class Cell:
    """Mean square over the stated noise in one channel and band, and how unlikely it is with nothing wrong."""

    channel: str
    low: float
    high: float
    power: float
    robust: float
    p_value: float
    significant: bool


@dataclass(frozen=True)
class Spot:
    """The frame that stands out most from all others: in which vertical channel and band, and by how much [nats]."""

    channel: str
    low: float
    high: float
    frame: int
    nats: float

    @property
    def alone(self) -> bool:
        """Whether something is there that the other frames do not have."""
        return self.nats > LONE


NOWHERE = Spot("", 0.0, 0.0, 0, 0.0)


@dataclass(frozen=True)
class Located:
    """What remains after the nuisances.

    Attributes
    ----------
    cells : channel by band. map : (k, channels) mean square of each frame. strip : (k,) over all channels, whitened.
    regimes : mean square by regime. surprising : nuisances far from their prior. spot : the frame that stands out most.
    """

    cells: tuple[Cell, ...]
    map: np.ndarray
    strip: np.ndarray
    regimes: dict[str, float]
    surprising: dict[str, float]
    spot: Spot = NOWHERE

    @property
    def significant(self) -> list[Cell]:
        """Cells that are too large to be chance, the largest first."""
        return sorted((cell for cell in self.cells if cell.significant), key=lambda cell: -cell.robust)

    @property
    def worth_looking(self) -> bool:
        """Whether anything asks for an effect."""
        return bool(self.significant or self.surprising)

    @property
    def loud(self) -> list[Cell]:
        """Significant cells beyond what the noise model may be wrong by, the largest first."""
        return [cell for cell in self.significant if cell.robust > LOUD]

    @property
    def bent(self) -> bool:
        """Whether more nuisances are far from their prior than chance would bring there."""
        return len(self.surprising) >= BENT

    @property
    def far(self) -> bool:
        """Whether so many nuisances are far from their prior, or one so far, that what is explained with them is not
        explained.
        """
        return len(self.surprising) >= FAR or any(abs(z) > OUTRIGHT for z in self.surprising.values())

    def plain(self) -> dict[str, Any]:
        """For the verdict."""
        return {
            "cells": [
                {"channel": c.channel, "band [Hz]": [c.low, c.high], "power": round(c.robust, 3)}
                for c in self.significant[:12]
            ],
            "regimes": {name: round(value, 3) for name, value in self.regimes.items()},
            "surprising": {name: round(value, 2) for name, value in self.surprising.items()},
            "spot": {"channel": self.spot.channel, "band [Hz]": [self.spot.low, self.spot.high]}
            | {"section": self.spot.frame, "nats": round(self.spot.nats, 1)},
        }


def locate(problem: Problem, fit: Fit) -> Located:
    """Statistics of the residual over all frames, those held out included."""
    if problem.white is None:
        raise ValueError("state the noise first")
    marginal = problem.white.marginal(problem.measured - fit.stacked)
    heard = np.maximum(problem.white.good.sum(axis=1) * 2 * fit.residual.shape[1], 1)
    strip = (fit.residual**2).sum(axis=(1, 2)) / heard
    cells = _cells(problem, marginal)
    found = zip(problem.forward.nuisances, fit.z.tolist(), strict=True)
    surprising = {one.label: z for one, z in found if abs(z) > one.strained}
    spot = _spot(problem, marginal)
    return Located(tuple(cells), marginal.mean(axis=1), strip, _regimes(problem, strip), surprising, spot)


def _cells(problem: Problem, marginal: np.ndarray) -> list[Cell]:
    frequency = problem.frames.frequencies
    rows: list[tuple[str, float, float, float, float, float]] = []
    for place, channel in enumerate(problem.evidence.channels):
        for low, high in zip(BANDS, BANDS[1:], strict=False):
            inside = (frequency >= low) & (frequency < high)
            if not inside.any():
                continue
            heard = np.isfinite(marginal[:, inside, place]).all(axis=1)
            frames = np.sort(marginal[heard][:, inside, place].mean(axis=1))
            if len(frames) <= 2 * DROPPED:
                continue
            calm = float(frames[:-DROPPED].mean())
            freedom = (len(frames) - DROPPED) * int(inside.sum()) / REDUNDANCY
            p_value = float(gamma.sf(calm / MISFIT, freedom, scale=1.0 / freedom))
            rows.append((channel, low, high, float(frames.mean()), calm, p_value))
    limit = _limit([row[5] for row in rows])
    return [Cell(n, low, high, mean, calm, p, p <= limit) for n, low, high, mean, calm, p in rows]


def _spot(problem: Problem, marginal: np.ndarray) -> Spot:
    """The loudest band of a frame against the median of the others and the stated noise: coefficients of a louder noise
    or of the same, by the likelihood ratio of exponential powers.
    """
    frequency = problem.frames.frequencies
    best = NOWHERE
    for place, channel in enumerate(problem.evidence.channels):
        for low, high in zip(BANDS, BANDS[1:], strict=False):
            inside = (frequency >= low) & (frequency < high)
            heard = np.isfinite(marginal[:, inside, place]).all(axis=1)
            if not (channel.endswith(VERTICAL) and inside.any() and heard.any()):
                continue
            power = np.where(heard, marginal[:, inside, place].mean(axis=1), 0.0)
            times = np.maximum(power / max(1.0, float(np.median(power[heard]))), 1.0)
            frame = int(np.argmax(times))
            nats = float(inside.sum() * (times[frame] - 1.0 - math.log(times[frame])))
            if nats > best.nats:
                best = Spot(channel, low, high, frame, nats)
    return best


def _limit(p_values: list[float]) -> float:
    """Largest p-value that is significant (Benjamini and Hochberg); below zero where none is."""
    ordered = np.sort(p_values)
    allowed = FALSE_SHARE * np.arange(1, len(ordered) + 1) / len(ordered)
    passing = np.flatnonzero(ordered <= allowed)
    return float(ordered[passing[-1]]) if passing.size else -1.0


def _regimes(problem: Problem, strip: np.ndarray) -> dict[str, float]:
    """Mean square by straight, transition, curve; slow and fast; pulled."""
    time, speed, _ = problem.evidence.speed
    at = problem.frames.middles
    here = np.interp(at, time, speed)
    travelled = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    s = problem.forward.registration.start + np.interp(at, time, travelled)
    track = problem.evidence.track
    curvature = np.interp(s, track.s, track.curvature)
    change = np.interp(s, track.s, np.gradient(track.curvature, track.s)) * here
    pulled = np.abs(np.gradient(here, at)) > 0.2 if len(at) > 1 else np.zeros(len(at), bool)
    bent, easing = np.abs(curvature) > CURVED, np.abs(change) > CURVED / 2.0
    masks = {
        "straight": ~bent & ~easing,
        "transition": easing,
        "curve": bent & ~easing,
        "speeding up or braking": pulled,
        "slower half": here < np.median(here) - 0.5,
        "faster half": here > np.median(here) + 0.5,
    }
    return {name: float(strip[mask].mean()) for name, mask in masks.items() if mask.sum() >= 2}
