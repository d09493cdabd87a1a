"""True speed by locking on to the travel time between the wheelsets with a motion model: sub-sample, without delay."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from estimators.speed.bogie_channels import Stepper, accelerometer_offset
from estimators.speed.inverse_filter import inverse_filter
from estimators.speed.motion_models import Motion, filter_bank
from estimators.speed.noise_slopes import noise_slope, power
from estimators.speed.travel_time import COLUMNS, Limits, Tracking, run
from estimators.speed.wheelset_correlation import WheelsetCorrelation
from estimators.speed.wheelset_filters import ACCELERATION, FORWARD, PITCH_RATE, Chain, chain
from estimators.vehicle.parameters import positive_numbers
from estimators.vehicle.vertical import NEEDED, pitch_frequency
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

LEAST = 0.1  # of `floor`; what a sensor without any noise is taken to have
TRIAL = "trial on tests/estimators/bogie_rig.py"


class SpeedRefined(WheelsetCorrelation, frozen=True):
    """Speed from the delay between both wheelsets' vertical accelerations, tracked with a model of the motion.

    The mismatch is w_2''(t) - w_1''(t - T), with V T - a T^2/2 = 2 Lb. A running correlation finds the travel time
    coarsely; a bank of extended Kalman filters (steady speed, steady acceleration, change) then drives the mismatch to
    zero step by step. Their memory is as long as the noise asks for and the motion allows. Errors of the vehicle's
    parameters that let one wheelset leak into the other are estimated too. Where the bogie's longitudinal acceleration
    is recorded at the same rate, it drives the motion model, and what is estimated is its bias (sensor, mounting,
    gradient): manoeuvres are then followed without delay. While the signals are no more than the sensors' noise, as at
    standstill, no travel time is looked for; a peak that stands in both directions alike is noise of one sensor. Noise
    that comes up on the way is seen in the mismatch: it takes weight from what is measured, and what of the slopes is
    noise is not counted as knowledge. After the travel time was lost, the speed of the search's window is carried on
    with the longitudinal acceleration less its known bias.
    """

    reach: float = quantity(
        1.3,
        unit="-",
        source="upper edge over the bogie's pitch frequency; manoeuvres are followed faster than at 1.0",
        gt=0.3,
        le=5,
    )
    threshold: float = quantity(0.5, unit="-", source="peak of unrelated signals stays below; " + TRIAL, gt=0, lt=1)
    ambiguity: float = quantity(1.5, unit="-", source="peak over the next one; " + TRIAL, ge=1)
    lost: float = quantity(0.05, unit="-", source="relative standard deviation at which a new search is better", gt=0)
    memory: float = quantity(1.0, unit="s", source="averaging of the mismatch's power; a few travel times", gt=0.1)
    model_error: float = quantity(
        5e-3,
        unit="-",
        source="power that curving and longitudinal forces add to the mismatch; chosen on figures 18 and 19, class175",
        gt=0,
        lt=1,
    )
    steady_speed: float = quantity(1e-6, unit="m2/s3", source="cruise drifts by some mm/s in 10 s; illustrative", gt=0)
    steady_acceleration: float = quantity(
        3e-7, unit="m2/s5", source="sum of gradient and thrust while coasting; illustrative", gt=0
    )
    first_acceleration: float = quantity(0.5, unit="m/s2", source="service braking and traction, EN 13452-1", gt=0)
    forward_bias: float = quantity(
        0.3, unit="m/s2", source="gradient of 3 %; bias and mounting of a MEMS sensor stay below", gt=0
    )
    gradient_change: float = quantity(
        1e-4, unit="m2/s5", source="gradient: 0.3 % (0.03 m/s2) within 10 s; illustrative", gt=0
    )
    cruise: float = quantity(
        0.01, unit="m/s2*s^0.5", source="1 cm/s of drift in a second of cruise; illustrative", gt=0
    )
    forward_change: float = quantity(
        0.02, unit="m2/s5", source="end of a gradient: 2 % (0.2 m/s2) within 2 s; illustrative", gt=0
    )
    change: float = quantity(0.5, unit="m2/s5", source="1 m/s2 reached within 2 s, EN 13452-1 service braking", gt=0)
    switch_rate: float = quantity(3e-3, unit="1/s", source="a change of motion every few minutes; illustrative", gt=0)
    inertia_spread: float = quantity(0.1, unit="-", source="parameter scatter between vehicles; illustrative", ge=0)
    gain_spread: float = quantity(0.02, unit="-", source="scale errors of MEMS data sheets", ge=0)
    lead_spread: float = quantity(0.5e-3, unit="s", source="half a sample at 1 kHz between two sensors", ge=0)
    damping_spread: float = quantity(0.3e-3, unit="s", source="damping over stiffness; 10 % of 3 ms", ge=0)
    secondary_spread: float = quantity(0.8e-3, unit="s", source="secondary over primary; 10 % of 8 ms", ge=0)
    acceleration_noise: float = quantity(6e-4, unit="m/s2/Hz^0.5", source="60 ug, industrial MEMS data sheets", gt=0)
    rate_noise: float = quantity(9e-5, unit="rad/s/Hz^0.5", source="0.005 deg/s, industrial MEMS data sheets", gt=0)

    nearby: ClassVar[bool] = True
    adds: ClassVar[Mapping[str, str]] = MappingProxyType({FORWARD: "a speed that is kept while the vehicle brakes"})

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return NEEDED

    def start(self, about: Mapping[str, Any], rate: float, forward: bool) -> Stepper:
        """Start a run; the longitudinal acceleration drives the motion models where it is measured."""
        if not self.slowest < self.fastest:
            raise InputError("speed_refined: 'slowest' must lie below 'fastest'")
        vehicle = about["vehicle"]
        positive_numbers(vehicle, NEEDED)
        high = self.reach * pitch_frequency(vehicle)
        filters = chain(vehicle, rate, self.low, high, True, accelerometer_offset(about))
        stride = max(1, int(rate / (8 * high)))
        densities = self.acceleration_noise, self.rate_noise
        limits = Limits(
            rate=rate,
            stride=stride,
            wheelbase=filters.wheelbase,
            delay=filters.delay,
            slowest=self.slowest,
            fastest=self.fastest,
            threshold=self.threshold,
            ambiguity=self.ambiguity,
            floor=self.floor**2,
            lost=self.lost,
            model_error=self.model_error,
            smoothing_factor=stride / (self.memory * rate),
            window_smoothing_factor=2 * stride / (self.window * rate),
            repeat=max(1.0, rate / stride / (2 * filters.bandwidth)),
            first=max(1, int(filters.wheelbase / self.fastest * rate / stride) - 1),
            spread=self._spread(),
            noise_slope=noise_slope(filters, rate, filters.wheelbase / self.slowest, densities),
            late=round(filters.delay * rate),
            first_acceleration=self.forward_bias if forward else self.first_acceleration,
            noise=self._still(about, filters, rate),
            cruise=self.cruise**2 if forward else 0.0,
        )
        filter_bank = self._driven_filter_bank(stride / rate) if forward else self._filter_bank(stride / rate)
        tracking = Tracking.new(inverse_filter(filters, rate, self.low), filter_bank, limits, self.window)
        return Stepper(COLUMNS, rate, lambda a, q, u: run(tracking, limits, a, q, u))

    def _still(self, about: Mapping[str, Any], filters: Chain, rate: float) -> float:
        """Power of the wheelsets' signals at standstill, (m/s2)^2: by the data sheets, or else `floor` squared."""
        vertical, pitch = data_sheet(about, ACCELERATION), data_sheet(about, PITCH_RATE)
        if not vertical.states("noise_density") or not pitch.states("noise_density"):
            return self.floor**2
        return max(power(filters, rate, (vertical.density(rate), pitch.density(rate))), (LEAST * self.floor) ** 2)

    def _spread(self) -> np.ndarray:
        return (
            np.array(
                [
                    self.inertia_spread,
                    self.inertia_spread,
                    self.gain_spread,
                    self.lead_spread,
                    self.damping_spread,
                    self.secondary_spread,
                ]
            )
            ** 2
        )

    def _driven_filter_bank(self, step: float) -> Motion:
        diffusion = np.zeros((3, 8))
        diffusion[:, 0] = self.steady_speed
        diffusion[:, 1] = self.steady_acceleration, self.gradient_change, self.forward_change
        diffusion[:, 2:] = self._spread() / 1000
        return filter_bank(np.full(3, np.inf), diffusion, step, self.switch_rate)

    def _filter_bank(self, step: float) -> Motion:
        slow = self._spread() / 1000  # the vehicle may have changed within a quarter of an hour
        diffusion = np.zeros((3, 8))
        diffusion[:, 0] = self.steady_speed
        diffusion[:, 1] = self.steady_acceleration, self.steady_acceleration, self.change
        diffusion[:, 2:] = slow
        diffusion[0, 1] = 0.0
        return filter_bank(np.array([0.3, np.inf, np.inf]), diffusion, step, self.switch_rate)
