"""Speed of a recording's vehicle, from what its tachometer or its satellite receiver says.

A signal is the vehicle's speed, and what the wheel does beside it (it rolls on other radii, it yaws), and white noise.
Accelerations change seldom, and then by any amount. So the bends of the speed are Cauchy distributed: normal with a
variance of their own each (West 1987, Biometrika 74). What the wheel does is a first-order autoregression. Sizes are
those of the greatest likelihood; one banded matrix gives likelihood and mean (Rue and Held 2005, section 2.4).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize

from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.stamps import usual_step

STANDING = 0.2  # m/s, that is given for a vehicle that stands
SLOW = 2.0  # m/s, below which nothing is excited
FEWEST = 4  # samples of a speed
KNOT = 0.125  # s, between the speed's knots; illustrative
ROUNDS = 20  # of bends and sizes in turn, at most
SAME = 1e-4  # m/s; a round that changes the speed by less is the last
BEGIN = (1e-3, 1e-3, 1e-3, 0.2)  # of the sizes: noise, bend, wheel [m/s], time in which the wheel forgets [s]
LEAST, MOST = (
    (1e-4, 1e-6, 1e-5, 0.02),
    (10.0, 10.0, 10.0, 1.0),
)  # memory: a wheel's own motions last less than a second (illustrative); else what numbers bear
TURNS, FURTHER = 400, 100  # evaluations of a search for the sizes: the first, and each that follows


class MeasuredSpeed(NamedTuple):
    """Speed [m/s] over `time` [s], the relative standard deviation of its scale, and the wheel that told it."""

    time: np.ndarray
    speed: np.ndarray
    scale_std: float
    wheel: "Wheel | None" = None


class Wheel(NamedTuple):
    """Body on which a tachometer is mounted, and how its samples were smoothed."""

    body: str
    smoother: "Smoother"


def measured_speed(measured: Measurements, scenario: Scenario, duration: float, begin: float = 0.0) -> MeasuredSpeed:
    """Speed over time, from `begin` [s] of the recording on: by the tachometer or the satellite receiver, else the
    scenario's.

    The scale of a tachometer (wheel wear) is taken from the satellite receiver where both are there.

    Raises
    ------
    InputError : the vehicle hardly moves.
    """
    heard = {
        sheet["kind"]: sheet
        for sheet in measured.about["sensors"]
        if sheet.get("kind") in ("tachometer", "gnss") and _heard(measured, f"{sheet['name']}.speed [m/s]")
    }
    series = {kind: _series(measured, one["name"], kind == "tachometer", begin) for kind, one in heard.items()}
    knots, wheel = np.arange(0.0, duration + KNOT, KNOT), None
    if not series:
        speed = np.interp(knots, *scenario.speed.knots(duration))
        scale_std = 0.01
    else:
        if len(series) == 2 and np.median(series["tachometer"][1]) < SLOW <= np.median(series["gnss"][1]):
            del series["tachometer"]  # dead, or its wheel stands
        time, values = series.get("tachometer") or series["gnss"]
        speed, smoother = vehicle_speed(Signal(time, values, knots))
        body = heard["tachometer"].get("body") if "tachometer" in series else None
        wheel = Wheel(body, smoother) if body else None
        scale_std = 0.01 if "gnss" not in series else 0.002
        if len(series) == 2:
            time, receiver = series["gnss"]
            speed = speed * float(np.median(receiver / np.maximum(np.interp(time, knots, speed), 0.1)))
    if float(np.median(speed)) < SLOW:
        raise InputError(f"the vehicle moves slower than {SLOW:g} m/s most of the time; give a faster recording")
    return MeasuredSpeed(knots, np.maximum(speed, STANDING), scale_std, wheel)


def _heard(measured: Measurements, channel: str) -> bool:
    """Whether a channel is there and tells a speed."""
    return channel in measured and int(np.isfinite(measured[channel]).sum()) >= FEWEST


def _series(measured: Measurements, name: str, counted: bool, begin: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) instants [s] and speeds [m/s]; what is `counted` since the sample before is the speed in between."""
    channel = f"{name}.speed [m/s]"
    time, values = measured.time(channel) - begin, measured[channel]
    if counted:
        time = time - 0.5 * usual_step(time).size
    good = np.isfinite(values)
    return time[good], values[good]


def vehicle_speed(signal: "Signal") -> tuple[np.ndarray, "Smoother"]:
    """Speed at the knots [m/s], piecewise linear between them, and how the samples were smoothed."""
    weights, found = np.ones(len(signal.knots) - 2), np.full(len(signal.knots), np.inf)
    smoother = Smoother(signal, np.log(BEGIN), weights)
    for number in range(ROUNDS):
        sizes = signal.fitted(smoother.sizes, weights, FURTHER if number else TURNS)
        cost, speed = signal.at(sizes, weights)
        if not np.isfinite(cost):
            break
        before, found, smoother = found, speed, Smoother(signal, sizes, weights)
        if np.abs(found - before).max() < SAME:
            break
        weights = 0.5 * (1.0 + (np.diff(found, 2) / np.exp(sizes[1])) ** 2)
    return found, smoother


@dataclass(frozen=True, eq=False)
class Smoother:
    """How the samples of a signal were smoothed: logs of the sizes, and variances of the bends."""

    signal: "Signal"
    sizes: np.ndarray
    weights: np.ndarray

    def speed(self, values: np.ndarray) -> np.ndarray:
        """Speed at the knots [m/s] of other samples at the same instants, smoothed in the same way."""
        return replace(self.signal, values=values).at(self.sizes, self.weights)[1]


@dataclass(frozen=True, eq=False)
class Signal:
    """Samples of a speed [m/s] at `time` [s] as a linear function of speed and wheel at evenly spaced `knots` [s],
    s0 w0 s1 w1 ...
    """

    time: np.ndarray
    values: np.ndarray
    knots: np.ndarray

    def fitted(self, begin: np.ndarray, weights: np.ndarray, turns: int) -> np.ndarray:
        """Logs of the sizes of greatest likelihood, with these variances of the bends (in units of their size)."""
        options: dict[str, Any] = {"maxfev": turns, "xatol": 0.02, "fatol": 0.02}
        bounds = list(zip(np.log(LEAST), np.log(MOST), strict=True))
        return minimize(lambda x: self.at(x, weights)[0], begin, method="Nelder-Mead", bounds=bounds, options=options).x

    def at(self, sizes: np.ndarray, weights: np.ndarray) -> tuple[float, np.ndarray]:
        """Minus twice the log likelihood (up to a constant), and the mean of the speed at the knots; infinite where the
        bends are too small for the numbers.
        """
        noise, bend, wheel, memory = np.exp(sizes)
        count, kept = len(self.knots), np.exp(-(self.knots[1] - self.knots[0]) / memory)
        fresh = wheel**2 * (1.0 - kept**2)
        matrix = self._data / noise**2
        for first, one in enumerate((1.0, -2.0, 1.0)):
            for second, two in list(enumerate((1.0, -2.0, 1.0)))[first:]:
                row = matrix[2 * (second - first), 2 * first : 2 * (first + count - 2) : 2]
                row += one * two / (bend**2 * weights)
        matrix[0, 1::2] += np.r_[1.0, np.full(count - 2, 1.0 + kept**2), 1.0] / fresh
        matrix[2, 1:-2:2] -= kept / fresh
        try:
            root = cholesky_banded(matrix, lower=True)
        except np.linalg.LinAlgError:
            return np.inf, np.full(count, np.nan)
        mean = cho_solve_banded((root, True), self._right / noise**2)
        square = (self.values @ self.values - self._right @ mean) / noise**2
        logs = 2.0 * np.log(root[0]).sum() + 2.0 * len(self.values) * np.log(noise)
        logs += np.log(bend**2 * weights).sum() + (count - 1) * np.log(fresh) + 2.0 * np.log(wheel)
        return float(square + logs), mean[::2]

    @cached_property
    def _cells(self) -> tuple[np.ndarray, np.ndarray]:
        """Knot before each sample, and the share of the next one."""
        place = np.clip((self.time - self.knots[0]) / (self.knots[1] - self.knots[0]), 0.0, len(self.knots) - 1.001)
        return place.astype(int), place - place.astype(int)

    def _sum(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """(knots,) of what samples give to the knot before and to the one after."""
        cell, count = self._cells[0], len(self.knots)
        return np.bincount(cell, before, count) + np.bincount(cell + 1, after, count)

    @cached_property
    def _data(self) -> np.ndarray:
        """(5, 2 knots) lower band of the samples' matrix, for noise of 1 m/s."""
        share = self._cells[1]
        own, next_one = self._sum((1.0 - share) ** 2, share**2), self._sum((1.0 - share) * share, 0.0 * share)[:-1]
        found = np.zeros((5, 2 * len(self.knots)))
        found[0, ::2] = found[0, 1::2] = found[1, ::2] = own
        for row, first in ((2, 0), (2, 1), (3, 0), (1, 1)):  # with speed and wheel of the next knot
            found[row, first:-2:2] += next_one
        return found

    @cached_property
    def _right(self) -> np.ndarray:
        share = self._cells[1]
        return np.repeat(self._sum((1.0 - share) * self.values, share * self.values), 2)
