"""What to record next, where two effects stay likely."""

import math
from itertools import islice

import numpy as np
import pytest

from experiments.discrepancy.core.levels import middles
from experiments.discrepancy.core.model import Effect, Fit, Hypothesis
from experiments.discrepancy.core.verdict import Action, Row, Verdict
from experiments.discrepancy.railway import further as module
from experiments.discrepancy.railway.cases import VERTICAL, nominal, recorded
from experiments.discrepancy.railway.further import Part, carried, further, further_sensors, options
from experiments.discrepancy.railway.library import found_library
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of

FEW = VERTICAL[:2]


@pytest.fixture(scope="module")
def system() -> Railway:
    """A vehicle on two channels, with a library of two effects."""
    bare = Railway(Record(evidence_of(recorded(np.random.default_rng(12), "home", (), FEW), nominal("home", FEW))))
    found = found_library(bare, ("weak_primary_damper", "soft_track"))
    bare.kept["library"] = tuple(one for one in found.library.effects if one.kind == "name")
    return Railway(bare.record, installed=found.makers, kept=bare.kept)


def fitted(system: Railway, effect: Effect) -> Fit:
    """An effect at its first start, known as well as before the recording."""
    hypothesis = Hypothesis((effect,))
    spreads = np.array([one.spread for one in hypothesis.coordinates(system.coordinates)])
    x = effect.begins(np.zeros(len(system.coordinates)), system.coordinates)[1 - len(effect.own) :][0]
    nothing = np.zeros((0, 0))
    return Fit(hypothesis, system, x, middles(system.levels), 0.0, 0.0, np.diag(spreads**-2), nothing, (), ())


@pytest.fixture(scope="module")
def verdict(system: Railway) -> Verdict:
    """Two effects, each as likely as the other."""
    rows = tuple(Row(fitted(system, one), 0.0, 0.0, 0.5) for one in system.kept["library"])
    return Verdict(Action("set", tuple(one.family for one in system.kept["library"])), rows, {})


def test_what_is_known_goes_by_names_and_the_place_on_the_track_is_new(system: Railway, verdict: Verdict) -> None:
    other = Railway(system.record, kept=dict(system.kept))
    fit = verdict.rows[0].fit
    moved = fit.x.copy()
    moved[system.alignment], moved[0] = 0.1, 0.02
    same = carried(Fit(**{**fit.__dict__, "x": moved}), other)
    assert np.all(same.x[other.alignment] == 0.0)
    assert same.x[0] == 0.02
    assert np.allclose(np.diag(same.precision), np.diag(fit.precision))


def test_a_part_shows_what_the_whole_shows(system: Railway) -> None:
    name = next(iter(system.record.channels))
    part, x = Part(system, {name}), np.zeros(len(system.coordinates))
    assert np.array_equal(part.observed[0], system.observed[0][..., :1])
    assert np.array_equal(part.predict(x[None], ())[0], system.predict(x[None], ())[0][..., :1])
    assert np.array_equal(part.covariances(x, ())[0], system.covariances(x, ())[0][..., :1, :1])


def test_a_further_recording_saves_and_a_sensor_where_they_differ_saves_more(
    system: Railway, verdict: Verdict, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "shipped_scenarios", lambda: ["suspension"])
    few = islice(options(system.record, system.installed), 2)
    found = further(verdict, few, np.random.default_rng(1), math.inf, lambda _: None)
    nats = {one.name: one.separation for one in found}
    besides = [value for name, value in nats.items() if name.endswith("besides")]
    assert besides and max(besides) > nats["the same again"] > 0.0
    assert all(one.after <= one.before + 1e-9 for one in found)
    assert [one.after for one in found] == sorted(one.after for one in found)


def test_further_sensors_are_new_and_fit_the_vehicle(system: Railway, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "shipped_scenarios", lambda: ["lateral_2mm", "suspension"])
    scenario = system.record.scenario
    have = {name for sensor in scenario.sensors for name in sensor.channels()}
    found = further_sensors(scenario)
    assert found
    for sensor in found:
        assert set(sensor.channels()) - have
        scenario.but(sensors=(sensor,)).check()
