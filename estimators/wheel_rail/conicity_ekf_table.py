"""Conicity as a function of the shift on the rails by an extended Kalman filter with a look-up table."""

from typing import Any

import numpy as np

from estimators.wheel_rail.contact_run import ContactEstimator, Run
from railsim.spec import quantity

TWIN = 0.9
"""Share of the table's variation that is the same to both sides: the wheels of a wheelset are alike (illustrative)."""


class ConicityEkfTable(ContactEstimator, frozen=True):
    """Conicity over the shift of a single wheelset, as a table, by a Kalman filter (Ward et al. 2011, section 4.3.2).

    The track is unknown; the conicity is looked up over y - d. The nodes of the table are states. The conicity moves
    with the shift by d(lambda)/dt = (d lambda / dy) x' (equation 2), each measurement corrects the nodes beside the
    present shift, and by their correlation those around. `conicity [-]` is the cone's that fits the table best over the
    last seconds; the table is in `about["conicity_function"]`, secant conicities.
    """

    reach: float = quantity(5e-3, unit="m", source="beyond the shifts on straight track", gt=1e-3, le=0.02)
    spacing: float = quantity(1e-3, unit="m", source="illustrative", gt=1e-4, le=5e-3)
    shape_std: float = quantity(0.4, unit="- of the logarithm", source="illustrative: S1002 on 60E1", gt=0.0)
    shape_length: float = quantity(1.5e-3, unit="m", source="illustrative: S1002 on 60E1", gt=0.0)

    def drive(self) -> np.ndarray:
        """Track and gauge are unknown."""
        return super().drive()

    def nodes(self) -> np.ndarray:
        """Uniform to both sides."""
        count = round(self.reach / self.spacing)
        return self.spacing * np.arange(-count, count + 1)

    def prior(self, nodes: np.ndarray) -> np.ndarray:
        """A common level, and smooth variation that is mostly the same to both sides."""

        def near(shifts: np.ndarray) -> np.ndarray:
            return np.exp(-0.5 * ((shifts[:, None] - shifts) / self.shape_length) ** 2)

        shape = TWIN * near(np.abs(nodes)) + (1.0 - TWIN) * near(nodes)
        return self.conicity_std**2 + self.shape_std**2 * shape + 1e-6 * np.eye(len(nodes))

    def further(self, run: Run) -> dict[str, Any]:
        """The table at the end of the record."""
        shift, conicity, spread = run.table()
        function = {
            "shift [m]": shift.tolist(),
            "conicity [-]": conicity.tolist(),
            "conicity_std [-]": spread.tolist(),
            "kind": "secant",
        }
        return {**super().further(run), "conicity_function": function}
