"""Conicity function, rails, gauge and state together, without a known track: the most likely function and a smoother.

Where the gauge is constant, one Kalman filter has everything (`wheel_rail.constant_gauge`). Where it varies, the
conicity of worn wheels changes along the line by more than its mean, which no Gaussian holds: there particles integrate
rails and gauge out (`wheel_rail.varying_gauge`).
"""

from collections.abc import Iterable
from typing import ClassVar

import numpy as np

from estimators.interface import Estimate, Estimator, Missing
from estimators.vehicle import single_wheelset
from estimators.vehicle.creep import DRY_WORKING
from estimators.vehicle.single_wheelset import wheelset_model
from estimators.wheel_rail.conicity_kernel import Numbers, WheelsetRecord
from estimators.wheel_rail.conicity_likelihood import ConicityPrior, Likelihood
from estimators.wheel_rail.constant_gauge import on_constant_gauge
from estimators.wheel_rail.rail_process import Corners, process
from estimators.wheel_rail.straight import told_of_curves
from estimators.wheel_rail.varying_gauge import Gauge, level_of, on_varying_gauge
from estimators.wheel_rail.wheelset_motion import BODY, TRANSDUCER, YAW, filled, missing_wheel_speed, wheelset_speed
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity
from railsim.track.spectra import WC, WR, WS

ERRI = "ERRI B176 (1989), lateral"
BRIDGED = 0.05  # s; samples in longer gaps are left out


class ConicitySmoother(Estimator, frozen=True):
    """Conicity over the shift of a single wheelset; the track need not be known.

    It takes yaw gyro, lateral accelerometer of the mass above, transducer between it and the wheelset, and speed. The
    rails are a random process of which the spectrum's shape is known and the level is not. Without that shape the
    conicity cannot be found: every conicity has rails that explain the sensors exactly. What is found is the function
    at mean gauge. Where the gauge is known to be constant, say `gauge` = 0: faster, and smaller deviations.
    """

    spacing: float = quantity(0.3, unit="m between the filter's steps", source="waves of ERRI end at 1 m", gt=0.0)
    pieces: int = quantity(9, unit="of the conicity over |y - d|", source="illustrative", ge=2, le=40)
    reach: float = quantity(5e-3, unit="m", source="illustrative", gt=0.0)
    corner: float = quantity(WC, unit="rad/m", source=ERRI, gt=0.0)
    slow_corner: float = quantity(WR, unit="rad/m", source=ERRI, gt=0.0)
    shortest: float = quantity(
        1.0, unit="m, wave at which rails and gauge end", source="EN 13848-1 (2019): range D0 begins there", gt=0.0
    )  # fmt: skip
    rail: float = quantity(7e-4, unit="m, level of the rails' noise (guess)", source="2 mm by ERRI's shape", gt=0.0)
    creep: float = quantity(
        DRY_WORKING,
        unit="share of Kalker's slope",
        source="Polach (2005): 0.7 at none, less at working creepages",
        gt=0.0,
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
    gauge_corner: float = quantity(WC, unit="rad/m", source="ERRI B176 (1989), gauge", gt=0.0)
    gauge_slow_corner: float = quantity(WS, unit="rad/m", source="ERRI B176 (1989), gauge", gt=0.0)
    gauge_spread: float = quantity(0.3, unit="- of the gauge's level", source="illustrative", gt=0.0)
    particles: int = quantity(300, unit="of rails and gauge", source="runs of seeds 7600 to 7605", ge=20, le=20000)
    seed: int = quantity(643, unit="of the particles", source="any", ge=0)
    window: float = quantity(4.0, unit="s, of the conicity over time", source="illustrative", gt=0.0)

    requires: ClassVar[tuple[str, ...]] = (YAW, BODY, TRANSDUCER)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the model of a single wheelset needs."""
        return single_wheelset.NEEDED

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, the wheelset's speed among it."""
        return super().missing(measurements) + missing_wheel_speed(measurements)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Fit the function, then smooth.

        Raises
        ------
        InputError : a channel or parameter is missing, or the vehicle hardly moves.
        """
        self.need(measurements)
        time, record = self._record(measurements)
        likelihood = self.likelihood(measurements, record)
        if self.gauge > 0.0:
            fit = on_varying_gauge(
                self.name, likelihood, self._gauge(), time, record, self.spacing, self.window, self.model_error
            )
        else:
            fit = on_constant_gauge(likelihood, self.starts, time, record, self.window, self.model_error)
        found = Estimate(self.name, fit.series, self.model_dump(mode="json") | fit.stated(self.model_error))
        return told_of_curves(found, measurements)

    def _gauge(self) -> Gauge:
        """What varies along the line."""
        level = level_of(self.gauge, self.gauge_slow_corner, self.gauge_corner)
        return Gauge(
            process(Corners(self.slow_corner, self.corner, self.shortest), self.rail, self.spacing),
            process(
                Corners(self.gauge_slow_corner, self.gauge_corner, self.shortest), level, self.spacing
            ),
            self.gauge_spread, self.gauge, self.conicity_spread, self.particles, self.seed,
        )  # fmt: skip

    def fitted(self, measurements: Measurements) -> tuple[Likelihood, np.ndarray]:
        """Likelihood of a record and its most likely parameters, for Fisher information."""
        likelihood = self.likelihood(measurements, self._record(measurements)[1])
        return likelihood, likelihood.fit(self.starts).parameters

    def likelihood(self, measurements: Measurements, record: WheelsetRecord) -> Likelihood:
        """What is maximised: for Fisher information and tests."""
        model = wheelset_model(measurements.vehicle, self.creep)
        c = model.numbers
        density = data_sheet(measurements.about, YAW).error("noise_density")
        white = max(density**2 / (2.0 * record.step), 1e-8)
        numbers = Numbers(
            c.I, c.l, c.r0, c.k_psi, c.f_psi, c.f11, self.corner, self.slow_corner, self.rail, self.slip_corner,
            self.slip, self.moment, self.line, self.line_corner, self.noise * white, self.least**2,
            max(data_sheet(measurements.about, BODY).error("noise_density"), 1e-4),
        )  # fmt: skip
        logs = np.log([c.f11, self.rail, self.slip, self.line])
        prior = ConicityPrior(
            model.conicity, self.conicity_spread, self.roughness, logs, np.array([self.creep_spread, 1.5, 1.0, 1.5])
        )
        return Likelihood(record, numbers, prior, self.reach, self.pieces)

    def _record(self, measurements: Measurements) -> tuple[np.ndarray, WheelsetRecord]:
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
        return time, WheelsetRecord(channels[0], channels[1], force, speed, every / measurements.rate(YAW))
