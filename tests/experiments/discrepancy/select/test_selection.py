"""Selection: through which model the track's errors are passed before effects are compared."""

from types import SimpleNamespace
from typing import Any

import pytest

from experiments.discrepancy.select import selection
from experiments.discrepancy.select.selection import Stand, _noise_there, _out_of_question
from railsim.errors import InputError


class _Problem:
    """Notes through what its noise is propagated."""

    def __init__(self) -> None:
        self.through: list[str] = []

    def with_noise(self, z: str, effects: str) -> "_Problem":
        self.through.append(z)
        return self


def _judged(evidence: float, name: str) -> Any:
    fit = SimpleNamespace(z=name, effects=())
    one = SimpleNamespace(fit=fit, label=name, classes=frozenset({name}), log_evidence=evidence)
    return SimpleNamespace(hypothesis=one, evidence=evidence, standing=evidence)


@pytest.mark.parametrize(
    ("evidence", "left", "through"),
    [
        ([4.0], False, []),  # too little to be said at all
        ([20.0], False, ["nuisances"]),  # weak: the vehicle as it was fitted decides
        ([20.0, 15.0], False, ["nuisances"]),
        ([20.0], True, ["damper0"]),  # something is left: the best effect may change what becomes of the errors
        ([500.0], False, []),
        ([500.0, 490.0], False, ["damper0"]),  # two that are close
    ],
)
def test_a_weak_effect_is_weighed_with_the_noise_of_the_fitted_vehicle(
    monkeypatch: pytest.MonkeyPatch, evidence: list[float], left: bool, through: list[str]
):
    monkeypatch.setattr(selection, "again", lambda problem, one, tell: one)
    monkeypatch.setattr(selection, "shown_held_out", lambda problem, one, tell: one)
    problem: Any = _Problem()
    judged = [_judged(one, f"damper{number}") for number, one in enumerate(evidence)]
    stand = Stand(problem, _judged(0.0, "nuisances").hypothesis, [one.hypothesis for one in judged])
    stand.__dict__.update(judged=judged, unexplained=left)
    after = _noise_there(stand, lambda text: None)
    assert problem.through == through
    assert {one.label for one in after.fitted} == {one.label for one in stand.fitted}


def test_an_effect_that_derails_on_a_track_that_it_may_be_keeps_the_noise_that_there_was():
    class Derails:
        def with_noise(self, z: str, effects: str) -> Any:
            raise InputError("wheel1_left leaves its rail")

    problem: Any = Derails()
    judged = [_judged(500.0, "joints"), _judged(490.0, "sleepers")]
    stand = Stand(problem, _judged(0.0, "nuisances").hypothesis, [one.hypothesis for one in judged])
    stand.__dict__.update(judged=judged, unexplained=False)
    said: list[str] = []
    assert _noise_there(stand, said.append) is stand
    assert "leaves its rail" in said[-1]


@pytest.mark.parametrize(("evidence", "asked"), [(-58.0, True), (200.0, False)])
def test_what_is_worse_than_nuisances_alone_puts_no_effect_out_of_question(
    monkeypatch: pytest.MonkeyPatch, evidence: float, asked: bool
):
    """A weak roll bar, on the shortlist beside bent nuisances only, after a gauge that leaves noise and explains
    nothing.
    """
    monkeypatch.setattr(selection, "something_left", lambda problem, one: False)
    monkeypatch.setattr(selection, "held_out_gap", lambda problem, fit: 0.9)
    stand = Stand(Any, _judged(0.0, "nuisances").hypothesis, [])  # type: ignore[arg-type]
    at_home: Any = SimpleNamespace(chosen={"gauge": SimpleNamespace(gain=30.0)})
    bent: Any = SimpleNamespace(chosen={"roll bar": SimpleNamespace(gain=156.0)})
    best = _judged(evidence, "gauge").hypothesis
    assert _out_of_question(stand, "roll bar", best, [at_home, bent]) is not asked
