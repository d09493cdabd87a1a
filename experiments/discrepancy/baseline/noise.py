"""Noise: what remains between model and measurement when nothing is wrong, per frame and frequency, across channels.

The sum of the sensors' data-sheet noise, the track measurement's errors as the model passes them on to all channels
(a full matrix, from perturbed runs of the model), and a few per cent of the predicted signal for the model itself.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import OVERRUN, Forward, Prediction
from experiments.discrepancy.baseline.frames import REDUNDANCY, Frames, stack
from experiments.discrepancy.baseline.parallel import in_parallel
from railsim.effects.interface import Effect
from railsim.sensors.interface import Sensor
from railsim.track.ends import continued
from railsim.track.track import Track

MODEL_ERROR = 0.03  # of the predicted amplitude, each channel on its own; illustrative
LEVELS = (0.5, 1.8)  # true over stated density of a sensor's noise; a third in amplitude to both sides
DOMINANT = 0.6  # share of the stated density that is the sensor's own, from which a bin says its level
FEWEST = 12  # bins in which it does so in most frames
PERTURBED = 6  # runs with perturbed tracks
SEED = 20110901  # of these and of the nominal track's survey: always the same, so that evidence can be compared
SPEED_WIDTH = 0.08  # relative speed over which frames share the propagated track error
BINS = 2  # to each side, over which predicted power is averaged


@dataclass(frozen=True)
class Whitener:
    """Turns coefficients (k, f, c) into real numbers that have unit variance when only the stated noise is there.

    Attributes
    ----------
    inverse : (k, f, c, c) L^-1 of S = L L^H. deviation : (k, f, c) square roots of the diagonal of S.
    good : (k, c) whether a channel has no lost sample in a frame. log_determinant : (k,) of S, summed over f.
    """

    inverse: np.ndarray
    deviation: np.ndarray
    good: np.ndarray
    log_determinant: np.ndarray

    def __call__(self, coefficients: np.ndarray) -> np.ndarray:
        """(k, f, 2 c): real and imaginary parts of L^-1 c, each of unit variance; 0 Hz has real parts only."""
        return split(self.complex(coefficients))

    def complex(self, coefficients: np.ndarray) -> np.ndarray:
        """(k, f, c) L^-1 c before it is split."""
        clean = np.where(self.good[:, None, :], coefficients, 0.0)
        return np.matmul(self.inverse, clean[..., None])[..., 0]

    def marginal(self, coefficients: np.ndarray) -> np.ndarray:
        """(k, f, c) mean square of each channel's coefficient over its own stated noise; NaN where lost."""
        scaled = coefficients / self.deviation
        power = np.abs(scaled) ** 2
        return np.where(self.good[:, None, :], power, np.nan)

    def mean_square(self, residual: np.ndarray, frames: np.ndarray) -> float:
        """Mean square of a whitened residual (k, f, 2 c) over some frames, lost ones not counted; NaN of none."""
        counted = self.good[frames].sum() * 2 * residual.shape[1]
        return float(np.sum(residual[frames] ** 2) / counted) if counted else float("nan")


def split(white: np.ndarray) -> np.ndarray:
    """Complex coefficients of unit mean square as real ones of unit variance."""
    out = np.concatenate([np.real(white), np.imag(white)], axis=-1) * np.sqrt(2.0)
    out[:, 0, :] /= np.sqrt(2.0)
    return out


def whitener(covariance: np.ndarray, measured: np.ndarray) -> Whitener:
    """From S (k, f, c, c) and the measured coefficients, whose NaN mark lost frames."""
    good = np.array(np.isfinite(measured).all(axis=1))
    both = (good[:, :, None] & good[:, None, :])[:, None]
    alone = np.eye(covariance.shape[-1])
    covariance = np.where(both, covariance, alone)
    factor = np.linalg.cholesky(covariance)
    inverse = np.linalg.inv(factor)
    diagonal = np.real(np.diagonal(factor, axis1=-2, axis2=-1))
    deviation = np.sqrt(np.real(np.diagonal(covariance, axis1=-2, axis2=-1)))
    return Whitener(inverse, deviation, good, 2.0 * np.log(diagonal).sum(axis=(1, 2)) / REDUNDANCY)


def covariance_of(
    evidence: Evidence,
    frames: Frames,
    predicted: np.ndarray,
    propagated: np.ndarray | None,
    level: np.ndarray | None = None,
) -> np.ndarray:
    """S (k, f, c, c) [channel^2/Hz] for the predicted coefficients (k, f, c); `level` (c,): of the sensors' own
    density, over that of their data sheets.
    """
    k, f = frames.shape
    diagonal = model_power(predicted) * MODEL_ERROR**2
    for place, name in enumerate(evidence.channels):
        own = sensor_density(_owner(evidence.sensors, name), frames)
        diagonal[:, :, place] += own if level is None else level[place] * own
    total = np.zeros((k, f, len(evidence.channels), len(evidence.channels)), dtype=complex)
    index = np.arange(len(evidence.channels))
    total[..., index, index] = diagonal
    return total if propagated is None else total + propagated


def model_power(predicted: np.ndarray) -> np.ndarray:
    """Predicted power (k, f, c), averaged over neighbouring frequencies and frames, without the constant part."""
    power = np.abs(predicted - predicted.mean(axis=0, where=np.isfinite(predicted))) ** 2
    count = power.shape[1]
    kernel = np.ones(2 * BINS + 1)
    weight = np.convolve(np.ones(count), kernel, mode="same")
    smooth = np.apply_along_axis(lambda row: np.convolve(row, kernel, mode="same"), 1, power) / weight[:, None]
    before, after = np.roll(smooth, 1, axis=0), np.roll(smooth, -1, axis=0)
    before[0], after[-1] = smooth[0], smooth[-1]
    return 0.5 * smooth + 0.25 * (before + after)


def sensor_density(sensor: Sensor, frames: Frames) -> np.ndarray:
    """(f,) one-sided density [channel^2/Hz] of white noise, resolution and slow drift, as the frames see it."""
    sheet = sensor.errors
    white = sheet.noise_density**2 + sheet.resolution**2 / 6.0 / sensor.rate
    bins = frames.frequencies * frames.length
    drift = sheet.bias_instability**2
    leaked = 1.62 * frames.length * drift / (4.0 * bins**2 - 1.0) ** 2
    tau = sheet.bias_correlation_time
    own = 4.0 * drift * tau / (1.0 + (2.0 * np.pi * np.maximum(frames.frequencies, 0.5 / frames.length) * tau) ** 2)
    return white + leaked + own


def noise_level(
    evidence: Evidence, frames: Frames, white: Whitener, residual: np.ndarray, level: np.ndarray | None = None
) -> np.ndarray:
    """(c,) density of each sensor's noise over that of its data sheet, where it dominates the residual (k, f, c).

    Data sheets give typical values: the level is a nuisance within `LEVELS`. A sensor's noise is in all bins and all
    frames: medians say how much, whatever a resonance or an impact adds to some of them. `level` is the one that
    `white` was made with (one if None); it stays where nothing says more.
    """
    found = np.ones(len(evidence.channels)) if level is None else level.copy()
    for place, name in enumerate(evidence.channels):
        own = found[place] * sensor_density(_owner(evidence.sensors, name), frames)
        share = own / white.deviation[:, :, place] ** 2
        counts = (share > DOMINANT) & white.good[:, None, place]
        often = counts.mean(axis=0) > 0.5
        if often.sum() >= FEWEST:
            power = np.abs(residual[:, :, place] / white.deviation[:, :, place]) ** 2
            spectrum = np.nanmedian(np.where(counts, power, np.nan)[:, often], axis=0)
            seen = float(np.median(spectrum)) / math.log(2.0)  # |c|^2 of a complex Gaussian is exponential
            typical = float(share[:, often][counts[:, often]].mean())
            found[place] = np.clip(found[place] * (seen - (1.0 - typical)) / typical, *LEVELS)
    return found


def propagated_track_error(
    forward: Forward,
    frames: Frames,
    z: np.ndarray,
    effects: Sequence[Effect],
    base: Prediction,
    tracks: Sequence[Track],
) -> np.ndarray | None:
    """(k, f, c, c) cross-spectral matrix that the track measurement's errors cause, None where they are nothing.

    Differences between runs on perturbed and on the measured track, averaged over runs and frames of like speed.
    """
    evidence = forward.evidence
    if not any(evidence.track_errors.model_dump().values()):
        return None

    def difference(track: Track) -> np.ndarray:
        prediction = forward.but(track=track).predict(z, effects)
        change = {name: prediction[name] - base[name] for name in evidence.channels}
        return stack(frames, evidence.channels, change, evidence.rates)

    found = in_parallel(difference, tracks)
    outer = np.mean([np.matmul(d[..., :, None], d[..., None, :].conj()) for d in found], axis=0)
    speed = np.interp(frames.middles, evidence.speed[0], evidence.speed[1])
    apart = np.log(speed[:, None] / speed[None, :]) / SPEED_WIDTH
    weight = np.exp(-0.5 * apart**2)
    weight /= weight.sum(axis=1, keepdims=True)
    k, f, c, _ = outer.shape
    return (weight @ outer.reshape(k, -1)).reshape(k, f, c, c)


def perturbed_tracks(evidence: Evidence, seed: int, count: int) -> list[Track]:
    """Tracks as likely as any other given the measured one; the same for the same seed."""
    rng = np.random.default_rng(seed)
    return [continued(evidence.surveyed.drawn(rng), OVERRUN) for _ in range(count)]


def _owner(sensors: Sequence[Sensor], channel: str) -> Sensor:
    return next(sensor for sensor in sensors if channel in sensor.channels())
