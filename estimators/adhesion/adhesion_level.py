"""Adhesion level with a calibrated probability, and the initial creep slope, in windows of ordinary running."""

from typing import Any

import numpy as np
import pandas as pd

from estimators.adhesion.change_points import Change, find_changes
from estimators.adhesion.channels import WHEELSETS, has_all, used_channels
from estimators.adhesion.classifier import LEVELS, Classifier, classifier
from estimators.adhesion.creep_force_estimator import SETTLE, CalibratedEstimator
from estimators.adhesion.creep_forces import RATE, Forces
from estimators.adhesion.features import SETS, features, windows
from estimators.interface import Estimate
from estimators.signals.channel_health import Health
from railsim.measurements import Measurements
from railsim.spec import quantity

WINDOW, SHORT = 10.0, 4.0  # s
COLUMNS = tuple(f"adhesion_{level.replace(' ', '_')} [-]" for level in LEVELS)
LEFT_OUT = 0.05  # share of a window in which a channel may be left out
BEYOND = 0.1  # relative distance from the calibration's speeds that is still accepted


class AdhesionLevel(CalibratedEstimator, frozen=True):
    """Dry, wet, low or very low from spectra of the creep force filter's estimates; braking is not needed.

    Each window of 10 s is compared with a calibration on simulated runs of the same vehicle over other tracks
    (`adhesion_calibration.json`). Windows without a full set of wheelset sensors go by those of bogie and body alone.
    Changes are placed by windows of 4 s.
    """

    hop: float = quantity(0.5, unit="s between windows", source="illustrative", ge=0.1, le=5.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Probabilities over time, each of the 10 s around; NaN where the sensors or the speed allow none."""
        self.need(measurements)
        health = self.health(measurements)
        names = [name for name in used_channels(measurements, SETS["wheelsets"]) if name in health.good]
        warnings = health.warnings()
        by_sensors = {}
        if has_all(measurements, names, WHEELSETS):
            by_sensors["wheelsets"] = self._judged(measurements, health, "wheelsets")
        else:
            warnings.append("no full set of wheelset sensors: adhesion goes by the sensors of bogie and body")
        if "wheelsets" not in by_sensors or not np.isfinite(by_sensors["wheelsets"][0]["creep_slope [-]"]).all():
            by_sensors["bogie"] = self._judged(measurements, health, "bogie")
        table, changes = _merged(by_sensors)
        return Estimate(self.name, table, self._about(table, changes, health, warnings))

    def _judged(self, measurements: Measurements, health: Health, kind: str) -> tuple[pd.DataFrame, list[Change]]:
        """Table of windows and changes by one set of sensors."""
        forces = self.forces(measurements, health, SETS[kind])
        vehicle = str(measurements.vehicle.get("name"))
        complete = has_all(measurements, health.good, SETS[kind])
        table = judge(forces, kind, WINDOW, self.hop, classifier(vehicle, kind, WINDOW), complete)
        close = judge(forces, kind, SHORT, self.hop, classifier(vehicle, kind, SHORT), complete)
        return table, find_changes(_values(table), _values(close), WINDOW)

    def _about(self, table: pd.DataFrame, changes: list[Change], health: Health, warnings: list[str]) -> dict[str, Any]:
        valid = table["valid [-]"].to_numpy() > 0.5
        if not valid.all():
            warnings.append(f"no adhesion level in {np.mean(~valid):.0%} of the windows: see 'left_out' and the speed")
        strange = float(np.mean(table["unlike_calibration [-]"].to_numpy()[valid] > 1.0)) if valid.any() else 0.0
        if strange > 0.2:
            warnings.append(f"{strange:.0%} of the windows are unlike all of the calibration: do not trust the level")
        return {
            "settings": self.model_dump(mode="json"),
            "levels": list(LEVELS),
            "changes": [change._asdict() for change in changes],
            "left_out": health.left_out,
            "warnings": warnings,
        }


def judge(forces: Forces, kind: str, window: float, hop: float, by: Classifier, complete: bool = True) -> pd.DataFrame:
    """Windows of one length: probabilities, creep slope, whether they count; none does if the set is not `complete`."""
    skipped = round(SETTLE * RATE)
    signals, used = forces.signals[skipped:], np.isfinite(forces.record.samples[skipped:])
    spans = windows(len(signals), window, hop)
    speed = np.array([np.mean(forces.record.speed[skipped:][span]) for span in spans])
    low, high = by.speeds
    good = (speed >= low * (1.0 - BEYOND)) & (speed <= high * (1.0 + BEYOND)) & complete
    good &= np.array([bool((used[span].mean(axis=0) >= 1.0 - LEFT_OUT).all()) for span in spans], dtype=bool)
    chosen = [span for span, valid in zip(spans, good, strict=True) if valid]
    rows = np.full((len(spans), len(LEVELS) + 3), np.nan)
    if chosen:
        table = np.stack([features(signals[span], kind, window) for span in chosen])
        slope = by.creep_slope(table, speed[good])
        rows[good] = np.column_stack(
            [by.probabilities(table, speed[good]), slope, slope * by.slope_std, by.distance(table) / by.farthest]
        )
    time = np.array([forces.time[skipped:][span].mean() for span in spans])
    names = [*COLUMNS, "creep_slope [-]", "creep_slope_std [-]", "unlike_calibration [-]"]
    return pd.DataFrame({"time [s]": time, **dict(zip(names, rows.T, strict=True)), "valid [-]": good.astype(float)})


def _merged(by_sensors: dict[str, tuple[pd.DataFrame, list[Change]]]) -> tuple[pd.DataFrame, list[Change]]:
    """The better set where it counts, the other one elsewhere; changes of the set that counts at their time."""
    if "wheelsets" not in by_sensors:
        table, changes = by_sensors["bogie"]
        return table.assign(**{"wheelset_sensors [-]": 0.0}), changes
    table, changes = by_sensors["wheelsets"]
    table = table.assign(**{"wheelset_sensors [-]": 1.0})
    if "bogie" not in by_sensors:
        return table, changes
    other = by_sensors["bogie"][0].assign(**{"wheelset_sensors [-]": 0.0})
    count = min(len(table), len(other))
    table, other = table.iloc[:count].reset_index(drop=True), other.iloc[:count].reset_index(drop=True)
    full = table["valid [-]"].to_numpy() > 0.5
    merged = other.where(~pd.Series(full), table)
    share = float(np.mean(full))
    return merged, changes if share > 0.5 else by_sensors["bogie"][1]


def _values(table: pd.DataFrame) -> np.ndarray:
    """Time and probabilities of the windows that count, (n, 5)."""
    return table.loc[table["valid [-]"] > 0.5, ["time [s]", *COLUMNS]].to_numpy(float)
