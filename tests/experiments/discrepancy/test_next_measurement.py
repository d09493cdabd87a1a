"""The next measurement: a quieter sensor saves what it tells, one that sees nothing saves nothing."""

from dataclasses import dataclass

import numpy as np
import pytest

from experiments.discrepancy.core.model import Effect
from experiments.discrepancy.core.next_measurement import savings
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.search import infer
from tests.experiments.discrepancy.toy import LIBRARY, Line, line


@dataclass(frozen=True, eq=False)
class Quiet(Line):
    """The same line with noise `times` as large."""

    times: float = 0.2

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        (parts,) = super().covariances(x, effects)
        return (np.stack([self.times**2 * parts[0], parts[1]]),)


@pytest.fixture(scope="module")
def unsure():
    """A bend that a record hardly tells from a drift."""
    return infer(Line(line(5, bend=0.08)), LIBRARY)


def test_better_records_save_more(unsure):
    seen = unsure.rows[0].fit.system.seen
    options = {"as it is": Line(seen), "quiet": Quiet(seen), "deaf": Quiet(seen, times=100.0)}
    found = {one.name: one for one in savings(unsure, options, Policy(), np.random.default_rng(1))}
    assert next(iter(found)) == "quiet"
    before = found["quiet"].before
    assert before > 0.2
    assert found["quiet"].after < 0.5 * before and found["quiet"].after < found["as it is"].after
    assert found["deaf"].after == pytest.approx(before, rel=0.1) and found["deaf"].separation < 0.01


def test_a_sure_verdict_needs_no_measurement():
    verdict = infer(Line(line(5, bend=2.0)), LIBRARY)
    for one in savings(verdict, {"again": Line(line(5, bend=2.0))}, Policy(), np.random.default_rng(1)):
        assert one.before < 0.1
