"""What the estimators of track geometry share: settings, the columns of their series, cleaning of a gyro's signal."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd

from estimators.interface import Estimate, Estimator, Missing
from estimators.signals.bands import Band, band_pass, bands_of, settled, transform
from estimators.signals.frequency_response import filter_time
from estimators.speed.odometry import Odometry, SpeedSource, integrate_speed, missing_speed
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

Gain = Callable[[np.ndarray], np.ndarray]
PAPER = "Ward et al. 2011, section 3.2"
CANT_BASE = 1.5  # m, distance of the rail centres over which cross level is given (EN 13848-1)
APART = 1.06  # ratio of neighbouring speeds between which responses are blended
STANDING = 2.0  # s of standstill from which a bias is taken
ENDS = 25.0  # m, longest wavelength of D1: closer to an end or a gap (or than half of `cut`) nothing is called valid


class TrackEstimator(Estimator, frozen=True):
    """Base: distance from a speed source, wavelengths up to `cut`."""

    speed_source: SpeedSource = quantity("tachometer", unit="-", source=PAPER)
    slowest: float = quantity(1.0, unit="m/s", source="illustrative: slower is marked as invalid", gt=0.0)
    cut: float = quantity(70.0, unit="m", source=f"{PAPER}: wavelengths below 35 m or 70 m", gt=6.0, le=300.0)

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, a speed among it."""
        return super().missing(measurements) + missing_speed(measurements, self.speed_source)

    def odometry(self, measurements: Measurements) -> Odometry:
        """Distance; raises `InputError` where a channel or the speed is missing."""
        self.need(measurements)
        return integrate_speed(measurements, self.speed_source, self.slowest)

    def result(
        self, odometry: Odometry, columns: Mapping[str, np.ndarray], good: np.ndarray, **about: object
    ) -> Estimate:
        """The estimate from its columns; `good`: where all that went in was measured."""
        valid = settled(good, odometry.spacing, max(ENDS, self.cut / 2.0))
        table = {"s [m]": odometry.s, "time [s]": odometry.time, **columns, "valid [-]": valid.astype(float)}
        about = {"settings": self.model_dump(mode="json"), **odometry.stated(), **about}
        return Estimate(self.name, pd.DataFrame(table), about)


def geometry(
    name: str,
    values: np.ndarray,
    good: np.ndarray,
    odometry: Odometry,
    cut: float,
    integrate: int = 0,
    bands: Mapping[str, Band] | None = None,
) -> dict[str, np.ndarray]:
    """Columns of one quantity: wavelengths below `cut`, then the bands, each where its filter has settled.

    Parameters
    ----------
    name : "vertical" and the like, in m after integration.
    values : on the grid, shape (n,). good : where they are measured.
    integrate : how often to integrate over distance.
    bands : those that are given; all of the quantity's where None.
    """
    masked = np.where(good, values, np.nan)
    whole = {f"{name} [m]": band_pass(masked, odometry.spacing, Band(0.0, cut), integrate)}
    return whole | in_bands(name, values, good, odometry, integrate, bands)


def in_bands(
    name: str,
    values: np.ndarray,
    good: np.ndarray,
    odometry: Odometry,
    integrate: int = 0,
    bands: Mapping[str, Band] | None = None,
) -> dict[str, np.ndarray]:
    """Those of `geometry` in bands; `values` may be several in rows, shape (..., n), and the columns are so then."""
    masked, columns = np.where(good, values, np.nan), {}
    for band, edges in (bands_of(name) if bands is None else bands).items():
        found = band_pass(masked, odometry.spacing, edges, integrate)
        found[..., ~settled(good, odometry.spacing, edges.longest)] = np.nan
        columns[f"{name}_{band} [m]"] = found
    return columns


def filled(values: np.ndarray) -> np.ndarray:
    """Lost samples (NaN) bridged by straight lines; zeros where there is nothing at all."""
    good = np.isfinite(values)
    if good.all():
        return np.asarray(values)
    if not good.any():
        return np.zeros(len(values))
    index = np.arange(len(values))
    return np.interp(index, index[good], np.asarray(values)[good])


def turning(
    measurements: Measurements,
    name: str,
    odometry: Odometry,
    gain: Callable[[np.ndarray], np.ndarray] | None = None,
    ahead: float = 0.0,
    samples: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """A gyro's rate over the speed (1/m) on the grid, bias taken out, and where it is measured.

    Parameters
    ----------
    gain : response of a filter over time, by angular frequency in rad/s.
    ahead : how far before the bogie's centre the place lies to which the rate shall belong, m.
    samples : to be taken in place of the measured ones; they have no bias and none is lost. Several in rows, shape
        (rows, k), give values of shape (rows, n).
    """
    if samples is None:
        samples = filled(without_bias(measurements[name], measurements.time(name), odometry))
    rate = samples
    if gain is not None:
        rate = filter_time(rate, measurements.rate(name), gain)
    values, good = odometry.channel(measurements, name, ahead, rate)
    values /= odometry.speed_behind(ahead)
    return values, good


def without_bias(values: np.ndarray, time: np.ndarray, odometry: Odometry, still_only: bool = False) -> np.ndarray:
    """A gyro's signal less its bias: the mean at standstill where there is 2 s of it, or else the mean of the record.

    `still_only` : leave it as it is where there was no standstill (in a curve the mean is no bias).
    """
    speed = np.interp(time, odometry.knots, odometry.speed_at_knots)
    still = (speed < 1e-3) & np.isfinite(values)
    stood = still.any() and still.sum() * float(np.median(np.diff(time))) >= STANDING
    chosen = still if stood else np.isfinite(values) & (not still_only)
    return values - (float(np.mean(values[chosen])) if chosen.any() else 0.0)


def by_speed(
    inputs: Sequence[np.ndarray], odometry: Odometry, filters_at: Callable[[float], Sequence[Gain]], memory: float
) -> np.ndarray:
    """Sum of filtered inputs where the filters depend on the speed: those of neighbouring speeds, blended by place.

    Parameters
    ----------
    inputs : on the grid, NaN where there is nothing (at the same places).
    filters_at : speed (m/s) to one response by angular wave number (rad/m) for each input.
    memory : of the filters, m.
    """
    known = np.isfinite(inputs[0])
    if not known.any():
        return inputs[0]
    fast = odometry.speed[known]
    low, high = float(fast.min()), float(fast.max())
    speeds = np.geomspace(low, high, max(2, round(np.log(high / low) / np.log(APART)) + 1))
    table_index = np.clip(np.interp(odometry.speed, speeds, np.arange(len(speeds))), 0.0, len(speeds) - 1.0)
    total = np.where(known, 0.0, np.nan)
    for index, speed in enumerate(speeds):
        weight = np.maximum(0.0, 1.0 - np.abs(table_index - index))
        if weight[known].any():
            for values, gain in zip(inputs, filters_at(float(speed)), strict=True):
                total += weight * transform(values, odometry.spacing, gain, memory, detrend=False)
    return total


def number(measurements: Measurements, name: str) -> float:
    """A nominal parameter of the vehicle; raises `InputError` where about.json does not give it as a number."""
    value = measurements.vehicle.get(name)
    if not isinstance(value, int | float):
        raise InputError(f"vehicle parameter '{name}' is {value!r}; about.json must give a number in SI units")
    return float(value)


def rails(
    vertical: Mapping[str, np.ndarray], level: Mapping[str, np.ndarray], cant: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Columns of the left and the right rail from those of their mean and of cross level.

    Parameters
    ----------
    vertical, level : errors of both are taken as independent.
    cant : the bands that a curve's cant may have, m, named as those of cross level. Cross level holds it; a rail's own
        irregularity does not, so it is error there.
    """
    columns = {}
    for side, sign in (("left", -0.5), ("right", 0.5)):
        for name, values in vertical.items():
            of_level = name.replace("vertical", "cross_level")
            if of_level not in level or not (name.startswith("vertical") and name.endswith("[m]")):
                continue
            if "_std" in name:
                canted = np.nan_to_num(cant[of_level.replace("_std", "")])
                columns[f"{side}_{name}"] = np.sqrt(values**2 + (level[of_level] ** 2 + canted**2) / 4.0)
            else:
                columns[f"{side}_{name}"] = values + sign * level[of_level]
    return columns
