"""What the estimators share that run the creep force filter: settings, channels, and the columns of what it gives."""

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from estimators.adhesion.bogie_place import BogiePlace, places
from estimators.adhesion.channels import WHEELSETS, LateralRecord, grid, has_all, read, used_channels
from estimators.adhesion.classifier import no_calibration, vehicles
from estimators.adhesion.creep_forces import Forces, find_forces, smoothed_forces
from estimators.adhesion.creep_model import ROLL_BODIES, Shaping, needed_parameters, parameters
from estimators.adhesion.force_budget import budgeted
from estimators.interface import Estimator, Missing
from estimators.signals.channel_health import Health, channel_health
from estimators.speed.odometry import SpeedSource, missing_speed
from railsim.measurements import Measurements
from railsim.spec import quantity

ILLUSTRATIVE = "illustrative"
SETTLE = 4.0  # s after which the high-pass has forgotten how the record begins


class CreepForceEstimator(Estimator, frozen=True):
    """What the filter that floats on its contacts can be told."""

    corner: float = quantity(
        0.3, unit="Hz, of the high-pass that every channel goes through", source=ILLUSTRATIVE, gt=0.01, le=2.0
    )
    force: float = quantity(5e3, unit="N, standard deviation of a wheelset's force", source=ILLUSTRATIVE, gt=0.0)
    moment: float = quantity(5e3, unit="N m, the same of its yaw moment", source=ILLUSTRATIVE, gt=0.0)
    correlation_time: float = quantity(0.1, unit="s, of force and moment", source=ILLUSTRATIVE, gt=0.0)
    secondary: float = quantity(
        5e2, unit="N, standard deviation of the error of the secondary suspension's force", source=ILLUSTRATIVE, gt=0.0
    )
    speed_source: SpeedSource = quantity("tachometer", unit="-", source="Ward et al. 2011, section 3.1")

    requires: ClassVar[tuple[str, ...]] = (
        "bogie.acceleration_y [m/s2]",
        "bogie.rate_yaw [rad/s]",
        "bogie.rate_roll [rad/s]",
        "body.acceleration_y [m/s2]",
    )
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            f"wheelset{number}.{quantity}": "forces of each wheelset, a surer level (all six sensors of the wheelsets)"
            for number in (1, 2)
            for quantity in ("acceleration_y [m/s2]", "rate_yaw [rad/s]", "rate_roll [rad/s]")
        }
    )

    @property
    def shaping(self) -> Shaping:
        """The unknown inputs as shaped noise."""
        return Shaping(self.force, self.moment, self.secondary, self.correlation_time)

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, a speed among it."""
        return super().missing(measurements) + missing_speed(measurements, self.speed_source)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return needed_parameters(measurements.vehicle)

    def forces(
        self,
        measurements: Measurements,
        health: Health,
        bodies: tuple[str, ...] = ROLL_BODIES,
        place: BogiePlace | None = None,
    ) -> Forces:
        """The filter over the recording of one bogie with the sensors of these bodies; the leading bogie where None."""
        record = self.record(measurements, health, bodies, place or places(measurements.vehicle)[0])
        return find_forces(record, parameters(measurements.vehicle), self.shaping)

    def net_forces(self, measurements: Measurements, health: Health, place: BogiePlace) -> Forces:
        """Smoothed over one bogie, with all that its data sheets leave unknown."""
        record = self.record(measurements, health, ROLL_BODIES, place)
        p = parameters(measurements.vehicle)
        lever = measurements.vehicle.get("arm_length")
        return smoothed_forces(record, p, budgeted(measurements.vehicle | p, record, self.shaping, lever))

    def record(
        self, measurements: Measurements, health: Health, bodies: tuple[str, ...], place: BogiePlace
    ) -> LateralRecord:
        """What the filter takes of one bogie, on the same times for every bogie."""
        used = [name for one in self.bogies(measurements, health) for name in used_channels(measurements, bodies, one)]
        time = grid(measurements, [name for name in used if name in health.good])
        return read(measurements, bodies, health.good, self.corner, self.speed_source, place, time)

    def bogies(self, measurements: Measurements, health: Health) -> list[BogiePlace]:
        """The leading bogie, and others whose wheelsets bear all sensors: their forces would be known by sums only."""
        own = ("bogie", *WHEELSETS)
        leading, *others = places(measurements.vehicle)
        return [leading, *(place for place in others if has_all(measurements, health.good, own, place))]

    def health(self, measurements: Measurements) -> Health:
        """Judgement of every channel that the filter can use."""
        names = [
            name for place in places(measurements.vehicle) for name in used_channels(measurements, ROLL_BODIES, place)
        ]
        return channel_health(measurements, dict.fromkeys(names))


class CalibratedEstimator(CreepForceEstimator, frozen=True):
    """One that goes by the calibration of the adhesion level, which some vehicles have."""

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, the vehicle's calibration among it."""
        name = measurements.vehicle.get("name")
        others = () if name in vehicles() else (no_calibration(str(name)),)
        return super().missing(measurements) + Missing(others=others)


def settled_rows(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Rows of `values` (n, k) that are whole, after the filter has settled, shape (n,)."""
    return (time >= time[0] + SETTLE) & np.isfinite(values).all(axis=1)


def columns_with_std(
    names: Sequence[str], values: np.ndarray, spread: np.ndarray, settled: np.ndarray
) -> dict[str, np.ndarray]:
    """Columns by name, each with its standard deviation; NaN where not `settled`.

    Parameters
    ----------
    names : as "quantity [unit]".
    values, spread : estimates and their standard deviations, shapes (n, number of names or more).
    settled : shape (n,).
    """
    table = {}
    for index, name in enumerate(names):
        bare, _, unit = name.partition(" [")
        table[name] = np.where(settled, values[:, index], np.nan)
        table[f"{bare}_std [{unit}"] = np.where(settled, spread[:, index], np.nan)
    return table
