"""What a plain estimate leaves unknown: a chain of filters shows the track as the vehicle passes it on.

Over a linear vehicle, the estimate of a wave k is H(k) times the track, and a share of its other quantities. What the
filters do not undo, |H - 1|^2 of the track's spectrum, is error; so is what they make of the sensors' noise. H is known
for the nominal vehicle only: what each parameter that a data sheet leaves open changes of it is error too. The level
of the track is that of the estimate itself.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np

from estimators.filters.information import band_rms
from estimators.filters.track_spectrum import ERRI_CROSS_LEVEL, ERRI_GAUGE, ERRI_LATERAL, ERRI_VERTICAL, TrackSpectrum
from estimators.signals.bands import BANDS, bands_of, response
from estimators.speed.odometry import Odometry
from estimators.track.self_check import gauge_over_vertical
from estimators.vehicle import lateral_roll
from estimators.vehicle import vertical as vertical_plane
from estimators.vehicle.creep import CREEP_FACTOR
from estimators.vehicle.parameters import given, numbers
from estimators.vehicle.state_space import Output, System, responses
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

SPEEDS = 2.0  # ratio of the speeds at which errors are computed; between them they are interpolated
PAYLOAD = (1.0, 1.4)  # factors on the body's mass: empty, and full by 40 %
FRICTION = (1.0, 0.3, 0.1)  # factors on creep slopes: dry, wet, low adhesion (Polach 2005, kA and kS of dry and wet)
WAVES = 2.0 * np.pi / np.geomspace(600.0, 1.0, 120)  # rad/m, increasing
STIFF, DAMPED = (0.8, 1.25), (0.5, 2.0)  # factors on stiffness and damping by age and tolerance; illustrative
WORN = (0.5, 2.0)  # factors on conicity and the contact angle's rate from new to worn profiles; illustrative


VERTICAL = {
    "body_mass": PAYLOAD,
    "primary_vertical_stiffness": STIFF,
    "primary_vertical_damping": DAMPED,
    "secondary_vertical_stiffness": STIFF,
    "secondary_vertical_damping": DAMPED,
}
"""Factors on what moves a bogie upwards."""
SIDEWAYS = {
    CREEP_FACTOR: FRICTION,
    "design_conicity": WORN,
    "design_contact_angle_rate": WORN,
    "body_mass": PAYLOAD,
    "body_roll_inertia": STIFF,
    "roll_bar_stiffness": STIFF,
    "secondary_lateral_stiffness": STIFF,
    "secondary_lateral_damping": DAMPED,
    "secondary_vertical_stiffness": STIFF,
}
"""Factors on what moves a bogie sideways and rolls it."""


Gain = Callable[[float, np.ndarray], Sequence[np.ndarray]]
"""From speed (m/s) and wave numbers (rad/m, shape (k,)) to the estimate's response to each reading, shapes (k,)."""


@dataclass(frozen=True)
class Chain:
    """What an estimate is made of, at `WAVES`.

    Attributes
    ----------
    gain : the estimate over its readings.
    followed : from speed (m/s) to the readings over each quantity of the track, the estimated one first, for each
        vehicle, the nominal one first, shape (vehicles, k, readings, quantities).
    weights : of the squares of the other vehicles' differences from the nominal one, shape (vehicles - 1,).
    noise : from speed to the densities of the readings' noise, unit^2/Hz, shape (readings, k).
    priors : spectra of the quantities of the track; only their relative size counts.
    """

    gain: Gain
    followed: Callable[[float], np.ndarray]
    weights: np.ndarray
    noise: Callable[[float], np.ndarray]
    priors: Sequence[TrackSpectrum]

    def table(self, odometry: Odometry) -> "Table | None":
        """At the speeds of a record; None where it has none that is valid."""
        k, speed = WAVES, odometry.speed[odometry.valid]
        if not speed.size:
            return None
        low, high = float(speed.min()), float(speed.max())
        speeds = np.geomspace(low, high, 1 + int(np.ceil(np.log(high / low) / np.log(SPEEDS) - 1e-9)))
        tracks = np.stack([one.density(k) for one in self.priors])[:, None]
        shown, wrong, noise = [], [], []
        for one in map(float, speeds):
            gains = np.stack(list(self.gain(one, k)))
            H = np.einsum("mk,vkmq->qvk", gains, self.followed(one))
            shown.append(np.sum(np.abs(H) ** 2 * tracks, axis=0))
            H[:, 1:] -= H[:, :1]
            H[0, 0] -= 1.0
            wrong.append(np.sum(np.abs(H) ** 2 * tracks, axis=0))
            noise.append(one / (2.0 * np.pi) * np.sum(self.noise(one) * np.abs(gains) ** 2, axis=0))
        weights = np.append(1.0, self.weights)
        return Table(k, speeds, weights, np.stack(shown, axis=1), np.stack(wrong, axis=1), np.stack(noise))


def deviations(
    name: str,
    columns: Mapping[str, np.ndarray],
    table: "Table | None",
    odometry: Odometry,
    added: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> dict[str, np.ndarray]:
    """Standard deviation of each band of a quantity that has a column, by the speed at each place.

    Parameters
    ----------
    name : "vertical" and the like. columns : of the estimate, by their names with unit. table : of its chain.
    added : the same columns of what unknown additions to the readings make, one standard deviation of each, in rows.
    """
    found = {}
    for band, edges in bands_of(name).items():
        column = f"{name}_{band} [m]"
        if table is not None and column in columns:
            more = sum_of_squares(added[column]) if column in added else 0.0
            power = response(table.k, edges) ** 2
            found[f"{name}_{band}_std [m]"] = table.spread(odometry.speed, power, columns[column], more)
    return found


def sum_of_squares(rows: np.ndarray) -> np.ndarray:
    """Over the rows, shape (n,); 0 where they are NaN."""
    return np.nan_to_num(np.einsum("rn,rn->n", rows, rows))


def filtered_deviation(
    values: np.ndarray,
    gain: Callable[[np.ndarray], np.ndarray],
    table: "Table | None",
    odometry: Odometry,
    more: np.ndarray | float = 0.0,
) -> np.ndarray:
    """The same of what a filter with that response (by wave number, rad/m) makes of the quantity.

    Parameters
    ----------
    values : filtered. table : of the quantity's chain. more : variance by other causes.
    """
    if table is None:
        return np.full(len(odometry.s), np.nan)
    return table.spread(odometry.speed, np.abs(gain(table.k)) ** 2, values, more)


class Table(NamedTuple):
    """Densities for a track of the priors' level, at a few speeds.

    Attributes
    ----------
    k : waves, rad/m, shape (k,). speeds : m/s, shape (v,). weights : of the vehicles, the nominal one's first.
    shown : by the estimate, for each vehicle, shape (vehicles, v, k). wrong : its error with the nominal vehicle, then
        how each other one differs from that. noise : of the sensors, shape (v, k).
    """

    k: np.ndarray
    speeds: np.ndarray
    weights: np.ndarray
    shown: np.ndarray
    wrong: np.ndarray
    noise: np.ndarray

    def spread(self, speed: np.ndarray, power: np.ndarray, values: np.ndarray, more: np.ndarray | float) -> np.ndarray:
        """Standard deviation at each place, NaN where the estimate shows nothing.

        Each vehicle has the track's level with which it would show what the estimate shows.

        Parameters
        ----------
        power : squared response of a filter at the waves. values : what the estimate shows, NaN where nothing.
        more : variance by other causes.
        """

        known = np.isfinite(values)
        if not known.any():
            return np.full(len(speed), np.nan)

        def within(densities: np.ndarray) -> np.ndarray:
            return np.trapezoid(densities * power * self.k, np.log(self.k))

        near = np.stack([np.interp(speed, self.speeds, row) for row in np.eye(len(self.speeds))])  # their weights
        usual = near[:, known].mean(axis=1)
        noise, shown = within(self.noise), within(self.shown)
        other = float(np.mean(np.broadcast_to(more, speed.shape)[known]))
        track = max(float(np.mean(values[known] ** 2)) - float(noise @ usual) - other, 0.0)
        total = noise + track * np.sum((self.weights / (shown @ usual))[:, None] * within(self.wrong), axis=0)
        return np.where(known, np.sqrt(total @ near + more), np.nan)


class Reading(NamedTuple):
    """What goes into a chain.

    Attributes
    ----------
    channels : the mean, or half the difference, of these. output : what they show of the vehicle's plane.
    """

    channels: tuple[str, ...]
    output: Output


def sensor_noise(measurements: Measurements, readings: Sequence[Reading], speed: float) -> np.ndarray:
    """Densities of the readings' noise at `WAVES`, for `Chain.noise`."""
    rows = []
    for one in readings:
        densities = [_density(measurements, name, WAVES * speed) for name in one.channels]
        rows.append(np.mean(densities, axis=0) / len(densities))
    return np.stack(rows)


def _density(measurements: Measurements, channel: str, omega: np.ndarray) -> np.ndarray:
    """Of white noise and of a bias that drifts (Gauss-Markov), one-sided, unit^2/Hz, at angular frequencies, rad/s."""
    sheet = data_sheet(measurements.about, channel)
    time = sheet.error("bias_correlation_time", 100.0)
    drift = 4.0 * sheet.error("bias_instability") ** 2 * time / (1.0 + (omega * time) ** 2)
    return sheet.density(measurements.rate(channel)) ** 2 + drift


def vehicles(
    nominal: Mapping[str, Any], factors: Mapping[str, Sequence[float]]
) -> tuple[list[dict[str, Any]], np.ndarray]:
    """The nominal vehicle, then one for each factor on each parameter; weights of these by how many a parameter has."""
    others = [
        ({**nominal, name: nominal.get(name, 1.0) * factor}, 1.0 / len(several))
        for name, several in factors.items()
        for factor in several
        if factor != 1.0
    ]
    return [dict(nominal), *(vehicle for vehicle, _ in others)], np.array([weight for _, weight in others])


def vertical_chain(measurements: Measurements, readings: Sequence[Reading], gain: Gain) -> Chain | None:
    """Of a height from readings in the vertical plane; None where the vehicle's parameters are not all given.

    Where gauge widens by g, wheels run g / 2 farther out on treads of the contact angle and sink by half of that times
    it. No sensor of the plane can tell that from the rails' height.
    """
    if not given(measurements.vehicle, vertical_plane.NEEDED):
        return None
    outputs = [one.output for one in readings]
    several, weights = vehicles(measurements.vehicle, VERTICAL)
    systems = [vertical_plane.vertical(vehicle, outputs) for vehicle in several]
    wide = gauge_over_vertical("d1") ** 2 * _power(ERRI_VERTICAL) / _power(ERRI_GAUGE)
    gauge = ERRI_GAUGE.scaled(ERRI_GAUGE.amplitude * wide)
    vehicle = measurements.vehicle
    slope = 0.5 * float(vehicle.get("design_contact_angle", vehicle.get("design_conicity", 0.0)))
    sinking, arm = np.array([1.0, slope]), float(vehicle["semi_wheelbase"])

    @cache
    def followed(speed: float) -> np.ndarray:
        return over_centre(systems, arm, speed, WAVES) * sinking

    return Chain(gain, followed, weights, partial(sensor_noise, measurements, readings), [ERRI_VERTICAL, gauge])


def _power(spectrum: TrackSpectrum) -> float:
    """Mean square in D1, m^2."""
    return band_rms(WAVES, spectrum.density(WAVES), BANDS["d1"]) ** 2


def sideways_chain(
    measurements: Measurements,
    readings: Sequence[Reading],
    gain: Gain,
    quantity: Literal["lateral", "cross_level"],
) -> Chain | None:
    """Of the rails' path or of cross level from readings in the lateral plane with roll; None likewise."""
    if not given(measurements.vehicle, lateral_roll.NEEDED):
        return None
    outputs, order = [one.output for one in readings], [0, 1] if quantity == "lateral" else [1, 0]
    nominal = numbers(measurements.vehicle, lateral_roll.NEEDED)
    several, weights = vehicles(nominal, SIDEWAYS)

    @cache
    def followed(speed: float) -> np.ndarray:
        systems = [lateral_roll.lateral(vehicle, outputs, speed) for vehicle in several]
        return over_centre(systems, nominal["semi_wheelbase"], speed, WAVES)[..., order]

    priors = [(ERRI_LATERAL, ERRI_CROSS_LEVEL)[one] for one in order]
    return Chain(gain, followed, weights, partial(sensor_noise, measurements, readings), priors)


def over_centre(systems: Sequence[System], arm: float, speed: float, k: np.ndarray) -> np.ndarray:
    """Readings over waves of the track's quantities under the bogie's centre, shape (systems, k, readings, quantities).

    Parameters
    ----------
    systems : alike but for their numbers. arm : half the wheelbase, m. speed : m/s. k : wave numbers, rad/m, (k,).
    """
    lead, trail = np.split(responses(systems, k * speed), 2, axis=-1)
    ahead = np.exp(1j * k * arm)[:, None, None]
    return lead * ahead + trail / ahead
