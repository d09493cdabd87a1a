"""One plane of the fused estimate: levels of the track's spectra, filter and smoother, uncertainty of every band."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from estimators.filters.delay_line_smoother import backward, forward
from estimators.filters.information import Information, deviations, information, responses, spectra, wavenumbers
from estimators.filters.track_spectrum import Noise, Passage, TrackSpectrum, passage
from estimators.signals.bands import Band, response, settled
from estimators.speed.odometry import Odometry
from estimators.track.observations import Observation
from estimators.track.whittle import fit
from estimators.vehicle.state_space import System

FLOOR = 0.007  # of what a sensor typically shows: the least that the linear model is taken to leave as noise
STRUCTURE = 0.015  # of what a sensor shows: standard deviation of what the model leaves out; tuned on straight_erri_low
SPEED_RATIO = 1.5  # between speeds at which uncertainties of bands are computed; in between they are interpolated
LEAST_SPREAD = 1.02  # of the speed: less counts as constant
SHORT = Band(0.0, 70.0)  # m; longer waves are not looked at in what disturbs usually
UNIT_LENGTH = 0.25  # m; a disturbance of size 1 has the acceleration's variance in steps of this length
BEYOND = 1.5  # variance over the stationary one from which on a place counts as badly seen


class TrackRegime(NamedTuple):
    """A kind of place, where the vehicle or what disturbs it is another.

    Attributes
    ----------
    changes : parameters that differ there.
    unknown : relative standard deviations of parameters beside those of the plane.
    sized_as : number of the kind whose disturbances are fitted for both together.
    """

    changes: Mapping[str, float] = MappingProxyType({})
    unknown: Mapping[str, float] = MappingProxyType({})
    sized_as: int = 0


@dataclass(frozen=True)
class Plane:
    """A plane of the vehicle with what is read of it.

    Attributes
    ----------
    system : from parameters and speed (m/s) to the linear model with the readings as outputs.
    vehicle : nominal parameters.
    unknown : relative standard deviations of parameters.
    observations : in the order of the outputs.
    priors : shapes of the spectra of the track's quantities; their levels are fitted.
    states : how many the vehicle has.
    disturbed : groups of states (rates) that forces push which are not in the model; their sizes are fitted.
    regimes, kind : what kinds of places there are, and the number of each place's, shape (n,).
    structure : of what a sensor shows: standard deviation of what the model leaves out, coherent with the track.
    start : standard deviation of each state for heights (m) and slopes (rad) of the quantities, at a speed.
    """

    system: Callable[[dict[str, float], float], System]
    vehicle: dict[str, float]
    unknown: dict[str, float]
    observations: list[Observation]
    priors: tuple[TrackSpectrum, ...]
    states: int
    disturbed: tuple[tuple[int, ...], ...]
    start: Callable[[np.ndarray, np.ndarray, float], np.ndarray]
    regimes: tuple[TrackRegime, ...] = (TrackRegime(),)
    kind: np.ndarray | None = None
    structure: float = STRUCTURE

    @cached_property
    def _responses(self) -> dict[tuple[float, float], tuple[System, np.ndarray, np.ndarray]]:
        """What `information` has computed already, by speed and error of distance."""
        return {}

    @cached_property
    def _powers(self) -> dict[float, np.ndarray]:
        """What `usual` has computed already, by speed."""
        return {}

    @cached_property
    def _at(self) -> dict[int, "Plane"]:
        return {}

    def at(self, number: int) -> "Plane":
        """The same as it is at one kind of place."""
        if number not in self._at:
            regime = self.regimes[number]
            vehicle, unknown = self.vehicle | dict(regime.changes), self.unknown | dict(regime.unknown)
            self._at[number] = (
                replace(self, vehicle=vehicle, unknown=unknown) if regime.changes or regime.unknown else self
            )
        return self._at[number]

    @property
    def wheelbase(self) -> float:
        """Distance of the wheelsets, m."""
        return 2.0 * self.vehicle["semi_wheelbase"]

    def only(self, names: Sequence[str]) -> "Plane":
        """The same with the readings of some channels."""
        chosen = [number for number, one in enumerate(self.observations) if one.name in names]
        observations = [self.observations[number] for number in chosen]
        return replace(self, system=lambda p, speed: self.system(p, speed).only(chosen), observations=observations)

    def noise(self, drive: np.ndarray | None = None) -> Noise:
        """Of the readings by their data sheets; `drive` : variance per second that enters the states."""
        columns = [(one.density, one.bias, one.drift, one.drift_time, one.tilt) for one in self.observations]
        density, bias, drift, drift_time, tilt = (np.array(column) for column in zip(*columns, strict=True))
        return Noise(density, bias, drift, drift_time, tilt, np.zeros(self.states) if drive is None else drive)

    def usual(self, speed: float, priors: Sequence[TrackSpectrum]) -> np.ndarray:
        """Variance per second that enters each disturbed state if its acceleration by each quantity of the track were
        white noise over time, shape (quantities, disturbances, n); `priors` : those of the plane at any level.
        """
        units = self._unit_powers(speed)
        levels = np.array([prior.amplitude / unit.amplitude for prior, unit in zip(priors, self.priors, strict=True)])
        return levels[:, None, None] * units

    def _unit_powers(self, speed: float) -> np.ndarray:
        """`usual` for the plane's own priors."""
        if speed in self._powers:
            return self._powers[speed]
        system, k = self.system(self.vehicle, speed), wavenumbers()
        lead, trail = np.split(system.states(k * speed), 2, axis=2)
        moves = (
            np.abs(lead + trail * np.exp(-1j * k * self.wheelbase)[:, None, None]) ** 2
            * (k * speed)[:, None, None] ** 2
        )
        powers = np.zeros((len(self.priors), len(self.disturbed), self.states))
        for q, prior in enumerate(self.priors):
            for j, group in enumerate(self.disturbed):
                for state in group:
                    power = moves[:, state, q] * prior.density(k) * response(k, SHORT)
                    powers[q, j, state] = np.trapezoid(power * k, np.log(k)) * UNIT_LENGTH / speed
        self._powers[speed] = powers
        return powers

    def drive(self, speed: float, priors: Sequence[TrackSpectrum], sizes: np.ndarray) -> np.ndarray:
        """Variance per second that enters each state, shape (n,)."""
        return np.einsum("qjn,j->n", self.usual(speed, priors), sizes**2)

    def bounds(
        self, speed: float, priors: Sequence[TrackSpectrum], bands: Sequence[dict[str, Band]]
    ) -> list[dict[str, float]]:
        """Cramer-Rao bound of each band at a speed, m rms: sensor noise alone, the model taken to be right."""
        system = self.system(self.vehicle, speed)
        known = information([system], priors, self.noise(), speed, self.wheelbase, np.zeros(len(self.observations)))
        return [
            {name: known.rms(bound, band) for name, band in one.items()}
            for bound, one in zip(known.bound.T, bands, strict=True)
        ]

    def information(
        self,
        speed: float,
        spacing: float,
        distance_error: float,
        priors: Sequence[TrackSpectrum],
        sizes: np.ndarray | None,
    ) -> Information:
        """Spectra at a speed, with disturbances of those sizes and the readings' floor; neither where None."""
        key = (speed, distance_error)
        if key not in self._responses:
            systems = deviations(lambda p: self.system(p, speed), self.vehicle, self.unknown)
            scales = np.array([np.hypot(one.scale, self.structure) for one in self.observations])
            self._responses[key] = systems[0], *responses(systems, speed, self.wheelbase, scales, distance_error)
        system, H, wrong = self._responses[key]
        noise = self.noise(None if sizes is None else self.drive(speed, priors, sizes))
        plain = spectra(H, wrong, system, priors, noise, speed)
        if sizes is None:
            return plain
        floor = FLOOR * np.array([plain.rms(one) for one in plain.readings.T])
        return replace(plain, noise=plain.noise + np.diag(floor**2 * spacing / np.pi))


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
    hidden : places of which nothing is said.
    """

    s: np.ndarray
    values: np.ndarray
    std: np.ndarray
    band_std: dict[str, np.ndarray]
    seen: np.ndarray
    level: float
    bounds: dict[str, float]
    hidden: np.ndarray

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
        seen, hidden = (np.interp(s, self.s, one) > 0.5 for one in (self.seen, self.hidden))
        return Fused(s, values, std, band_std, seen, self.level, self.bounds, hidden)

    def without(self, hidden: np.ndarray) -> "Fused":
        """The same with nothing said where `hidden`, nor of the bands that reach there."""
        return self._replace(hidden=self.hidden | hidden)

    def with_share(self, other: "Fused", share: float) -> "Fused":
        """This plus a share of another quantity, whose errors are independent."""
        band_std = {name: np.hypot(std, share * other.band_std[name]) for name, std in self.band_std.items()}
        std = np.hypot(self.std, share * other.std)
        return self._replace(values=self.values + share * other.values, std=std, band_std=band_std)


def fuse(plane: Plane, odometry: Odometry, bands: Sequence[dict[str, Band]], distance_error: float) -> list[Fused]:
    """Smooth one plane over the whole record; one result for each quantity, with its bands."""
    kind = np.zeros(len(odometry.s), dtype=int) if plane.kind is None else plane.kind
    levels, sizes = fit_levels(plane, odometry, kind, distance_error)
    priors = [prior.scaled(float(level)) for prior, level in zip(plane.priors, levels, strict=True)]
    low, high = float(odometry.speed.min()), float(odometry.speed.max())
    count = int(np.ceil(np.log(high / low) / np.log(SPEED_RATIO))) + 1
    speeds = np.geomspace(low, high, count) if high > low * LEAST_SPREAD else np.array([_usual_speed(odometry)])
    over = Over(speeds, odometry.speed, kind)
    known = [
        [plane.at(number).information(float(one), odometry.spacing, distance_error, priors, size) for one in speeds]
        for number, size in enumerate(sizes)
    ]
    noise = _per_step(plane, odometry, over, known)
    made = _passage(plane, odometry, priors, sizes, speeds)
    values, variance = smooth(made, odometry, plane.observations, noise, kind)
    seen = odometry.valid & np.any([np.isfinite(one.values) for one in plane.observations], axis=0)
    local = {
        band: over.courses([[one.local(values, odometry.spacing, band) for one in of_kind] for of_kind in known])
        for band in dict.fromkeys(band for one in bands for band in one.values())
    }
    bounds = plane.bounds(float(np.median(odometry.speed)), priors, bands)
    results = []
    for number, own in enumerate(bands):

        def of(
            density: Callable[[Information], np.ndarray], band: Band | None = None, number: int = number
        ) -> np.ndarray:
            return over.values([[one.rms(density(one)[:, number], band) ** 2 for one in some] for some in known])

        stationary = of(lambda one: one.bound)
        wrong = of(lambda one: one.with_model_error) - stationary
        excess = np.maximum(variance[:, number] - BEYOND * stationary, 0.0)
        band_std = {}
        for name, band in own.items():
            unknown = of(lambda one: one.tracks, band)  # of the band without any reading: no more can be unsure
            near = np.where(_near_gap(seen, odometry.spacing, band.longest), np.minimum(excess, unknown), 0.0)
            band_std[name] = np.sqrt(of(lambda one: one.bound, band) + local[band][:, number] + near)
        std = np.sqrt(variance[:, number] + wrong)
        results.append(
            Fused(
                odometry.s,
                values[:, number],
                std,
                band_std,
                seen,
                float(levels[number]),
                bounds[number],
                ~np.isfinite(std),
            )
        )
    return results


@dataclass(frozen=True)
class Over:
    """What is known at some speeds and for each kind of place, at every place of the grid.

    Attributes
    ----------
    speeds : m/s, increasing. speed, kind : at each place, shapes (n,).
    """

    speeds: np.ndarray
    speed: np.ndarray
    kind: np.ndarray

    @cached_property
    def table_index(self) -> np.ndarray:
        """Fractional index of each place's speed."""
        return np.interp(np.log(self.speed), np.log(self.speeds), np.arange(len(self.speeds), dtype=float))

    def values(self, table: Sequence[Sequence[float]]) -> np.ndarray:
        """Of numbers by kind and speed, shape (n,)."""
        return self.courses(np.array(table)[:, :, None, None])[:, 0]

    def courses(self, table: Any) -> np.ndarray:
        """Of courses over the places by kind and speed, (kinds, speeds, n or 1, q); shape (n, q)."""
        stacked = np.asarray(table)
        low = np.minimum(self.table_index.astype(int), max(len(self.speeds) - 2, 0))
        high, at = np.minimum(low + 1, len(self.speeds) - 1), np.arange(len(self.speed)) * (stacked.shape[2] > 1)
        share = (self.table_index - low)[:, None]
        kind = np.minimum(self.kind, len(stacked) - 1)
        return stacked[kind, low, at] + share * (stacked[kind, high, at] - stacked[kind, low, at])


def _passage(
    plane: Plane, odometry: Odometry, priors: Sequence[TrackSpectrum], sizes: Sequence[np.ndarray], speeds: np.ndarray
) -> Passage:
    height = np.sqrt([float(prior.stationary()[0, 0]) for prior in priors])
    slope = np.sqrt([_slope_variance(prior) for prior in priors])

    def drive_of(own: Plane, size: np.ndarray) -> Callable[[float], np.ndarray]:
        table = np.stack([own.drive(float(one), priors, size) for one in speeds])
        return lambda speed: np.array([np.interp(np.log(speed), np.log(speeds), column) for column in table.T])

    def system_of(own: Plane) -> Callable[[float], System]:
        return lambda speed: own.system(own.vehicle, speed)

    regimes = [plane.at(number) for number in range(len(sizes))]
    return passage(
        [system_of(own) for own in regimes], priors, plane.noise(),
        [drive_of(own, size) for own, size in zip(regimes, sizes, strict=True)],
        odometry.speed, odometry.spacing, round(plane.wheelbase / odometry.spacing),
        plane.start(height, slope, float(np.median(odometry.speed))),
    )  # fmt: skip


def smooth(
    made: Passage, odometry: Odometry, observations: list[Observation], noise: np.ndarray, kind: np.ndarray | int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed track under the leading wheelset and its variance, shapes (n, q); `noise` : variances, (n, m)."""
    table_index = made.table_index(odometry.speed, kind)
    measured = np.stack([one.values for one in observations], axis=1)
    turning = np.stack([one.turning for one in observations], axis=1)
    x, P = np.zeros(len(made.covariance)), made.covariance.copy()
    filtered = forward(made.steps, table_index, measured, noise, turning, odometry.valid, x, P)
    values, variance = backward(made.steps, table_index, turning, filtered)
    return values, np.maximum(variance, 0.0)


def fit_levels(
    plane: Plane, odometry: Odometry, kind: np.ndarray, distance_error: float
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Levels of the track's spectra, and sizes of the disturbances at each kind of place, by Whittle's likelihood."""
    speed = _usual_speed(odometry)
    levels, fitted = np.array([prior.amplitude for prior in plane.priors]), dict[int, np.ndarray]()
    groups = np.array([one.sized_as for one in plane.regimes])
    for number in dict.fromkeys(sorted(groups)):
        where = groups[kind] == number
        fixed = bool(fitted) and bool((groups[kind] == 0).any())
        model, disturbances = _fit_model(plane.at(number), odometry, speed, distance_error)
        levels, fitted[number] = fit(
            plane.observations, odometry, speed, model, disturbances, list(levels), where, fixed
        )
    return levels, [fitted[number] for number in groups]


def _fit_model(plane: Plane, odometry: Odometry, speed: float, distance_error: float) -> tuple[Information, np.ndarray]:
    """Spectra for tracks of level 1, and those of the readings by each disturbance."""
    units = [prior.scaled(1.0) for prior in plane.priors]
    system = plane.system(plane.vehicle, speed)
    model = plane.information(speed, odometry.spacing, distance_error, units, None)
    pushed = system.from_states(model.wavenumber * speed)
    usual = plane.usual(speed, units) * (speed / np.pi)
    disturbances = (
        np.stack([(pushed * column[None, None]) @ np.swapaxes(pushed.conj(), 1, 2) for row in usual for column in row])
        if usual.size
        else np.zeros((0, *model.noise.shape))
    )
    return model, disturbances.reshape(len(units), len(plane.disturbed), *model.noise.shape)


def _usual_speed(odometry: Odometry) -> float:
    """Median of the speeds where they are known, m/s."""
    return (
        float(np.median(odometry.speed[odometry.valid])) if odometry.valid.any() else float(np.median(odometry.speed))
    )


def _per_step(plane: Plane, odometry: Odometry, over: Over, known: Sequence[Sequence[Information]]) -> np.ndarray:
    """Variance of each reading at each step, shape (n, m): white noise over a step, and the floor."""
    columns = []
    for number, reading in enumerate(plane.observations):
        typical = [[info.rms(info.readings[:, number]) ** 2 for info in of_kind] for of_kind in known]
        white = reading.density**2 * odometry.speed / (2.0 * odometry.spacing)
        columns.append(white + FLOOR**2 * over.values(typical))
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


def _slope_variance(prior: TrackSpectrum) -> float:
    """Variance of the irregularity's slope, rad^2."""
    P, A = prior.stationary(), prior.matrix[0]
    return float(A @ P @ A)
