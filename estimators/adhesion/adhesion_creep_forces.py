"""Net lateral creep force and yaw moment of each wheelset by a Kalman filter (Ward et al. 2011, section 4.2)."""

from typing import ClassVar

import numpy as np
import pandas as pd

from estimators.adhesion.channels import has_all, used_channels
from estimators.adhesion.creep_forces import FORCE_NAMES, MOTIONS, Forces, find_forces, force_spectra
from estimators.adhesion.creep_model import ROLL_BODIES, Shaping
from estimators.interface import Estimate, Estimator
from estimators.signals.channel_health import Health, channel_health
from estimators.speed.odometry import SpeedSource, has_speed
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

    @property
    def shaping(self) -> Shaping:
        """The unknown inputs as shaped noise."""
        return Shaping(self.force, self.moment, self.secondary, self.correlation_time)

    def fits(self, measurements: Measurements) -> bool:
        """Whether the recording has every channel, and a speed."""
        return super().fits(measurements) and has_speed(measurements, self.speed_source)

    def forces(self, measurements: Measurements, health: Health, bodies: tuple[str, ...] = ROLL_BODIES) -> Forces:
        """The filter over the recording with the sensors of these bodies."""
        return find_forces(measurements, bodies, health.good, self.corner, self.speed_source, self.shaping)

    def health(self, measurements: Measurements) -> Health:
        """Judgement of every channel that the filter can use."""
        return channel_health(measurements, used_channels(measurements, ROLL_BODIES))


class AdhesionCreepForces(CreepForceEstimator, frozen=True):
    """Net lateral force and yaw moment of each wheelset as the rails' unknown inputs, by a Kalman filter.

    The filter knows no creep law and no profile: the vehicle floats on its contacts. Gravity's force on a wheelset that
    stands aside is in the lateral force (`adhesion_creep_forces_profile` takes it out). Wheelset sensors are used where
    there are any; with bogie and body sensors alone only the sums over the bogie are known, and `_std` says so.
    """

    def estimate(self, measurements: Measurements) -> Estimate:
        """Forces over time, high-passed like every channel; NaN until the filter has settled."""
        self.need(measurements)
        health = self.health(measurements)
        forces = self.forces(measurements, health)
        return Estimate(self.name, force_table(forces), self.about_forces(measurements, health, forces))

    def about_forces(self, measurements: Measurements, health: Health, forces: Forces) -> dict[str, object]:
        """Settings, densities of the estimates, and what was left out."""
        complete = has_all(measurements, forces.record.names + _rolls(measurements, health), ("wheelset1", "wheelset2"))
        warnings = health.warnings()
        if not complete:
            warnings.append("no full set of wheelset sensors: single wheelsets' forces are known by their sums only")
        return {
            "settings": self.model_dump(mode="json"),
            "channels": list(forces.record.names),
            "densities": force_spectra(forces),
            "left_out": health.left_out,
            "warnings": warnings,
        }


def _rolls(measurements: Measurements, health: Health) -> tuple[str, ...]:
    return tuple(name for name in used_channels(measurements, ROLL_BODIES) if name in health.good)


def force_table(forces: Forces) -> pd.DataFrame:
    """Columns of the estimate: forces, moments and creepages, each with its standard deviation."""
    settled = (forces.time >= forces.time[0] + SETTLE) & np.isfinite(forces.signals).all(axis=1)
    table = {"time [s]": forces.time}
    for index, name in enumerate(FORCE_NAMES + MOTIONS[:2]):
        bare, _, unit = name.partition(" [")
        table[name] = np.where(settled, forces.signals[:, index], np.nan)
        table[f"{bare}_std [{unit}"] = np.where(settled, forces.spread[:, index], np.nan)
    return pd.DataFrame(table | {"valid [-]": settled.astype(float)})
