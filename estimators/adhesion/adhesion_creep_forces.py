"""Net lateral creep force and yaw moment of each wheelset by a Kalman filter (Ward et al. 2011, section 4.2)."""

import pandas as pd

from estimators.adhesion.channels import has_all, used_channels
from estimators.adhesion.creep_force_estimator import CreepForceEstimator, columns_with_std, settled_rows
from estimators.adhesion.creep_forces import FORCE_NAMES, MOTIONS, Forces, force_spectra
from estimators.adhesion.creep_model import ROLL_BODIES
from estimators.interface import Estimate
from estimators.signals.channel_health import Health
from railsim.measurements import Measurements


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
    settled = settled_rows(forces.time, forces.signals)
    columns = columns_with_std(FORCE_NAMES + MOTIONS[:2], forces.signals, forces.spread, settled)
    return pd.DataFrame({"time [s]": forces.time, **columns, "valid [-]": settled.astype(float)})
