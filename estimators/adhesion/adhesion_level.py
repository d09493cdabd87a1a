"""Adhesion level with a calibrated probability, and the initial creep slope, in windows of ordinary running."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from estimators.adhesion.bogie_place import BogiePlace, places
from estimators.adhesion.change_points import Change, find_changes
from estimators.adhesion.channels import WHEELSETS, has_all, used_channels
from estimators.adhesion.classifier import LEVELS, Classifier, classifier
from estimators.adhesion.creep_force_estimator import SETTLE, CalibratedEstimator
from estimators.adhesion.creep_forces import RATE, Forces
from estimators.adhesion.creep_model import parameters
from estimators.adhesion.features import SETS, features_of, windows
from estimators.adhesion.level_gates import Gate, gates
from estimators.adhesion.level_windows import COLUMNS, LEFT_OUT, Reason, pooled, undecided, with_spare, withheld
from estimators.interface import Estimate
from estimators.signals.channel_health import Health
from railsim.measurements import Measurements
from railsim.spec import quantity

WINDOW, SHORT = 10.0, 4.0  # s
BEYOND = 0.1  # relative distance from the calibration's speeds that is still accepted


class Windows(NamedTuple):
    """Tables of windows of `WINDOW` and of `SHORT` seconds."""

    long: pd.DataFrame
    short: pd.DataFrame


class AdhesionLevel(CalibratedEstimator, frozen=True):
    """Level of adhesion (dry, wet, low, very low) without braking, from spectra of the creep forces.

    Each window of 10 s is compared with a calibration on simulated runs of the same vehicle over other tracks
    (`adhesion_calibration.json`). Windows without a full set of wheelset sensors go by those of bogie and body alone.
    Changes are placed by windows of 4 s. Of a whole vehicle every bogie is judged that bears the sensors, and the
    probabilities are their geometric mean. Where the calibration does not hold, or no level is likely, a window counts
    as one of which nothing can be told.
    """

    hop: float = quantity(0.5, unit="s between windows", source="illustrative", ge=0.1, le=5.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Probabilities over time, each of the 10 s around; NaN where the sensors, the speed or the line allow none."""
        self.need(measurements)
        health = self.health(measurements)
        leading, *others = places(measurements.vehicle)
        bogies = [leading, *(one for one in others if has_all(measurements, health.good, SETS["bogie"], one))]
        found = [self._of_bogie(measurements, health, place) for place in bogies]
        reasons: dict[str, Reason] = {}
        both = Windows(*(pooled([one[kind] for one in found]) for kind in range(2)))
        closing = self._gates(measurements, health)
        table, short = (
            withheld(table, window, *closing, reasons if window == WINDOW else {})
            for table, window in zip(both, (WINDOW, SHORT), strict=True)
        )
        changes = find_changes(_values(table), _values(short), WINDOW)
        table = undecided(table, reasons)
        warnings = health.warnings()
        if not table["wheelset_sensors [-]"].to_numpy().any():
            warnings.append("no full set of wheelset sensors: adhesion is judged by the sensors of bogie and body")
        return Estimate(self.name, table, self._about(table, changes, health, warnings, reasons))

    def _of_bogie(self, measurements: Measurements, health: Health, place: BogiePlace) -> Windows:
        """Windows by all sensors where these are there, by those of bogie and body elsewhere."""
        names = [name for name in used_channels(measurements, SETS["wheelsets"], place) if name in health.good]
        if not has_all(measurements, names, WHEELSETS, place):
            return self._judged(measurements, health, "bogie", place)
        by_all = self._judged(measurements, health, "wheelsets", place)
        if np.isfinite(by_all.long["creep_slope [-]"]).all():
            return by_all
        spare = self._judged(measurements, health, "bogie", place)
        return Windows(*map(with_spare, by_all, spare))

    def _judged(self, measurements: Measurements, health: Health, kind: str, place: BogiePlace) -> Windows:
        """Windows by one set of sensors of a bogie."""
        forces = self.forces(measurements, health, SETS[kind], place)
        vehicle = str(measurements.vehicle.get("name"))
        complete = has_all(measurements, health.good, SETS[kind], place)
        shared = {"wheelset_sensors [-]": float(kind == "wheelsets")}
        return Windows(
            *(
                judge(forces, kind, window, self.hop, classifier(vehicle, kind, window), complete).assign(**shared)
                for window in (WINDOW, SHORT)
            )
        )

    def _gates(self, measurements: Measurements, health: Health) -> tuple[np.ndarray, Sequence[Gate]]:
        """Where the calibration does not hold, on a grid of time."""
        record = self.record(measurements, health, SETS["bogie"], places(measurements.vehicle)[0])
        p = parameters(measurements.vehicle)
        return record.time, gates(measurements, health, record.time, record.speed, p)

    def _about(
        self,
        table: pd.DataFrame,
        changes: list[Change],
        health: Health,
        warnings: list[str],
        reasons: Mapping[str, Reason],
    ) -> dict[str, Any]:
        valid = table["valid [-]"].to_numpy() > 0.5
        for reason, one in reasons.items():
            warnings.append(f"cannot tell the level in {one.share:.0%} of the windows: {reason}; {one.help} would help")
        beyond = (float(np.mean(~valid)) if valid.size else 0.0) - sum(one.share for one in reasons.values())
        if beyond > 1e-6:
            warnings.append(f"no adhesion level in {beyond:.0%} of the windows: see 'left_out' and the speed")
        return {
            "settings": self.model_dump(mode="json"),
            "levels": list(LEVELS),
            "changes": [change._asdict() for change in changes],
            "cannot_tell": [
                {"reason": reason, "would_help": one.help, "share": one.share} for reason, one in reasons.items()
            ],
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
        table = features_of(signals, chosen, kind, window)
        slope = by.creep_slope(table, speed[good])
        rows[good] = np.column_stack(
            [by.probabilities(table, speed[good]), slope, slope * by.slope_std, by.distance(table) / by.farthest]
        )
    time = np.array([forces.time[skipped:][span].mean() for span in spans])
    names = [*COLUMNS, "creep_slope [-]", "creep_slope_std [-]", "unlike_calibration [-]"]
    return pd.DataFrame({"time [s]": time, **dict(zip(names, rows.T, strict=True)), "valid [-]": good.astype(float)})


def _values(table: pd.DataFrame) -> np.ndarray:
    """Time and probabilities of the windows that count, (n, 5)."""
    return table.loc[table["valid [-]"] > 0.5, ["time [s]", *COLUMNS]].to_numpy(float)
