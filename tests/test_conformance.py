"""Every plug-in that is discovered conforms: a docstring, and fields whose numbers carry unit and source."""

import re
from pathlib import Path

import pydantic
import pytest

import estimators
from estimators.interface import Estimator
from railsim import load_scenario, sensors, vehicles
from railsim.effects.interface import PLACES
from railsim.registry import discover
from railsim.scenario import Scenario, effect_kinds, shipped_scenarios
from railsim.sensors.errors import SensorErrors
from railsim.sensors.interface import Sensor
from railsim.sensors.suite import build_sensor
from railsim.spec import Spec
from railsim.track.survey import TrackErrors
from railsim.vehicles.interface import Vehicle

VEHICLES = discover(vehicles, Vehicle)
SENSORS = discover(sensors, Sensor)
ESTIMATORS = discover(estimators, Estimator)
EFFECTS = effect_kinds()
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
        assert set(whole.parameters()) == set(kind.parameters()) - {"place", "length"}
        assert whole.absent == kind.absent


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
