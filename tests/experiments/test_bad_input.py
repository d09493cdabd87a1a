"""Bad input: one line on stderr that says what is wrong, exit code 2, no traceback, and older results stay."""

import shutil
from pathlib import Path

import pytest

from tests.experiments.conftest import Command

SCENARIO = """
track: {track}
vehicle: manchester
speed: {{kind: constant, speed: 20}}
duration: 2
sensors: [{{kind: gyro, name: bogie, body: bogie, rate: 256}}]
"""
GOOD_ROWS = "0,0\n100,0.001\n200,0\n300,0\n"
HEAD = "s [m],vertical [m]\n"


def refused(done, *parts: str) -> None:
    """Assert exit code 2 and one line on stderr that holds all `parts`."""
    assert done.returncode == 2
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("railsim: ")
    assert "Traceback" not in done.stderr
    missing = [part for part in parts if part not in lines[0]]
    assert missing == [], lines[0]


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """A scenario on the track file `mine.csv` beside it."""
    (tmp_path / "mine.csv").write_text(HEAD + GOOD_ROWS)
    path = tmp_path / "mine.yaml"
    path.write_text(SCENARIO.format(track="mine.csv"))
    return path


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ("durations=3", ("durations: unknown key", "duration,")),
        ("vehicle.body_mass=-5", ("vehicle.body_mass: Input should be greater than 0 (got -5)",)),
        ("duration=30", ("ends at 300.0 m", "shorten duration to")),
        ("sensors.0.rate=300", ("sensors.bogie.rate: 300 Hz does not divide output_rate", "use 256 Hz")),
        ("substeps=0", ("substeps: Input should be greater than or equal to 1",)),
        ("speed.speed=1e-9", ("substeps",)),
    ],
)
def test_scenario_that_cannot_be_run(railsim_here: Command, scenario: Path, change: str, parts: tuple[str, ...]):
    extra = ["substeps=1"] if change.startswith("speed") else []
    refused(railsim_here("run", scenario, "--engine", "compiled", "--set", change, *extra), *parts)


@pytest.mark.parametrize(
    ("rows", "parts"),
    [
        ("0,0\n100,0\n50,0\n300,0\n", ("mine.csv line 4", "s goes from 100 to 50 m; it must increase")),
        ("0,0\n100,nan\n200,0\n300,0\n", ("mine.csv line 3", "vertical is nan; fill in a number")),
        ("0,0\n100,\n200,0\n300,0\n", ("mine.csv line 3", "vertical is '', not a number")),
        ("0,0\n", ("only 1 rows",)),
    ],
)
def test_track_that_is_no_track(railsim_here: Command, scenario: Path, rows: str, parts: tuple[str, ...]):
    (scenario.parent / "mine.csv").write_text(HEAD + rows)
    refused(railsim_here("simulate", scenario, "--out", "out"), *parts)
    assert not (scenario.parent / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("run", "nix.yaml"), "no scenario 'nix.yaml'; check the path"),
        (("simulate", "nix", "--out", "out"), "no scenario 'nix'; there are: braking_dry,"),
        (("estimate", "speed_plain", "nix", "--out", "out"), "'nix' is not a recording"),
        (("score", "nix", "nix"), "'nix' is not an estimate"),
        (("inspect", "nix"), "'nix' does not exist"),
        (("inspect", "nix.csv"), "no track 'nix.csv'; check the path"),
        (("figure", "nix", "--out", "out"), "unknown figure 'nix'"),
        (("estimate", "nix", "nix", "--out", "out"), "unknown estimator 'nix'; there are: adhesion_creep_forces,"),
        (("run", "default", "--engine", "nix"), "unknown engine 'nix'; there are: compiled"),
        (("run", "default", "--seed", "many"), "invalid int value: 'many'"),
        (("run",), "the following arguments are required: SCENARIO"),
        ((), "the following arguments are required: COMMAND"),
        (("nix",), "invalid choice: 'nix'"),
        (("list", "nix"), "invalid choice: 'nix'"),
    ],
)
def test_what_does_not_exist(railsim_here: Command, arguments: tuple[str, ...], part: str):
    refused(railsim_here(*arguments), part)


@pytest.mark.parametrize("command", ["run", "simulate", "estimate", "figure"])
def test_output_that_cannot_be_written(railsim_here: Command, recording: Path, tmp_path: Path, command: str):
    """Below a regular file, since root may write anywhere else."""
    file = tmp_path / "file"
    file.write_text("mine")
    before = {
        "run": ("run", "smooth", "--engine", "compiled"),
        "simulate": ("simulate", "smooth", "--engine", "compiled"),
        "estimate": ("estimate", "speed_plain", recording),
        "figure": ("figure", "all", "--fast"),
    }
    refused(railsim_here(*before[command], "--out", file / "out"), f"cannot write '{file}/out", "name a folder")
    assert file.read_text() == "mine"


def test_folder_of_somebody_else_stays(railsim_here: Command, scenario: Path):
    mine = scenario.parent / "thesis"
    mine.mkdir()
    (mine / "chapter.txt").write_text("mine")
    refused(railsim_here("simulate", scenario, "--engine", "compiled", "--out", mine), "did not write")
    assert [path.name for path in mine.iterdir()] == ["chapter.txt"]


def cut(path: Path) -> None:
    """Keep the first half of a file."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.parametrize("part", ["about.json", "measured/256hz.parquet", "truth/about.json", "truth/channels.parquet"])
def test_recording_cut_in_half(railsim_here: Command, recording: Path, tmp_path: Path, part: str):
    half = tmp_path / "half"
    shutil.copytree(recording, half)
    cut(half / part)
    refused(railsim_here("inspect", half), part.rpartition("/")[2])
    refused(railsim_here("estimate", "speed_plain", half, "--out", "out"), part.rpartition("/")[2])


@pytest.mark.parametrize("part", ["about.json", "measured/256hz.parquet"])
def test_recording_without_a_part(railsim_here: Command, recording: Path, tmp_path: Path, part: str):
    half = tmp_path / "half"
    shutil.copytree(recording, half)
    (half / part).unlink()
    refused(railsim_here("inspect", half), part.rpartition("/")[2])


def test_results_of_a_former_run_stay_after_a_failed_one(railsim_here: Command, scenario: Path):
    results = scenario.parent / "results"
    arguments = ("run", scenario, "--engine", "compiled", "--out", results)
    assert railsim_here(*arguments).returncode == 0
    before = {path: path.read_bytes() for path in results.rglob("*") if path.is_file()}
    off_the_rails = ["speed={kind: driven, speed: 20}", "duration=14.5"]
    refused(railsim_here(*arguments, "--set", *off_the_rails), "leaves 'mine' at t = 13.")
    assert {path: path.read_bytes() for path in results.rglob("*") if path.is_file()} == before
    assert sorted(path.name for path in scenario.parent.iterdir()) == ["mine.csv", "mine.yaml", "results"]


def test_score_needs_truth_and_the_same_recording(railsim_here: Command, recording: Path, tmp_path: Path):
    field, estimate = tmp_path / "field", tmp_path / "estimate"
    assert railsim_here("estimate", "speed_plain", recording, "--out", estimate).returncode == 0
    shutil.copytree(recording, field)
    shutil.rmtree(field / "truth")
    refused(railsim_here("score", estimate, field), "has no truth to score against")
    short = tmp_path / "short"
    assert (
        railsim_here("simulate", "smooth", "--engine", "compiled", "--out", short, "--set", "duration=1").returncode
        == 0
    )
    refused(railsim_here("score", estimate, short), "score it on the recording that it was made from")


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("discrepancy", "rec", "--model", "default", "--effects", "rust"), ("'rec'",)),
        (("discrepancy", "--plan", "--model", "nowhere"), ("no scenario 'nowhere'",)),
        (("discrepancy", "--plan", "--model", "default", "--effects", "a,b"), ("set names apart by spaces",)),
        (("discrepancy-benchmark", "--laws", "nowhere.yaml"), ("--laws nowhere.yaml", "list of effects")),
        (("discrepancy-benchmark", "--part", "2/2"), ("--part 2/2", "for example 0/2")),
    ],
)
def test_discrepancy_that_cannot_begin_leaves_no_folder(
    railsim_here: Command, tmp_path: Path, words: tuple[str, ...], parts: tuple[str, ...]
):
    refused(railsim_here(*words, "--out", tmp_path / "out"), *parts)
    assert not (tmp_path / "out").exists()
