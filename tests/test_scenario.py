"""Scenarios: what YAML gives, what is refused and how, and that text and object are the same."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from railsim import InputError, load_scenario
from railsim.overrides import override
from railsim.scenario import Scenario, shipped_scenarios
from railsim.track.files import shipped_tracks, write_track
from railsim.track.track import Track
from railsim.vehicles.manchester import Manchester

SMALL = """
track: smooth
vehicle: {name: manchester, body_mass: 15000}
speed: {kind: constant, speed: 20}
duration: 2
sensors:
  - {kind: gyro, name: bogie, body: bogie, rate: 256}
  - {kind: accelerometer, name: bogie, body: bogie, axes: z, rate: 256, errors: mems}
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    return path


@pytest.mark.parametrize("name", shipped_scenarios())
def test_shipped_scenario_is_whole(name: str):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert len(scenario.description) > 20
    assert scenario.sensors


def test_every_shipped_track_has_a_scenario():
    assert set(shipped_tracks()) <= {load_scenario(name).track for name in shipped_scenarios()}


@pytest.mark.parametrize("name", shipped_scenarios())
def test_yaml_gives_the_same_scenario_back(name: str):
    scenario = load_scenario(name)
    again = Scenario.build(yaml.safe_load(scenario.to_yaml()))
    assert again == scenario
    assert hash(again) == hash(scenario)
    assert again.digest() == scenario.digest()


def test_names_become_what_they_stand_for(small: Path):
    scenario = load_scenario(small)
    assert scenario.vehicle == Manchester(body_mass=15000)
    assert scenario.vehicle_name == "manchester"
    assert scenario.sensors[1].errors.range == 100.0
    assert scenario.name == "small"


def test_overrides_reach_into_lists_and_short_forms(small: Path):
    texts = ["sensors.0.rate=512", "sensors.1.errors.bandwidth=50", "vehicle.adhesion.friction=0.3", "seed=7"]
    scenario = load_scenario(small, texts)
    assert (scenario.sensors[0].rate, scenario.sensors[1].rate) == (512, 256)
    assert (scenario.sensors[1].errors.bandwidth, scenario.sensors[1].errors.range) == (50, 100)
    assert scenario.vehicle.model_dump()["adhesion"]["friction"] == 0.3
    assert scenario.seed == 7
    assert load_scenario(small, dict(text.split("=") for text in texts)) == scenario


def test_override_by_name_changes_every_entry_of_that_name(small: Path):
    assert [sensor.rate for sensor in load_scenario(small, ["sensors.bogie.rate=128"]).sensors] == [128, 128]


def test_override_leaves_the_original_alone():
    values = {"a": [{"b": 1}]}
    assert override(values, "a.0.b", 2) == {"a": [{"b": 2}]}
    assert values == {"a": [{"b": 1}]}


def test_but_is_checked_again(small: Path):
    scenario = load_scenario(small)
    assert scenario.but(duration=3).duration == 3
    with pytest.raises(InputError, match="^track: 'smooth' ends at 3000.0 m"):
        scenario.but(duration=200)


def test_a_scenario_that_runs_elsewhere_needs_no_track_along_its_way(small: Path):
    with pytest.raises(InputError, match="before track 'smooth' begins"):
        load_scenario(small, ["start=0"])
    assert load_scenario(small, ["start=0"], elsewhere=True).start == 0.0
    with pytest.raises(InputError, match="wheelset"):
        load_scenario(small, ["start=0", "traction=[{wheelset: 7, time: [0, 1], torque: [0, 100]}]"], elsewhere=True)


def test_digest_follows_the_contents_of_the_track(small: Path, tmp_path: Path):
    s = np.linspace(0, 500, 6)
    digests = set()
    for height in (0.0, 1e-3, 1e-3):
        write_track(Track(s, {"vertical": height * np.sin(s)}), tmp_path / "mine.csv")
        digests.add(load_scenario(small, ["track=mine.csv"]).digest())
    assert len(digests) == 2


def test_relative_track_is_looked_for_beside_the_scenario_first(small: Path, tmp_path: Path, monkeypatch):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    for folder, end in ((elsewhere, 200.0), (tmp_path, 100.0)):
        write_track(Track(np.linspace(0, end, 6), {}), folder / "mine.csv")
        assert load_scenario(small, ["track=mine.csv"]).geometry.s[-1] == end


def test_length_of_the_run_is_the_integral_of_speed(small: Path):
    profile = {"kind": "profile", "time": [0, 1, 5], "speed": [10, 20, 20]}
    assert load_scenario(small, {"speed": profile}).distance == pytest.approx(15 + 20)
    assert load_scenario(small, {"speed": {"kind": "driven", "speed": 20}}).distance is None


def test_missing_bogie_may_stand_before_the_track_but_no_wheelset(small: Path):
    half = Manchester().semi_wheelbase
    assert load_scenario(small, {"start": half}).start == half
    with pytest.raises(InputError, match="start: 1.27 m puts the rear wheelset at -0.01 m"):
        load_scenario(small, {"start": 1.27})


def test_longest_duration_that_is_named_does_fit(small: Path):
    profile = {"kind": "profile", "time": [0, 30, 60], "speed": [10, 60, 20]}
    with pytest.raises(InputError) as caught:
        load_scenario(small, {"speed": profile, "duration": 100})
    longest = float(str(caught.value).split("shorten duration to ")[1].split(" s")[0])
    assert load_scenario(small, {"speed": profile, "duration": longest}).duration == longest
    with pytest.raises(InputError):
        load_scenario(small, {"speed": profile, "duration": longest + 0.05})


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (["vehicle.body_mass=-5"], r"vehicle\.body_mass: Input should be greater than 0 \(got -5\)"),
        (["vehicle.body_mas=5"], r"vehicle\.body_mas: unknown key; did you mean 'body_mass'\? Manch"),
        (["vehicle=nix"], r"unknown vehicle 'nix'; there are: .*manchester"),
        (["vehicle=3"], r"vehicle: give a name"),
        (["durations=5"], r"durations: unknown key; did you mean 'duration'\? Scenario knows"),
        (["duration=-5"], r"duration: Input should be greater than 0"),
        (["track=nix"], r"no track 'nix'; there are: .*smooth"),
        (["track=nix.csv"], r"no track 'nix\.csv'; check the path"),
        (["speed=3"], r"speed: give for example"),
        (["speed.kind=slow"], r"unknown kind of speed 'slow'; there are: constant, driven, profile"),
        (["speed.speed=-3"], r"speed\.speed: Input should be greater than 0"),
        (["sensors.0.rate=300"], r"sensors\.bogie\.rate: 300 Hz does not divide output_rate \(1024 Hz\); use 256 Hz"),
        (["output_rate=200"], r"sensors\.bogie\.rate: 256 Hz does not divide output_rate \(200 Hz\); use 200 Hz"),
        (["sensors.0.body=roof"], r"sensors\.bogie\.body: no body 'roof'; the vehicle has body, bogie, wheelset1"),
        (["sensors.7.rate=64"], r"sensors\.7\.rate: no entry '7' in a list of 2"),
        (["sensors=3"], r"sensors: give a list"),
        (["effects=[tilt]"], r"unknown effect 'tilt'; there are: .*weak_yaw_damper"),
        (["effects=[{factor: 1}]"], r"effects\.0: an effect needs a kind; give one of: .*weak_lateral_damper"),
        (["effects=[{kind: weak_yaw_damper, factor: 3}]"], r"effects\.0\.factor: Input should be less than or equal"),
        (["effects=[weak_yaw_damper]"], r"effects\.0: effect 'weak_yaw_damper': this vehicle has nothing there"),
        (["traction=[{wheelset: 3, time: [0], slip: [0]}]"], r"traction\.0\.wheelset: 3, but the vehicle has 2"),
        (["traction=[{wheelset: 1, time: [0]}]"], r"traction\.0: give one of torque, brake and slip"),
        (["output_rate=256", "substeps=1"], r"substeps: a step of 3.91 ms is unstable .* give at least 3 or"),
        (["speed.speed=2", "substeps=1"], r"substeps: a step of 0.977 ms is unstable .* at 2 m/s; give at least"),
        (["seed"], r"--set seed: write key=value"),
        (["seed=["], r"--set seed=\[: the value is not YAML"),
        (["seed.deep=3", "seed.deep.er=4"], r"seed\.deep\.er: 'er' leads into the value 3"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(small: Path, changes: list[str], line: str):
    if changes[0].startswith("output_rate=256"):
        changes = [*changes, "sensors=[]"]
    with pytest.raises(InputError, match=f"^{line}") as caught:
        load_scenario(small, changes)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("track: [smooth", "is not YAML: .* \\(line 1\\)"),
        ("- a\n- b\n", "is not a scenario: it must hold keys and values"),
        ("1: 2\n", "is not a scenario"),
        ("vehicle: !!python/object/apply:os.getcwd []\n", "is not YAML: could not determine a constructor"),
    ],
)
def test_files_that_are_no_scenarios(tmp_path: Path, text: str, line: str):
    path = tmp_path / "any.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=line):
        load_scenario(path)


def test_no_such_file(tmp_path: Path):
    with pytest.raises(InputError, match="no scenario 'nix'; there are: .*default"):
        load_scenario("nix")
    with pytest.raises(InputError, match=r"no scenario '.*nix\.yaml'; check the path"):
        load_scenario(tmp_path / "nix.yaml")
    with pytest.raises(InputError, match="cannot read scenario"):
        load_scenario(tmp_path)
