"""Slow motions that a sensor feels beside what it stands for: across its axis, under brakes, in canted curves.

What they make of an estimate is part of its stated deviation; see `chain_error`.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

from estimators.signals.bands import Band
from estimators.speed.odometry import Odometry
from estimators.track.chain_error import Chain, deviations
from estimators.track.geometry import CANT_BASE, in_bands
from estimators.track.observations import CURVE
from estimators.vehicle.parameters import given
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

SMOOTH = 0.5  # s; trains are not braked faster
ALONG, UPWARDS = "acceleration_x [m/s2]", "acceleration_z [m/s2]"
YAWING, PITCHING = "rate_yaw [rad/s]", "rate_pitch [rad/s]"
YAW = "bogie.rate_yaw [rad/s]"
LINEAR, ANGULAR = (ALONG, "acceleration_y [m/s2]", UPWARDS), ("rate_roll [rad/s]", PITCHING, YAWING)
NODDING = ("body_mass", "bogie_mass", "bogie_height", "primary_vertical_stiffness", "semi_wheelbase")


Through = Callable[[np.ndarray], np.ndarray]
"""From samples of a channel in rows, shape (rows, k), to what an estimate makes of them on the grid, (rows, n)."""


def stated(
    name: str,
    columns: Mapping[str, np.ndarray],
    chain: Chain | None,
    felt: Mapping[str, Through],
    measurements: Measurements,
    odometry: Odometry,
    good: np.ndarray,
    integrate: int = 0,
    bands: Mapping[str, Band] | None = None,
) -> dict[str, np.ndarray]:
    """Standard deviations of a quantity's bands: by `chain`, and by the slow motions that its channels feel.

    Parameters
    ----------
    name, columns : see `chain_error.deviations`. chain : nothing is stated where None.
    felt : what is made of each channel that feels slow motions, before it is integrated.
    good, integrate, bands : see `geometry`.
    """
    if chain is None:
        return {}
    rows = [through(additions(measurements, channel, odometry)) for channel, through in felt.items()]
    added = in_bands(name, np.concatenate(rows), good, odometry, integrate, bands) if rows else {}
    return deviations(name, columns, chain.table(odometry), odometry, added)


def additions(measurements: Measurements, channel: str, odometry: Odometry) -> np.ndarray:
    """What a reading may hold beside what it stands for: one standard deviation of each at its samples, in rows.

    A sensor that is not quite along its axis feels the other axes, and the pull of brakes among them. That pull also
    turns the bogie on its primary springs. In a canted curve yaw turns into pitch, and the pull to the outside into
    weight; cant is taken to balance the curve. All of it is slow: what compensates short waves leaves it as it is.
    """
    sheet, time = data_sheet(measurements.about, channel), measurements.time(channel)
    sensor, _, quantity = channel.partition(".")
    misaligned, rows = sheet.error("misalignment_std"), list[np.ndarray]()
    axes = LINEAR if quantity in LINEAR else ANGULAR
    for other in axes:
        name = f"{sensor}.{other}"
        if other != quantity and name in measurements and len(measurements[name]) == len(time):
            rows.append(misaligned * without_mean(measurements[name]))
        elif other == ALONG:
            rows.append(misaligned * pull(odometry, time))
    rows.append(sheet.error("scale_error_std") * without_mean(measurements[channel]))
    if quantity == PITCHING:
        rows.append(np.gradient(nod(measurements.vehicle, odometry, time), time))
    yaw = f"{sensor}.{YAWING}"
    if quantity in (UPWARDS, PITCHING) and yaw in measurements and len(measurements[yaw]) == len(time):
        speed = np.interp(time, odometry.knots, odometry.speed_at_knots)
        turning = without_mean(measurements[yaw])
        rows.append(speed * turning**2 / GRAVITY * (speed if quantity == UPWARDS else 1.0))
    return np.stack(rows)


def nod(vehicle: Mapping[str, Any], odometry: Odometry, time: np.ndarray) -> np.ndarray:
    """Pitch of a bogie on its primary springs by braking at times, rad: the whole force at the bogie's height.

    Zero where a parameter is not given.
    """
    if not given(vehicle, NODDING):
        return np.zeros(len(time))
    force = (vehicle["body_mass"] + vehicle["bogie_mass"]) * pull(odometry, time)
    return (
        force * vehicle["bogie_height"] / (4.0 * vehicle["primary_vertical_stiffness"] * vehicle["semi_wheelbase"] ** 2)
    )


def balancing_cant(measurements: Measurements, odometry: Odometry) -> np.ndarray:
    """Cant that would balance the curve, m, on the grid, less its mean; zero where no yaw gyro is on the bogie."""
    if YAW not in measurements:
        return np.zeros(len(odometry.s))
    yaw, _ = odometry.channel(measurements, YAW, values=without_mean(measurements[YAW]))
    return CANT_BASE * uniform_filter1d(odometry.speed * yaw / GRAVITY, max(1, round(CURVE / odometry.spacing)))


def without_mean(values: np.ndarray) -> np.ndarray:
    """Values less their mean; lost ones (NaN) are zero."""
    return np.nan_to_num(values - np.nanmean(values)) if np.isfinite(values).any() else np.zeros(len(values))


def pull(odometry: Odometry, time: np.ndarray) -> np.ndarray:
    """Acceleration along the track at times, m/s2, smoothed over `SMOOTH` s."""
    even = np.arange(odometry.knots[0], odometry.knots[-1], 0.1)
    speed = np.interp(even, odometry.knots, odometry.speed_at_knots)
    return np.interp(time, even, np.gradient(gaussian_filter1d(speed, SMOOTH / 0.1), 0.1))
