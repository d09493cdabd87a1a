"""The rough order of effects against the marginal likelihood of the same linear model, by another formula."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.inference.fitting import fit
from experiments.inference.model import Hypothesis
from experiments.inference.policy import Policy
from experiments.inference.problem import Problem, raised
from experiments.inference.screen import SIZE, rough_gains
from tests.experiments.inference.toy import BEND, STEEP, Line, line


@pytest.mark.parametrize("bend", [0.0, 0.4])
def test_a_rough_gain_is_a_ratio_of_likelihoods(bend: float) -> None:
    system = Line(line(3, bend=bend))
    none = fit(Problem(system, Hypothesis(), Policy()), np.zeros(2))
    assert none is not None
    change = 0.5 * system.time**2
    bent = replace(BEND, shown=(change[None, None],))
    latent = np.array([one.place is not None for one in system.levels])
    psi = np.where(latent, np.maximum(none.psi, raised(system.levels)), none.psi)
    errors = np.tensordot(np.exp(2.0 * psi), system.covariances(none.x, ())[0][:, 0], 1)
    lines = np.stack([np.ones_like(system.time), system.time])

    def value(covariance: np.ndarray) -> float:
        return -0.5 * float(system.seen @ np.linalg.solve(covariance, system.seen) + np.linalg.slogdet(covariance)[1])

    healthy = errors + lines.T @ np.diag([1.0, 0.1**2]) @ lines
    steep = errors + lines.T @ np.diag([1.0, 3.0**2]) @ lines
    expected = [value(healthy + SIZE**2 * np.outer(change, change)) - value(healthy), value(steep) - value(healthy)]
    assert rough_gains(none, (bent, STEEP), Policy()) == pytest.approx(expected, abs=0.02)
