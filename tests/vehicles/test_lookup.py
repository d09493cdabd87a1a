"""A vehicle in a file: what it changes, what it leaves to its base, and how that is told."""

import json
from pathlib import Path

import pytest

from railsim import Recording, load_scenario, measure, simulate
from railsim.distribution import shipped_folder
from railsim.errors import InputError
from railsim.vehicles.lookup import build_vehicle, vehicle_names
from railsim.vehicles.manchester import Manchester

COACH = "base: manchester\nbody_mass: 18000\nadhesion: {condition: wet}\n"
SHIPPED = {"kind": "profiles", "wheel": "s1002", "rail": "uic60_40"}
SCENARIO = """
track: smooth
vehicle: my_coach.yaml
speed: {kind: constant, speed: 20}
start: 40
duration: 0.1
sensors: [{kind: gyro, name: bogie, body: bogie, rate: 64}]
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """A scenario beside the file of its vehicle."""
    (tmp_path / "my_coach.yaml").write_text(COACH)
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    return tmp_path / "mine.yaml"


def test_a_file_changes_its_base(scenario: Path):
    vehicle = load_scenario(scenario).vehicle
    assert isinstance(vehicle, Manchester)
    assert (vehicle.name, vehicle.body_mass, vehicle.bogie_mass) == ("my_coach", 18000.0, Manchester().bogie_mass)
    assert vehicle.adhesion.condition == "wet"


@pytest.mark.parametrize("place", ["scenario", "vehicle"])
def test_profiles_lie_beside_the_file_that_names_them(scenario: Path, monkeypatch: pytest.MonkeyPatch, place: str):
    """Named in the scenario or in the vehicle's file, and read from another working folder."""
    folder, pair = scenario.parent, "pair: {kind: profiles, wheel: wheel.csv, rail: uic60_40}"
    (folder / "wheel.csv").write_text((shipped_folder("track_data", "profiles") / "s1002.csv").read_text())
    (folder / "my_coach.yaml").write_text(COACH + (pair + "\n" if place == "vehicle" else ""))
    if place == "scenario":
        scenario.write_text(SCENARIO.replace("my_coach.yaml", "{name: my_coach.yaml, " + pair + "}"))
    monkeypatch.chdir(folder.parent)
    given, shipped = load_scenario(scenario).vehicle, build_vehicle({"name": "manchester", "pair": SHIPPED})
    assert isinstance(given, Manchester) and isinstance(shipped, Manchester)
    left, other = (one.pair.sides(one.wheel_radius, one.half_gauge)[0] for one in (given, shipped))
    assert left.radius == pytest.approx(other.radius, abs=1e-12)


def test_what_is_assumed_is_named_and_what_is_given_is_not(scenario: Path):
    vehicle = load_scenario(scenario, ["vehicle.bogie_mass=3000"]).vehicle
    assert vehicle.model_dump()["bogie_mass"] == 3000.0
    given = {"body_mass", "bogie_mass", "adhesion"}
    assert set(vehicle.assumed) == set(Manchester.model_fields) - given - {"label", "assumed"}
    (line,) = vehicle.assumptions()
    assert line.startswith("vehicle 'my_coach': as of 'manchester': body_roll_inertia, ")
    assert Manchester().assumptions() == []


def test_recording_and_its_scenario_hold_it_and_need_no_file(scenario: Path, tmp_path: Path):
    run = load_scenario(scenario)
    measure(simulate(run, "compiled", tmp_path / "truth"), run, folder=tmp_path / "recording")
    (tmp_path / "my_coach.yaml").unlink()
    about = json.loads((tmp_path / "recording" / "about.json").read_text())
    assert about["vehicle"]["name"] == "my_coach"
    assert about["assumptions"] == run.vehicle.assumptions()
    again = load_scenario(tmp_path / "recording" / "truth" / "scenario.yaml")
    assert again.vehicle == run.vehicle
    truth = Recording.open(tmp_path / "recording").truth
    assert truth is not None and truth.about["vehicle"]["name"] == "my_coach"


def test_a_file_in_a_folder_of_plug_ins_has_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "vehicles").mkdir()
    (tmp_path / "vehicles" / "my_coach.yaml").write_text(COACH)
    monkeypatch.setenv("RAILSIM_PLUGINS", str(tmp_path))
    assert "my_coach" in vehicle_names()
    assert build_vehicle({"name": "my_coach", "body_mass": 17000}).model_dump()["body_mass"] == 17000.0


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("body_mass: 18000", "my_coach.yaml': say what it changes, for example 'base: manchester'"),
        ("base: nix", "unknown vehicle 'nix'; there are: class175, "),
        (
            "base: manchester\nbody_mas: 1",
            r"vehicle 'my_coach'.body_mas: unknown key; did you mean 'body_mass'",
        ),
        ("base: manchester\nbody_mass: -1", r"vehicle 'my_coach'.body_mass: Input should be greater than 0"),
        ("base: [", "is not YAML"),
    ],
)
def test_a_wrong_file_is_told_in_a_line(scenario: Path, text: str, line: str):
    scenario.with_name("my_coach.yaml").write_text(text)
    with pytest.raises(InputError, match=line):
        load_scenario(scenario)


def test_a_file_that_is_not_there(scenario: Path):
    scenario.with_name("my_coach.yaml").unlink()
    with pytest.raises(InputError, match="no vehicle 'my_coach.yaml'; check the path"):
        load_scenario(scenario)
