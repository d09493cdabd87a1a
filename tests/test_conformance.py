"""Every plug-in that is discovered conforms: a docstring, and fields whose numbers carry unit and source."""

import re
from pathlib import Path
from typing import get_args

import pydantic
import pytest

from estimators import interface as estimators
from railsim import load_scenario
from railsim.effects import interface as effects
from railsim.effects.interface import PLACES
from railsim.effects.sensor_changes import FilterEffect
from railsim.scenario import Scenario, shipped_scenarios
from railsim.sensors import interface as sensors
from railsim.sensors.errors import SensorErrors
from railsim.sensors.suite import build_sensor
from railsim.spec import Role, Spec
from railsim.track.survey import TrackErrors
from railsim.vehicles import interface as vehicles

VEHICLES = vehicles.VEHICLES.classes()
SENSORS = sensors.SENSORS.classes()
ESTIMATORS = estimators.ESTIMATORS.classes()
EFFECTS = effects.EFFECTS.classes()
PLUGINS = [*VEHICLES.values(), *SENSORS.values(), *ESTIMATORS.values(), *EFFECTS.values()]
SPECS = [*PLUGINS, Scenario, SensorErrors, TrackErrors]


def _nested(kind: type[Spec], name: str) -> bool:
    """Whether a field is itself a Spec, whose own fields carry the units."""
    annotation = kind.model_fields[name].annotation
    return isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel)


@pytest.mark.parametrize("kind", SPECS, ids=lambda kind: kind.__module__.rpartition(".")[2])
def test_docstring_and_fields_with_unit_and_source(kind: type[Spec]):
    assert re.match(r"\S.{10,}", kind.__doc__ or ""), "give the class a docstring that starts with a sentence"
    bare = [name for name in kind.model_fields if not all(kind.about(name)) and not _nested(kind, name)]
    assert bare == []


@pytest.mark.parametrize("name", list(VEHICLES))
def test_vehicle_stands_on_its_wheels(name: str):
    vehicle = VEHICLES[name].build({})
    model = vehicle.model()
    assert model.reference in [body.name for body in model.bodies]
    assert {wheelset.body for wheelset in model.wheelsets} <= {body.name for body in model.bodies}
    assert vehicle.nominal()["wheel_radius"] == model.wheelsets[0].radius
    assert VEHICLES[name].build(vehicle.model_dump(mode="json")) == vehicle


@pytest.mark.parametrize("name", list(SENSORS))
def test_sensor_is_rebuilt_from_its_settings(name: str):
    sensor = build_sensor({"kind": name, "name": "mine", "body": "bogie", "rate": 64})
    assert sensor.kind == name
    assert build_sensor(sensor.settings()) == sensor
    assert all(re.fullmatch(r"mine\.\w+ \[.+\]", channel) for channel in sensor.channels())
    assert set(sensor.hidden).isdisjoint(sensor.data_sheet())


@pytest.mark.parametrize("name", list(EFFECTS))
def test_effect_knows_itself(name: str):
    kind = EFFECTS[name]
    effect = kind.build({})
    assert effect.kind == name
    assert kind.build(effect.model_dump(mode="json")) == effect
    assert kind.acts_on in PLACES
    assert len(kind.signature) > 30
    assert kind.references
    assert kind.absent and kind.smallest and {*kind.absent, *kind.smallest} <= set(kind.parameters())
    if kind.everywhere:  # the same effect without a stretch
        whole = EFFECTS[kind.everywhere]
        assert set(whole.parameters()) == set(kind.parameters()) - set(kind.fields_of("distance", "length"))
        assert whole.absent == kind.absent


PLACED = {
    "": (),
    "short": ("distance",),
    "stretch": ("distance", "length"),
    "pulse": ("distance time", "length duration"),
}
"""Roles of which an effect of each extent needs one field each."""


@pytest.mark.parametrize("name", list(EFFECTS))
def test_effect_has_the_fields_that_a_search_for_it_needs(name: str):
    kind = EFFECTS[name]
    free = kind.parameters()
    assert {kind.role(field) for field in kind.model_fields} <= set(get_args(Role))
    for roles in PLACED[kind.extent]:
        assert [field for field in free if kind.role(field) in roles.split()], f"extent needs a field of role {roles}"
    assert not kind.impact or kind.fields_of("phase"), "an impact needs an angle of its wheel"
    assert not kind.wave_about_mean or kind.fields_of("wavelength")
    assert set(kind.rivals) <= set(EFFECTS) and (kind.masked or not kind.rivals)
    assert not kind.weakens or "factor" in free
    for field, one in free.items():
        assert all(one.low <= value <= one.high for value in one.trials) or field in getattr(kind, "probe", {}), field
    if issubclass(kind, FilterEffect) and kind.probe:
        sized = [field for field in free if field not in kind.held()]
        assert sorted(kind.probe) == sorted(sized), "the probe fixes all numbers of the filter"
        assert all(free[field].trials for field in kind.probe)
        assert set(kind.fine_trials) <= set(kind.probe)


@pytest.mark.parametrize("name", list(ESTIMATORS))
def test_estimator_says_what_it_needs(name: str):
    estimator = ESTIMATORS[name].build({})
    assert estimator.name == name
    assert estimator.requires
    assert all(re.fullmatch(r"\w+\.\w+ \[.+\]", channel) for channel in estimator.requires)


@pytest.mark.parametrize("name", shipped_scenarios())
def test_scenario_gives_some_estimator_what_it_needs(name: str):
    channels = {channel for sensor in load_scenario(name).sensors for channel in sensor.channels()}
    assert any(set(estimator.requires) <= channels for estimator in ESTIMATORS.values())


def test_a_scenario_in_a_new_file_needs_nothing_else(tmp_path: Path):
    path = tmp_path / "mine.yaml"
    path.write_text("track: smooth\nvehicle: manchester\nspeed: {kind: constant, speed: 9}\nduration: 1\n")
    assert load_scenario(path).name == "mine"
