"""Selection: through which model the track's errors are passed before effects are compared."""

from types import SimpleNamespace
from typing import Any

import pytest

from experiments.discrepancy.fit.candidates import Context, candidates
from experiments.discrepancy.select import selection
from experiments.discrepancy.select.selection import (
    Base,
    Stand,
    fitted_from_bases,
    fitted_from_starts,
    hopeless_beside,
    with_noise_of_best,
)
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
    monkeypatch.setattr(selection, "again", lambda problem, one, progress: one)
    monkeypatch.setattr(selection, "shown_held_out", lambda problem, one, progress: one)
    problem: Any = _Problem()
    judged = [_judged(one, f"damper{number}") for number, one in enumerate(evidence)]
    stand = Stand(problem, _judged(0.0, "nuisances").hypothesis, [one.hypothesis for one in judged])
    stand.__dict__.update(judged=judged, unexplained=left)
    after = with_noise_of_best(stand, lambda text: None)
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
    assert with_noise_of_best(stand, said.append) is stand
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
    assert hopeless_beside(stand, "roll bar", best, [at_home, bent]) is not asked


@pytest.mark.parametrize(("at_home", "begun"), [(-40.0, ["home", "bent"]), (90.0, ["home"])])
def test_what_ends_behind_nuisances_alone_is_begun_from_these_too(
    monkeypatch: pytest.MonkeyPatch, at_home: float, begun: list[str]
):
    """Softer springs that nuisances alone have taken: from the nominal build their fit ends at nuisances that are worse
    than alone, though these are a part of it.
    """
    from_where: list[str] = []

    def fitted(stand: Any, base: Any, one: Any, progress: Any) -> Any:
        from_where.append(base.fit)
        fit = SimpleNamespace(cost=lambda frames: 0.0)
        return SimpleNamespace(log_evidence=at_home if base.fit == "home" else 88.0, fit=fit)

    monkeypatch.setattr(selection, "_begun", fitted)
    monkeypatch.setattr(selection, "something_left", lambda problem, one: False)
    monkeypatch.setattr(selection, "moved", lambda problem, one, progress: one)
    stand = Stand(SimpleNamespace(train=None), _judged(0.0, "nuisances").hypothesis, [])  # type: ignore[arg-type]
    bases: Any = [SimpleNamespace(fit=name, chosen={"springs": SimpleNamespace()}) for name in ("home", "bent")]
    made = fitted_from_bases(stand, "springs", bases, lambda text: None)
    assert made is not None
    assert made.log_evidence == max(at_home, 88.0 if "bent" in begun else at_home)
    assert from_where == begun


@pytest.mark.parametrize("nominal", [False, True])
def test_a_stop_is_fitted_from_each_of_its_sizes_and_not_only_from_a_part_of_a_signature(
    monkeypatch: pytest.MonkeyPatch, nominal: bool
):
    """Where the signature of a gap of a tenth fits best at a third of its size there is no contact at all."""
    context = Context(("body.acceleration_y",), (0.0, 700.0), (0.0, 24.0), ((0.0, 0.0),))
    stop = next(one for one in candidates(context) if one.name == "bump_stop_contact")
    begun: list[float] = []

    def fitted(problem: Any, null: Any, which: Any, starts: Any, progress: Any, level: float) -> Any:
        begun.append(starts[0][1][0]["closed"])
        return SimpleNamespace(log_evidence=400.0)

    monkeypatch.setattr(selection, "hypothesis", fitted)
    sizes = list(stop.sizes())
    one: Any = SimpleNamespace(candidate=stop, z=0.0, values={"closed": 0.7, "offset": 0.0}, tried=sizes[1], gain=600.0)
    base = Base(SimpleNamespace(z=0.0), (), nominal)  # type: ignore[arg-type]
    fitted_from_starts(Stand(None, _judged(0.0, "nuisances").hypothesis, []), base, one, lambda text: None)  # type: ignore[arg-type]
    assert begun == [0.7, *(values["closed"] for values in sizes)]
