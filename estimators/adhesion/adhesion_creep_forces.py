"""Net lateral creep force and yaw moment of each wheelset by a Kalman filter (Ward et al. 2011, section 4.2)."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from estimators.adhesion.channels import WHEELSETS, has_all
from estimators.adhesion.creep_force_estimator import CreepForceEstimator, columns_with_std, settled_rows
from estimators.adhesion.creep_forces import FORCE_NAMES, MOTIONS, Forces, force_spectra
from estimators.interface import Estimate
from estimators.signals.channel_health import Health
from railsim.measurements import Measurements


class AdhesionCreepForces(CreepForceEstimator, frozen=True):
    """Net lateral force and yaw moment of each wheelset, from accelerometers and gyros; no creep law is assumed.

    The forces are the rails' unknown inputs to a Kalman smoother. The filter knows no creep law and no profile: the
    vehicle floats on its contacts. Gravity's force on a wheelset that stands aside is in the lateral force
    (`adhesion_creep_forces_profile` takes it out). Wheelset sensors are used where there are any; with bogie and body
    sensors alone only the sums over the bogie are known, and `_std` says so.
    """

    def estimate(self, measurements: Measurements) -> Estimate:
        """Forces over time, high-passed like every channel; NaN until the filter has settled."""
        self.need(measurements)
        health = self.health(measurements)
        found = [self.net_forces(measurements, health, place) for place in self.bogies(measurements, health)]
        return Estimate(self.name, force_table(found), self.about_forces(measurements, health, found))

    def about_forces(self, measurements: Measurements, health: Health, found: Sequence[Forces]) -> dict[str, object]:
        """Settings, densities of the estimates, and what was left out."""
        warnings = health.warnings()
        densities: dict[str, object] = {}
        for forces in found:
            densities |= force_spectra(forces)
            place = forces.record.place
            if not has_all(measurements, health.good, WHEELSETS, place):
                names = " and ".join(place.bodies[name] for name in WHEELSETS)
                warnings.append(f"no full set of sensors on {names}: their forces are known by their sums only")
        return {
            "settings": self.model_dump(mode="json"),
            "channels": list(dict.fromkeys(name for forces in found for name in forces.record.names)),
            "densities": densities,
            "left_out": health.left_out,
            "warnings": warnings,
        }


def force_table(found: Sequence[Forces]) -> pd.DataFrame:
    """Columns of the estimate: forces, moments and creepages of every bogie, each with its standard deviation."""
    columns: dict[str, np.ndarray] = {}
    valid = np.ones(len(found[0].time), dtype=bool)
    for forces in found:
        settled = settled_rows(forces.time, forces.signals)
        names = [forces.record.place.column(name) for name in FORCE_NAMES + MOTIONS[:2]]
        columns |= columns_with_std(names, forces.signals, forces.spread, settled)
        valid &= settled
    return pd.DataFrame({"time [s]": found[0].time, **columns, "valid [-]": valid.astype(float)})
