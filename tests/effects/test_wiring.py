"""How effects come into a run: they act on what is simulated and measured, and what is known in the field stays."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from railsim import load_scenario, measure, simulate
from railsim.scenario import Scenario
from railsim.simulation import run_digest
from tests.effects.rig import largest_difference, rows, scenario
from tests.engines.rig import ratio

WEAK = [{"kind": "weak_lateral_damper", "factor": 0.3}]


def test_yaml_gives_the_same_effects_back():
    one = scenario([{"kind": "weak_lateral_damper", "factor": 0.3, "onset": 5.0}])
    again = Scenario.build(yaml.safe_load(one.to_yaml()))
    assert again == one
    assert again.digest() == one.digest() != scenario([]).digest()
    assert again.effects[0].kind == "weak_lateral_damper"


def test_run_digest_changes_with_the_effect():
    assert run_digest(scenario(WEAK), "compiled") != run_digest(scenario([]), "compiled")


def test_model_of_a_scenario_is_that_of_its_setup_and_its_vehicle_the_nominal_one():
    one, without = scenario(WEAK), scenario([])
    damping = [next(e for e in s.model.elements if e.name == "secondary").damping[1, 1] for s in (one, without)]
    assert damping[0] == pytest.approx(0.3 * damping[1])
    assert one.vehicle == without.vehicle


def test_effects_stand_in_the_truth_only(tmp_path: Path):
    one = scenario(WEAK, duration=0.5)
    recording = measure(simulate(one, "compiled", tmp_path / "truth"), one, folder=tmp_path / "recording")
    about = (tmp_path / "recording" / "about.json").read_text()
    assert "effect" not in about and "weak" not in about
    assert json.loads(about)["vehicle"] == json.loads(json.dumps(recording.measurements.about["vehicle"]))
    assert recording.measurements.about["vehicle"]["secondary_lateral_damping"] == 20e3
    assert recording.truth is not None
    assert recording.truth.about["effects"][0] == one.effects[0].settings()
    assert load_scenario(tmp_path / "recording" / "truth" / "scenario.yaml").effects == one.effects


@pytest.mark.parametrize("kind", ["weak_lateral_damper", "weak_yaw_damper", "weak_vertical_damper"])
def test_a_fault_that_begins_in_the_run_changes_nothing_before(kind: str):
    late, without = rows([{"kind": kind, "factor": 0.0, "onset": 1.0}]), rows([])
    assert np.array_equal(late.rows[:1024], without.rows[:1024])
    assert largest_difference(late, without) > 1e-3


def test_engines_agree_on_a_yaw_damper_that_fails_in_the_transition_of_a_curve():
    """The car body's yaw is that of the chord there, so the damper works although nothing moves from its place."""
    fault = [{"kind": "weak_yaw_damper", "factor": 0.0, "onset": 1.0}]
    place = {"track": "curve_r400", "start": 90.0, "speed.speed": 14.0, "duration": 3.0}
    fast, reference = (rows(fault, engine, **place) for engine in ("compiled", "exudyn"))
    whole = rows([], **place)
    for name in ("bogie.yaw [rad]", "wheelset1.y [m]"):
        assert ratio(reference[name], fast[name]) < 5e-3
        assert ratio(whole[name], fast[name]) > 5e-3


@pytest.mark.parametrize("kind", ["weak_lateral_damper", "weak_yaw_damper", "weak_vertical_damper"])
def test_a_fault_from_the_first_instants_is_that_from_the_start(kind: str):
    """The one changes the elements' matrices, the other adds an element of negative size."""
    settings = {"kind": kind, "factor": 0.4}
    here, there = rows([settings]), rows([settings | {"onset": 1e-6, "ramp": 1e-6}])
    for name in ("bogie.y [m]", "bogie.yaw [rad]", "body.z [m]", "body.roll [rad]"):
        assert np.abs(here[name] - there[name]).max() < 2e-3 * np.abs(here[name]).max(), name
