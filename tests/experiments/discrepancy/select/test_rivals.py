"""Rivals: what imitates an effect nearly is told from it by derivatives and noise of its own."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.baseline.noise import perturbed_tracks
from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.fit.hypothesis import hypothesis
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.select import rivals
from experiments.discrepancy.select.refining import nuisances_alone
from experiments.discrepancy.select.rivals import with_noise_of_likeliest, with_rivals_refined
from experiments.discrepancy.select.stand import Stand
from experiments.discrepancy.workflow import context_of
from railsim.effects.sensor_delay import SensorDelay

CHANNEL = "axlebox1_left.acceleration_y"
DELAY = 0.007  # s


@dataclass(frozen=True)
class _One:
    """A hypothesis of one class, without a fit."""

    label: str
    log_evidence: float
    fresh: bool = False

    @property
    def classes(self) -> frozenset[str]:
        return frozenset({self.label.split("@")[0]})


class _Stand(Stand):
    """The best is the one with most evidence."""

    @property
    def best(self) -> Any:  # type: ignore[override]
        return max(self.fitted, key=lambda one: one.log_evidence)


def test_the_best_and_what_is_close_to_it_are_refined_until_none_is_behind_for_that(monkeypatch: pytest.MonkeyPatch):
    brings = {"joint": 10.0, "rod": 150.0, "wind": 500.0}
    refined: list[str] = []

    def polished(problem: Any, one: _One, progress: Any, stage: str) -> _One:
        refined.append(one.label)
        return replace(one, log_evidence=one.log_evidence + brings[one.label])

    monkeypatch.setattr(rivals, "polished", polished)
    monkeypatch.setattr(rivals, "time_for", lambda *given: True)
    null: Any = _One("nuisances", 0.0)
    fitted: Any = [_One("joint", 3000.0), _One("rod", 2900.0), _One("rod@2", 2890.0), _One("wind", 2800.0)]
    problem: Any = None
    after: Any = with_rivals_refined(_Stand(problem, null, fitted), lambda text: None)
    assert refined == ["joint", "rod"]  # 200 nats of 3000 are too far behind, and one of a class is enough
    assert after.best.label == "rod"
    assert with_rivals_refined(after, lambda text: None) is after

    monkeypatch.setattr(rivals, "time_for", lambda *given: False)
    stand = _Stand(problem, null, fitted)
    assert with_rivals_refined(stand, lambda text: None) is stand


def test_a_late_channel_is_told_from_a_resonance_by_the_noise_that_it_passes_on(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
):
    """Over a track that its file describes badly at short waves: the channel that comes late no longer disagrees with
    what the others say of it. (A mount's resonance, lightly damped, is no near rival.)
    """
    monkeypatch.setattr(rivals, "CLOSE", 1e6)
    forward = problem.forward.but(track=perturbed_tracks(problem.evidence, 4, 1)[0])
    late = SensorDelay(channel=CHANNEL, delay=DELAY)
    measured = problem.stacked(forward.predict(np.zeros(len(forward.nuisances)), (late,)))
    there = problem.but(measured=measured)
    null = nuisances_alone(there, np.zeros(len(forward.nuisances)), lambda text: None)
    context = context_of(there, locate(there, null.fit))
    both = [one for one in candidates(context) if dict(one.choices).get("channel", "").startswith(CHANNEL)]
    fitted = []
    for name in ("sensor_delay", "sensor_resonance"):
        one = next(one for one in both if one.name == name)
        starts = [(null.fit.z, [values]) for values in one.banked()]
        made = hypothesis(there, null.fit, (one,), starts, lambda text: None)
        assert made is not None
        fitted.append(made)
    stand = with_rivals_refined(Stand(there, null, fitted), lambda text: None)
    after = with_noise_of_likeliest(stand, lambda text: None)
    before, delay, resonance = stand.fitted[0], *after.fitted
    assert [one.candidate.name for one in after.fitted] == ["sensor_delay", "sensor_resonance"]
    assert delay.log_evidence > resonance.log_evidence + 20.0
    assert delay.values[0]["delay"] == pytest.approx(DELAY, rel=0.05)
    left = _left(stand.problem, before.fit.residual)  # by the truth, under the noise of a healthy vehicle
    assert _left(after.problem, delay.fit.residual) < 0.5 * left
    alone = replace(stand, fitted=stand.fitted[:1])
    assert with_noise_of_likeliest(alone, lambda text: None) is alone  # nothing to be told from


def _left(problem: Problem, residual: np.ndarray) -> float:
    """Mean square in units of the noise."""
    assert problem.white is not None
    return problem.white.mean_square(residual, problem.train)
