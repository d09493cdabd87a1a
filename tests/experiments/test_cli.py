"""The command on good input: shapes of the JSON, files, exit codes."""

import argparse
import ctypes
import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from estimators.interface import ESTIMATORS, Estimate
from experiments.cli import build_parser, main
from experiments.commands.list import LISTERS, execute
from experiments.reporting.text import first_sentence, table
from railsim import Recording
from tests.experiments.conftest import ROOT, Command

SCENARIO = """
description: for a test
track: straight_erri_low
vehicle: class175
speed: {kind: constant, speed: 30}
start: 60
duration: 8
sensors:
  - {kind: accelerometer, name: bogie, body: bogie, axes: z, rate: 256, errors: mems}
  - {kind: gyro, name: bogie, body: bogie, axes: pitch, rate: 256, errors: mems}
  - {kind: tachometer, name: wheelset1, body: wheelset1, rate: 64}
"""
COMMANDS = sorted(
    path.stem.rstrip("_").replace("_", "-") for path in (ROOT / "experiments" / "commands").glob("[!_]*.py")
)
INSPECTION_CAR = ROOT.parent / "shared" / "reference" / "track" / "inspection_car.csv"


def read(done: subprocess.CompletedProcess[str], code: int = 0) -> Any:
    """The one JSON object on stdout."""
    assert done.returncode == code, done.stderr
    assert len(done.stdout.splitlines()) == 1
    return json.loads(done.stdout)


def test_run_writes_everything(railsim: Command, tmp_path: Path):
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    result = read(railsim("run", "mine.yaml", "--engine", "compiled", "--json"))
    folder = tmp_path / "results" / "mine"
    assert result["folder"] == "results/mine"
    assert {row["estimator"] for row in result["scores"]} >= {"speed_plain", "speed_refined"}
    assert all(set(row) == {"estimator", "score", "value", "unit"} for row in result["scores"])
    assert {path.name for path in folder.iterdir()} == {
        ".railsim", "recording", "estimates", "plots", "scores.csv", "summary.json",
    }  # fmt: skip
    for name in ("speed", "overview", "forces"):
        assert (folder / "plots" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["scores"] == result["scores"]
    assert summary["duration [s]"] == 8.0
    assert summary["distance [m]"] == pytest.approx(240.0)
    table = pd.read_csv(folder / "scores.csv")
    assert table["value"].tolist() == pytest.approx([row["value"] for row in result["scores"]])
    assert Recording.open(folder / "recording").truth is not None


def test_run_prints_true_and_estimated_speed(railsim: Command, tmp_path: Path):
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    done = railsim("run", "mine.yaml", "--engine", "compiled")
    assert (done.returncode, done.stderr) == (0, "")
    header = next(line for line in done.stdout.splitlines() if line.startswith("time [s]"))
    titles = header.replace("time [s]", "time_s").replace("tachometer wheelset1", "tachometer").split()
    assert titles[:3] == ["time_s", "true", "tachometer"]
    assert {"speed_plain", "speed_refined"} <= set(titles[3:]) <= set(ESTIMATORS.classes())
    last = next(line for line in done.stdout.splitlines() if line.strip().startswith("8.00")).split()
    speeds = dict(zip(titles, map(float, last), strict=True))
    assert [speeds[name] for name in ("true", "tachometer", "speed_plain", "speed_refined")] == pytest.approx(
        [108.0] * 4, abs=3.0
    )
    assert "largest error  km/h" in done.stdout


def test_simulate_estimate_score_by_hand_is_what_run_does(railsim_here: Command, tmp_path: Path):
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    run = read(railsim_here("run", "mine.yaml", "--engine", "compiled", "--seed", "5", "--json"))
    made = read(railsim_here("simulate", "mine.yaml", "--engine", "compiled", "--seed", "5", "--out", "made", "--json"))
    assert made["recording"] == "made"
    assert made["seed"] == 5
    estimate = read(railsim_here("estimate", "speed_plain", "made", "--out", "estimate", "--json"))
    assert estimate["columns"][:2] == ["time [s]", "speed [m/s]"]
    scores = read(railsim_here("score", "estimate", "made", "--json"))["scores"]
    assert scores == [row for row in run["scores"] if row["estimator"] == "speed_plain"]


def test_score_of_an_estimate_that_nothing_scores_is_a_note(railsim_here: Command, recording: Path, tmp_path: Path):
    Estimate("mine", pd.DataFrame({"time [s]": [0.0], "colour [-]": [1.0]})).save(tmp_path / "estimate")
    result = read(railsim_here("score", "estimate", recording, "--json"))
    assert result["scores"] == []
    assert result["notes"][0].startswith("nothing scores column 'colour [-]' of estimate 'mine'")
    assert "Note: nothing scores" in railsim_here("score", "estimate", recording).stdout


def test_run_without_an_estimator_that_fits(railsim_here: Command, tmp_path: Path):
    (tmp_path / "mine.yaml").write_text(SCENARIO.split("sensors:")[0])
    text = "sensors=[{kind: gyro, name: body, body: body, rate: 64}]"
    done = railsim_here("run", "mine.yaml", "--engine", "compiled", "--set", text)
    assert done.returncode == 0, done.stderr
    assert "No estimator fits" in done.stdout


def test_run_of_the_single_wheelset(railsim_here: Command, tmp_path: Path):
    """Pictures leave out what that vehicle does not have."""
    text = SCENARIO.split("sensors:")[0] + "sensors: [{kind: accelerometer, name: w, body: wheelset1, rate: 64}]\n"
    (tmp_path / "mine.yaml").write_text(text.replace("class175", "wheelset").replace("speed: 30", "speed: 10"))
    assert railsim_here("run", "mine.yaml", "--engine", "compiled").returncode == 0
    assert (tmp_path / "results" / "mine" / "plots" / "overview.png").is_file()


@pytest.mark.skipif(not INSPECTION_CAR.is_file(), reason="the measured track is not shipped: no ../shared/reference")
def test_run_on_a_measured_track(railsim_here: Command, tmp_path: Path):
    text = SCENARIO.replace("straight_erri_low", str(INSPECTION_CAR)).replace("start: 60", "start: 25")
    (tmp_path / "mine.yaml").write_text(text)
    result = read(railsim_here("run", "mine.yaml", "--engine", "compiled", "--json"))
    largest = {row["estimator"]: row["value"] for row in result["scores"] if row["score"] == "largest error"}
    assert largest["speed_refined"] < 1.0  # m/s
    truth = Recording.open(tmp_path / "results" / "mine" / "recording").truth
    assert truth is not None
    assert 0.2e-3 < truth["wheelset1.z [m]"].std() < 0.6e-3  # m; the rails' is 0.4 mm


def test_list_shows_every_kind(railsim_here: Command):
    found = read(railsim_here("list", "--json"))
    assert list(found) == list(LISTERS)
    assert {"name", "description"} == set(found["estimators"][0])
    assert {row["name"] for row in found["tracks"]} >= {"curve_r400", "smooth"}
    assert {row["name"]: row["description"] for row in found["figures"]}["fig04"].startswith("Figure 4: ")
    nameless = [(kind, row) for kind, rows in found.items() for row in rows if not row["description"]]
    assert nameless == []


def test_a_sentence_ends_where_another_begins():
    assert (
        first_sentence("Speed (Ward et al. 2011) at\n    1.5 m/s. Nothing else.\n\nMore.")
        == "Speed (Ward et al. 2011) at 1.5 m/s."
    )
    assert first_sentence("No full stop\n\nNext.") == "No full stop"


def test_long_descriptions_are_wrapped_into_a_terminal_and_nowhere_else(monkeypatch: pytest.MonkeyPatch):
    rows = [["short", "one two three four five six seven eight nine ten"], ["name", ""]]
    wrapped = table(["name", "description"], rows, columns=40).splitlines()
    assert wrapped == [
        "name   description",
        "-----  ---------------------------------",
        "short  one two three four five six seven",
        "       eight nine ten",
        "name",
    ]
    assert rows[0][1] in table(["name", "description"], rows)
    given = argparse.Namespace(kind="effects")
    assert max(map(len, execute(given).text.splitlines())) > 150
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "100")
    assert max(map(len, execute(given).text.splitlines())) <= 100


def test_inspect_a_name_that_is_a_scenario_and_a_track(railsim_here: Command):
    found = read(railsim_here("inspect", "smooth", "--json"))["inspected"]
    assert [(one["kind"], one["name"]) for one in found] == [("scenario", "smooth"), ("track", "smooth")]


def test_inspect_says_what_is_suspicious(railsim_here: Command, recording: Path, tmp_path: Path):
    good = read(railsim_here("inspect", recording, "--json"))["inspected"][0]
    assert good["problems"] == []
    assert good["table"][0]["samples"] == 65
    bad = tmp_path / "bad.csv"
    rows = "".join(f"{s},{0.05 if s == 30 else 0}\n" for s in range(1000))
    bad.write_text(f"s [m],vertical [m]\n{rows}")
    done = railsim_here("inspect", bad)
    assert done.returncode == 1
    assert "suspicious: vertical jumps" in done.stdout


def test_bench_measures_engine_and_estimators(railsim_here: Command):
    rows = read(railsim_here("bench", "--fast", "--json"))["rows"]
    assert all(set(row) == {"name", "value", "unit", "against", "ratio"} for row in rows)
    values = {row["name"]: row["value"] for row in rows}
    assert {name for name, value in values.items() if value > 0} >= {"engine compiled", "estimator speed_plain"}


def test_help_lists_every_command_with_its_line(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit) as done:
        build_parser().parse_args(["--help"])
    assert done.value.code == 0
    listed = dict(re.findall(r"^    (\S+)\s+(.+)$", capsys.readouterr().out, re.MULTILINE))
    assert list(listed) == COMMANDS
    assert listed["bench"] == "measure the speed of engines and estimators"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as done:
        build_parser().parse_args([command, "--help"])
    assert done.value.code == 0
    assert "--json" in capsys.readouterr().out


LOADED = """
import sys
from experiments.cli import main
try:
    main(sys.argv[1:])
except SystemExit:
    print(*sorted(name for name in sys.modules if name.startswith("experiments.commands.")), file=sys.stderr)
    print(*({"numpy", "numba", "pandas", "matplotlib"} & set(sys.modules)), file=sys.stderr)
"""


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_imports_the_chosen_command_alone_and_nothing_heavy(command: str):
    words = [sys.executable, "-c", LOADED, *command.split(), "--help"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=True)
    commands, heavy = done.stderr.split("\n")[:2]
    module = command.replace("-", "_")
    public = [name.rpartition(".")[2].rstrip("_") for name in commands.split() if "._" not in name]
    assert public == module.split()
    assert heavy == ""


def test_errors_of_the_system_become_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    cases = {
        PermissionError(13, "Permission denied", "/x"): (2, "railsim: '/x': Permission denied; check"),
        OSError(28, "No space left on device"): (2, "railsim: No space left on device; check"),
        MemoryError(): (2, "railsim: not enough memory"),
        KeyboardInterrupt(): (130, "railsim: interrupted"),
    }
    for error, (code, start) in cases.items():

        def fail(*_: object, error: BaseException = error) -> None:
            raise error

        monkeypatch.setattr("experiments.commands.list.execute", fail)
        assert main(["list"]) == code
        written = capsys.readouterr()
        assert written.err.startswith(start)
        assert len(written.err.splitlines()) == 1
        assert written.out == ""


def test_interrupt_that_falls_into_a_callback_is_heard(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    """Code that is being compiled calls back from C, where Python can only print an exception."""

    @ctypes.CFUNCTYPE(None)
    def callback() -> None:
        raise KeyboardInterrupt

    def work(*_: object) -> None:
        callback()
        time.sleep(5.0)

    monkeypatch.setattr("experiments.commands.list.execute", work)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job of a shell ignores it
    try:
        assert main(["list"]) == 130
    finally:
        signal.signal(signal.SIGINT, before)
    assert capsys.readouterr().err == "railsim: interrupted; nothing was written\n"


def test_being_told_to_end_is_like_an_interrupt(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    """As a scheduler does that finds a job too long."""
    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(
        "experiments.commands.list.execute", lambda given: os.kill(os.getpid(), signal.SIGTERM) or time.sleep(5)
    )
    assert main(["list"]) == 130
    assert capsys.readouterr().err == "railsim: interrupted; nothing was written\n"
    assert signal.getsignal(signal.SIGTERM) is before


def test_what_an_interrupt_left_half_made_does_not_complain(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    class HalfMade:
        def __del__(self) -> None:
            raise AttributeError("not there yet")

    def execute(given: argparse.Namespace) -> None:
        held = HalfMade()
        raise KeyboardInterrupt(f"interrupted with {type(held).__name__}")

    monkeypatch.setattr("experiments.commands.list.execute", execute)
    assert main(["list"]) == 130
    assert capsys.readouterr().err == "railsim: interrupted with HalfMade\n"


def test_interrupt_leaves_nothing_behind(tmp_path: Path, cache: Path):
    """Ctrl-C while the engine works: exit code 130, one line, no half of a folder."""
    words = [sys.executable, "-m", "experiments.cli", "simulate", "default", "--engine", "compiled", "--out", "out"]
    settings = {"PYTHONPATH": str(ROOT), "RAILSIM_CACHE": str(tmp_path / "cache"), "PATH": ""}
    words += ["--set", "track=long.csv", "duration=7000", "speed={kind: constant, speed: 10}", "sensors=[]"]
    words += ["output_rate=64"]  # 0.4 GB: a disk with less than 5 GB left would refuse the run at full rate
    (tmp_path / "long.csv").write_text("s [m],vertical [m]\n" + "".join(f"{20e3 * i},0\n" for i in range(5)))
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # background jobs of a shell are born deaf to it
    child = subprocess.Popen(words, cwd=tmp_path, env=settings, stderr=subprocess.PIPE, text=True, preexec_fn=heard)
    deadline = time.monotonic() + 150
    while not list(tmp_path.glob("cache/*.partial-*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    complaint, deadline = "", time.monotonic() + 60
    while child.poll() is None and time.monotonic() < deadline:  # as a person does who sees nothing happen
        child.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            _, complaint = child.communicate(timeout=5)
    assert (child.returncode, complaint) == (130, "railsim: interrupted; nothing was written\n")
    assert not list(tmp_path.glob("out*"))
    assert not list(tmp_path.glob("cache/*.partial-*"))


def test_an_error_that_nobody_foresaw_is_one_line_with_a_code_of_its_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def fail(given: argparse.Namespace) -> None:
        raise KeyError("nobody\nforesaw\x1b[31m")

    monkeypatch.setattr("experiments.commands.list.execute", fail)
    assert main(["list"]) == 3
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert line.startswith("railsim: KeyError: 'nobody")
    assert "(in test_cli.py:" in line
    assert "--debug" in line
    assert line.strip().isprintable()
    with pytest.raises(KeyError):
        main(["list", "--debug"])


def test_linear_algebra_runs_in_one_thread_whatever_is_asked_for():
    program = """
import sys
import experiments.commands.list as command
from threadpoolctl import threadpool_info
from railsim.__main__ import main
def say(given):
    import scipy.linalg
    raise SystemExit(max(one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"))
command.execute = say
main(["list"])
"""
    asked = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, env=asked, check=False).returncode == 1
