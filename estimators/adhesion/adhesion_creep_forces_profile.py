"""Creep forces without gravity's share: the filter knows the nominal profile's contact functions and a creep law."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pandas as pd

from estimators.adhesion.adhesion_level import AdhesionLevel
from estimators.adhesion.channels import RATE, LateralRecord, read
from estimators.adhesion.creep_force_estimator import CalibratedEstimator, columns_with_std, settled_rows
from estimators.adhesion.creep_forces import FORCE_NAMES
from estimators.adhesion.creep_law import ForceOutputs, LawShaping, with_law
from estimators.adhesion.creep_model import ROLL_BODIES, Floating, parameters
from estimators.filters.dropout_filter import run_filter, shifted
from estimators.interface import Estimate
from railsim.measurements import Measurements
from railsim.spec import quantity

GRAVITY_NAMES = ("wheelset1.gravity_force [N]", "wheelset2.gravity_force [N]")
BLOCK = 1.0  # s in which speed and slope count as constant
FINE = 0.05  # step of the logarithms of speed and slope among which models are kept
MIDDLE = 0.2  # share of Kalker's slope where nothing is known of it: the middle of the presets


class AdhesionCreepForcesProfile(CalibratedEstimator, frozen=True):
    """Net lateral creep force and yaw moment of each wheelset, with gravity's force taken out by the nominal profile.

    The linear creep law's slope is that of `adhesion_level` on the same record; its error, first-order noise on every
    force, is estimated with the rest. Rails that lie aside are shaped noise, so that no measured track is needed.
    """

    law_force: float = quantity(5e2, unit="N, error of the creep law's force", source="illustrative", gt=0.0)
    law_moment: float = quantity(5e2, unit="N m, error of its moment", source="illustrative", gt=0.0)
    law_time: float = quantity(0.1, unit="s, correlation time of both", source="illustrative", gt=0.0)
    track_level: float = quantity(
        1.5, unit="- over the lateral spectrum of ERRI low", source="between ERRI B176 low and high", gt=0.0
    )

    def estimate(self, measurements: Measurements) -> Estimate:
        """Forces over time, high-passed like every channel; NaN until the filter has settled."""
        self.need(measurements)
        health = self.health(measurements)
        level = AdhesionLevel(corner=self.corner, speed_source=self.speed_source).estimate(measurements)
        record = read(measurements, ROLL_BODIES, health.good, self.corner, self.speed_source)
        slope, known = _slope(level.series, record.time)
        forces, spread = self._filtered(record, parameters(measurements.vehicle), slope)
        warnings = health.warnings()
        if not known:
            warnings.append(f"no window gave a creep slope: {MIDDLE:g} of Kalker's was taken")
        about = {
            "settings": self.model_dump(mode="json"),
            "channels": list(record.names),
            "left_out": health.left_out,
            "warnings": warnings,
        }
        return Estimate(self.name, _table(record, forces, spread, slope), about)

    def _filtered(self, record: LateralRecord, p: dict[str, float], slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Creep forces and moments, gravity's forces, their deviations, (n, 6) each."""
        shaping = LawShaping(self.law_force, self.law_moment, self.law_time, self.secondary)

        @lru_cache(maxsize=512)
        def model(speed: int, share: int) -> tuple[Floating, ForceOutputs]:
            given = float(np.exp(FINE * speed)), float(np.exp(FINE * share))
            return with_law(p, RATE, *given, self.track_level, self.corner, shaping)

        forces, spread = np.full((2, len(record.time), 6), np.nan)
        driving = shifted(record.inputs)
        x = P = None
        for block in _blocks(len(record.time)):
            speed = float(np.mean(record.speed[block]))
            if not np.isfinite(speed):
                x = P = None
                continue
            floating, contact = model(round(np.log(speed) / FINE), round(float(np.log(slope[block]).mean()) / FINE))
            if x is None or P is None:
                x, P = np.zeros(len(floating.A)), floating.start.copy()
            H, D = record.observation(floating)
            values, deviations = run_filter(
                np.ascontiguousarray(floating.A),
                np.ascontiguousarray(floating.Q),
                np.ascontiguousarray(floating.B),
                H,
                D,
                record.R,
                x,
                P,
                driving[block],
                record.inputs[block],
                record.samples[block],
                contact.rows,
            )
            forces[block], spread[block] = values + record.inputs[block] @ contact.inputs.T, deviations
        return forces, spread


def _blocks(count: int) -> Sequence[slice]:
    length = round(BLOCK * RATE)
    return [slice(start, min(start + length, count)) for start in range(0, count, length)]


def _slope(series: pd.DataFrame, time: np.ndarray) -> tuple[np.ndarray, bool]:
    """Creep slope at any time, that of the nearest windows, and whether there was any."""
    given = series["creep_slope [-]"].to_numpy(float)
    good = np.isfinite(given)
    if not good.any():
        return np.full(len(time), MIDDLE), False
    return np.exp(np.interp(time, series["time [s]"].to_numpy(float)[good], np.log(given[good]))), True


def _table(record: LateralRecord, forces: np.ndarray, spread: np.ndarray, slope: np.ndarray) -> pd.DataFrame:
    """Columns of the estimate: creep forces and moments, gravity's forces, each with its standard deviation."""
    settled = settled_rows(record.time, forces)
    columns = columns_with_std(FORCE_NAMES + GRAVITY_NAMES, forces, spread, settled)
    last = {"creep_slope [-]": slope, "valid [-]": settled.astype(float)}
    return pd.DataFrame({"time [s]": record.time, **columns, **last})
