"""Dipped rail joints from the bogie's gyros: position, depth, dip angle and side (section 3.3 of Ward et al. 2011)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.bands import settled
from estimators.speed.odometry import Odometry, integrate_speed
from estimators.track.curvature import (
    BOUNCE,
    PITCH,
    ROLL,
    Gain,
    blur,
    chord_rotation,
    needed_parameters,
    over_distance,
    roll_inverse,
    vertical,
)
from estimators.track.dip_fit import SIDES, Dips, find, no_dips, synthesise, without_echoes
from estimators.track.dips import Channel, ChannelKind, MatchedFilters, channel, clipped
from estimators.track.events import EventEstimator
from estimators.vehicle.parameters import positive_numbers
from railsim.measurements import Measurements
from railsim.spec import quantity

CLEAR = 3.0
"""A dip whose wheelbase comes this close to an end or a gap is left out, m."""
RAMP = 4.0
"""Length over which channels come in after a gap, m."""
LEAST = 20.0
"""Shorter records hold no background to compare with, m."""


FLOOR = 4.0
"""Least signal to noise ratio of a dip that is looked at."""
CROSSINGS = 5.0
"""False dips in white noise, 1/m, over exp(-snr^2 / 2): 1.5 to 4.5 counted in 10 km, for one and two channels."""
ROUNDS = 2
"""How often the background is taken anew, without the dips found."""


class DippedJoints(EventEstimator, frozen=True):
    """Dipped rail joints, with place, depth and angle, from gyros on the bogie.

    A joint is a pair of opposite steps of the curvature one wheelbase apart. Matched filters in space find it. It needs
    the pitch gyro and a speed. With a vertical accelerometer on the bogie the sizes are better; with a roll gyro it
    names the rail, and finds joints on one rail alone more surely. The spacing of joints is not used.
    """

    threshold: float = quantity(5.0, unit="-", source="tuned on jointed_60ft: in white noise once in 50 km", ge=3.0)
    false_share: float = quantity(0.02, unit="-", source="tuned on jointed_60ft: share of the dips", gt=0, lt=1)

    requires: ClassVar[tuple[str, ...]] = (PITCH,)
    nearby: ClassVar[bool] = True
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            BOUNCE: "more joints",
            ROLL: "which rail a joint is in",
        }
    )

    def estimate(self, measurements: Measurements) -> Estimate:
        """Events of kind "joint", in the order of distance.

        Raises
        ------
        InputError : a channel, the speed or a vehicle parameter is missing.
        """
        self.need(measurements)
        odometry = integrate_speed(measurements, self.speed_source, self.slowest)
        floor = min(FLOOR, self.threshold)
        dips, channels, valid = find_dips(measurements, odometry, self.cut_off, floor)
        length = np.count_nonzero(valid) * odometry.spacing
        dips = dips.take(dips.snr > credible(dips.snr, length, self.threshold, self.false_share))
        chord, _ = chord_rotation(measurements, odometry, self.cut_off)
        series = pd.DataFrame(
            {
                "s [m]": odometry.s,
                "time [s]": odometry.time,
                "vertical_curvature [1/m]": np.where(valid, -chord, np.nan),
                "dip_snr [-]": np.where(valid, MatchedFilters(channels).snr if channels else np.nan, np.nan),
                "valid [-]": valid.astype(float),
            }
        )
        joints = [dict(event, kind="joint") for event in events(dips, odometry, len(channels) > 1)]
        about = {
            "settings": self.model_dump(mode="json"),
            "curvature": channels[0].kind if channels else "none",
            "events": joints,
        } | odometry.stated()
        return Estimate(self.name, series, about)


def credible(snr: np.ndarray, length: float, threshold: float, false_share: float) -> float:
    """Signal to noise ratio from which a dip counts: `threshold`, or less where so many dips are above it that the
    false ones among them, of which white noise has `CROSSINGS` exp(-snr^2 / 2) a metre, are at most `false_share`.
    """
    levels = np.arange(min(FLOOR, threshold), threshold, 0.05)
    expected = CROSSINGS * length * np.exp(-(levels**2) / 2)
    above = (snr[None, :] > levels[:, None]).sum(axis=1)
    enough = np.flatnonzero(expected <= false_share * above)
    return float(levels[enough[0]]) if enough.size else threshold


def find_dips(
    measurements: Measurements, odometry: Odometry, cut_off: float, threshold: float
) -> tuple[Dips, list[Channel], np.ndarray]:
    """Dips, the whitened channels in which they were found, and where on the grid there is anything to be found.

    The background's spectrum is taken from the record with its spikes cut off, then again without the dips found.
    Where less than `LEAST` is valid there are none.
    """
    positive_numbers(measurements.vehicle, needed_parameters(measurements))
    curvature, valid, kind = vertical(measurements, odometry, cut_off)
    if np.count_nonzero(valid) * odometry.spacing < LEAST:
        valid = np.zeros(len(odometry.s), dtype=bool)
    rows: list[tuple[np.ndarray, np.ndarray, ChannelKind, Gain]] = [
        (curvature * _ramp(valid, odometry.spacing), valid, kind, np.ones_like)
    ]
    speed = float(np.median(odometry.speed[valid])) if valid.any() else 1.0
    if ROLL in measurements:
        inverse, trust = roll_inverse(measurements.vehicle)
        roll, good = over_distance(measurements, odometry, ROLL, inverse, cut_off)
        rows.append((roll * _ramp(good, odometry.spacing), good, "roll", lambda k: trust(k * speed)))
    base = float(measurements.vehicle["semi_wheelbase"])
    width = blur(speed, cut_off)
    rest = [clipped(values, good) for values, good, _, _ in rows]
    dips, channels = no_dips(), []
    for _ in range(ROUNDS if valid.any() else 0):
        channels = [
            channel(values, background, good, what, base, width, odometry.spacing, trust)
            for (values, good, what, trust), background in zip(rows, rest, strict=True)
        ]
        dips = without_echoes(find(channels, threshold, known=dips), 2 * base)
        rest = [row[0] - synthesise(dips, one, white=False) for row, one in zip(rows, channels, strict=True)]
    good = np.logical_and.reduce([valid, *(row[1] for row in rows)])
    return dips.take(_inside(dips.distance, good, odometry.spacing, base + CLEAR)), channels, good


def events(dips: Dips, odometry: Odometry, sides: bool) -> list[dict[str, Any]]:
    """Place, time, depth, angle and rail of each dip, with standard deviations, as JSON holds them.

    "depth [m]" and "angle [rad]" are those of both rails' mean, as a bogie feels them; "rail_depth [m]" that of the
    rail that is named, twice as much where it is one alone.
    """
    depth, depth_std = dips.depth()
    angle, angle_std = dips.angle()
    length = dips.half_length()
    time = np.interp(dips.distance, odometry.s, odometry.time)
    numbers = dips.side()
    entries = []
    for i in range(len(depth)):
        side = SIDES[numbers[i]] if sides else "unknown"
        entries.append(
            {
                "s [m]": float(dips.distance[i]),
                "s_std [m]": float(dips.distance_std[i]),
                "time [s]": float(time[i]),
                "depth [m]": float(depth[i]),
                "depth_std [m]": float(depth_std[i]),
                "angle [rad]": float(angle[i]),
                "angle_std [rad]": float(angle_std[i]),
                "half_length [m]": float(length[i]),
                "side": side,
                "rail_depth [m]": float(depth[i] * (2.0 if side in SIDES[1:] else 1.0)),
                "snr [-]": float(dips.snr[i]),
            }
        )
    return entries


def _inside(distance: np.ndarray, good: np.ndarray, spacing: float, reach: float) -> np.ndarray:
    """Places around which the record is good as far as `reach`, m."""
    bad = np.concatenate([[0], np.cumsum(~good)])
    low = np.clip(np.floor((distance - reach) / spacing).astype(np.int64), 0, len(good))
    high = np.clip(np.ceil((distance + reach) / spacing).astype(np.int64) + 1, 0, len(good))
    ends = (distance - reach >= 0) & (distance + reach <= (len(good) - 1) * spacing)
    return (bad[high] == bad[low]) & ends


def _ramp(valid: np.ndarray, spacing: float) -> np.ndarray:
    """0 where not valid, rising to 1 within `RAMP` of it."""
    kernel = np.hanning(2 * round(RAMP / spacing) + 1)
    reach = settled(valid, spacing, RAMP)
    return np.convolve(reach, kernel / kernel.sum(), mode="same") * valid
