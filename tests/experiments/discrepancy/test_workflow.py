"""The whole workflow on recordings that Exudyn made, in a process that cannot open the truth."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from railsim import load_scenario, measure, simulate

# Refuses to open anything of the truth or of the cache of runs: reading one byte of it ends the process.
GUARDED = """
import sys
forbidden = sys.argv[1:3]
def guard(event, arguments):
    if event == "open" and any(str(arguments[0]).startswith(one) for one in forbidden):
        raise SystemExit(f"opened {arguments[0]}")
sys.addaudithook(guard)
from experiments.cli import main
sys.exit(main(sys.argv[3:]))
"""
BUILD = {  # of this specimen, within tolerance of the nominal
    "vehicle.body_mass": 17500.0,
    "vehicle.primary_vertical_stiffness": 1.15e6,
    "vehicle.secondary_lateral_damping": 18e3,
    "vehicle.pair.conicity": 0.133,
}
SHORT = {"duration": 14.5}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A healthy vehicle and one whose yaw dampers have failed, both with their truth, and the nominal scenario."""
    folder = tmp_path_factory.mktemp("discrepancy")
    found = {"folder": folder, "model": folder / "nominal.yaml"}
    found["model"].write_text(load_scenario("yaw_dampers", SHORT).to_yaml(), encoding="utf-8")
    for name, effects in (("healthy", []), ("failed", [{"kind": "weak_yaw_damper", "factor": 0.05}])):
        scenario = load_scenario("yaw_dampers", {**SHORT, **BUILD, "start": 25.2, "seed": 11, "effects": effects})
        measure(simulate(scenario, folder=folder / f"{name}_run"), scenario, folder=folder / name)
        shutil.rmtree(folder / f"{name}_run")
    return found


def _explain(recordings: dict[str, Path], name: str) -> tuple[subprocess.CompletedProcess, Path]:
    out = recordings["folder"] / f"{name}_explained"
    truth = recordings[name] if name in recordings else recordings["folder"] / name / "truth"
    effects = ["weak_yaw_damper", "weak_lateral_damper"]
    command = ["discrepancy", str(recordings["folder"] / name), "--model", str(recordings["model"]), "--out", str(out)]
    command += ["--effects", *effects, "--engine", "compiled", "--json"]
    guarded = [sys.executable, "-c", GUARDED, str(truth), str(recordings["folder"] / "cache"), *command]
    return subprocess.run(guarded, capture_output=True, text=True, check=False), out


def test_failed_yaw_dampers_are_found_named_and_added(recordings: dict[str, Path]):
    done, out = _explain(recordings, "failed")
    assert done.returncode == 0, done.stderr
    verdict = json.loads(done.stdout)
    assert (verdict["status"], verdict["effect"]) == ("named", "weak_yaw_damper")
    assert verdict["parameters"]["factor"]["low"] <= 0.05 <= verdict["parameters"]["factor"]["high"] + 0.05
    gap = verdict["gap"]
    assert gap["before"] > gap["nuisance_only"] > gap["after"]
    assert gap["after"] < 1.15
    model = yaml.safe_load((out / "model.yaml").read_text())
    assert [effect["kind"] for effect in model["effects"]] == ["weak_yaw_damper"]
    assert load_scenario(out / "model.yaml").effects[0].kind == "weak_yaw_damper"
    page = (out / "report.html").read_text()
    assert "data:image/png;base64," in page
    assert "http" not in page


def test_a_healthy_vehicle_is_not_accused(recordings: dict[str, Path]):
    done, out = _explain(recordings, "healthy")
    assert done.returncode == 0, done.stderr
    verdict = json.loads(done.stdout)
    assert (verdict["status"], verdict["effect"]) == ("none", None)
    assert verdict["gap"]["nuisance_only"] < 1.15
    assert load_scenario(out / "model.yaml").effects == ()


def test_refusals_are_one_line_that_says_why(recordings: dict[str, Path], tmp_path: Path):
    from experiments.cli import main

    blind = tmp_path / "no_track"
    shutil.copytree(recordings["folder"] / "healthy", blind, ignore=shutil.ignore_patterns("truth", "track.csv"))
    command = ["discrepancy", str(blind), "--model", str(recordings["model"]), "--out", str(tmp_path / "out")]
    assert main(command) == 2
    assert not (tmp_path / "out").exists()
