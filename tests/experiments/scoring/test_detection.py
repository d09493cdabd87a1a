"""Detection of weak dampers: delay after the onset, and alarms on what is healthy."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from experiments.scoring.detection import damping_left, score_detection
from railsim.truth import Truth

BUILT = {"secondary_lateral_damping [N s/m]": 20e3, "yaw_damper_damping [N s/m]": 200e3}
VEHICLE = BUILT | {"yaw_damper_half_spacing [m]": 1.0, "design_conicity [-]": 0.15}
LATERAL, YAW = 40e3, 400e3
TIME = np.arange(0.0, 60.0, 0.5)


def truth(*effects: dict[str, Any]) -> Truth:
    """A run of which nothing but what is said of it matters."""
    return Truth(Path(), 256.0, 1, [], {"vehicle": VEHICLE, "effects": list(effects)})


def estimate(lateral: Any = 1.0, yaw: Any = 1.0, spread: float = 0.05) -> Estimate:
    """Shares of the damping as built, over time."""
    columns = {"time [s]": TIME}
    for name, share, whole in zip(PARAMETERS[:2], (lateral, yaw), (LATERAL, YAW), strict=True):
        columns |= {
            name: np.broadcast_to(share, TIME.shape) * whole,
            std_name(name): np.full(TIME.size, spread * whole),
        }
    return Estimate("it", pd.DataFrame(columns))


def test_delay_is_counted_from_the_onset_to_the_first_verdict():
    run = truth({"kind": "weak_yaw_damper", "factor": 0.5, "onset": 20.0})
    found = score_detection(estimate(yaw=np.where(TIME < 24.0, 1.0, 0.5)), run)
    assert found == {
        "false alarms [-]": 0.0,
        "time under false alarm [s]": 0.0,
        "detected [-]": 1.0,
        "detection delay [s]": 4.0,
    }


def test_a_fault_that_nobody_calls_has_no_delay():
    found = score_detection(estimate(), truth({"kind": "weak_lateral_damper", "factor": 0.25, "onset": 20.0}))
    assert found["detected [-]"] == 0.0
    assert "detection delay [s]" not in found


@pytest.mark.parametrize(
    ("lateral", "yaw", "alarms"),
    [(1.0, 1.0, 0.0), (0.8, 1.0, 0.0), (0.5, 1.0, 1.0), (0.5, 0.5, 2.0)],
)
def test_healthy_dampers_called_degraded_are_false_alarms(lateral: float, yaw: float, alarms: float):
    found = score_detection(estimate(lateral, yaw), truth())
    assert found["false alarms [-]"] == alarms
    assert found["time under false alarm [s]"] == alarms * 0.5 * (TIME >= 15.0).sum()
    assert "detected [-]" not in found


def test_a_verdict_before_the_onset_or_on_the_other_damper_is_a_false_alarm():
    run = truth({"kind": "weak_lateral_damper", "factor": 0.5, "onset": 40.0})
    early = score_detection(estimate(lateral=np.where(TIME < 30.0, 1.0, 0.5)), run)
    assert (early["false alarms [-]"], early["time under false alarm [s]"]) == (1, 10)
    assert score_detection(estimate(yaw=0.5), run)["false alarms [-]"] == 1.0


def test_an_alarm_that_stood_before_the_onset_detects_nothing_until_it_is_raised_again():
    run = truth({"kind": "weak_lateral_damper", "factor": 0.5, "onset": 40.0})
    standing = score_detection(estimate(lateral=np.where(TIME < 30.0, 1.0, 0.5)), run)
    assert standing["detected [-]"] == 0.0
    assert "detection delay [s]" not in standing
    again = score_detection(estimate(lateral=np.where((TIME < 30.0) | ((TIME >= 41.0) & (TIME < 43.0)), 1.0, 0.5)), run)
    assert (again["detected [-]"], again["detection delay [s]"], again["false alarms [-]"]) == (1, 3, 1)
    ended = score_detection(estimate(lateral=np.where((TIME >= 30.0) & (TIME < 39.0), 0.5, 1.0)), run)
    assert (ended["detected [-]"], ended["false alarms [-]"]) == (0, 1)


def test_a_damper_weak_from_the_beginning_is_detected_from_when_verdicts_are_asked_for():
    found = score_detection(estimate(yaw=0.5), truth({"kind": "weak_yaw_damper", "factor": 0.5}))
    assert (found["detected [-]"], found["detection delay [s]"]) == (1, 15)


def test_a_wide_deviation_says_nothing():
    found = score_detection(estimate(lateral=0.1, spread=0.4), truth({"kind": "weak_lateral_damper", "factor": 0.0}))
    assert found["detected [-]"] == 0.0


def test_factors_of_the_same_damper_multiply():
    share, onset = damping_left(
        truth({"kind": "weak_yaw_damper", "factor": 0.5}, {"kind": "weak_yaw_damper", "factor": 0.5, "onset": 9.0})
    )
    assert share.tolist() == [1.0, 0.25]
    assert onset.tolist() == [0.0, 9.0]
