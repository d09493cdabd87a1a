"""What is taken from a recording: where its sensors are."""

from experiments.discrepancy.railway.cases import as_measured
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.measurements import Measurements
from railsim.scenario import load_scenario


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
