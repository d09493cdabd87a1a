"""Laws without a name: their polynomials, what they show against runs, and a one-way stop that no library has."""

from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.core.model import Effect, Fit
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.search import infer
from experiments.discrepancy.railway.cases import VERTICAL, nominal, recorded
from experiments.discrepancy.railway.laws import TERMS, Law, laws
from experiments.discrepancy.railway.library import found_library
from experiments.discrepancy.railway.record import DROPPED, Record
from experiments.discrepancy.railway.scales import SCALES
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.railway.unknown import unknown_of
from experiments.discrepancy.recording.evidence import evidence_of

STOP: dict[str, Any] = {
    "kind": "empirical_force", "upper": "bogie", "lower": "wheelset1", "axis": "z", "position": [1.3, 0.0, 0.5],
    "displacement": [-0.012, -0.008, -0.004, 0.0, 0.004], "velocity": [-10.0, 10.0],
    "force": [[2.0 * one] * 2 for one in (-8640.0, -3840.0, -960.0, 0.0, 0.0)],
}  # fmt: skip
"""Pushes only where the frame comes down."""


def system_of(*hidden: dict[str, Any]) -> Railway:
    measured = recorded(np.random.default_rng(5), "home", hidden, VERTICAL)
    return Railway(Record(evidence_of(measured, nominal("home", VERTICAL))), SCALES)


@pytest.fixture(scope="module")
def healthy() -> Railway:
    return system_of()


@pytest.fixture(scope="module")
def found(healthy: Railway) -> dict[str, tuple[Effect, Law]]:
    return {one.name: (one, law) for one, law in laws(healthy)}


def test_there_is_one_for_each_place_and_state(healthy: Railway, found: dict[str, tuple[Effect, Law]]) -> None:
    joints = [one for one in healthy.answers[0].places if one.lower]
    assert len(found) == 2 * len(joints) and {one.place for one, _ in found.values()} == {one.name for one in joints}


def test_polynomials_are_as_loud_and_none_is_along_another(
    healthy: Railway, found: dict[str, tuple[Effect, Law]]
) -> None:
    truth = healthy.simulated.nominal_truth
    assert truth is not None
    for name in ("unknown: primary1 z over its displacement", "unknown: secondary y over its velocity"):
        law = found[name][1]
        forces = np.stack([law.acting(one, truth)[round(DROPPED * truth.rate) :] for one in np.eye(TERMS)])
        size = float(forces[0].std())
        assert size > 0.0
        np.testing.assert_allclose(forces.mean(axis=1), 0.0, atol=0.02 * size)
        np.testing.assert_allclose(np.cov(forces) / size**2, np.eye(TERMS), atol=0.05)


@pytest.mark.parametrize("state", ["displacement", "velocity"])
def test_what_a_law_shows_is_what_a_run_with_it_changes(
    healthy: Railway, found: dict[str, tuple[Effect, Law]], state: str
) -> None:
    """Linear answers against runs with the table as a force; in frames of 2 s what rings on into the next is lost."""
    effect, law = found[f"unknown: primary1 z over its {state}"]
    assert effect.shown is not None
    share = 0.05
    setups = [healthy.nominal_with(law.make(share * effect.own[k].spread * np.eye(TERMS)[k])) for k in range(TERMS)]
    runs = healthy.shown([(healthy.nominal, 0.0), *((one, 0.0) for one in setups)])
    for shown, run in zip(effect.shown, runs, strict=True):
        changed, loud = (run[1:] - run[:1]) / share, np.sqrt(healthy.record.densities)
        for k in range(TERMS):
            off = np.linalg.norm((changed[k] - shown[k]) / loud) / np.linalg.norm(changed[k] / loud)
            assert off < 0.25, (k, off)


def test_a_one_way_stop_is_an_unknown_at_its_place_and_its_curve_is_found() -> None:
    """A latent force of unknown course gains nothing here; the law has hundreds of nats."""
    system = system_of(STOP)
    library = found_library(system, ["weak_vertical_damper"])
    system = Railway(system.record, SCALES, library.makers, kept=system.kept)
    verdict = infer(system, library.library, Policy())
    assert (verdict.action.kind, verdict.action.place) == ("unknown", "primary1 z"), verdict.table()
    best: Fit = verdict.rows[0].fit
    assert verdict.rows[0].evidence > 50.0 and best.hypothesis.effects[0].kind == "law", verdict.table()
    like = unknown_of(best)
    assert like is not None and like.words == "it follows the displacement there" and like.unit == "N"
    over = like.curves["displacement"]
    hidden = -np.interp(over.state, STOP["displacement"], [one for one, _ in STOP["force"]])  # upwards on the frame
    found, true = (one - np.polyval(np.polyfit(over.state, one, 1), over.state) for one in (over.mean, hidden))
    assert over.share > 0.5 and over.mean[0] > 2.0 * np.abs(over.mean[2:]).max()  # it pushes up, one way
    assert np.corrcoef(found, true)[0, 1] > 0.9  # up to a line, which the springs' tolerance may take
