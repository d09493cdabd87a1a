"""The plan names each pair that looks alike once, the worst first, and draws the matrix."""

from pathlib import Path

import numpy as np

from experiments.discrepancy.result.planning import Plan, draw_plan


def test_pairs_that_look_alike(tmp_path: Path):
    alike = np.array([[1.0, 0.95, 0.2], [0.95, 1.0, 0.99], [0.2, 0.99, 1.0]])
    plan = Plan(["a", "b", "c"], {}, alike)
    assert plan.confusable() == [("b", "c", 0.99), ("a", "b", 0.95)]
    draw_plan(plan, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 1000
