"""Scores of the suspension estimators: dampers and conicity against the run's own."""

from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from experiments.scoring.detection import damping_left, score_detection, score_verdicts
from experiments.scoring.interface import Check, Scorer
from experiments.scoring.wheel_rail_truth import cone_of, contact_truth
from railsim.errors import InputError
from railsim.truth import TIME, Truth

SETTLED = 5.0  # s at the end of the record over which the estimate is averaged
LABELS = ("secondary lateral damping", "secondary yaw damping", "conicity")


_QUARTER = "illustrative: a quarter of the nominal damping; dampers are called degraded below three quarters"


class SuspensionScorer(Scorer):
    """Dampers of the secondary suspension at the end of the record, and detection of weak ones.

    Conicity, the third of the parameters, is scored with that of the other estimators.
    """

    columns: ClassVar[tuple[str, ...]] = PARAMETERS[:2]
    needs: ClassVar[tuple[str, ...]] = (TIME,)
    checks: ClassVar[tuple[Check, ...]] = (
        *(Check(name, f"{name} size of error [%]", 25.0, _QUARTER, f"{name} within 2 std [-]") for name in LABELS[:2]),
        Check(
            "verdicts at the end",
            "wrong verdicts [-]",
            0.0,
            "no healthy part accused, no faulty one called healthy",
            answered="verdicts given [-]",
            enough=1.0,
            subject="health",
            excused=False,
        ),
        Check("alarms on the way", "false alarms [-]", 0.0, "no healthy part accused", subject="health", excused=False),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Error and stated deviation of each damper; detection of both beside the lateral one's."""
        scores: dict[str, float] = {}
        if PARAMETERS[0] in self.columns_of(estimate):
            scores |= score_parameter(0, estimate, truth) | score_detection(estimate, truth)
            scores |= score_verdicts(estimate, truth, true_conicity(truth))
        if PARAMETERS[1] in self.columns_of(estimate):
            scores |= score_parameter(1, estimate, truth)
        return scores


def true_parameters(truth: Truth) -> np.ndarray:
    """C_sy (N s/m), C_spsi (N m s/rad) at the start of the run, and the conicity that the wheels had, shape (3,).

    Conicity is the slope of half the difference of the rolling radii over the lateral shift, of both wheelsets.

    Raises
    ------
    InputError : the run does not state its dampers.
    """
    vehicle = truth.about.get("vehicle", {})
    try:
        lateral = 2.0 * float(vehicle["secondary_lateral_damping [N s/m]"])
        yaw = 2.0 * float(vehicle["yaw_damper_damping [N s/m]"]) * float(vehicle["yaw_damper_half_spacing [m]"]) ** 2
    except KeyError as error:
        raise InputError(f"the run's vehicle states no {error}; simulate it again") from None
    return np.array([lateral, yaw, true_conicity(truth)])


def true_conicity(truth: Truth) -> float:
    """The cone that fits both wheelsets best: slope of half the difference of the rolling radii over the shift."""
    contacts = [contact_truth(truth, number) for number in (1, 2)]
    shift = np.concatenate([one.shift - one.shift.mean() for one in contacts])
    return cone_of(shift, np.concatenate([one.half_difference for one in contacts]))


def final(estimate: Estimate) -> np.ndarray:
    """Means and standard deviations over the last seconds of the record, shape (2, 3)."""
    time = estimate.series["time [s]"].to_numpy(dtype=float)
    late = time >= time.max() - SETTLED
    names = (list(PARAMETERS), [std_name(name) for name in PARAMETERS])
    return np.array([estimate.series[one].to_numpy(dtype=float)[late].mean(axis=0) for one in names])


def score_parameter(index: int, estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Error at the end of the record from what the run had then: in per cent of the nominal damper, or of conicity as
    it is.
    """
    if PARAMETERS[index] not in estimate.series.columns or std_name(PARAMETERS[index]) not in estimate.series.columns:
        return {}
    true = true_parameters(truth)[index]
    mean, std = final(estimate)[:, index]
    if not (np.isfinite(mean) and np.isfinite(std)):
        return {}  # withheld
    if index == 2:
        return {"conicity error [-]": mean - true, "conicity std [-]": std}
    if true <= 0.0:
        return {}
    label, left = LABELS[index], damping_left(truth)[0][index]
    error, spread = mean / true - left, std / true
    scores = {f"{label} error [%]": 100.0 * error, f"{label} std [%]": 100.0 * spread}
    scores[f"{label} size of error [%]"] = 100.0 * abs(error)
    return scores | {f"{label} within 2 std [-]": float(abs(error) <= 2.0 * spread)}
