"""Conicity function, rails and state together, without a known track: smoother with the most likely function."""

from typing import ClassVar

import numpy as np
import pandas as pd

from estimators._conicity_kernel import RAIL, Numbers, Record, Y
from estimators._conicity_likelihood import Likelihood, Posterior, Prior
from estimators._wheelset_model import fits, wheelset_model
from estimators._wheelset_motion import BODY, SPEEDS, TRANSDUCER, YAW, filled, wheelset_speed
from estimators.interface import Estimate, Estimator
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

ERRI = "ERRI B176 (1989), lateral"
POINTS = 121
QUANTILE = 0.999  # of the visited shifts, to which the function is stated
BRIDGED = 0.05  # s; samples in longer gaps are left out


class ConicitySmoother(Estimator, frozen=True):
    """Yaw gyro, lateral accelerometer of the mass above, transducer between it and the wheelset, speed: nothing else.

    The rails are a random process of which the spectrum's shape is known and the level is not. Without that shape the
    conicity cannot be found: every conicity has rails that explain the sensors exactly. What is found is the function
    at mean gauge. Where the gauge is known to be constant, `gauge` = 0 states smaller deviations.
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
    gauge_error: float = quantity(
        20.0, unit="1/m: std of conicity by that", source="tuned on conicity_blind, worn", ge=0.0
    )
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
        posterior = likelihood.fit(self.starts)
        conicity, spread = likelihood.conicity(posterior)
        states, deviation = likelihood.smooth(posterior)
        shift = states[:, Y] - states[:, RAIL]
        value = np.interp(np.abs(shift), likelihood.shift, conicity)
        count = max(1, round(self.window / record.step))
        running = _moving(value * shift**2, count) / np.maximum(_moving(shift**2, count), 1e-15)
        own = np.interp(np.sqrt(_moving(shift**2, count)), likelihood.shift, spread)
        series = pd.DataFrame({
            "time [s]": time,
            "conicity [-]": running,
            "conicity_std [-]": np.hypot(own, self._wrong()),
            "track_lateral [m]": states[:, RAIL],
            "track_lateral_std [m]": deviation[:, 0],
            "wheelset1.lateral_shift [m]": shift,
            "wheelset1.lateral_shift_std [m]": deviation[:, 1],
        })  # fmt: skip
        table = np.linspace(-1.0, 1.0, POINTS) * float(np.quantile(np.abs(shift), QUANTILE))
        std = np.hypot(np.interp(np.abs(table), likelihood.shift, spread), self._wrong())
        function = {
            "shift [m]": table.tolist(),
            "conicity [-]": np.interp(np.abs(table), likelihood.shift, conicity).tolist(),
            "conicity_std [-]": std.tolist(),
            "kind": "secant",
        }
        logs = np.exp(posterior.parameters[likelihood.count :])
        found = dict(zip(("f11 [N]", "rail_level [m]", "slip [m/s]", "line [-]"), logs.tolist(), strict=True))
        about = {"conicity_function": function, "found": found} | self._effective(likelihood, posterior, shift)
        return Estimate(self.name, series, self.model_dump(mode="json") | about)

    def _wrong(self) -> float:
        """Standard deviation of what the model lacks: creep, sharp contact, and the gauge where it varies."""
        return float(np.hypot(self.model_error, self.gauge_error * self.gauge))

    def fitted(self, measurements: Measurements) -> tuple[Likelihood, np.ndarray]:
        """Likelihood of a record and its most likely parameters, for Fisher information."""
        likelihood = self.likelihood(measurements, self._record(measurements)[1])
        return likelihood, likelihood.fit(self.starts).parameters

    def _effective(self, likelihood: Likelihood, posterior: Posterior, shift: np.ndarray) -> dict[str, float]:
        """Conicity of the cone that fits best over the whole record, and its standard deviation."""
        place = np.abs(shift)
        basis = np.stack([np.interp(place, likelihood.shift, column) for column in likelihood.basis.T], axis=1)
        weights = shift**2 @ basis / np.sum(shift**2)
        count = likelihood.count
        variance = float(weights @ posterior.covariance[:count, :count] @ weights)
        return {
            "effective_conicity [-]": float(weights @ posterior.parameters[:count]),
            "effective_conicity_std [-]": float(np.hypot(np.sqrt(max(variance, 0.0)), self._wrong())),
        }

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


def _moving(values: np.ndarray, count: int) -> np.ndarray:
    """Mean over a window of `count` samples, shorter at the ends."""
    weights = np.ones(min(count, len(values)))
    return np.convolve(values, weights, "same") / np.convolve(np.ones(len(values)), weights, "same")
