"""The whole workflow on recordings that Exudyn made, in a process that cannot open the truth."""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from estimators.interface import Estimate
from experiments.cli import main
from experiments.discrepancy.baseline.estimated_track import given_track
from railsim import load_scenario, measure, simulate
from railsim.digests import write_marker
from railsim.errors import InputError
from railsim.parquet import write_frame

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
        _edit(folder / name, lambda table, at=3.0 if effects else None: _dead(table, at))
    return found


def _edit(recording: Path, change: Callable[[pd.DataFrame], pd.DataFrame]) -> None:
    """Every table of a recording changed, and its description with it."""
    about = json.loads((recording / "about.json").read_text())
    for path in (recording / "measured").glob("*.parquet"):
        table = change(pd.read_parquet(path))
        write_frame(path, table)
        about["measured"][path.name]["rows"] = len(table)
    (recording / "about.json").write_text(json.dumps(about))
    write_marker(recording)


def _dead(table: pd.DataFrame, dropped: float | None) -> pd.DataFrame:
    """A transducer that always gives the same value, and a gyro that fails for 1.5 s."""
    for name in table.columns:
        if name.startswith("primary1_right"):
            table[name] = 0.001
        if dropped and name.endswith("rate_roll [rad/s]"):
            table.loc[table["time [s]"].between(dropped, dropped + 1.5), name] = np.nan
    return table


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
    factor = verdict["parameters"]["factor"]
    assert factor["low"] <= 0.05 <= factor["high"] < 0.3  # what the recording was made with, and little else
    gap = verdict["gap"]
    assert gap["before"] > gap["nuisance_only"] > gap["after"]
    assert gap["after"] < 1.15
    assert verdict["left_out"] == ["primary1_right.displacement [m]: it always gives the same value"]
    assert 0.0 < verdict["lost_sections"]["bogie.rate_roll [rad/s]"] < 0.5
    assert len(verdict["lost_sections"]) == 1
    model = yaml.safe_load((out / "model.yaml").read_text())
    assert [effect["kind"] for effect in model["effects"]] == ["weak_yaw_damper"]
    assert load_scenario(out / "model.yaml").effects[0].kind == "weak_yaw_damper"
    page = (out / "report.html").read_text()
    assert "data:image/png;base64," in page
    assert "://" not in page  # base64 has no colon


def test_a_healthy_vehicle_is_not_accused(recordings: dict[str, Path]):
    done, out = _explain(recordings, "healthy")
    assert done.returncode == 0, done.stderr
    verdict = json.loads(done.stdout)
    assert (verdict["status"], verdict["effect"]) == ("none", None)
    assert verdict["gap"]["nuisance_only"] < 1.15
    assert load_scenario(out / "model.yaml").effects == ()


def _short(table: pd.DataFrame) -> pd.DataFrame:
    return table.loc[: int(np.searchsorted(table["time [s]"].to_numpy(), 8.0)) - 1]


def _standing(table: pd.DataFrame) -> pd.DataFrame:
    rng = np.random.default_rng(3)
    for name in table.columns[1:]:
        table[name] = 0.0 if "speed" in name else 1e-4 * rng.standard_normal(len(table))
    return table


def _noise(table: pd.DataFrame) -> pd.DataFrame:
    return table if "wheelset1.speed [m/s]" in table else _standing(table)


def _nothing(table: pd.DataFrame) -> pd.DataFrame:
    for name in table.columns[1:]:
        table[name] = table[name] if "speed" in name else 0.5
    return table


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_short, "8.0 s long, too short to be judged; give 12 s or more"),
        (_standing, "moves slower than 2 m/s"),
        (_noise, "nothing in the recording follows the measured track"),
        (_nothing, "no channel of accelerometer, gyro, displacement that can be compared"),
        (None, "no track.csv.*--track ESTIMATE.*track_smoother"),
    ],
)
def test_what_cannot_say_anything_is_refused_in_one_line(
    recordings: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    change: Callable[[pd.DataFrame], pd.DataFrame] | None,
    said: str,
):
    blind = tmp_path / "recording"
    left = ("truth",) if change else ("truth", "track.csv")
    shutil.copytree(recordings["folder"] / "healthy", blind, ignore=shutil.ignore_patterns(*left))
    if change:
        _edit(blind, change)
    command = ["discrepancy", str(blind), "--model", str(recordings["model"]), "--out", str(tmp_path / "out")]
    assert main(command) == 2
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert re.search(said, line), line
    assert not (tmp_path / "out").exists()


def test_a_track_may_come_from_an_estimate(tmp_path: Path):
    s = np.arange(0.0, 100.0, 0.5)
    vertical = np.where(s < 5.0, np.nan, 1e-3 * np.sin(s))
    series = pd.DataFrame({"s [m]": s, "vertical [m]": vertical, "vertical_std [m]": np.full(s.size, 2e-4)})
    Estimate("track_smoother", series).save(tmp_path / "estimate")
    track, errors, estimated = given_track(str(tmp_path / "estimate"))
    assert estimated and track is not None
    assert errors is not None and np.isclose(errors.vertical_std, 2e-4) and errors.lateral_std == 0.0
    assert np.allclose(np.interp(s[20:], track.s, track.vertical), vertical[20:], atol=5e-5)
    Estimate("speed_plain", pd.DataFrame({"time [s]": s, "speed [m/s]": s})).save(tmp_path / "other")
    with pytest.raises(InputError, match="none of vertical, lateral, cross_level"):
        given_track(str(tmp_path / "other"))
