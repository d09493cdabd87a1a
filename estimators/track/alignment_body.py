"""Vertical alignment from an accelerometer on the body over a bogie: what a box in a coach can know of the track."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from estimators.filters.track_spectrum import ERRI_VERTICAL
from estimators.interface import Estimate
from estimators.signals.bands import BANDS, response
from estimators.speed.odometry import Odometry
from estimators.track.chain_error import WAVES, Chain, Reading, vertical_chain
from estimators.track.geometry import TrackEstimator, by_speed, geometry
from estimators.track.slow_motions import stated, without_mean
from estimators.vehicle.lateral_frequency import is_whole
from estimators.vehicle.state_space import Output
from estimators.vehicle.vertical import NEEDED
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

MEMORY = 60.0  # m; the body's bounce at 1 Hz dies out within it up to 40 m/s
FAR = 3.0  # m along the body from the bogie's centre: farther, the body's pitch is not that of this bogie any more
BENDING = 9.0  # Hz; first vertical bending of coach bodies, 8 to 12 Hz (Carlbom 2000); the model's body is rigid
ELSEWHERE = 0.2  # share of the other bogie in what the body does over this one, where it is not given; illustrative


class Known(NamedTuple):
    """What can be known of a band: rms error over the track's, with the vehicle known and as data sheets have it."""

    vehicle_known: float
    as_stated: float


class AlignmentBody(TrackEstimator, frozen=True):
    """Vertical alignment from one accelerometer on the body over a bogie, as far as both suspensions are known.

    Among linear filters it has the least mean square error for a track of ERRI B176's shape, a sensor of the stated
    noise, and vehicles whose payload, springs and dampers scatter as data sheets leave them (Wiener filter). Short
    waves hardly reach the body: the stated deviation there is about the track itself. `about` says what could be known
    at best.
    """

    sensor: str = quantity("body", unit="name of the accelerometer", source="a box on the floor", pattern=r"^\w+$")

    requires: ClassVar[tuple[str, ...]] = ("body.acceleration_z [m/s2]",)

    def needed(self) -> tuple[str, ...]:
        """The vertical channel of `sensor`."""
        return (f"{self.sensor}.acceleration_z [m/s2]",)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vertical model needs; of a whole vehicle also where its bogies are."""
        return (*NEEDED, *(("semi_bogie_spacing",) if is_whole(measurements.vehicle) else ()))

    def estimate(self, measurements: Measurements) -> Estimate:
        """Alignment over the whole record.

        Raises
        ------
        InputError : a channel, the speed or a parameter is missing, or the sensor does not stand over a bogie.
        """
        odometry = self.odometry(measurements)
        name = self.needed()[0]
        box = BodyBox.of(measurements, name)

        def path(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            acceleration, measured = odometry.channel(measurements, name, box.ahead, samples)
            return acceleration / odometry.speed**2, measured

        felt, good = path(without_mean(measurements[name]))
        curvature = by_speed([np.where(good, felt, np.nan)], odometry, lambda speed: [box.filter(speed)], MEMORY)
        columns = geometry("vertical", curvature, good, odometry, self.cut, 2)
        slow = {name: lambda rows: path(rows)[0]}
        columns |= stated("vertical", columns, box.chain, slow, measurements, odometry, good, 2)
        about = {"known": box.known(_usual_speed(odometry)), "body": "body", "position [m]": list(box.position)}
        return self.result(odometry, columns, good, **about)


class BodyBox(NamedTuple):
    """A box on the body, and what is between it and the rails.

    Attributes
    ----------
    position : on the body, m. ahead : of the leading bogie's centre, m.
    chain : responses of the box to the rails under its bogie, of all vehicles that the data sheet allows.
    """

    position: tuple[float, float, float]
    ahead: float
    chain: Chain

    @staticmethod
    def of(measurements: Measurements, name: str) -> "BodyBox":
        """From its data sheet and the vehicle's parameters; raises `InputError` where it stands over no bogie."""
        vehicle, position = measurements.vehicle, data_sheet(measurements.about, name).position
        pivot = float(vehicle["semi_bogie_spacing"]) if is_whole(vehicle) else 0.0
        off = abs(abs(position[0]) - pivot)
        if off > FAR:
            raise InputError(
                f"'{name}' stands {off:.3g} m along the body from the nearest bogie, where the body's pitch hides the "
                f"track; put the box over a bogie (x = {pivot:g} m), within {FAR:g} m"
            )
        plain = vertical_chain(measurements, [Reading((name,), Output("body acceleration"))], _nothing)
        assert plain is not None  # the parameters are there
        share = _other_bogie(vehicle)

        def followed(speed: float) -> np.ndarray:
            all_vehicles = plain.followed(speed)
            nominal = all_vehicles[:1]
            bent = 1.0 + _bending(WAVES * speed / (2.0 * np.pi))[None, :, None, None]
            return np.concatenate([all_vehicles, nominal * bent, nominal * (1.0 + share)])

        chain = replace(plain, followed=followed, weights=np.append(plain.weights, [1.0, 1.0]))
        behind = -2.0 * pivot if position[0] < 0.0 < pivot else 0.0
        box = BodyBox(position, behind, chain)
        return box._replace(chain=replace(chain, gain=lambda speed, k: [box.height(speed, k)]))

    def height(self, speed: float, k: np.ndarray) -> np.ndarray:
        """Height of the rails over the acceleration of the box by the Wiener filter, at wave numbers, rad/m, (k,)."""
        return -self.filter(speed)(k) / (speed * np.maximum(k, WAVES[0] / 10.0)) ** 2

    def filter(self, speed: float) -> Callable[[np.ndarray], np.ndarray]:
        """The same over the path that the acceleration would be: both in curvature."""
        shown, power, noise = self._shown(speed)
        gain = np.conj(shown) / (power + noise)
        return between_waves(-gain * (speed * WAVES) ** 2)

    def known(self, speed: float) -> dict[str, dict[str, float]]:
        """`Known` by band at a speed in m/s, for the filter's own track, by name."""
        shown, power, noise = self._shown(speed)
        tracks = ERRI_VERTICAL.density(WAVES)
        found = {}
        for band, edges in BANDS.items():
            weight = response(WAVES, edges) ** 2 * tracks
            left = [1.0 - np.abs(shown) ** 2 / (whole + noise) for whole in (np.abs(shown) ** 2, power)]
            whole = _integral(weight)
            errors = [float(np.sqrt(max(_integral(weight * one), 0.0) / whole)) for one in left]
            found[band] = Known(*errors)._asdict()
        return found

    def _shown(self, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """At `WAVES`: the nominal vehicle's response, mean square over all vehicles, the noise over the track."""
        H = self.chain.followed(speed)[:, :, 0, 0]
        power = np.abs(H[0]) ** 2 + np.einsum("v,vk->k", self.chain.weights, np.abs(H[1:] - H[0]) ** 2)
        density = speed / (2.0 * np.pi) * self.chain.noise(speed)[0]
        return H[0], power, density / ERRI_VERTICAL.density(WAVES)


def between_waves(values: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """A response at any wave numbers from that at `WAVES`: beyond the longest wave as there, then none."""
    logarithms, both = np.log(WAVES), np.stack([np.real(values), np.imag(values)])

    def gain(k: np.ndarray) -> np.ndarray:
        real, imaginary = (np.interp(np.log(np.maximum(k, WAVES[0])), logarithms, part) for part in both)
        return np.where(k > WAVES[-1], 0.0, real + 1j * imaginary)

    return gain


def _bending(frequency: np.ndarray) -> np.ndarray:
    """Share by which a body that bends moves otherwise than a rigid one, at most 1: r^2 / |1 - r^2|, r = f / 9 Hz."""
    square = (frequency / BENDING) ** 2
    return np.minimum(square / np.maximum(np.abs(1.0 - square), 1e-9), 1.0)


def _other_bogie(vehicle: Mapping[str, Any]) -> float:
    """Share of the other bogie's force in the body's acceleration over this one: (1 - q) / (1 + q), q = m l^2 / I."""
    inertia, spacing = vehicle.get("body_pitch_inertia"), vehicle.get("semi_bogie_spacing")
    if not is_whole(vehicle) or not isinstance(inertia, int | float) or not isinstance(spacing, int | float):
        return ELSEWHERE
    ratio = float(vehicle["whole_body_mass"]) * float(spacing) ** 2 / float(inertia)
    return abs(1.0 - ratio) / (1.0 + ratio)


def _integral(values: np.ndarray) -> float:
    return float(np.trapezoid(values * WAVES, np.log(WAVES)))


def _nothing(speed: float, k: np.ndarray) -> list[np.ndarray]:
    """A gain that is put in later."""
    return [np.zeros(len(k))]


def _usual_speed(odometry: Odometry) -> float:
    return float(np.median(odometry.speed[odometry.valid])) if odometry.valid.any() else odometry.slowest
