"""Plug-ins that fail: one line that names them and their line of code, the traceback in a file, the rest is kept."""

import errno
import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from experiments.cli import main
from experiments.reporting.failures import PluginError, plugin_code
from experiments.sweep.table import read_table
from railsim.errors import InputError

ESTIMATOR = '''
import pandas as pd

from estimators.interface import Estimate, Estimator


class Failing(Estimator, frozen=True):
    """Fails in one way or another."""

    requires = ("bogie.rate_pitch [rad/s]",)

    def estimate(self, measurements):
        time = measurements.time(self.requires[0])
        {body}
'''
SCORER = '''
from experiments.scoring.interface import Scorer


class Failing(Scorer):
    """Fails for every estimate of the speed."""

    columns = ("speed [m/s]",)

    def score(self, estimate, truth):
        raise KeyError("wind")
'''
BODIES = {
    "raising": ("raise Exception('out of tune')", "raising failed: Exception: out of tune (raising.py, line 14)"),
    "library": ("pd.concat([])", "library failed: ValueError: No objects to concatenate (library.py, line 14)"),
    "nothing": ("return None", "nothing failed: TypeError: estimate() gave NoneType, not an Estimate"),
    "unwritable": (
        "return Estimate(self.name, pd.DataFrame({'time [s]': time}), {'rate': {1, 2}})",
        "unwritable failed: TypeError: Object of type set is not JSON serializable",
    ),
    "words": (
        "return Estimate(self.name, pd.DataFrame({'time [s]': time, 'speed [m/s]': 'fast'}))",
        "words failed: ValueError: could not convert string to float: 'fast'",
    ),
}
"""Body of `estimate` and begin of the line, by name of the estimator."""
WIND = "scorer 'wind' of 'speed_plain' failed: KeyError: 'wind' (wind.py, line 11)"
GOOD = {"speed_plain", "speed_refined"}


@pytest.fixture(scope="module")
def plugins(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the failing estimators and scorer."""
    folder = tmp_path_factory.mktemp("failing")
    files = {f"estimators/{name}.py": ESTIMATOR.replace("{body}", body) for name, (body, _) in BODIES.items()}
    for name, code in {**files, "scorers/wind.py": SCORER}.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(code)
    return folder


@pytest.fixture(scope="module")
def ran(plugins: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder and text of a run with them."""
    out, text = tmp_path_factory.mktemp("run") / "out", io.StringIO()
    words = ["run", "default", "--engine", "compiled", "--set", "duration=8", "--plugins", str(plugins)]
    with redirect_stdout(text):
        assert main([*words, "--out", str(out)]) == 1
    return out, text.getvalue()


def summary(ran: tuple[Path, str]) -> dict[str, Any]:
    return json.loads((ran[0] / "summary.json").read_text())


@pytest.mark.parametrize("name", BODIES)
def test_an_estimator_that_fails_is_told_in_one_line_with_its_traceback(name: str, ran: tuple[Path, str]):
    (failed,) = [one for one in summary(ran)["failed"] if one["name"] == name]
    assert failed["message"].startswith(BODIES[name][1])
    assert f"FAILED: {failed['message']}; traceback: {ran[0] / failed['traceback']}\n" in ran[1]
    assert "Traceback (most recent call last)" in (ran[0] / failed["traceback"]).read_text()
    assert not (ran[0] / "estimates" / name).exists()


def test_a_scorer_that_fails_is_told_in_one_line_with_its_traceback(ran: tuple[Path, str]):
    told = {one["name"]: one for one in summary(ran)["failed"]}
    assert told["speed_plain-wind"]["message"] == WIND
    assert "KeyError" in (ran[0] / told["speed_plain-wind"]["traceback"]).read_text()


def test_the_results_of_the_others_are_kept(ran: tuple[Path, str]):
    assert {row["estimator"] for row in summary(ran)["scores"]} >= GOOD
    assert {path.name for path in (ran[0] / "estimates").iterdir()} >= GOOD
    assert (ran[0] / "plots" / "speed.png").exists()


def test_sweep_has_failed_rows_and_keeps_the_others(
    plugins: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    Path("sweep.yaml").write_text(
        "scenario: default\nset: {duration: 6}\ndesign: {kind: grid, keys: {vehicle.body_mass: [17000]}}\n"
        "engine: compiled\nestimators: [raising, speed_plain]\n"
    )
    assert main(["sweep", "sweep.yaml", "--out", "out", "--jobs", "1", "--plugins", str(plugins), "--json"]) == 1
    result = json.loads(capsys.readouterr().out)
    status = read_table(Path("out", "table.parquet")).groupby(["estimator", "status"])["message"].agg(list).to_dict()
    assert status["raising", "failed"] == [BODIES["raising"][1]]
    assert status["speed_plain", "failed"] == [WIND]
    assert len(status["speed_plain", "ok"]) > 3
    assert result["failed"] == sorted([BODIES["raising"][1], WIND])
    assert Path(result["tracebacks"]).read_text().count("Traceback (most recent call last)") == 2


def test_raw_data_stay_where_an_estimator_fails(
    plugins: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "default", "--engine", "compiled", "--set", "duration=8", "--out", "recording"]) == 0
    words = ["inspect", "recording", "--prune", "--after", "0", "--yes"]
    assert main([*words, "--plugins", str(plugins)]) == 1
    assert BODIES["raising"][1] in capsys.readouterr().out
    assert Path("recording", "measured").is_dir()
    assert main(words) == 0
    assert not Path("recording", "measured").exists()


@pytest.mark.parametrize("error", [InputError("too short"), MemoryError(), OSError(errno.ENOSPC, "full")], ids=repr)
def test_refusals_and_errors_of_the_machine_are_no_failure_of_the_plugin(error: Exception):
    with pytest.raises(type(error)), plugin_code("mine"):
        raise error


def test_a_missing_file_is_a_failure_of_the_plugin():
    with pytest.raises(PluginError, match=r"^mine failed: FileNotFoundError: .*no/such"), plugin_code("mine"):
        open("/no/such")  # noqa: SIM115 - it is not opened
