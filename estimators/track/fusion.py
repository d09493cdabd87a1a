"""Filter and smoother of one plane of the fused estimate, and the uncertainty of every band."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from estimators.filters import delay_line_smoother
from estimators.filters.information import Information
from estimators.filters.track_spectrum import Passage, TrackSpectrum, passage
from estimators.signals.bands import Band, settled
from estimators.speed.odometry import Odometry
from estimators.track import disturbances
from estimators.track.observations import Observation
from estimators.track.plane import FLOOR, Plane
from estimators.track.plane_fit import PlaneFit, fit_plane

SPEED_RATIO = 1.5  # between speeds at which uncertainties of bands are computed; in between they are interpolated
LEAST_SPREAD = 1.02  # of the speed: less counts as constant
BEYOND = 1.5  # variance over the stationary one from which on a place counts as badly seen


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
    fit : what was found of the plane.
    """

    s: np.ndarray
    values: np.ndarray
    std: np.ndarray
    band_std: dict[str, np.ndarray]
    seen: np.ndarray
    level: float
    bounds: dict[str, float]
    hidden: np.ndarray
    fit: PlaneFit

    def raised(self, by: np.ndarray, error: np.ndarray, shares: dict[str, float]) -> "Fused":
        """The same with something added to the values, and with an `error` (m, standard deviation) of which `shares`
        fall into the bands.
        """
        band_std = {name: np.hypot(std, shares.get(name, 1.0) * error) for name, std in self.band_std.items()}
        return self._replace(values=self.values + by, std=np.hypot(self.std, error), band_std=band_std)

    def widened(self, errors: Mapping[str, Any]) -> "Fused":
        """The same with an independent error in each band, m, standard deviation: a number, or one at each place."""
        band_std = {name: np.hypot(std, errors[name]) for name, std in self.band_std.items()}
        return self._replace(band_std=band_std)

    def on(self, s: np.ndarray) -> "Fused":
        """The same at other places."""
        band_std = {name: np.interp(s, self.s, std) for name, std in self.band_std.items()}
        values, std = CubicSpline(self.s, self.values)(s), np.interp(s, self.s, self.std)
        seen, hidden = (np.interp(s, self.s, one) > 0.5 for one in (self.seen, self.hidden))
        return Fused(s, values, std, band_std, seen, self.level, self.bounds, hidden, self.fit)

    def without(self, hidden: np.ndarray) -> "Fused":
        """The same with nothing said where `hidden`, nor of the bands that reach there."""
        return self._replace(hidden=self.hidden | hidden)

    def with_share(self, other: "Fused", share: float) -> "Fused":
        """This plus a share of another quantity, whose errors are independent."""
        band_std = {name: np.hypot(std, share * other.band_std[name]) for name, std in self.band_std.items()}
        std = np.hypot(self.std, share * other.std)
        return self._replace(values=self.values + share * other.values, std=std, band_std=band_std)


def fuse(
    planes: Sequence[Plane], odometry: Odometry, bands: Sequence[dict[str, Band]], distance_error: float
) -> list[Fused]:
    """Smooth a plane over the whole record; one result for each quantity, with its bands. Of several planes with the
    same readings and kinds of places it is that which explains them best.
    """
    kind = np.zeros(len(odometry.s), dtype=int) if planes[0].kind is None else planes[0].kind
    fits = [fit_plane(plane, odometry, kind, distance_error) for plane in planes]
    found = min(fits, key=lambda one: one.cost)
    plane, levels, sizes = found.plane, found.levels, found.sizes
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
    if plane.whole is not None:
        values = values - over.courses([[one.mistaken(values, odometry.spacing, -1) for one in some] for some in known])
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
                found,
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
        states = len(own.system(own.vehicle, float(speeds[0])).A)
        table = np.stack(
            [
                disturbances.drive(states, own.disturbances, own.variances(float(one), priors, size), float(one))
                for one in speeds
            ]
        )
        return lambda speed: np.array([np.interp(np.log(speed), np.log(speeds), column) for column in table.T])

    regimes = [plane.at(number) for number in range(len(sizes))]
    usual = float(np.median(odometry.speed))
    own = plane.start(height, slope, usual)
    added = disturbances.start(plane.disturbances, plane.variances(usual, priors, sizes[0]))
    return passage(
        [own.extended for own in regimes], priors, plane.noise(),
        [drive_of(own, size) for own, size in zip(regimes, sizes, strict=True)],
        odometry.speed, odometry.spacing, round(plane.wheelbase / odometry.spacing),
        np.concatenate([own, added]),
    )  # fmt: skip


def smooth(
    made: Passage, odometry: Odometry, observations: list[Observation], noise: np.ndarray, kind: np.ndarray | int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed track under the leading wheelset and its variance, shapes (n, q); `noise` : variances, (n, m)."""
    table_index = made.table_index(odometry.speed, kind)
    measured = np.stack([one.values for one in observations], axis=1)
    turning = np.stack([one.turning for one in observations], axis=1)
    x, P = np.zeros(len(made.covariance)), made.covariance.copy()
    values, variance = delay_line_smoother.smooth(
        made.steps, table_index, measured, noise, turning, odometry.valid, x, P
    )
    return values, np.maximum(variance, 0.0)


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
