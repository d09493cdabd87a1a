"""What a plain estimate leaves unknown: a chain of filters shows the track as the vehicle passes it on.

Over a linear vehicle, the estimate of a wave k is H(k) times the track, and a share of its other quantities. What the
filters do not undo, |H - 1|^2 of the track's spectrum, is error; so is what they make of the sensors' noise. H is known
for the nominal vehicle only: what each parameter that a data sheet leaves open changes of it is error too. The level
of the track is that of the estimate itself.
"""

from collections.abc import Callable, Mapping, Sequence
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
from estimators.vehicle.state_space import Output, System
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


class Chain(NamedTuple):
    """What an estimate is made of.

    Attributes
    ----------
    responses : from speed (m/s) and wave numbers (rad/m, shape (k,)) to the estimate over each quantity of the track,
        the estimated one first, for each vehicle, the nominal one first, shape (vehicles, quantities, k).
    weights : of the squares of the other vehicles' differences from the nominal one, shape (vehicles - 1,).
    noise : from the same to the density of the error by the sensors' noise, m^2/(rad/m), shape (k,).
    priors : spectra of the quantities of the track; only their relative size counts.
    """

    responses: Callable[[float, np.ndarray], np.ndarray]
    weights: np.ndarray
    noise: Callable[[float, np.ndarray], np.ndarray]
    priors: Sequence[TrackSpectrum]


def deviations(
    name: str,
    columns: Mapping[str, np.ndarray],
    chain: Chain,
    odometry: Odometry,
    added: Sequence[Mapping[str, np.ndarray]] = (),
) -> dict[str, np.ndarray]:
    """Standard deviation of each band of a quantity that has a column, by the speed at each place.

    Parameters
    ----------
    name : "vertical" and the like. columns : of the estimate, by their names with unit.
    added : the same columns of what unknown additions to the readings make, one standard deviation of each.
    """
    table = _Table.of(chain, odometry)
    found = {}
    for band, edges in bands_of(name).items():
        column = f"{name}_{band} [m]"
        if table is not None and column in columns:
            more = np.sum([np.nan_to_num(one[column]) ** 2 for one in added], axis=0)
            power = response(table.k, edges) ** 2
            found[f"{name}_{band}_std [m]"] = table.spread(odometry.speed, power, columns[column], more)
    return found


def filtered_deviation(
    values: np.ndarray,
    gain: Callable[[np.ndarray], np.ndarray],
    chain: Chain,
    odometry: Odometry,
    more: np.ndarray | float = 0.0,
) -> np.ndarray:
    """The same of what a filter with that response (by wave number, rad/m) makes of the quantity.

    Parameters
    ----------
    values : filtered. more : variance by other causes.
    """
    table = _Table.of(chain, odometry)
    if table is None:
        return np.full(len(odometry.s), np.nan)
    return table.spread(odometry.speed, np.abs(gain(table.k)) ** 2, values, more)


class _Table(NamedTuple):
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

    @staticmethod
    def of(chain: Chain, odometry: Odometry) -> "_Table | None":
        """At the speeds of a record; None where it has none that is valid."""
        k, speed = WAVES, odometry.speed[odometry.valid]
        if not speed.size:
            return None
        low, high = float(speed.min()), float(speed.max())
        speeds = np.geomspace(low, high, 1 + int(np.ceil(np.log(high / low) / np.log(SPEEDS) - 1e-9)))
        tracks = np.stack([one.density(k) for one in chain.priors])
        shown, wrong = [], []
        for one in speeds:
            H = chain.responses(float(one), k)
            ideal = np.eye(H.shape[1])[0][:, None]
            expected = np.concatenate([np.broadcast_to(ideal, H[:1].shape), np.broadcast_to(H[0], H[1:].shape)])
            shown.append(np.sum(np.abs(H) ** 2 * tracks, axis=1))
            wrong.append(np.sum(np.abs(H - expected) ** 2 * tracks, axis=1))
        noise = [chain.noise(float(one), k) for one in speeds]
        weights = np.append(1.0, chain.weights)
        return _Table(k, speeds, weights, np.stack(shown, axis=1), np.stack(wrong, axis=1), np.stack(noise))

    def spread(self, speed: np.ndarray, power: np.ndarray, values: np.ndarray, more: np.ndarray | float) -> np.ndarray:
        """Standard deviation at each place, NaN where the estimate shows nothing.

        Each vehicle has the track's level with which it would show what the estimate shows.

        Parameters
        ----------
        power : squared response of a filter at the waves. values : what the estimate shows, NaN where nothing.
        more : variance by other causes.
        """

        def along(densities: np.ndarray) -> np.ndarray:
            return np.interp(speed, self.speeds, np.trapezoid(densities * power * self.k, np.log(self.k)))

        total = along(self.noise) + more
        known = np.isfinite(values)
        if not known.any():
            return np.full(len(speed), np.nan)
        track = max(float(np.mean(values[known] ** 2) - total[known].mean()), 0.0)
        for weight, shown, wrong in zip(self.weights, self.shown, self.wrong, strict=True):
            total = total + weight * track / along(shown)[known].mean() * along(wrong)
        return np.where(known, np.sqrt(total), np.nan)


class Reading(NamedTuple):
    """What goes into a chain.

    Attributes
    ----------
    channels : the mean, or half the difference, of these. output : what they show of the vehicle's plane.
    """

    channels: tuple[str, ...]
    output: Output


Gain = Callable[[float, np.ndarray], Sequence[np.ndarray]]
"""From speed (m/s) and wave numbers (rad/m, shape (k,)) to the estimate's response to each reading, shapes (k,)."""


def sensor_noise(
    measurements: Measurements, readings: Sequence[Reading], gain: Gain
) -> Callable[[float, np.ndarray], np.ndarray]:
    """Density of the error by the readings' noise, for `Chain.noise`."""

    def noise(speed: float, k: np.ndarray) -> np.ndarray:
        total = np.zeros(len(k))
        for one, follows in zip(readings, gain(speed, k), strict=True):
            densities = [_density(measurements, name, k * speed) for name in one.channels]
            total += np.mean(densities, axis=0) / len(densities) * np.abs(follows) ** 2
        return speed / (2.0 * np.pi) * total

    return noise


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
    systems = [lambda speed, p=vehicle: vertical_plane.vertical(p, outputs) for vehicle in several]
    wide = gauge_over_vertical("d1") ** 2 * _power(ERRI_VERTICAL) / _power(ERRI_GAUGE)
    gauge = ERRI_GAUGE.scaled(ERRI_GAUGE.amplitude * wide)
    chain = _chain(measurements, readings, gain, systems, weights, [ERRI_VERTICAL, gauge])
    vehicle = measurements.vehicle
    slope = 0.5 * float(vehicle.get("design_contact_angle", vehicle.get("design_conicity", 0.0)))
    sinking = np.array([1.0, slope])[:, None]
    return chain._replace(responses=lambda speed, k: chain.responses(speed, k) * sinking)


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
    systems = [lambda speed, p=vehicle: lateral_roll.lateral(p, outputs, speed) for vehicle in several]
    chain = _chain(
        measurements, readings, gain, systems, weights, [(ERRI_LATERAL, ERRI_CROSS_LEVEL)[one] for one in order]
    )
    return chain._replace(responses=lambda speed, k: chain.responses(speed, k)[:, order])


def _chain(
    measurements: Measurements,
    readings: Sequence[Reading],
    gain: Gain,
    systems: Sequence[Callable[[float], System]],
    weights: np.ndarray,
    priors: Sequence[TrackSpectrum],
) -> Chain:
    arm = measurements.vehicle["semi_wheelbase"]

    def responses(speed: float, k: np.ndarray) -> np.ndarray:
        gains = np.stack(list(gain(speed, k)))
        return np.stack([np.einsum("mk,kmq->qk", gains, over_centre(one(speed), arm, speed, k)) for one in systems])

    return Chain(responses, weights, sensor_noise(measurements, readings, gain), priors)


def over_centre(system: System, arm: float, speed: float, k: np.ndarray) -> np.ndarray:
    """Readings over waves of the track's quantities under the bogie's centre, shape (k, readings, quantities).

    Parameters
    ----------
    arm : half the wheelbase, m. speed : m/s. k : wave numbers, rad/m, shape (k,).
    """
    lead, trail = np.split(system.response(k * speed), 2, axis=2)
    ahead = np.exp(1j * k * arm)[:, None, None]
    return lead * ahead + trail / ahead
