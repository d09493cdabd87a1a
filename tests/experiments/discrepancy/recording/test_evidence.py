"""What is taken from a recording: where its sensors are."""

import pytest

from experiments.discrepancy.railway.cases import as_measured
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.scenario import load_scenario
from railsim.sensors.suite import build_sensor


def test_sensors_of_a_recording_that_states_half_a_vehicle_are_where_its_body_stands() -> None:
    """Half a body stands over its bogie, the middle of a whole one is half a spacing behind."""
    whole = load_scenario("whole_coach", {"duration": 14})
    spacing = getattr(whole.vehicle, "semi_bogie_spacing")  # noqa: B009
    measured = as_measured(whole, whole, "compiled")
    as_stated = {one.name: one.position for one in evidence_of(measured, whole).sensors}
    halved = [
        one | {"position": [one["position"][0] - spacing, *one["position"][1:]]} if one["body"] == "body" else one
        for one in measured.about["sensors"]
    ]
    about = measured.about | {"vehicle": measured.vehicle | {"name": "manchester"}, "sensors": halved}
    tables = {measured.rate(name): {"time [s]": measured.time(name)} for name in measured.channels}
    for name in measured.channels:
        tables[measured.rate(name)][name] = measured[name]
    moved = {one.name: one.position for one in evidence_of(Measurements(about, tables, measured.track), whole).sensors}
    assert moved == as_stated and any(x > 0.0 for x, *_ in moved.values())


def test_sensors_of_the_bogie_that_half_a_vehicle_lacks_are_left_out_and_said() -> None:
    """The shipped whole coach has sensors on both bogies, half a vehicle has one of these."""
    whole = load_scenario("whole_coach", {"duration": 14})
    far = {"kind": "displacement", "name": "far", "across": "primary3_left", "rate": 256, "errors": "transducer"}
    whole = whole.but(sensors=(*whole.sensors, build_sensor(far)))
    measured = as_measured(whole, whole, "compiled")
    half = load_scenario("default", {"duration": 14})
    found = evidence_of(measured, half)
    assert {one.name for one in evidence_of(measured, whole).sensors} - {one.name for one in found.sensors} == {
        "bogie2",
        "far",
    }
    assert not [name for name in found.channels if name.startswith(("bogie2", "far"))]
    assert found.left_out == (
        "bogie2: the model has no body 'bogie2'; it has body, bogie, wheelset1, wheelset2",
        "far: the model has no element 'primary3_left'",
    )


def test_a_single_wheelset_as_model_is_refused_with_what_to_give() -> None:
    """It has no body, bogie and dampers, which tolerances and effects are about."""
    half = load_scenario("default", {"duration": 14})
    with pytest.raises(InputError, match=r"'wheelset' has no bogie; give .* default or whole_coach"):
        evidence_of(as_measured(half, half, "compiled"), load_scenario("wheelset_new"))
