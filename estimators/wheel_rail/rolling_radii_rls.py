"""Rolling radii and contact angles by local recursive least squares (Ward et al. 2011, section 4.3.4)."""

from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from estimators.interface import Estimate, Estimator, Missing
from estimators.vehicle import single_wheelset
from estimators.vehicle.creep import DRY
from estimators.vehicle.single_wheelset import wheelset_model
from estimators.wheel_rail.known_rails import Survey, centre_fit, missing_rails
from estimators.wheel_rail.section_rls import (
    Geometry,
    Sections,
    Signals,
    geometry,
    geometry_spread,
    regress,
)
from estimators.wheel_rail.straight import told_of_curves
from estimators.wheel_rail.wheelset_motion import (
    BODY,
    ROLL,
    YAW,
    WheelsetMotion,
    filled,
    missing_motion,
    wheelset_motion,
)
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity
from railsim.wheelset.parameters import Coefficients

COLUMNS = {
    "sum_of_radii": "m",
    "difference_of_radii": "m",
    "sum_of_angles": "rad",
    "difference_of_angles": "rad",
}


class RollingRadiiRls(Estimator, frozen=True):
    """Sums and differences of rolling radii and contact angles over the shift of a single wheelset.

    Recursive least squares of (r_L + r_R), (r_L - r_R), (delta_L + delta_R), (delta_L - delta_R) for each section of
    the shift, equations (5) to (8). The recursion runs sample by sample; y, psi and the rails under the wheelset, which
    the article takes as measured, come from zero-phase filters over the record. What the regression finds is joined
    with what is known beforehand of wheels and creep coefficients, so that a quantity that the data do not bear keeps
    its prior value and spread.
    """

    width: float = quantity(5e-4, unit="m, of a section of y - d", source="illustrative", gt=0.0)
    degree: int = quantity(2, unit="of the polynomial within a section", source="1 is local linear", ge=0, le=3)
    use_gauge: bool = quantity(True, unit="whether the measured gauge is a regressor", source="illustrative")
    forgetting: float = quantity(1.0, unit="a sample", source="illustrative", gt=0.9, le=1.0)
    longest: float = quantity(100.0, unit="m", source="illustrative", gt=0.0)
    highest: float = quantity(20.0, unit="Hz", source="illustrative", gt=0.0)
    correlation: float = quantity(0.1, unit="s, of the model's error", source="illustrative: a shift's change", ge=0.0)
    creep: float = quantity(DRY, unit="share of Kalker's slope", source="Polach (2005), dry rail", gt=0.0, le=1.5)
    creep_error: float = quantity(0.15, unit="- (std)", source="S1002 new to worn, Kalker's coefficients", gt=0.0)
    parameter_error: float = quantity(0.03, unit="- (std) of masses, stiffness", source="illustrative", ge=0.0)
    radii_error: float = quantity(1e-4, unit="m (std) of r_L - r_R", source="tuned on wheelset_worn", ge=0.0)
    angles_error: float = quantity(
        0.03, unit="rad (std) of delta_L - delta_R", source="tuned on wheelset_worn: slip of y' - V psi", ge=0.0
    )
    radius_std: float = quantity(3e-3, unit="m, r_L + r_R about 2 r0", source="illustrative: 1.5 mm a wheel", gt=0.0)
    difference_std: float = quantity(2e-3, unit="m, r_L - r_R", source="illustrative: S1002 at 5 mm", gt=0.0)
    angle_std: float = quantity(0.15, unit="rad, both angles' sum and difference", source="illustrative", gt=0.0)

    requires: ClassVar[tuple[str, ...]] = (YAW, ROLL, BODY)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the model of a single wheelset needs."""
        return single_wheelset.NEEDED

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there: motion and the measured track among it."""
        return super().missing(measurements) + missing_motion(measurements) + missing_rails(measurements)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Run the recursion over the record.

        Raises
        ------
        InputError : sensors, measured track or parameters are missing, or the track does not reach as far as the run.
        """
        self.need(measurements)
        known, angle = self._known(measurements)
        motion = wheelset_motion(measurements, self.longest, self.highest)
        survey = Survey(measurements)
        offset, scale = centre_fit(measurements, motion, survey)
        rails = survey.rails(motion, offset, scale)
        rows = motion.valid
        signals = _signals(measurements, motion, motion.y - rails.centre, rails.gauge)
        signals = Signals(*(values[rows] for values in signals))
        sections = regress(signals, known, self.width, self.degree, self.use_gauge, forgetting=self.forgetting)
        estimated = geometry(sections.history, known)
        alike = np.sqrt(max(1.0, self.correlation * motion.band.rate))
        spread = geometry_spread(alike * sections.spread, known)
        series = pd.DataFrame({"time [s]": motion.time[rows]})
        for name, values, std in self._joined(estimated, spread, known, angle):
            series[f"{name} [{COLUMNS[name]}]"] = values
            series[f"{name}_std [{COLUMNS[name]}]"] = std
        series["wheelset1.lateral_shift [m]"] = signals.shift
        found = Estimate(self.name, series, self.model_dump(mode="json") | self._table(sections, known))
        return told_of_curves(found, measurements)

    def _known(self, measurements: Measurements) -> tuple[Coefficients, float]:
        """Nominal numbers, and the contact angle of new profiles at rest (rad)."""
        p = wheelset_model(measurements.vehicle, self.creep)
        return p.numbers, p.s

    def _joined(
        self, estimated: Geometry, spread: Geometry, known: Coefficients, angle: float
    ) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Each quantity with its prior: mean weighted by the variances, of which the parameters' errors are a part.

        Errors of f11 and f22 by a share e make one of r0 e in (r_L + r_R) / 2, of e itself in (r_L - r_R); of k_psi by
        a share e one of 2 k_psi e / (l W) in (delta_L + delta_R).
        """
        c = known
        own = Geometry(
            2.0 * c.r0 * self.creep_error * np.ones(1),
            np.hypot(self.creep_error * estimated.difference_of_radii, self.radii_error),
            2.0 * (c.k_psi * self.parameter_error) / (c.l * c.W) * np.ones(1),
            np.hypot(self.creep_error * estimated.difference_of_angles, self.angles_error),
        )
        priors = (self.radius_std, self.difference_std, self.angle_std, self.angle_std)
        out = []
        for name, value, std, more, middle, wide in zip(
            COLUMNS, estimated, spread, own, (2.0 * c.r0, 0.0, 2.0 * angle, 0.0), priors, strict=True
        ):
            variance = std**2 + more**2 + 1e-30
            weight = wide**2 / (wide**2 + variance)
            out.append((name, middle + weight * (value - middle), wide * np.sqrt(1.0 - weight)))
        return out

    def _table(self, sections: Sections, known: Coefficients) -> dict[str, Any]:
        """Sections at the end of the run, as they come from the regression alone."""
        end = geometry(sections.coefficients, known)
        variance = np.maximum(np.einsum("asii->asi", sections.covariance), 0.0)
        spread = geometry_spread(np.sqrt(variance), known)
        rows: dict[str, Any] = {"shift [m]": sections.centres.tolist(), "samples": sections.samples.tolist()}
        for name, values, std in zip(COLUMNS, end, spread, strict=True):
            rows[f"{name} [{COLUMNS[name]}]"] = values.tolist()
            rows[f"{name}_std [{COLUMNS[name]}]"] = std.tolist()
        rows["condition [-]"] = np.where(np.isfinite(sections.condition), sections.condition, -1.0).tolist()
        return {"sections": rows}


def _signals(measurements: Measurements, motion: WheelsetMotion, shift: np.ndarray, gauge: np.ndarray) -> Signals:
    band, time = motion.band, motion.time
    force, _ = filled(measurements, BODY, time)
    rolling, _ = filled(measurements, ROLL, time)
    late, last = (data_sheet(measurements.about, name).delay for name in (BODY, ROLL))
    return Signals(
        motion.y_rate,
        band.filter(motion.y_rate, 1),
        motion.yaw,
        motion.yaw_rate,
        motion.yaw_acceleration,
        motion.roll,
        band.filter(rolling, 0, last),
        -float(measurements.vehicle["suspended_mass"]) * band.filter(force, 0, late),
        shift,
        gauge,
        motion.speed,
    )
