"""True creep forces of wheels that touch in two places."""

from pathlib import Path

import numpy as np
import pytest

from experiments.scoring.creep_forces import true_forces
from railsim.scenario import load_scenario
from railsim.simulation import simulate


def test_forces_on_tread_and_flange_are_both_in_them(tmp_path: Path) -> None:
    """In the curve the flange of the leading outer wheel bears a third of the load."""
    scenario = load_scenario("curve_s1002_flange", {"start": 400.0, "duration": 1.0})
    truth = simulate(scenario, "compiled", tmp_path / "truth")
    found = true_forces(truth, 1)
    across, along = np.zeros(len(truth)), np.zeros((2, len(truth)))
    for row, side in enumerate(("left", "right")):
        for place in ("", "second_"):
            angle = truth[f"wheel1_{side}.{place}contact_angle [rad]"]
            across += truth[f"wheel1_{side}.{place}creep_force_y [N]"] * np.cos(angle)
            along[row] += truth[f"wheel1_{side}.{place}creep_force_x [N]"]
    half_gauge = truth.about["vehicle"]["half_gauge [m]"]
    assert truth["wheel1_right.second_normal_force [N]"].min() > 1e3
    assert found["creep"] == pytest.approx(across)
    assert found["moment"] == pytest.approx(-half_gauge * (along[0] - along[1]))
