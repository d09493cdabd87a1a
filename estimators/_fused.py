"""One plane of the fused estimate: level of the track's spectrum, filter and smoother, uncertainty of every band."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import get_window

from estimators._bands import Band, settled, stretches
from estimators._information import Information, deviations, information
from estimators._planes import System
from estimators._readings import Reading
from estimators._shaping import Noise, Passage, Prior, passage
from estimators._smoother import backward, forward
from estimators._space import Way

FLOOR = 0.007  # of what a sensor typically shows: the least that the linear model is trusted not to explain
STRUCTURE = 0.015  # of what a sensor shows: standard deviation of what the model leaves out; tuned on straight_erri_low
SPEED_RATIO = 1.5  # between speeds at which uncertainties of bands are computed; in between they are interpolated
FITTED = (2.5, 60.0)  # m; wavelengths from which the level of the spectrum is found
LEAST_SPREAD = 1.02  # of the speed: less counts as constant
SHORTEST_FIT = 256  # steps of the grid
LEVELS = (-22.0, -9.0)  # natural logarithm of the level in m rad: 3e-10 to 1e-4; ERRI's lie at -15
BEYOND = 1.5  # variance over the stationary one from which on a place counts as badly seen


@dataclass(frozen=True)
class Plane:
    """A plane of the vehicle with what is read of it.

    Attributes
    ----------
    system : from parameters and speed (m/s) to the linear model with the readings as outputs.
    vehicle : nominal parameters.
    unknown : relative standard deviations of parameters.
    readings : in the order of the outputs.
    prior : shape of the track's spectrum; its level is fitted.
    drive : variance per second that enters each state, at a speed.
    start : standard deviation of each state for an irregularity of 1 m and a slope of 1 rad, at a speed.
    """

    system: Callable[[dict[str, float], float], System]
    vehicle: dict[str, float]
    unknown: dict[str, float]
    readings: list[Reading]
    prior: Prior
    drive: np.ndarray
    start: Callable[[float, float, float], np.ndarray]

    @property
    def wheelbase(self) -> float:
        """Distance of the wheelsets, m."""
        return 2.0 * self.vehicle["semi_wheelbase"]

    def noise(self) -> Noise:
        """Of the readings by their data sheets."""
        columns = [(one.density, one.bias, one.drift, one.drift_time, one.tilt) for one in self.readings]
        density, bias, drift, drift_time, tilt = (np.array(column) for column in zip(*columns, strict=True))
        return Noise(density, bias, drift, drift_time, tilt, self.drive)

    def bounds(self, speed: float, prior: Prior, bands: dict[str, Band]) -> dict[str, float]:
        """Cramer-Rao bound of each band at a speed, m rms: sensor noise alone, the model taken to be right."""
        systems = [self.system(self.vehicle, speed)]
        known = information(systems, prior, self.noise(), speed, self.wheelbase, np.zeros(len(self.readings)))
        return {name: known.rms(known.bound, band) for name, band in bands.items()}

    def information(self, speed: float, spacing: float, distance_error: float, prior: Prior) -> Information:
        """Spectra at a speed with the floor under the readings' noise."""
        systems = deviations(lambda p: self.system(p, speed), self.vehicle, self.unknown)
        scales = np.array([np.hypot(one.scale, STRUCTURE) for one in self.readings])
        noise = self.noise()
        plain = information(systems, prior, noise, speed, self.wheelbase, scales, distance_error)
        floor = np.array([plain.rms(np.abs(one) ** 2 * plain.track) for one in plain.H.T]) * FLOOR
        raised = noise._replace(density=np.sqrt(noise.density**2 + 2 * floor**2 * spacing / speed))
        return information(systems, prior, raised, speed, self.wheelbase, scales, distance_error)


class Fused(NamedTuple):
    """One quantity of the track over the places of the leading wheelset, on the internal grid; shapes (n,).

    Attributes
    ----------
    s : distance of the bogie's centre when the leading wheelset was there, m.
    values, std : m.
    band_std : of each band by name, m.
    seen : whether any sensor gave anything.
    level : of the fitted spectrum, m rad.
    bounds : Cramer-Rao bound of each band at the median speed, m rms.
    """

    s: np.ndarray
    values: np.ndarray
    std: np.ndarray
    band_std: dict[str, np.ndarray]
    seen: np.ndarray
    level: float
    bounds: dict[str, float]

    def raised(self, by: np.ndarray, error: np.ndarray, shares: dict[str, float]) -> "Fused":
        """The same with something added to the values, and with an `error` (m, standard deviation) of which `shares`
        fall into the bands.
        """
        band_std = {name: np.hypot(std, shares.get(name, 1.0) * error) for name, std in self.band_std.items()}
        return self._replace(values=self.values + by, std=np.hypot(self.std, error), band_std=band_std)

    def without(self, places: np.ndarray) -> "Fused":
        """The same, NaN at some places and with them in the bands that reach there."""
        return self._replace(values=np.where(places, np.nan, self.values))

    def with_share(self, other: "Fused", share: float) -> "Fused":
        """This plus a share of another quantity, whose errors are independent."""
        band_std = {name: np.hypot(std, share * other.band_std[name]) for name, std in self.band_std.items()}
        std = np.hypot(self.std, share * other.std)
        return self._replace(values=self.values + share * other.values, std=std, band_std=band_std)


def fuse(plane: Plane, way: Way, bands: dict[str, Band], distance_error: float) -> Fused:
    """Smooth one plane over the whole record."""
    prior = plane.prior.scaled(fit_level(plane, way, distance_error))
    low, high = float(way.speed.min()), float(way.speed.max())
    count = int(np.ceil(np.log(high / low) / np.log(SPEED_RATIO))) + 1
    speeds = np.geomspace(low, high, count) if high > low * LEAST_SPREAD else np.array([low])
    known = [plane.information(float(one), way.spacing, distance_error, prior) for one in speeds]
    noise = _per_step(plane, way, speeds, known)
    variances = prior.stationary()
    slope = np.sqrt(_slope_variance(prior))
    start = plane.start(float(np.sqrt(variances[0, 0])), float(slope), float(np.median(way.speed)))
    made = passage(
        lambda speed: plane.system(plane.vehicle, speed), prior, plane.noise(), way.speed, way.spacing,
        round(plane.wheelbase / way.spacing), start,
    )  # fmt: skip
    values, variance = smooth(made, way, plane.readings, noise)
    stationary = _over(way.speed, speeds, [one.rms(one.bound) ** 2 for one in known])
    wrong = _over(way.speed, speeds, [one.rms(one.with_model_error) ** 2 - one.rms(one.bound) ** 2 for one in known])
    excess = np.maximum(variance - BEYOND * stationary, 0.0)
    seen = way.valid & np.any([np.isfinite(one.values) for one in plane.readings], axis=0)
    band_std = {}
    for name, band in bands.items():
        usual = _over(way.speed, speeds, [one.rms(one.bound, band) ** 2 for one in known])
        usual += _between(way.speed, speeds, [one.local(values, way.spacing, band) for one in known])
        band_std[name] = np.sqrt(usual + np.where(_near_gap(seen, way.spacing, band.longest), excess, 0.0))
    bounds = plane.bounds(float(np.median(way.speed)), prior, bands)
    return Fused(way.s, values, np.sqrt(variance + wrong), band_std, seen, prior.level, bounds)


def smooth(made: Passage, way: Way, readings: list[Reading], noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed irregularity under the leading wheelset and its variance, shapes (n,); `noise` : variances, (n, m)."""
    place = made.place(way.speed)
    measured = np.stack([one.values for one in readings], axis=1)
    turning = np.stack([one.turning for one in readings], axis=1)
    x, P = np.zeros(len(made.covariance)), made.covariance.copy()
    filtered = forward(made.steps, place, measured, noise, turning, way.valid, x, P, made.watched)
    values, variance = backward(made.steps, place, turning, filtered, made.watched)
    return values, np.maximum(variance, 0.0)


def fit_level(plane: Plane, way: Way, distance_error: float) -> float:
    """Level of the track's spectrum by Whittle's likelihood (1953) of the gyros' periodograms."""
    speed = float(np.median(way.speed[way.valid])) if way.valid.any() else float(np.median(way.speed))
    unit = replace(plane.prior, level=1.0)
    model = plane.information(speed, way.spacing, distance_error, unit)
    noise = plane.noise()
    parts = []
    for number, one in enumerate(plane.readings):
        longest = max(stretches(np.isfinite(one.values)), key=lambda ends: ends[1] - ends[0], default=(0, 0))
        if one.output.kind != "rate" or longest[1] - longest[0] < SHORTEST_FIT:
            continue
        piece = slice(*longest)
        k, density = _periodogram(one.values[piece] * speed / way.speed[piece], way.spacing)
        inside = (k > 2 * np.pi / FITTED[1]) & (k < 2 * np.pi / FITTED[0])
        gain = np.interp(k[inside], model.wavenumber, np.abs(model.H[:, number]) ** 2)
        white = np.full(int(inside.sum()), noise.density[number] ** 2 * speed / (2 * np.pi))
        parts.append((density[inside], gain * unit.density(k[inside]), white))
    if not parts:
        return plane.prior.level

    def unlikely(logarithm: float) -> float:
        total = 0.0
        for density, signal, white in parts:
            expected = np.exp(logarithm) * signal + white
            total += float(np.sum(np.log(expected) + density / expected))
        return total

    found: Any = minimize_scalar(unlikely, bounds=LEVELS, method="bounded", options={"xatol": 1e-3})
    return float(np.exp(found.x))


def _periodogram(values: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Wavenumbers in rad/m and one-sided density per rad/m, Hann window."""
    window = np.asarray(get_window("hann", len(values)))
    spectrum = np.fft.rfft((values - values.mean()) * window)
    density = np.abs(spectrum) ** 2 * spacing / np.sum(window**2) / np.pi
    return 2 * np.pi * np.fft.rfftfreq(len(values), spacing), density


def _per_step(plane: Plane, way: Way, speeds: np.ndarray, known: list[Information]) -> np.ndarray:
    """Variance of each reading at each step, shape (n, m): white noise over a step, and the floor."""
    columns = []
    for number, one in enumerate(plane.readings):
        typical = [info.rms(np.abs(info.H[:, number]) ** 2 * info.track) ** 2 for info in known]
        white = one.density**2 * way.speed / (2.0 * way.spacing)
        columns.append(white + FLOOR**2 * _over(way.speed, speeds, typical))
    return np.stack(columns, axis=1)


def _near_gap(seen: np.ndarray, spacing: float, reach: float) -> np.ndarray:
    """Places within `reach` m of one that no sensor saw; the ends of the record are none."""
    inside = np.flatnonzero(seen)
    if not inside.size:
        return np.ones(len(seen), dtype=bool)
    whole = seen.copy()
    whole[: inside[0]] = whole[inside[-1] + 1 :] = True
    margin = int(np.ceil(reach / spacing)) + 1
    return ~settled(np.pad(whole, margin, constant_values=True), spacing, reach)[margin:-margin]


def _slope_variance(prior: Prior) -> float:
    """Variance of the irregularity's slope, rad^2."""
    P, A = prior.stationary(), prior.matrix[0]
    return float(A @ P @ A)


def _over(speed: np.ndarray, speeds: np.ndarray, values: list[float]) -> np.ndarray:
    """Interpolated over the logarithm of the speed."""
    return np.interp(np.log(speed), np.log(speeds), values)


def _between(speed: np.ndarray, speeds: np.ndarray, courses: list[np.ndarray]) -> np.ndarray:
    """Courses over the places for each of `speeds`, each place interpolated to its own speed; shape (n,)."""
    place = np.interp(np.log(speed), np.log(speeds), np.arange(len(speeds), dtype=float))
    low = np.minimum(place.astype(int), max(len(speeds) - 2, 0))
    high, at, stacked = np.minimum(low + 1, len(speeds) - 1), np.arange(len(speed)), np.stack(courses)
    return stacked[low, at] + (place - low) * (stacked[high, at] - stacked[low, at])
