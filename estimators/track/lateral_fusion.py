"""The fused estimate across the track: lateral path and cross level together, of all that the bogie feels sideways.

Readings pass a band-pass over distance first: what is longer than `LONGEST` the vehicle follows without motion of its
own, so that path and cant of that length are those of the bogie itself; they are added afterwards. Filter and model
are linear, so that a band-passed track makes the band-passed readings.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from estimators.filters.track_spectrum import ERRI_VERTICAL, TrackSpectrum
from estimators.signals.bands import Band, band_pass, transform
from estimators.speed.odometry import Odometry
from estimators.track.disturbances import FORCE, HEIGHT, Disturbance
from estimators.track.observations import Attitude, Observation, observation
from estimators.track.plane import Plane, TrackRegime
from estimators.track.sensor_pairs import WHEELSETS, axleboxes, displacements, singles, with_rails
from estimators.vehicle import lateral_roll
from estimators.vehicle.bump_stop import slope, steps
from estimators.vehicle.lateral_roll import COORDINATES, WHOLE
from estimators.vehicle.parameters import given
from estimators.vehicle.state_space import CANT_BASE, Output
from estimators.vehicle.suspension import BUMP_STOP, PIVOT, whole_body_yaw_inertia
from railsim.data_sheet import channels_on, data_sheet
from railsim.measurements import Measurements
from railsim.track.spectra import WC

YAW, ROLL, SIDE = "bogie.rate_yaw [rad/s]", "bogie.rate_roll [rad/s]", "bogie.acceleration_y [m/s2]"
LONGEST = 300.0  # m; longer waves are taken from the bogie's own path and roll
SHORTEST = 2.0  # m; shorter waves shake wheelsets by what the model leaves out, and belong to no band
ORDER = 8
PATH = 1000.0  # m; of the bogie's own path longer waves are left out
SPACING = 0.25  # m, about; the grid divides the wheelbase
LATERAL = ERRI_VERTICAL
"""The fit begins with it, and it stays where none can be made; ERRI's lateral spectrum has half of that level."""
CROSS_LEVEL = TrackSpectrum(4 * ERRI_VERTICAL.amplitude, 0, (0.001, WC))
"""Likewise; ERRI's upper corner, and freedom for the design cant below."""


BEGINS = (0.05, 0.5)  # sizes of disturbances from which the fit begins
BEHIND = TrackSpectrum(1.0, 0, (2.0 * np.pi / 60.0,))
"""Shape of what the other bogie does to the body: that of a track, level for waves longer than those of interest."""
WORN = {"design_conicity": 0.4, "design_contact_angle_rate": 1.0}
"""Logarithms of what wear and larger amplitudes make of contact slopes: 1.5 and 2.7 times; a fit begins there too."""


def _of(*names: str) -> tuple[int, ...]:
    return tuple(WHOLE.index(name) for name in names)


def disturbances(coordinates: Sequence[str]) -> tuple[Disturbance, ...]:
    """What is not in the lateral model: the other bogie, flanges, creep beyond its slope, contacts that move.

    The other bogie does to a whole body half of what the modelled one does; half a body knows of no other bogie. Both
    sizes are choices, made with whole_coach and curve_r400 in view.
    """
    body = tuple(name for name in ("body.y", "body.yaw") if name in coordinates)
    behind = 0.5 if "body.yaw" in coordinates else 0.05
    return (
        Disturbance("lateral force on the body", _of(*body), BEHIND, size=behind, begins=BEGINS),
        Disturbance("roll moment on the body", _of("body.roll"), BEHIND, size=behind, begins=BEGINS),
        Disturbance("roll moment on the bogie", _of("bogie.roll"), begins=BEGINS),
        Disturbance("yaw moment on the bogie", _of("bogie.yaw"), begins=BEGINS),
        Disturbance("yaw moment on wheelsets", _of("wheelset1.yaw", "wheelset2.yaw"), begins=BEGINS, local=True),
        Disturbance("lateral force on the bogie", _of("bogie.y"), FORCE, begins=BEGINS),
        Disturbance("lateral force on wheelsets", _of("wheelset1.y", "wheelset2.y"), FORCE, begins=BEGINS, local=True),
        Disturbance("lean of wheelsets over the rails", (1, 3), HEIGHT, of_rails=True, size=0.02, spread=1.0),
    )


def fits(measurements: Measurements) -> bool:
    """Whether the bogie's three lateral channels and all parameters are there."""
    return all(name in measurements for name in (YAW, ROLL, SIDE)) and given(measurements.vehicle, lateral_roll.NEEDED)


def passed(reading: Observation, odometry: Odometry) -> Observation:
    """Without waves longer than `LONGEST` or shorter than `SHORTEST`; missing places are bridged for the filter and
    stay missing.
    """
    present = np.isfinite(reading.values)
    if not present.any():
        return reading
    at = np.arange(len(reading.values))
    bridged = np.interp(at, at[present], reading.values[present])
    values = transform(bridged, odometry.spacing, _between, 3.0 * LONGEST, detrend=False)
    return replace(reading, values=np.where(present, values, np.nan))


def _between(k: np.ndarray) -> np.ndarray:
    return (1.0 - low(k)) / (1.0 + (k * SHORTEST / (2.0 * np.pi)) ** (2 * ORDER))


def long_waves(vehicle: Mapping[str, Any], odometry: Odometry, moved: Attitude | None) -> tuple[np.ndarray, np.ndarray]:
    """Path and cross level of the bogie itself at the leading wheelset, m, shapes (n,): waves longer than `LONGEST`."""
    if moved is None:
        return np.zeros(len(odometry.s)), np.zeros(len(odometry.s))
    arm = vehicle["semi_wheelbase"]

    def passed(values: np.ndarray) -> np.ndarray:
        return transform(
            values, odometry.spacing, lambda k: low(k) * np.exp(1j * k * arm), 3.0 * LONGEST, detrend=False
        )

    path = band_pass(passed(moved.yaw_rate / odometry.speed), odometry.spacing, Band(0.0, PATH), integrate=2)
    return path, -CANT_BASE * passed(moved.roll)


def low(k: np.ndarray) -> np.ndarray:
    """Share of an angular wavenumber that is left to the bogie's own path."""
    return 1.0 / (1.0 + (k * LONGEST / (2.0 * np.pi)) ** ORDER)


def across(
    measurements: Measurements,
    odometry: Odometry,
    fitted: dict[str, float],
    unknown: dict[str, float],
    regimes: tuple[TrackRegime, ...],
    kind: np.ndarray,
    lift: Callable[[Output], tuple[np.ndarray, float]],
) -> list[Plane]:
    """The lateral plane with all readings, of half a vehicle, and of a whole one where the bogies' distance is given.
    Where the parameters are those of a whole vehicle it is that one alone.

    Parameters
    ----------
    fitted, unknown, regimes, kind : see `Plane`.
    lift : what the vertical estimate says of a sensor at a wheelset, see `singles`.
    """
    observations = [
        observation(measurements, odometry, YAW, Output("rate", axis="yaw")),
        observation(measurements, odometry, ROLL, Output("rate", axis="roll")),
    ]
    for name in channels_on(measurements, "bogie", "acceleration_y"):
        output = Output("acceleration", data_sheet(measurements.about, name).position)
        observations.append(observation(measurements, odometry, name, output))
    for number, x in WHEELSETS:
        for name in channels_on(measurements, f"wheelset{number}", "acceleration_y"):
            observations.append(with_rails(measurements, odometry, name, Output("axlebox", (x, 0.0, 0.0))))
    observations += displacements(measurements, odometry, half_difference=True)
    observations += axleboxes(measurements, odometry, half_difference=True)
    observations += singles(measurements, odometry, lift)
    outputs = [one.output for one in observations]
    vehicle = dict(measurements.vehicle)
    half = Plane(
        lambda p, speed: lateral_roll.lateral(p, outputs, speed),
        vehicle,
        unknown,
        fitted,
        [passed(one, odometry) for one in observations],
        (LATERAL, CROSS_LEVEL),
        disturbances(COORDINATES),
        partial(start, COORDINATES),
        regimes,
        kind,
        varying=tuple(WORN),
        begins=(WORN,),
    )
    distance = vehicle.get("semi_bogie_spacing", 0.0)
    if not distance > 0.0:
        return [half]
    whole = vehicle | {PIVOT: distance, "body_yaw_inertia": whole_body_yaw_inertia(vehicle)}
    free = replace(
        half,
        vehicle=whole,
        disturbances=disturbances(WHOLE),
        start=partial(start, WHOLE),
        whole=lambda p, speed, k: lateral_roll.along_the_track(p, outputs, speed, k),
    )
    return [free] if "whole_body_mass" in vehicle else [half, free]


def track_regimes(
    vehicle: Mapping[str, Any], curve: np.ndarray, unbalanced: np.ndarray
) -> tuple[tuple[TrackRegime, ...], np.ndarray]:
    """Kinds of places: straight track, curves, and curves in which the body leans on its bump stop, more or less.

    Parameters
    ----------
    vehicle : nominal parameters. curve : where the track is curved, shape (n,). unbalanced : see `slope`, m/s2.
    """
    mean, spread = slope(vehicle, unbalanced)
    step = np.where(curve, 1 + steps(vehicle, unbalanced), 0)
    numbers = [0, *(int(one) for one in np.unique(step) if one > 0)]
    usual = max(numbers[1:], key=lambda one: np.count_nonzero(step == one), default=0)
    regimes = []
    for number in numbers:
        here = step == number
        sized_as = numbers.index(usual) if number else 0
        if number < 2:
            regimes.append(TrackRegime(sized_as=sized_as))
        else:
            stiff = float(mean[here].mean())
            regimes.append(TrackRegime({BUMP_STOP: stiff}, {BUMP_STOP: float(spread[here].mean()) / stiff}, sized_as))
    return tuple(regimes), np.searchsorted(numbers, step)


def start(coordinates: Sequence[str], height: np.ndarray, slope: np.ndarray, speed: float) -> np.ndarray:
    """Standard deviations of the states at the start."""
    shift, rotation, roll = height[0] + height[1], slope[0] + slope[1], height[1] / CANT_BASE
    of_axis = {"y": shift, "roll": roll, "yaw": rotation}
    share = [{"body.y": 3, "body.roll": 2}.get(name, 1) for name in coordinates]
    positions = np.array([of_axis[name.partition(".")[2]] for name in coordinates])
    return np.concatenate([share * positions, speed * (np.array(share) * rotation)])
