"""Scores of creep forces: forces and moments of an estimate against those of the contacts."""

from typing import ClassVar

import numpy as np
import pandas as pd

from estimators.adhesion.channels import high_pass
from estimators.interface import Estimate
from experiments.scoring.interface import Check, Scorer, stated
from railsim.analysis.statistics import root_mean_square
from railsim.truth import TIME, Truth

SIDES = ("left", "right")
NUMBERS = (1, 2, 3, 4)
"""Wheelsets that an estimate may have columns of; it must have the first two."""
SECOND = "second_"
"""How the channels of a wheel's second contact begin."""

FORCE, MOMENT = "lateral_creep_force [N]", "creep_yaw_moment [N m]"


OF_LOAD = 0.01
"""Allowed rms error over the static load of a wheelset: levels of adhesion lie 0.04 to 0.3 of it apart."""


def _checks() -> tuple[Check, ...]:
    source = "illustrative: 1 % of a wheelset's load; levels of adhesion lie 4 to 30 % of it apart"
    checks = []
    for name in (f"wheelset{number}" for number in NUMBERS):
        for what in ("lateral force", "yaw moment"):
            label = f"{name} {what}"
            checks.append(
                Check(
                    label,
                    f"{label} rms error over load [-]",
                    OF_LOAD,
                    source,
                    f"{label} within 2 std [-]",
                    f"{name} valid share [-]",
                )
            )
    return tuple(checks)


class CreepForceScorer(Scorer):
    """Lateral creep forces and yaw moments of the wheelsets."""

    columns: ClassVar[tuple[str, ...]] = (f"wheelset1.{FORCE}",)
    needs: ClassVar[tuple[str, ...]] = (
        TIME,
        "valid [-]",
        *(f"wheelset{n}.{name}" for n in (1, 2) for name in (FORCE, MOMENT)),
    )
    checks: ClassVar[tuple[Check, ...]] = _checks()

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Errors of forces and moments against the contacts', both high-passed at the estimator's corner.

        The force whose error stands over the load, beside its coverage, is what the estimate means by it: with the part
        of gravity, or the creep alone where gravity has a column of its own.
        """
        series = estimate.series
        valid = series["valid [-]"].to_numpy(float) > 0.5
        numbers = [number for number in NUMBERS if f"wheelset{number}.{FORCE}" in series.columns]
        share = float(np.mean(valid))
        scores = {"valid share [-]": share} | {f"wheelset{number} valid share [-]": share for number in numbers}
        if not valid.any():
            return scores
        time = series[TIME].to_numpy(float)[valid]
        corner = stated(estimate, "settings", "corner")
        vehicle = truth.about["vehicle"]
        load = 2.0 * vehicle.get("design_wheel_load [N]", np.nan)
        lever = vehicle["half_gauge [m]"]
        for number in numbers:
            true = {key: _as_seen(values, truth, time, corner) for key, values in true_forces(truth, number).items()}
            name = f"wheelset{number}"
            force = series[f"{name}.{FORCE}"].to_numpy(float)[valid]
            moment = series[f"{name}.{MOMENT}"].to_numpy(float)[valid]
            gravity = f"{name}.gravity_force [N]"  # stands apart where the estimator knows the profile
            apart = series[gravity].to_numpy(float)[valid] if gravity in series.columns else 0.0
            net, turning = force + apart - true["creep"] - true["gravity"], moment - true["moment"]
            side = net if gravity not in series.columns else force - true["creep"]
            scores |= _judged(f"{name} lateral force", side, load, _spread(series, f"{name}.{FORCE}", valid))
            scores |= _judged(f"{name} yaw moment", turning, load * lever, _spread(series, f"{name}.{MOMENT}", valid))
            scores |= {
                f"{name} lateral force rms error, gravity's included [N]": root_mean_square(net),
                f"{name} lateral force rms error, creep alone [N]": root_mean_square(force - true["creep"]),
                f"{name} lateral force true rms, creep alone [N]": root_mean_square(true["creep"]),
                f"{name} yaw moment rms error [N m]": root_mean_square(turning),
                f"{name} yaw moment true rms [N m]": root_mean_square(true["moment"]),
            }
        return scores


def _spread(series: pd.DataFrame, column: str, valid: np.ndarray) -> np.ndarray | None:
    """The stated deviation of a column."""
    name, unit = column.removesuffix("]").split(" [")
    std = f"{name}_std [{unit}]"
    return series[std].to_numpy(float)[valid] if std in series.columns else None


def _judged(label: str, error: np.ndarray, full: float, spread: np.ndarray | None) -> dict[str, float]:
    """Rms error over the `full` force or moment, and coverage by the stated deviation."""
    scores = {f"{label} rms error over load [-]": root_mean_square(error) / full}
    if spread is not None:
        scores[f"{label} within 2 std [-]"] = float(np.mean(np.abs(error) <= 2.0 * spread))
    return scores


def true_forces(truth: Truth, number: int) -> dict[str, np.ndarray]:
    """Net forces of the rails on a wheelset, as the estimators mean them, by the rows of truth.

    Returns
    -------
    "creep" : lateral creep force along the axle, N. "gravity" : lateral part of the normal forces, less that of a load
    that leans with the wheelset, N. "moment" : yaw moment of the longitudinal creep forces, N m. "creepage" : mean
    lateral creepage of both wheels, -, where they may touch in two places that on the tread.
    """
    found = _of_contact(truth, number, "")
    if f"wheel{number}_{SIDES[0]}.{SECOND}normal_force [N]" in truth:
        second = _of_contact(truth, number, SECOND)
        found |= {name: found[name] + second[name] for name in ("creep", "gravity", "moment")}
    return found


def _of_contact(truth: Truth, number: int, prefix: str) -> dict[str, np.ndarray]:
    """`true_forces` of the one contact on each wheel whose channels begin with `prefix`."""
    columns = {
        quantity: np.stack([truth[f"wheel{number}_{side}.{prefix}{quantity}"] for side in SIDES])
        for quantity in (
            "creep_force_y [N]",
            "creep_force_x [N]",
            "normal_force [N]",
            "contact_angle [rad]",
            "creepage_y [-]",
        )
    }
    angle, normal = columns["contact_angle [rad]"], columns["normal_force [N]"]
    roll = truth[f"wheelset{number}.roll [rad]"]
    along = columns["creep_force_x [N]"]
    return {
        "creep": np.sum(columns["creep_force_y [N]"] * np.cos(angle), axis=0),
        "gravity": -np.sum(normal * np.sin(angle), axis=0) + np.sum(normal, axis=0) * roll,
        "moment": -truth.about["vehicle"]["half_gauge [m]"] * (along[0] - along[1]),
        "creepage": np.mean(columns["creepage_y [-]"], axis=0),
    }


def _as_seen(values: np.ndarray, truth: Truth, time: np.ndarray, corner: float) -> np.ndarray:
    return np.interp(time, truth.time, high_pass(values, corner, rate=truth.rate))
