"""Creep forces without gravity's share: a filter that knows the nominal profile and a creep law finds gravity's."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pandas as pd

from estimators.adhesion.adhesion_level import AdhesionLevel
from estimators.adhesion.channels import RATE, LateralRecord
from estimators.adhesion.creep_force_estimator import CalibratedEstimator, columns_with_std, settled_rows
from estimators.adhesion.creep_forces import FORCE_NAMES, Forces
from estimators.adhesion.creep_law import ForceOutputs, LawShaping, with_law
from estimators.adhesion.creep_model import Floating
from estimators.adhesion.level_gates import gates
from estimators.filters.dropout_filter import run_filter, shifted
from estimators.interface import Estimate
from railsim.measurements import Measurements
from railsim.spec import quantity

GRAVITY_NAMES = ("wheelset1.gravity_force [N]", "wheelset2.gravity_force [N]")
BLOCK = 1.0  # s in which speed and slope count as constant
FINE = 0.05  # step of the logarithms of speed and slope among which models are kept
ANGLE_RATE = 1.0  # standard deviation of the contact angle's rate over the nominal one: worn wheels can double it
MIDDLE = 0.2  # share of Kalker's slope where nothing is known of it: the middle of the presets


class AdhesionCreepForcesProfile(CalibratedEstimator, frozen=True):
    """Lateral creep force and yaw moment of each wheelset; gravity's force is taken out with the nominal profile.

    Net forces are those of `adhesion_creep_forces`. Gravity's is what a second filter finds, whose linear creep law has
    the slope of `adhesion_level` on the same record; the law's error, first-order noise on every force, is estimated
    with the rest. Rails that lie aside are shaped noise, so that no measured track is needed.
    """

    law_force: float = quantity(5e2, unit="N, error of the creep law's force", source="illustrative", gt=0.0)
    law_moment: float = quantity(5e2, unit="N m, error of its moment", source="illustrative", gt=0.0)
    law_time: float = quantity(0.1, unit="s, correlation time of both", source="illustrative", gt=0.0)
    track_level: float = quantity(
        1.5, unit="- over the lateral spectrum of ERRI low", source="between ERRI B176 low and high", gt=0.0
    )

    def estimate(self, measurements: Measurements) -> Estimate:
        """Forces over time, high-passed like every channel; NaN until the filter has settled, and in curves."""
        self.need(measurements)
        health = self.health(measurements)
        level = AdhesionLevel(corner=self.corner, speed_source=self.speed_source).estimate(measurements)
        found = [self.net_forces(measurements, health, place) for place in self.bogies(measurements, health)]
        time, speed, p = found[0].time, found[0].record.speed, found[0].parameters
        slope, known = _slope(level.series, time)
        columns: dict[str, np.ndarray] = {}
        for net in found:
            columns |= _columns(net, *(values[:, 4:] for values in self._filtered(net.record, p, slope)))
        settled = settled_rows(time, np.column_stack(list(columns.values())))
        (curve, _) = gates(measurements, health, time, speed, p)
        valid = settled & ~curve.closed
        table = {"time [s]": time} | {name: np.where(valid, values, np.nan) for name, values in columns.items()}
        table |= {"creep_slope [-]": slope, "valid [-]": valid.astype(float)}
        warnings = health.warnings()
        if (settled & curve.closed).any():
            share = float(np.mean(curve.closed[settled]))
            warnings.append(f"{share:.0%} of the record is left out: {curve.reason}; {curve.help} would help")
        if not known:
            warnings.append(f"no window gave a creep slope: {MIDDLE:g} of Kalker's was taken")
        about = {
            "settings": self.model_dump(mode="json"),
            "channels": list(dict.fromkeys(name for net in found for name in net.record.names)),
            "left_out": health.left_out,
            "warnings": warnings,
        }
        return Estimate(self.name, pd.DataFrame(table), about)

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


def _columns(net: Forces, gravity: np.ndarray, spread: np.ndarray) -> dict[str, np.ndarray]:
    """Creep forces and moments, gravity's forces, each with its standard deviation, by the recording's names.

    Parameters
    ----------
    gravity, spread : forces by gravity and what the filter states of them, (n, 2).
    """
    forces, stated = net.signals[:, :4].copy(), net.spread[:, :4].copy()
    known = np.isfinite(gravity).all(axis=1)
    size = np.sqrt(np.mean(gravity[known] ** 2, axis=0)) if known.any() else np.zeros(2)
    spread = np.hypot(spread, ANGLE_RATE * size)
    forces[:, ::2] -= gravity
    stated[:, ::2] = np.hypot(stated[:, ::2], spread)
    names = [net.record.place.column(name) for name in FORCE_NAMES + GRAVITY_NAMES]
    everywhere = np.ones(len(forces), dtype=bool)
    return columns_with_std(names, np.hstack([forces, gravity]), np.hstack([stated, spread]), everywhere)
