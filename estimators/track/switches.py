"""Crossovers from the bogie's gyros: toes, heels, crossings and crossing angle (section 3.3 of Ward et al. 2011).

The yaw rate tells that there is one: the bogie's heading goes from the first track's by the crossing angle and back.
The vertical curvature tells where its parts are: wheels dip where they pass onto the blade, over the heel joint and
over the crossing's nose. Both wheelsets pass the same dip, and how far apart the odometer says they do, over the true
wheelbase, is the odometer's error: distances from the middle are corrected by it.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd
from scipy import signal

from estimators.interface import Estimate
from estimators.speed.odometry import Odometry, integrate_speed
from estimators.track.curvature import BOUNCE, PITCH, ROLL, chord_rotation
from estimators.track.dip_fit import Dips, refine
from estimators.track.dipped_joints import events, find_dips
from estimators.track.dips import Channel, channel
from estimators.track.events import EventEstimator
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

YAW = "bogie.rate_yaw [rad/s]"
REACH = 50.0
"""From the middle of a crossover to plain track, m; illustrative: one of 1 in 13, tracks 3.4 m apart, is 75 m long."""
PLAIN = 15.0
"""Length of plain track beyond, on which the heading is taken as that of the tracks, m."""
LETTERS = {"before": ("C", "B", "A"), "after": ("D", "E", "F")}
KINDS = {"A": "switch toe", "B": "switch heel", "C": "crossing", "D": "crossing", "E": "switch heel", "F": "switch toe"}
SCALES = np.linspace(-0.04, 0.04, 17)


class DetectedCrossover(NamedTuple):
    """A crossover in the heading: rows of the grid, signed crossing angle, rad."""

    middle: int
    angle: float


class Switches(EventEstimator, frozen=True):
    """Crossovers of two turnouts, with the places of toes, heels and crossings, from a yaw gyro.

    Events are A (toe), B (heel), C and D (crossings), E (heel), F (toe).
    """

    slowest: float = quantity(1.5, unit="m/s", source="illustrative: gyro noise over speed", ge=0.5)
    threshold: float = quantity(4.5, unit="-", source="illustrative: five dips at known parts of a turn", ge=3.0)
    smallest: float = quantity(0.03, unit="rad", source="flatter than 1 in 33: no turnout is", gt=0.0)
    radius_error: float = quantity(0.015, unit="-", source="illustrative: tachometer's scale, one std", gt=0.0)

    requires: ClassVar[tuple[str, ...]] = (PITCH, YAW)
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            BOUNCE: "smaller errors of place and dip",
            ROLL: "which rail a dip is in",
        }
    )

    def estimate(self, measurements: Measurements) -> Estimate:
        """Series of the bogie's yaw from the plain track's direction, and events.

        Raises
        ------
        InputError : a channel, the speed or a vehicle parameter is missing.
        """
        self.need(measurements)
        odometry = integrate_speed(measurements, self.speed_source, self.slowest)
        turning, valid = heading_rate(measurements, odometry)
        heading = np.cumsum(turning) * odometry.spacing
        dips, channels, good = find_dips(measurements, odometry, self.cut_off, self.threshold)
        chord, _ = chord_rotation(measurements, odometry, self.cut_off)
        switch_events: list[dict[str, Any]] = []
        crossovers = []
        for crossover in find_crossovers(heading, valid, odometry.spacing, self.smallest):
            heading = levelled(heading, crossover, odometry.spacing)
            parts = assigned(dips, np.abs(heading / crossover.angle), crossover, odometry.spacing)
            scale, scale_std = self._scale(-chord, good, odometry, dips, parts, measurements)
            entry, members = self._described(
                crossover, dips, parts, odometry, heading, scale, scale_std, len(channels) > 1
            )
            crossovers.append(entry)
            switch_events += members
        series = pd.DataFrame(
            {
                "s [m]": odometry.s,
                "time [s]": odometry.time,
                "yaw [rad]": np.where(valid, heading, np.nan),
                "lateral_curvature [1/m]": np.where(valid, turning, np.nan),
                "vertical_curvature [1/m]": np.where(good, -chord, np.nan),
                "valid [-]": (valid & good).astype(float),
            }
        )
        about = {"settings": self.model_dump(mode="json"), "crossovers": crossovers, "events": switch_events}
        about |= odometry.stated()
        return Estimate(self.name, series, about)

    def _scale(
        self,
        chord: np.ndarray,
        good: np.ndarray,
        odometry: Odometry,
        dips: Dips,
        parts: dict[str, int],
        measurements: Measurements,
    ) -> tuple[float, float]:
        """Measured over true distance, less 1, from the wheelbase in the dips' curvature; standard deviation."""
        which = np.array(sorted(parts.values()), dtype=np.int64)
        if not which.size:
            return 0.0, self.radius_error
        base = float(measurements.vehicle["semi_wheelbase"])
        one = channel(chord, np.where(good, chord, 0.0), good, "chord", base, 0.0, odometry.spacing)
        fits = np.array([_explained(one, dips.take(which), scale) for scale in SCALES])
        merit = fits - (SCALES / self.radius_error) ** 2 / 2
        best = int(np.clip(merit.argmax(), 1, len(SCALES) - 2))
        step = SCALES[1] - SCALES[0]
        low, middle, high = merit[best - 1 : best + 2]
        curvature = max(2 * middle - low - high, 1e-9)
        return float(SCALES[best] + step * (high - low) / (2 * curvature)), float(step / np.sqrt(curvature))

    def _described(
        self,
        crossover: DetectedCrossover,
        dips: Dips,
        parts: dict[str, int],
        odometry: Odometry,
        heading: np.ndarray,
        scale: float,
        scale_std: float,
        sides: bool,
    ) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        letters = sorted(parts)
        members = events(dips.take(np.array([parts[one] for one in letters], dtype=np.int64)), odometry, sides)
        distances = {one: member["s [m]"] for one, member in zip(letters, members, strict=True)}
        middle = _middle(distances, crossover.middle * odometry.spacing)
        for letter, member in zip(letters, members, strict=True):
            member["kind"], member["label"] = KINDS[letter], letter
            member["from_middle [m]"] = (member["s [m]"] - middle) / (1 + scale)
            member["from_middle_std [m]"] = float(np.hypot(member["s_std [m]"], member["from_middle [m]"] * scale_std))
        inside = [distances.get("C", middle - 2.0), distances.get("D", middle + 2.0)]
        between = (odometry.s > inside[0]) & (odometry.s < inside[1])
        angle = float(np.median(heading[between]))
        near = heading[np.abs(odometry.s - middle) < REACH]
        largest = float(near[np.abs(near).argmax()])
        entry = {
            "middle [m]": middle,
            "crossing_angle [rad]": angle,
            "largest_yaw [rad]": largest,
            "odometer_scale [-]": scale,
            "odometer_scale_std [-]": scale_std,
        }
        return entry, members


def heading_rate(measurements: Measurements, odometry: Odometry) -> tuple[np.ndarray, np.ndarray]:
    """Yaw rate over speed less the gyro's bias (median of the record), 1/m, 0 where not valid, and where it is."""
    time = measurements.time(YAW) - data_sheet(measurements.about, YAW).delay
    rate, valid = odometry.resample(time, measurements[YAW])
    bias = float(np.median(rate[valid])) if valid.any() else 0.0
    return np.where(valid, (rate - bias) / odometry.speed, 0.0), valid


def find_crossovers(heading: np.ndarray, valid: np.ndarray, spacing: float, smallest: float) -> list[DetectedCrossover]:
    """Where the heading differs from that `REACH` before and after, those two being alike."""
    reach = round(REACH / spacing)
    if len(heading) <= 2 * reach + 1:
        return []
    ahead, behind = heading[2 * reach :], heading[: -2 * reach]
    excess = heading[reach:-reach] - (ahead + behind) / 2
    smooth = np.convolve(excess, np.ones(round(4 / spacing)) / round(4 / spacing), mode="same")
    peaks = signal.find_peaks(np.abs(smooth), height=smallest, distance=reach)[0]
    alike = np.abs(ahead - behind) < 0.5 * np.abs(excess)
    crossovers = []
    for peak in peaks:
        top = np.flatnonzero(np.abs(smooth) > 0.85 * np.abs(smooth[peak]))
        top = top[np.abs(top - peak) < reach // 2]
        middle = round(float(top.mean()))
        if alike[middle] and valid[middle : middle + 2 * reach].all():
            crossovers.append(DetectedCrossover(middle + reach, float(smooth[peak])))
    return crossovers


def levelled(heading: np.ndarray, crossover: DetectedCrossover, spacing: float) -> np.ndarray:
    """Heading from that of the plain track on both sides of a crossover: what drifts in between is the gyro."""
    reach, plain = round(REACH / spacing), round(PLAIN / spacing)
    rows = np.arange(len(heading))
    beyond = (np.abs(rows - crossover.middle) >= reach) & (np.abs(rows - crossover.middle) <= reach + plain)
    line = np.polynomial.Polynomial.fit(rows[beyond], heading[beyond], 1)
    return heading - line(rows)


def assigned(dips: Dips, share: np.ndarray, crossover: DetectedCrossover, spacing: float) -> dict[str, int]:
    """Which dip is which part, by the share of the crossing angle that the bogie has turned when it gets there."""
    rows = np.clip(np.rint(dips.distance / spacing).astype(np.int64), 0, len(share) - 1)
    passed = share[rows]
    near = np.abs(rows - crossover.middle) * spacing < REACH
    numbers = {}
    for side, letters in LETTERS.items():
        there = near & ((rows < crossover.middle) if side == "before" else (rows >= crossover.middle))
        ranges = ((0.8, 2.0), (0.12, 0.75), (-1.0, 0.12))
        for letter, (low, high) in zip(letters, ranges, strict=True):
            candidates = np.flatnonzero(there & (passed > low) & (passed <= high))
            if candidates.size:
                numbers[letter] = int(candidates[dips.snr[candidates].argmax()])
    return numbers


def _explained(chord: Channel, dips: Dips, scale: float) -> float:
    """Half the sum of squares that the dips explain with a wheelbase that much longer on the odometer."""
    fitted = refine([replace(chord, half_base=chord.half_base * (1 + scale))], dips, steps=3)
    return float(np.sum(fitted.snr**2) / 2)


def _middle(distances: dict[str, float], otherwise: float) -> float:
    """Mean of the middles of the pairs A and F, B and E, C and D that are whole, m; `otherwise` where none is."""
    pairs = [(distances[a] + distances[b]) / 2 for a, b in ("AF", "BE", "CD") if a in distances and b in distances]
    return float(np.mean(pairs)) if pairs else otherwise
