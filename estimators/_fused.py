"""One plane of the fused estimate: levels of the track's spectra, filter and smoother, uncertainty of every band."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from estimators._bands import Band, response, settled
from estimators._information import Information, deviations, information, wavenumbers
from estimators._planes import System
from estimators._readings import Reading
from estimators._shaping import Noise, Passage, Prior, passage
from estimators._smoother import backward, forward
from estimators._space import Way
from estimators._whittle import fit

FLOOR = 0.007  # of what a sensor typically shows: the least that the linear model is taken to leave as noise
STRUCTURE = 0.015  # of what a sensor shows: standard deviation of what the model leaves out; tuned on straight_erri_low
SPEED_RATIO = 1.5  # between speeds at which uncertainties of bands are computed; in between they are interpolated
LEAST_SPREAD = 1.02  # of the speed: less counts as constant
SHORT = Band(0.0, 70.0)  # m; longer waves are not looked at in what disturbs usually
UNIT_LENGTH = 0.25  # m; a disturbance of size 1 has the acceleration's variance in steps of this length
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
    priors : shapes of the spectra of the track's quantities; their levels are fitted.
    states : how many the vehicle has.
    disturbed : groups of states (rates) that forces push which are not in the model; their sizes are fitted.
    structure : of what a sensor shows: standard deviation of what the model leaves out, coherent with the track.
    start : standard deviation of each state for heights (m) and slopes (rad) of the quantities, at a speed.
    """

    system: Callable[[dict[str, float], float], System]
    vehicle: dict[str, float]
    unknown: dict[str, float]
    readings: list[Reading]
    priors: tuple[Prior, ...]
    states: int
    disturbed: tuple[tuple[int, ...], ...]
    start: Callable[[np.ndarray, np.ndarray, float], np.ndarray]
    structure: float = STRUCTURE

    @property
    def wheelbase(self) -> float:
        """Distance of the wheelsets, m."""
        return 2.0 * self.vehicle["semi_wheelbase"]

    def noise(self, drive: np.ndarray | None = None) -> Noise:
        """Of the readings by their data sheets; `drive` : variance per second that enters the states."""
        columns = [(one.density, one.bias, one.drift, one.drift_time, one.tilt) for one in self.readings]
        density, bias, drift, drift_time, tilt = (np.array(column) for column in zip(*columns, strict=True))
        return Noise(density, bias, drift, drift_time, tilt, np.zeros(self.states) if drive is None else drive)

    def usual(self, speed: float, priors: Sequence[Prior]) -> np.ndarray:
        """Variance per second that enters each disturbed state if its acceleration by each quantity of the track were
        white noise over time, shape (quantities, disturbances, n).
        """
        system, k = self.system(self.vehicle, speed), wavenumbers()
        lead, trail = np.split(system.states(k * speed), 2, axis=2)
        moves = (
            np.abs(lead + trail * np.exp(-1j * k * self.wheelbase)[:, None, None]) ** 2
            * (k * speed)[:, None, None] ** 2
        )
        found = np.zeros((len(priors), len(self.disturbed), self.states))
        for q, prior in enumerate(priors):
            for j, group in enumerate(self.disturbed):
                for state in group:
                    power = moves[:, state, q] * prior.density(k) * response(k, SHORT)
                    found[q, j, state] = np.trapezoid(power * k, np.log(k)) * UNIT_LENGTH / speed
        return found

    def drive(self, speed: float, priors: Sequence[Prior], sizes: np.ndarray) -> np.ndarray:
        """Variance per second that enters each state, shape (n,)."""
        return np.einsum("qjn,j->n", self.usual(speed, priors), sizes**2)

    def bounds(self, speed: float, priors: Sequence[Prior], bands: Sequence[dict[str, Band]]) -> list[dict[str, float]]:
        """Cramer-Rao bound of each band at a speed, m rms: sensor noise alone, the model taken to be right."""
        systems = [self.system(self.vehicle, speed)]
        known = information(systems, priors, self.noise(), speed, self.wheelbase, np.zeros(len(self.readings)))
        return [
            {name: known.rms(bound, band) for name, band in one.items()}
            for bound, one in zip(known.bound.T, bands, strict=True)
        ]

    def information(
        self, speed: float, spacing: float, distance_error: float, priors: Sequence[Prior], sizes: np.ndarray
    ) -> Information:
        """Spectra at a speed, with disturbances of those sizes and the floor under the readings' noise."""
        systems = deviations(lambda p: self.system(p, speed), self.vehicle, self.unknown)
        scales = np.array([np.hypot(one.scale, self.structure) for one in self.readings])
        noise = self.noise(self.drive(speed, priors, sizes))
        plain = information(systems, priors, noise, speed, self.wheelbase, scales, distance_error)
        floor = np.array([plain.rms(one) for one in plain.readings.T]) * FLOOR
        raised = noise._replace(density=np.sqrt(noise.density**2 + 2 * floor**2 * spacing / speed))
        return information(systems, priors, raised, speed, self.wheelbase, scales, distance_error)


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

    def on(self, s: np.ndarray) -> "Fused":
        """The same at other places."""
        band_std = {name: np.interp(s, self.s, std) for name, std in self.band_std.items()}
        values, std = CubicSpline(self.s, self.values)(s), np.interp(s, self.s, self.std)
        return self._replace(s=s, values=values, std=std, band_std=band_std, seen=np.interp(s, self.s, self.seen) > 0.5)

    def without(self, places: np.ndarray) -> "Fused":
        """The same, NaN at some places and with them in the bands that reach there."""
        return self._replace(values=np.where(places, np.nan, self.values))

    def with_share(self, other: "Fused", share: float) -> "Fused":
        """This plus a share of another quantity, whose errors are independent."""
        band_std = {name: np.hypot(std, share * other.band_std[name]) for name, std in self.band_std.items()}
        std = np.hypot(self.std, share * other.std)
        return self._replace(values=self.values + share * other.values, std=std, band_std=band_std)


def fuse(plane: Plane, way: Way, bands: Sequence[dict[str, Band]], distance_error: float) -> list[Fused]:
    """Smooth one plane over the whole record; one result for each quantity, with its bands."""
    levels, sizes = fit_levels(plane, way)
    priors = [prior.scaled(float(level)) for prior, level in zip(plane.priors, levels, strict=True)]
    low, high = float(way.speed.min()), float(way.speed.max())
    count = int(np.ceil(np.log(high / low) / np.log(SPEED_RATIO))) + 1
    speeds = np.geomspace(low, high, count) if high > low * LEAST_SPREAD else np.array([low])
    known = [plane.information(float(one), way.spacing, distance_error, priors, sizes) for one in speeds]
    noise = _per_step(plane, way, speeds, known)
    height = np.sqrt([float(prior.stationary()[0, 0]) for prior in priors])
    slope = np.sqrt([_slope_variance(prior) for prior in priors])
    drives = np.stack([plane.drive(float(one), priors, sizes) for one in speeds])

    def drive(speed: float) -> np.ndarray:
        return np.array([np.interp(np.log(speed), np.log(speeds), column) for column in drives.T])

    made = passage(
        lambda speed: plane.system(plane.vehicle, speed), priors, plane.noise(), drive, way.speed, way.spacing,
        round(plane.wheelbase / way.spacing), plane.start(height, slope, float(np.median(way.speed))),
    )  # fmt: skip
    values, variance = smooth(made, way, plane.readings, noise)
    seen = way.valid & np.any([np.isfinite(one.values) for one in plane.readings], axis=0)
    edges = {band: None for one in bands for band in one.values()}
    local = {
        band: _between(way.speed, speeds, [one.local(values, way.spacing, band) for one in known]) for band in edges
    }
    bounds = plane.bounds(float(np.median(way.speed)), priors, bands)
    found = []
    for number, own in enumerate(bands):
        stationary = [one.rms(one.bound[:, number]) ** 2 for one in known]
        wrong = [one.rms(one.with_model_error[:, number]) ** 2 for one in known]
        wrong = _over(way.speed, speeds, [a - b for a, b in zip(wrong, stationary, strict=True)])
        excess = np.maximum(variance[:, number] - BEYOND * _over(way.speed, speeds, stationary), 0.0)
        band_std = {}
        for name, band in own.items():
            usual = _over(way.speed, speeds, [one.rms(one.bound[:, number], band) ** 2 for one in known])
            usual += local[band][:, number]
            band_std[name] = np.sqrt(usual + np.where(_near_gap(seen, way.spacing, band.longest), excess, 0.0))
        std = np.sqrt(variance[:, number] + wrong)
        found.append(Fused(way.s, values[:, number], std, band_std, seen, float(levels[number]), bounds[number]))
    return found


def smooth(made: Passage, way: Way, readings: list[Reading], noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed track under the leading wheelset and its variance, shapes (n, q); `noise` : variances, (n, m)."""
    place = made.place(way.speed)
    measured = np.stack([one.values for one in readings], axis=1)
    turning = np.stack([one.turning for one in readings], axis=1)
    x, P = np.zeros(len(made.covariance)), made.covariance.copy()
    filtered = forward(made.steps, place, measured, noise, turning, way.valid, x, P)
    values, variance = backward(made.steps, place, turning, filtered)
    return values, np.maximum(variance, 0.0)


def fit_levels(plane: Plane, way: Way) -> tuple[np.ndarray, np.ndarray]:
    """Levels of the track's spectra and sizes of the disturbances, by Whittle's likelihood of the readings."""
    speed = float(np.median(way.speed[way.valid])) if way.valid.any() else float(np.median(way.speed))
    units = [prior.scaled(1.0) for prior in plane.priors]
    system = plane.system(plane.vehicle, speed)
    model = information([system] * 2, units, plane.noise(), speed, plane.wheelbase, np.zeros(len(plane.readings)))
    pushed = system.from_states(model.wavenumber * speed)
    disturbances = np.einsum("qjn,kmn,kln->qjkml", plane.usual(speed, units) * (speed / np.pi), pushed, pushed.conj())
    return fit(plane.readings, way, speed, model, disturbances, [prior.level for prior in plane.priors])


def _per_step(plane: Plane, way: Way, speeds: np.ndarray, known: list[Information]) -> np.ndarray:
    """Variance of each reading at each step, shape (n, m): white noise over a step, and the floor."""
    columns = []
    for number, one in enumerate(plane.readings):
        typical = [info.rms(info.readings[:, number]) ** 2 for info in known]
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
    """Courses over the places for each of `speeds`, each place interpolated to its own speed; shape as one."""
    place = np.interp(np.log(speed), np.log(speeds), np.arange(len(speeds), dtype=float))
    low = np.minimum(place.astype(int), max(len(speeds) - 2, 0))
    high, at, stacked = np.minimum(low + 1, len(speeds) - 1), np.arange(len(speed)), np.stack(courses)
    share = (place - low)[:, None]
    return stacked[low, at] + share * (stacked[high, at] - stacked[low, at])
