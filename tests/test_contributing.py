"""The examples of CONTRIBUTING.md work as they stand there."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
import yaml

from estimators.interface import Estimate
from experiments.figures.interface import publish
from experiments.reporting.size import Size
from railsim import load_scenario
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.sensors.suite import build_sensor
from railsim.track import read_track
from tests.sensors.synthetic import times, write_truth

TEXT = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text()
EXAMPLES = {
    name: code
    for code in re.findall(r"^```(?:python|yaml)\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    for name in re.findall(r"\A# (\S+)", code)
}


def load(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Import an example from a file, under the name that it would have."""
    file, module = folder / "example.py", name.removesuffix(".py").replace("/", ".")
    file.write_text(EXAMPLES[name])
    spec = importlib.util.spec_from_file_location(module, file)
    assert spec is not None and spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, module, loaded)
    spec.loader.exec_module(loaded)
    return loaded


def test_every_kind_has_an_example():
    folders = {Path(name).parent.as_posix() for name in EXAMPLES}
    assert folders == {
        "estimators", "railsim/sensors", "railsim/vehicles", "railsim/effects", "scenarios", "experiments/figures",
        "experiments/scoring",
    }  # fmt: skip


def test_estimator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    estimator = load("estimators/pitch_bias.py", tmp_path, monkeypatch).PitchBias(window=1.0)
    table = {"time [s]": np.arange(2560) / 256.0, "bogie.rate_pitch [rad/s]": np.full(2560, 0.01)}
    measurements = Measurements({"origin": "test", "vehicle": {}, "sensors": []}, {256.0: table})
    assert estimator.name == "pitch_bias"
    assert estimator.fits(measurements)
    series = estimator.estimate(measurements).series
    assert series["rate_pitch_bias [rad/s]"].to_numpy()[200:-200] == pytest.approx(0.01)


def test_scorer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    scorer = load("experiments/scoring/pitch_bias.py", tmp_path, monkeypatch).PitchBiasScorer()
    true = 0.02 * np.sin(2.0 * np.pi * times(2.0))
    truth = write_truth(tmp_path / "truth", {"bogie.angular_velocity_y [rad/s]": true})
    bias = pd.DataFrame({"time [s]": times(2.0), "rate_pitch_bias [rad/s]": 0.5 * true})
    estimate = Estimate("pitch_bias", bias)
    assert scorer.columns_of(estimate) == ["rate_pitch_bias [rad/s]"]
    assert scorer.score(estimate, truth) == {"bias over true pitch rate, rms [-]": pytest.approx(0.5)}


def test_sensor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    vibration_switch = load("railsim/sensors/vibration_switch.py", tmp_path, monkeypatch).VibrationSwitch
    force = 9.81 + 10.0 * (times(2.0) > 1.0)
    truth = write_truth(tmp_path / "truth", {"bogie.specific_force_z [m/s2]": force})
    sensor = vibration_switch(name="bogie", body="bogie", rate=256.0)
    closed = sensor.measure(truth, np.random.default_rng(1))["bogie.closed [-]"].to_numpy()
    assert closed[:250].max() == 0.0
    assert closed[-250:].min() == 1.0


def test_vehicle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    loaded = load("railsim/vehicles/loaded.py", tmp_path, monkeypatch).Loaded()
    body = next(body for body in loaded.model().bodies if body.name == "body")
    assert body.mass == 19200.0
    assert loaded.nominal()["body_mass"] == 19200.0


def test_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    figure = load("experiments/figures/bounce.py", tmp_path, monkeypatch).Bounce()
    made = publish(figure, tmp_path / "figures", Size.FAST)
    assert sorted(Path(file).name for file in made["files"]) == ["bounce.csv", "bounce.png"]
    assert [set(claim) >= {"claim", "value", "target", "held"} for claim in made["claims"]] == [True]


def test_scenario_names_things_that_ship():
    scenario = yaml.safe_load(EXAMPLES["scenarios/slow_curve.yaml"])
    track, run = read_track(scenario["track"]), scenario["speed"]["speed"] * scenario["duration"]
    assert scenario["start"] + run < track.s[-1]
    sensors = [build_sensor(settings, "example") for settings in scenario["sensors"]]
    assert [channel for sensor in sensors for channel in sensor.channels()] == ["bogie.rate_pitch [rad/s]"]


def test_track(tmp_path: Path):
    text = re.search(r"^### Track$.*?^```\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert text is not None
    (tmp_path / "example.csv").write_text(text[1])
    assert read_track(tmp_path / "example.csv").given == ("vertical", "lateral")


def test_effect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    effect = load("railsim/effects/soft_primary.py", tmp_path, monkeypatch).SoftPrimary(factor=0.5)
    scenario = load_scenario("straight_erri_low")
    soft = effect.install(scenario.setup).model
    stiffness = [m.elements[1].stiffness[2, 2] for m in (soft, scenario.model)]
    assert stiffness[0] == pytest.approx(0.5 * stiffness[1])
    assert type(effect).parameters()["factor"][:6] == ("-", 0.3, 1.0, 0.8, 1.0, 0.9)
    with pytest.raises(InputError, match="'soft_primary': vehicle 'wheelset' has no primary_vertical_stiffness"):
        effect.install(load_scenario("wheelset_new").setup)
