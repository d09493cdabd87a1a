"""What was computed for the nominal run holds for a recording that began elsewhere; and is kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.discrepancy.baseline.forward import Forward, Registration, forward_over
from experiments.discrepancy.fit.bank import open_bank, rows_between
from experiments.discrepancy.fit.candidates import Candidate, Context, candidates
from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.screen.screening import turned_forms

CONTEXT = Context(("bogie.acceleration_y",), (30.0, 250.0), (1.0, 7.0), ((100.0, 3.0),))


def _candidate(name: str) -> Candidate:
    return next(one for one in candidates(CONTEXT) if one.name == name)


def _likeness(problem: Problem, a: np.ndarray | None, b: np.ndarray) -> float:
    assert a is not None
    a, b = problem.whitened(a), problem.whitened(b)
    return float((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum()))


def _kept(problem: Problem, one: Candidate, values: dict[str, float]) -> np.ndarray:
    found = problem.bank.signature(one, values) if problem.bank else None
    assert found is not None
    return found


def test_a_signature_moves_to_where_the_recording_began(problem: Problem):
    """1.5 m later at 30 m/s: 50 ms, half a period at 10 Hz; unmoved, the signature would not fit."""
    evidence = problem.evidence
    there = Registration(evidence.scenario.start + 1.5)
    forward = forward_over(evidence, there)
    bank = open_bank(evidence, there, problem.frames)
    one = _candidate("weak_yaw_damper")
    values = next(iter(one.sizes()))
    bank.fill([(one, values)])
    z = np.zeros(len(forward.nuisances))
    change = problem.stacked(forward.predict(z, (one.build(values),))) - problem.stacked(forward.predict(z))
    assert _likeness(problem, bank.signature(one, values), change) > 0.97
    still = replace(bank, delay=np.zeros_like(bank.delay))
    assert _likeness(problem, still.signature(one, values), change) < 0.8


def test_another_angle_of_a_wheel_is_another_time(problem: Problem):
    assert problem.bank is not None
    for name, field in (("wheel_unbalance", "phase"), ("out_of_round", "phase")):
        one = _candidate(name)
        values = next(iter(one.sizes())) | {field: 0.0}
        problem.bank.fill([(one, values)])
        at, phase = turned_forms(problem, one, values)[9]
        assert phase is not None
        moved = phase[..., None] * _kept(problem, one, values)
        z = np.zeros(len(problem.forward.nuisances))
        base = problem.stacked(problem.forward.predict(z))
        change = problem.stacked(problem.forward.predict(z, (one.build(at),))) - base
        assert _likeness(problem, moved, change) > 0.85, name


def test_a_blow_once_a_turn_is_kept_between_the_samples_too(problem: Problem):
    """The wheelset rings on its contact at some 200 Hz, of which sensors with 256 Hz show what is folded back: by a
    phase alone, two rows of truth off, the blow is not the same.
    """
    assert problem.bank is not None
    one = _candidate("wheel_flat")
    values = {"length": 0.04, "angle": 0.0}
    problem.bank.fill([(one, values)])
    parts = _kept(problem, one, values)
    evidence = problem.evidence
    rate, speed = evidence.scenario.output_rate, float(np.median(evidence.speed[1]))
    assert len(parts) == rate / min(evidence.rates.values()) == rows_between(problem.forward)
    radius = float(getattr(evidence.scenario.vehicle, "wheel_radius"))  # noqa: B009
    rows = 4 * 18 + 2
    at = {**values, "angle": rows * speed / rate / radius}
    z = np.zeros(len(problem.forward.nuisances))
    change = problem.stacked(problem.forward.predict(z, (one.build(at),))) - problem.stacked(problem.forward.predict(z))

    def later(part: int, whole: int) -> np.ndarray:
        return parts[part] * np.exp(-2j * np.pi * problem.frames.frequencies * whole / rate)[:, None]

    assert _likeness(problem, later(2, rows - 2), change) > 0.8
    assert _likeness(problem, later(0, rows), change) < 0.6


def test_a_bank_is_computed_once(problem: Problem, monkeypatch: pytest.MonkeyPatch):
    assert problem.bank is not None
    one = _candidate("weak_yaw_damper")
    values = next(iter(one.sizes()))
    problem.bank.fill([(one, values)])

    def fails(*given: object) -> None:
        raise AssertionError("ran again")

    monkeypatch.setattr(Forward, "run", fails)
    again = open_bank(problem.evidence, problem.forward.registration, problem.frames)
    again.fill([(one, values)])
    assert np.array_equal(again.columns, problem.bank.columns)
    found, known = again.signature(one, values), problem.bank.signature(one, values)
    assert found is not None and known is not None and np.array_equal(found, known)


def test_the_derivatives_of_another_creep_law_are_kept_beside(problem: Problem, monkeypatch: pytest.MonkeyPatch):
    """They are what a run with that law says of its own numbers, which Polach's derivatives are not."""
    assert problem.bank is not None
    other = problem.bank.under("fastsim")
    number = [one.label for one in problem.forward.nuisances].index("adhesion.k_slip")
    forward, z = problem.forward.but(law="fastsim"), np.zeros(len(problem.forward.nuisances))
    base = problem.stacked(forward.predict(z))
    z[number] = 0.3
    change = problem.stacked(forward.predict(z)) - base
    assert _likeness(problem, other.columns[number], change) > 0.99
    assert _likeness(problem, problem.bank.columns[number], change) < 0.97
    monkeypatch.setattr(Forward, "run", None)
    assert np.array_equal(problem.bank.under("fastsim").columns, other.columns)


def test_another_speed_gets_a_bank_of_its_own(problem: Problem):
    assert problem.bank is not None
    evidence = problem.evidence
    time, speed, scale = evidence.speed
    slower = replace(evidence, speed=(time, 0.8 * speed, scale))
    bank = open_bank(slower, problem.forward.registration, problem.frames)
    assert bank.folder != problem.bank.folder
    assert not bank.delay.any()


def test_a_damaged_file_is_made_again(problem: Problem):
    assert problem.bank is not None
    one = _candidate("weak_roll_bar")
    values = next(iter(one.sizes()))
    problem.bank.fill([(one, values)])
    before = problem.bank.signature(one, values)
    path = Path(problem.bank.folder) / "effect_weak_roll_bar.arrays"
    path.write_bytes(path.read_bytes()[:500])
    problem.bank.fill([(one, values)])
    after = problem.bank.signature(one, values)
    assert before is not None and after is not None and np.array_equal(after, before)
