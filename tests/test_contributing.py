"""The examples of CONTRIBUTING.md work as they stand there, in a folder outside the repository."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimators.interface import ESTIMATORS, Estimate
from experiments.cli import main
from experiments.scoring.interface import SCORERS
from railsim import load_scenario
from railsim.effects.interface import EFFECTS
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.sensors.interface import SENSORS
from railsim.vehicles.lookup import build_vehicle
from tests.sensors.synthetic import times, write_truth

TEXT = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text()
EXAMPLES = {
    name: code
    for code in re.findall(r"^```(?:python|yaml)?\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    for name in re.findall(r"\A# ([\w/]+/\w+\.\w+)", code)
}
KINDS = {
    "estimators": "estimators",
    "experiments/scoring": "scorers",
    "railsim/sensors": "sensors",
    "railsim/vehicles": "vehicles",
    "railsim/effects": "effects",
    "scenarios": "scenarios",
    "track_data": "tracks",
    "experiments/figures": "figures",
}
"""Kind by the folder of an example's first line."""
SHORT = ("--engine", "compiled", "--set", "duration=12")


@pytest.fixture(scope="module", params=["by kind", "as in the repository"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with every example, sorted as CONTRIBUTING shows or as the examples' first lines say."""
    folder = tmp_path_factory.mktemp("plugins")
    for name, code in EXAMPLES.items():
        place = Path(name).parent.as_posix()
        file = folder / (KINDS[place] if request.param == "by kind" else place) / Path(name).name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(code)
    return folder


@pytest.fixture
def call(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """The command with `--plugins`, in an empty folder: its JSON."""
    monkeypatch.chdir(tmp_path)

    def command(*words: str, code: int = 0) -> Any:
        capsys.readouterr()
        assert main([*words, "--plugins", str(folder), "--json"]) == code, capsys.readouterr().err
        return json.loads(capsys.readouterr().out)

    return command


@pytest.fixture
def plugged(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The examples are plugged into this process."""
    monkeypatch.setenv("RAILSIM_PLUGINS", str(folder))


def test_every_kind_has_an_example():
    assert {Path(name).parent.as_posix() for name in EXAMPLES} == set(KINDS)


def test_every_example_is_found(call: Any):
    listed = call("list")
    for name in EXAMPLES:
        kind = KINDS[Path(name).parent.as_posix()]
        (row,) = [row for row in listed[kind] if row["name"] == Path(name).stem]
        assert row["description"], name


@pytest.mark.parametrize("name", sorted({Path(name).stem for name in EXAMPLES}))
def test_every_example_conforms(name: str, call: Any):
    checks = call("check", name)["checks"]
    assert {KINDS[Path(one).parent.as_posix()] for one in EXAMPLES if Path(one).stem == name} == {
        row["kind"] for row in checks
    }
    assert [row for row in checks if not row["ok"]] == []


def test_run_estimates_and_scores_with_the_examples(call: Any, tmp_path: Path):
    run = call("run", "slow_curve", *SHORT)
    scores = [row for row in run["scores"] if row["estimator"] == "pitch_bias"]
    assert [row["score"] for row in scores] == ["bias over true pitch rate, rms"]
    again = call("estimate", "pitch_bias", "results/slow_curve/recording", "--out", "estimate")
    assert again["columns"] == ["time [s]", "rate_pitch_bias [rad/s]"]
    assert call("score", "estimate", "results/slow_curve/recording")["scores"] == scores


def test_estimate_by_the_path_of_a_file(call: Any, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    (file,) = folder.glob("estimators/pitch_bias.py")
    call("simulate", "slow_curve", *SHORT, "--out", "recording")
    assert main(["estimate", str(file), "recording", "--out", "estimate"]) == 0, capsys.readouterr().err


def test_an_estimate_that_nothing_scores_is_a_note(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "estimators").mkdir()
    (tmp_path / "estimators" / "pitch_bias.py").write_text(EXAMPLES["estimators/pitch_bias.py"])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RAILSIM_PLUGINS", str(tmp_path))
    assert main(["run", "default", "--engine", "compiled", "--set", "duration=8", "--json"]) == 0
    assert "nothing scores column 'rate_pitch_bias [rad/s]'" in str(json.loads(capsys.readouterr().out)["notes"])


def names(kind: str) -> list[str]:
    """The examples of a kind."""
    return [Path(name).stem for name in EXAMPLES if KINDS[Path(name).parent.as_posix()] == kind]


def with_examples(vehicle: str) -> dict[str, Any]:
    """Changes of a scenario that put the examples into it."""
    gyro = {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": ["pitch"], "rate": 256}
    switches = [{"kind": kind, "name": "bogie", "body": "bogie", "rate": 256} for kind in names("sensors")]
    effects = [{"kind": kind} for kind in names("effects")]
    (track,) = names("tracks")
    return {"track": track, "vehicle": vehicle, "effects": effects, "sensors": [gyro, *switches], "duration": 4}


@pytest.mark.parametrize("vehicle", names("vehicles"))
@pytest.mark.parametrize("scenario", names("scenarios"))
def test_run_with_every_example_at_once(scenario: str, vehicle: str, call: Any, tmp_path: Path):
    changes = [f"{key}={json.dumps(value)}" for key, value in with_examples(vehicle).items()]
    run = call("run", scenario, "--engine", "compiled", "--set", *changes)
    assert (run["notes"], run["refused"], run["failed"]) == ([], {}, [])
    assert [row["estimator"] for row in run["scores"]] == names("estimators") == names("scorers")
    recording = tmp_path / "results" / scenario / "recording"
    was = "".join((recording / "truth" / name).read_text() for name in ("scenario.yaml", "track.csv"))
    used = [*names("effects"), *names("sensors"), *(f"# track_data/{name}" for name in names("tracks")), vehicle]
    assert [name for name in used if name not in was] == []
    assert json.loads((recording / "about.json").read_text())["vehicle"]["name"] == vehicle


def test_what_the_file_of_a_vehicle_leaves_to_its_base_is_told(call: Any, tmp_path: Path):
    made = call("simulate", "slow_curve", *SHORT, "vehicle=laden", "--out", "recording")
    assert made["channels"] == ["bogie.rate_pitch [rad/s]"]
    about = json.loads((tmp_path / "recording" / "about.json").read_text())
    assert about["vehicle"]["body_mass"] == 19200.0
    assert about["assumptions"][0].startswith("vehicle 'laden': as of 'manchester': ")


def test_track_of_the_example_is_inspected(call: Any):
    (track,) = names("tracks")
    assert call("inspect", track)["inspected"][0]["kind"] == "track"


def test_figure_of_the_example(call: Any):
    made = call("figure", "bounce", "--out", "figures", "--fast")["figures"]["bounce"]
    assert sorted(Path(file).name for file in made["files"]) == ["bounce.csv", "bounce.png", "bounce.svg"]
    assert [claim["held"] for claim in made["claims"]] == [True]


@pytest.mark.parametrize("scenario", names("scenarios"))
def test_sweep_in_processes_with_every_example_at_once(scenario: str, call: Any, tmp_path: Path):
    changes = with_examples("manchester")
    del changes["vehicle"]
    design = {"kind": "grid", "keys": {"vehicle": names("vehicles")}}
    sweep = {"scenario": scenario, "set": changes, "design": design, "estimators": names("estimators")}
    (tmp_path / "sweep.yaml").write_text(json.dumps(sweep))
    call("sweep", "sweep.yaml", "--out", "out", "--jobs", "1")
    table = pd.read_parquet(tmp_path / "out" / "table.parquet")
    assert set(table["status"]) == {"ok"}, table["message"].tolist()
    assert set(table["vehicle"]) == set(names("vehicles"))
    assert set(table["estimator"]) == set(names("estimators"))
    assert set(table["score"]) == {"bias over true pitch rate, rms"}


@pytest.mark.usefixtures("plugged")
def test_what_the_estimator_and_its_scorer_give():
    estimator = ESTIMATORS.pick("pitch_bias").build({"window": 1.0})
    table = {"time [s]": np.arange(2560) / 256.0, "bogie.rate_pitch [rad/s]": np.full(2560, 0.01)}
    measurements = Measurements({"origin": "test", "vehicle": {}, "sensors": []}, {256.0: table})
    series = estimator.estimate(measurements).series
    assert series["rate_pitch_bias [rad/s]"].to_numpy()[200:-200] == pytest.approx(0.01)


@pytest.mark.usefixtures("plugged")
def test_what_the_scorer_gives(tmp_path: Path):
    true = 0.02 * np.sin(2.0 * np.pi * times(2.0))
    truth = write_truth(tmp_path / "truth", {"bogie.angular_velocity_y [rad/s]": true})
    estimate = Estimate("x", pd.DataFrame({"time [s]": times(2.0), "rate_pitch_bias [rad/s]": 0.5 * true}))
    scorer = SCORERS.pick("pitch_bias")()
    assert scorer.score(estimate, truth) == {"bias over true pitch rate, rms [-]": pytest.approx(0.5)}


@pytest.mark.usefixtures("plugged")
def test_what_the_sensor_measures(tmp_path: Path):
    force = 9.81 + 10.0 * (times(2.0) > 1.0)
    truth = write_truth(tmp_path / "truth", {"bogie.specific_force_z [m/s2]": force})
    sensor = SENSORS.pick("vibration_switch").build({"name": "bogie", "body": "bogie", "rate": 256.0})
    closed = sensor.measure(truth, np.random.default_rng(1))["bogie.closed [-]"].to_numpy()
    assert closed[:250].max() == 0.0
    assert closed[-250:].min() == 1.0


@pytest.mark.usefixtures("plugged")
@pytest.mark.parametrize("name", ["loaded", "laden"])
def test_what_the_vehicles_weigh(name: str):
    vehicle = build_vehicle(name)
    assert next(body for body in vehicle.model().bodies if body.name == "body").mass == 19200.0
    assert vehicle.nominal()["body_mass"] == 19200.0


@pytest.mark.usefixtures("plugged")
def test_what_the_effect_changes():
    effect = EFFECTS.pick("soft_primary").build({"factor": 0.5})
    scenario = load_scenario("straight_erri_low")
    soft = effect.install(scenario.setup).model
    stiffness = [m.elements[1].stiffness[2, 2] for m in (soft, scenario.model)]
    assert stiffness[0] == pytest.approx(0.5 * stiffness[1])
    with pytest.raises(InputError, match="'soft_primary': vehicle 'wheelset' has no primary_vertical_stiffness"):
        effect.install(load_scenario("wheelset_new").setup)


def test_an_installed_package_with_the_example(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    package, about = tmp_path / "my_filters", tmp_path / "my_filters-1.0.dist-info"
    for made in (package, about):
        made.mkdir()
    (package / "__init__.py").touch()
    (package / "pitch_bias.py").write_text(EXAMPLES["estimators/pitch_bias.py"])
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my_filters\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[railsim.estimators]\nmine = my_filters.pitch_bias\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert main(["list", "estimators", "--json"]) == 0
    assert "pitch_bias" in [row["name"] for row in json.loads(capsys.readouterr().out)["estimators"]]
    assert main(["check", "pitch_bias"]) == 0
