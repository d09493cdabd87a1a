"""Conicity function, rails, gauge and state together, without a known track: the most likely function and a smoother.

Where the gauge is constant, one Kalman filter has everything (`_conicity_likelihood`). Where it varies, the conicity
of worn wheels changes along the line by more than its mean, which no Gaussian holds: there the Kalman smoother is left
with what does not depend on the conicity, the wheelset's path y and half the difference of the rolling radii D, and
particles integrate rails and gauge out (`_gauge_likelihood`).
"""

from typing import ClassVar

import numpy as np
import pandas as pd

from estimators._conicity_kernel import PSI, PSI_RATE, RAIL, Numbers, Record, Y
from estimators._conicity_likelihood import Likelihood, Posterior, Prior
from estimators._gauge_kernel import Process
from estimators._gauge_likelihood import GaugeLikelihood, Rails
from estimators._wheel_basis import wheel_basis
from estimators._wheelset_model import fits, wheelset_model
from estimators._wheelset_motion import BODY, SPEEDS, TRANSDUCER, YAW, filled, wheelset_speed
from estimators.interface import Estimate, Estimator
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

ERRI = "ERRI B176 (1989), lateral"
POINTS = 121
QUANTILE = 0.999  # of the visited shifts, to which the function is stated
SETTLED = 30.0  # m at the start that the particles do not read: the Kalman smoother's own settling
FEWEST = 1000  # steps that the particles need: 300 m, tens of waves of the gauge
TOGETHER = 3.0  # m over which the error of the shift hangs together: the gauge's own length
WHEEL_REACH, WHEEL_PIECES = 4e-3, 16  # m; of one wheel's slope: pieces of 0.5 mm, in which hollow wheels bend
WHEEL_ROUGHNESS = 0.3  # second difference of the slope, hollow wheels 1
TILT, TURN, MIDDLE = 0.6, 1e-3, 4e-4  # of the slope at the start: steeper towards the flange, over m, about m
LOGARITHMS = 4  # last parameters of the Kalman filter's likelihood
BRIDGED = 0.05  # s; samples in longer gaps are left out


class ConicitySmoother(Estimator, frozen=True):
    """Yaw gyro, lateral accelerometer of the mass above, transducer between it and the wheelset, speed: nothing else.

    The rails are a random process of which the spectrum's shape is known and the level is not. Without that shape the
    conicity cannot be found: every conicity has rails that explain the sensors exactly. What is found is the function
    at mean gauge. Where the gauge is known to be constant, say `gauge` = 0: faster, and smaller deviations.
    """

    spacing: float = quantity(0.3, unit="m between the filter's steps", source="waves of ERRI end at 1 m", gt=0.0)
    pieces: int = quantity(9, unit="of the conicity over |y - d|", source="illustrative", ge=2, le=40)
    reach: float = quantity(5e-3, unit="m", source="illustrative", gt=0.0)
    corner: float = quantity(0.8246, unit="rad/m", source=ERRI, gt=0.0)
    slow_corner: float = quantity(0.0206, unit="rad/m", source=ERRI, gt=0.0)
    rail: float = quantity(7e-4, unit="m, level of the rails' noise (guess)", source="2 mm by ERRI's shape", gt=0.0)
    creep: float = quantity(
        0.6, unit="share of Kalker's slope", source="Polach (2005): 0.7 at none, less at working creepages", gt=0.0
    )
    creep_spread: float = quantity(0.03, unit="- of f11", source="illustrative", gt=0.0)
    slip: float = quantity(1.2e-3, unit="m/s (guess)", source="runs of wheelset_new", gt=0.0)
    slip_corner: float = quantity(20.0, unit="rad/s", source="kinematic motion at 30 m/s", gt=0.0)
    line: float = quantity(0.03, unit="- (guess): conicity by gauge", source="S1002 with 2 mm of gauge", gt=0.0)
    line_corner: float = quantity(0.2, unit="rad/m", source="illustrative: gauge over 30 m", gt=0.0)
    moment: float = quantity(150.0, unit="N m, unknown yaw moment", source="tuned: sharp contact changes", gt=0.0)
    noise: float = quantity(8.0, unit="- factor on the gyro's variance", source="tuned: what the model lacks", ge=1.0)
    least: float = quantity(1e-4, unit="m, std of the transducer's samples", source="tuned likewise", gt=0.0)
    conicity_spread: float = quantity(3.0, unit="-", source="flat: the data decide", gt=0.0)
    roughness: float = quantity(0.1, unit="- second difference of pieces", source="illustrative", gt=0.0)
    starts: int = quantity(3, unit="of the search", source="runs with a hollow of 0.27 mm, seeds 7208 to 7309", ge=1)
    model_error: float = quantity(0.008, unit="- (std)", source="tuned on 32 runs, seeds 7200 to 7505", ge=0.0)
    gauge: float = quantity(
        2e-3, unit="m (std) that the gauge is expected to vary by", source="Ward et al. 2011", ge=0.0
    )
    gauge_corner: float = quantity(0.8246, unit="rad/m", source="ERRI B176 (1989), gauge", gt=0.0)
    gauge_slow_corner: float = quantity(0.438, unit="rad/m", source="ERRI B176 (1989), gauge", gt=0.0)
    gauge_spread: float = quantity(0.3, unit="- of the gauge's level", source="illustrative", gt=0.0)
    particles: int = quantity(300, unit="of rails and gauge", source="runs of seeds 7600 to 7605", ge=20, le=20000)
    seed: int = quantity(643, unit="of the particles", source="any", ge=0)
    window: float = quantity(4.0, unit="s, of the conicity over time", source="illustrative", gt=0.0)

    requires: ClassVar[tuple[str, ...]] = (YAW, BODY, TRANSDUCER)

    def fits(self, measurements: Measurements) -> bool:
        """Whether the channels and the parameters of a single wheelset are there."""
        speed = any(name in measurements for name in SPEEDS)
        return super().fits(measurements) and speed and fits(measurements.vehicle)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Fit the function, then smooth.

        Raises
        ------
        InputError : a channel or parameter is missing, or the vehicle hardly moves.
        """
        self.need(measurements)
        time, record = self._record(measurements)
        likelihood = self.likelihood(measurements, record)
        posterior = likelihood.fit(1, False) if self.gauge > 0.0 else likelihood.fit(self.starts)
        conicity, spread = likelihood.conicity(posterior)
        states, deviation = likelihood.smooth(posterior)
        if self.gauge > 0.0:
            return self._with_gauge(time, record, likelihood.numbers, posterior, states, deviation)
        shift = states[:, Y] - states[:, RAIL]
        value = np.interp(np.abs(shift), likelihood.shift, conicity)
        running = self._moving(value * shift**2, record) / np.maximum(self._moving(shift**2, record), 1e-15)
        own = np.interp(np.sqrt(self._moving(shift**2, record)), likelihood.shift, spread)
        series = pd.DataFrame({
            "time [s]": time,
            "conicity [-]": running,
            "conicity_std [-]": np.hypot(own, self.model_error),
            "track_lateral [m]": states[:, RAIL],
            "track_lateral_std [m]": deviation[:, 0],
            "wheelset1.lateral_shift [m]": shift,
            "wheelset1.lateral_shift_std [m]": deviation[:, 1],
        })  # fmt: skip
        logs = np.exp(posterior.parameters[likelihood.count :])
        names: list[str] = ["f11 [N]", "rail_level [m]", "slip [m/s]", "line [-]"]
        found = dict(zip(names, logs.tolist(), strict=True))
        basis, own = likelihood.basis, posterior.covariance[: likelihood.count, : likelihood.count]
        return self._stated(series, likelihood.shift, conicity, basis @ own @ basis.T, np.abs(shift), found)

    def _with_gauge(
        self, time: np.ndarray, record: Record, numbers: Numbers, posterior: Posterior, states: np.ndarray,
        deviation: np.ndarray,
    ) -> Estimate:  # fmt: skip
        """By particles over rails and gauge; where they tell nothing, at both ends, the Kalman smoother's rails."""
        half = half_difference(numbers, record, states)
        along = np.concatenate([[0.0], np.cumsum(0.5 * (record.speed[1:] + record.speed[:-1]) * record.step)])
        places = np.arange(SETTLED, along[-1], self.spacing)
        if len(places) < FEWEST:
            raise InputError(
                f"{self.name}: {along[-1]:.0f} m are too short with varying gauge; give {FEWEST * self.spacing:.0f} m "
                "or set gauge to 0 if it is constant"
            )
        process = Process(self.gauge_slow_corner, self.gauge_corner, self.gauge * _per_deviation(self))
        rails = Rails(Process(self.slow_corner, self.corner, self.rail), process, (1.5, self.gauge_spread))
        basis = wheel_basis(WHEEL_REACH, WHEEL_PIECES, TILT, TURN, MIDDLE)
        cone = posterior.parameters[:-LOGARITHMS].mean()
        wheel, paths = GaugeLikelihood(
            np.interp(places, along, half), np.interp(places, along, states[:, Y]), self.spacing, rails, basis, cone,
            WHEEL_ROUGHNESS, self.conicity_spread, np.random.default_rng(self.seed), self.particles,
        ).fit()  # fmt: skip
        known = np.isfinite(paths[:, 0])
        inside = (along >= places[known][0]) & (along <= places[known][-1])
        shift, gauge, shift_std, gauge_std = (np.interp(along, places[known], column) for column in paths[known].T)
        shift = np.where(inside, shift, states[:, Y] - states[:, RAIL])
        shift_std = np.where(inside, shift_std, deviation[:, 1])
        square = np.maximum(self._moving(shift**2 + shift_std**2, record), 1e-15)
        count = self.window / record.step
        hanging = max(1.0, TOGETHER / (record.step * float(np.mean(record.speed))))
        by_shift = np.sqrt(self._moving((half * shift_std) ** 2, record) * hanging / count) / square
        function = np.interp(np.sqrt(square), basis.shift, np.sqrt(np.diag(wheel.covariance)))
        series = pd.DataFrame({
            "time [s]": time,
            "conicity [-]": self._moving(half * shift, record) / square,
            "conicity_std [-]": np.sqrt(by_shift**2 + function**2 + self.model_error**2),
            "track_lateral [m]": states[:, Y] - shift,
            "track_lateral_std [m]": np.hypot(deviation[:, 0], shift_std),
            "wheelset1.lateral_shift [m]": shift,
            "wheelset1.lateral_shift_std [m]": shift_std,
            "wheelset1.gauge_deviation [m]": np.where(inside, gauge, 0.0),
            "wheelset1.gauge_deviation_std [m]": np.where(inside, gauge_std, self.gauge),
        })  # fmt: skip
        levels = np.exp(wheel.parameters[-2:])
        found = {"rail_level [m]": float(levels[0]), "gauge_level [m]": float(levels[1])}
        found["best cone over the run [-]"] = float(half @ shift / np.sum(shift**2 + shift_std**2))
        visited = np.concatenate([np.abs(shift + one * shift_std) for one in (-1.0, 1.0)])
        return self._stated(series, basis.shift, wheel.conicity, wheel.covariance, visited, found)

    def _stated(
        self, series: pd.DataFrame, places: np.ndarray, conicity: np.ndarray, covariance: np.ndarray,
        visited: np.ndarray, found: dict[str, float],
    ) -> Estimate:  # fmt: skip
        """Function at the visited shifts, and conicity of the cone that fits best over the whole record."""
        table = np.linspace(-1.0, 1.0, POINTS) * float(np.quantile(visited, QUANTILE))
        spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        function = {
            "shift [m]": table.tolist(),
            "conicity [-]": np.interp(np.abs(table), places, conicity).tolist(),
            "conicity_std [-]": np.hypot(np.interp(np.abs(table), places, spread), self.model_error).tolist(),
            "kind": "secant",
        }
        weights = np.zeros(len(places))
        cell = np.minimum(visited / (places[1] - places[0]), len(places) - 1.001)
        near, share = cell.astype(int), cell - np.floor(cell)
        np.add.at(weights, near, (1.0 - share) * visited**2)
        np.add.at(weights, near + 1, share * visited**2)
        weights /= weights.sum()
        own = float(weights @ covariance @ weights)
        about = {
            "conicity_function": function,
            "found": found,
            "effective_conicity [-]": float(weights @ conicity),
            "effective_conicity_std [-]": float(np.hypot(np.sqrt(max(own, 0.0)), self.model_error)),
        }
        return Estimate(self.name, series, self.model_dump(mode="json") | about)

    def fitted(self, measurements: Measurements) -> tuple[Likelihood, np.ndarray]:
        """Likelihood of a record and its most likely parameters, for Fisher information."""
        likelihood = self.likelihood(measurements, self._record(measurements)[1])
        return likelihood, likelihood.fit(self.starts).parameters

    def _moving(self, values: np.ndarray, record: Record) -> np.ndarray:
        return _mean(values, max(1, round(self.window / record.step)))

    def likelihood(self, measurements: Measurements, record: Record) -> Likelihood:
        """What is maximised: for Fisher information and tests."""
        model = wheelset_model(measurements.vehicle, self.creep)
        c = model.numbers
        density = float(_sheet(measurements, YAW).get("noise_density", 0.0))
        white = max(density**2 / (2.0 * record.step), 1e-8)
        numbers = Numbers(
            c.I, c.l, c.r0, c.k_psi, c.f_psi, c.f11, self.corner, self.slow_corner, self.rail, self.slip_corner,
            self.slip, self.moment, self.line, self.line_corner, self.noise * white, self.least**2,
            max(float(_sheet(measurements, BODY).get("noise_density", 0.0)), 1e-4),
        )  # fmt: skip
        logs = np.log([c.f11, self.rail, self.slip, self.line])
        prior = Prior(
            model.conicity, self.conicity_spread, self.roughness, logs, np.array([self.creep_spread, 1.5, 1.0, 1.5])
        )
        return Likelihood(record, numbers, prior, self.reach, self.pieces)

    def _record(self, measurements: Measurements) -> tuple[np.ndarray, Record]:
        """Channels at the filter's rate: every sample of the gyro that falls on it, the others between their own."""
        typical = float(np.median(wheelset_speed(measurements, measurements.time(YAW))))
        every = max(1, round(measurements.rate(YAW) * self.spacing / max(typical, 1.0)))
        time = measurements.time(YAW)[::every]
        speed = wheelset_speed(measurements, time)
        if float(speed.min()) < 1.0:
            raise InputError(f"{self.name}: speed falls to {speed.min():.2g} m/s; choose a part that rolls faster")
        channels = []
        for name in (YAW, TRANSDUCER):
            values, good = filled(measurements, name, time)
            lost = ~good | (np.interp(time, measurements.time(name), np.isnan(measurements[name])) > BRIDGED)
            channels.append(np.where(lost, np.nan, values))
        force, _ = filled(measurements, BODY, time)
        return time, Record(channels[0], channels[1], force, speed, every / measurements.rate(YAW))


def _sheet(measurements: Measurements, name: str) -> dict[str, float]:
    try:
        return measurements.sensor(name).get("errors", {})
    except InputError:
        return {}


def half_difference(numbers: Numbers, record: Record, states: np.ndarray) -> np.ndarray:
    """(r_L - r_R) / 2 in m from smoothed yaw (n, states), by equation (18) with the yaw suspension and inertia."""
    c, rate = numbers, states[:, PSI_RATE]
    damping = 2.0 * c.l**2 * c.f11 / record.speed + c.c_psi
    moment = c.I * np.gradient(rate, record.step) + damping * rate + c.k_psi * states[:, PSI]
    return -c.r0 / (2.0 * c.l * c.f11) * moment


def _per_deviation(smoother: ConicitySmoother) -> float:
    """Level of the gauge's driving noise by its standard deviation."""
    slow, fast = smoother.gauge_slow_corner, smoother.gauge_corner
    return float(np.sqrt(2.0 * slow * fast * (slow + fast)))


def _mean(values: np.ndarray, count: int) -> np.ndarray:
    """Over a window of `count` samples, shorter at the ends."""
    weights = np.ones(min(count, len(values)))
    return np.convolve(values, weights, "same") / np.convolve(np.ones(len(values)), weights, "same")
