"""The matrix as a command: part of it run, resumed, damaged, shared, and bad input."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from experiments.cli import main
from tests.experiments.conftest import Command
from tests.experiments.test_bad_input import refused

MINE = """
plain: {group: home, base: half, what: nothing differs, line: {seed: 1}, duration: 8}
heavy: {group: nominal, base: half, what: body mass too large, line: {seed: 2}, duration: 8, nominal: {body_mass: 1.5}}
"""
ESTIMATOR = '''
import pandas as pd

from estimators.interface import Estimate, Estimator
from railsim.errors import InputError


class One(Estimator, frozen=True):
    """For a test."""

    requires = ("bogie.rate_pitch [rad/s]",)

    def estimate(self, measurements):
        {body}
'''
BODIES = {
    "raising": "raise KeyError('lost')",
    "refusing": "raise InputError('too slow for me')",
    "foreign": "return Estimate(self.name, pd.DataFrame({'time [s]': [0.0], 'wind [m/s]': [1.0]}))",
}
NAMES = ["alignment_displacement", "alignment_vertical", *BODIES]
QUICK = NAMES[:2]


@pytest.fixture(scope="module")
def mine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with circumstances, plug-ins and a finished run."""
    folder = tmp_path_factory.mktemp("mine")
    (folder / "mine.yaml").write_text(MINE)
    (folder / "plugins" / "estimators").mkdir(parents=True)
    for name, body in BODIES.items():
        (folder / "plugins" / "estimators" / f"{name}.py").write_text(ESTIMATOR.format(body=body))
    assert main(words(folder, "out", *NAMES)) == 1  # one of them fails
    return folder


def words(folder: Path, out: str, *more: str) -> list[str]:
    """The command on the circumstances of the folder."""
    plugins = ["--plugins", str(folder / "plugins")]
    return ["circumstances", "--file", str(folder / "mine.yaml"), "--out", str(folder / out), *plugins, "--json", *more]


def ran(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> dict[str, Any]:
    """What the command says."""
    main(arguments)
    return json.loads(capsys.readouterr().out)


def cells(folder: Path, out: str = "out") -> pd.DataFrame:
    """The table of cells."""
    return pd.read_csv(folder / out / "cells.csv")


def of(table: pd.DataFrame, circumstance: str, estimator: str) -> dict[str, list[Any]]:
    """Columns of one estimator's cells in one circumstance."""
    found = (table["circumstance"] == circumstance) & (table["estimator"] == estimator)
    return {str(name): table.loc[found, name].tolist() for name in table.columns}


def test_cells_hold_error_allowance_and_verdict(mine: Path) -> None:
    known = of(cells(mine), "plain", "alignment_vertical")
    assert known["quantity"] == ["vertical D1", "vertical D2"]
    assert known["unit"] == ["mm", "mm"]
    assert min(known["error"]) > 0.0
    stated = zip(known["error"], known["allowance"], known["coverage"], strict=True)
    good = [error <= most and covered >= 0.85 for error, most, covered in stated]
    assert known["verdict"] == ["right" if one else "silently wrong" for one in good]
    plain = of(cells(mine), "plain", "alignment_displacement")
    assert all(error <= most for error, most in zip(plain["error"], plain["allowance"], strict=True))
    assert plain["verdict"].count("right") >= len(plain["verdict"]) - 1


def test_estimators_that_refuse_or_fail_have_their_line(mine: Path) -> None:
    said = {name: of(cells(mine), "heavy", name) for name in BODIES}
    assert (said["refusing"]["verdict"], said["refusing"]["says"]) == (["says so"], ["too slow for me"])
    failed = ["raising failed: KeyError: 'lost' (raising.py, line 14)"]
    assert (said["raising"]["verdict"], said["raising"]["says"]) == (["failed"], failed)
    assert said["foreign"]["verdict"] == ["not applicable"]
    assert "nothing scores column 'wind [m/s]'" in said["foreign"]["says"][0]


def test_only_about_json_has_the_wrong_mass(mine: Path) -> None:
    (folder,) = (mine / "out" / "recordings").glob("heavy-*")
    about = json.loads((folder / "recording" / "about.json").read_text())
    truth = json.loads((folder / "recording" / "truth" / "about.json").read_text())
    assert about["vehicle"]["body_mass"] == pytest.approx(1.5 * truth["about"]["vehicle"]["body_mass [kg]"])


def test_the_picture_and_the_table_show_all(mine: Path) -> None:
    assert (mine / "out" / "matrix.png").read_bytes().startswith(b"\x89PNG")
    text = (mine / "out" / "matrix.md").read_text()
    assert "| circumstance | alignment_displacement | alignment_vertical |" in text
    assert "## Failed" in text


def test_a_finished_run_makes_nothing_again(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (mine / "out" / "cells.csv").read_bytes()
    assert ran(capsys, words(mine, "out", *NAMES))["performed"] == 0
    assert (mine / "out" / "cells.csv").read_bytes() == before


def test_a_half_written_cell_is_made_again_from_the_same_recording(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = cells(mine).drop(columns="seconds")
    (folder,) = (mine / "out" / "recordings").glob("plain-*")
    made = folder.stat().st_mtime_ns
    path = mine / "out" / "cells" / "plain" / "alignment_vertical.json"
    path.write_bytes(path.read_bytes()[:40])
    assert ran(capsys, words(mine, "out", *NAMES))["performed"] == 1
    pd.testing.assert_frame_equal(cells(mine).drop(columns="seconds"), before)
    assert folder.stat().st_mtime_ns == made


def test_slices_and_another_run_beside(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shared = ["--recordings", str(mine / "out" / "recordings")]
    first = ran(capsys, words(mine, "sliced", *QUICK, *shared, "--slice", "1/2"))
    assert first["performed"] == 2
    assert not (mine / "sliced" / "cells" / "heavy").exists()
    both = ran(capsys, words(mine, "sliced", *QUICK, *shared, "--jobs", "2", "--against", str(mine / "out")))
    assert both["performed"] == 2
    assert not (mine / "sliced" / "recordings").exists()
    total = both["against"][-1]
    assert total["estimator"] == "all"
    assert total["right"] == total["right before"]
    assert total["cells"] == both["cells"]
    assert (mine / "sliced" / "against.csv").exists()


def test_results_of_another_version_are_not_mixed(
    mine: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.circumstances.run.program_digest", lambda: "another")
    assert main(words(mine, "out", *QUICK)) == 2
    assert "begun by another version of railsim" in capsys.readouterr().err


def test_part_of_the_shipped_matrix(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The plain chains hold where the body's mass is wrong: they do not use it."""
    chosen = ["--only", "wheelset_home", "nominal_body_10", "--fast", "--out", str(tmp_path), "--json"]
    found = ran(capsys, ["circumstances", "alignment_displacement", "conicity_ekf_track", "dipped_joints", *chosen])
    table = cells(tmp_path, ".")
    assert found["counts"]["health"] == {"right": 0, "says so": 0, "silently wrong": 0, "failed": 0}
    assert set(of(table, "nominal_body_10", "alignment_displacement")["verdict"]) == {"right"}
    assert of(table, "nominal_body_10", "dipped_joints")["verdict"] == ["right"]
    assert of(table, "nominal_body_10", "conicity_ekf_track")["verdict"] == ["not applicable"]
    assert of(table, "wheelset_home", "conicity_ekf_track")["quantity"][0] == "conicity"
    claims = {one["claim"]: one["held"] for one in found["claims"]}
    assert claims["cells on the whole vehicle"] is None  # a part decides nothing


def test_a_circumstance_that_cannot_be_simulated_leaves_the_others(
    mine: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """So fast a train leaves the rails."""
    keys = "{track: curve_r400, start: 290, speed.speed: 80}"
    text = f"gone: {{group: speed, base: half, what: too fast, duration: 8, set: {keys}}}"
    (mine / "with_one.yaml").write_text(f"{text}\n{MINE}")
    shared = ["--recordings", str(mine / "out" / "recordings"), "--out", str(tmp_path / "out")]
    code = main(["circumstances", *QUICK, "--file", str(mine / "with_one.yaml"), *shared, "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == 1
    assert list(found["not_run"]) == ["gone"]
    assert "\n" not in found["not_run"]["gone"]
    assert found["performed"] == 4


def test_every_check_finds_its_scores_at_home(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A check whose score has another name would never judge anything."""
    forces = [f"wheelset{n} {what}" for n in (1, 2) for what in ("lateral force", "yaw moment")]
    dampers = [f"secondary {kind} damping" for kind in ("lateral", "yaw")]
    expected = {
        "adhesion_creep_forces": forces,
        "adhesion_creep_forces_profile": forces,
        "adhesion_level": ["adhesion level"],
        "cross_level": ["cross level D1", "cross level D2", "cant", "twist"],
        "suspension_ekf": [*dampers, "conicity", "verdicts at the end", "alarms on the way"],
        "switches": ["features of crossovers"],
    }
    ran(capsys, ["circumstances", *expected, "--only", "half_home", "--fast", "--out", str(tmp_path), "--json"])
    for name, quantities in expected.items():
        found = of(cells(tmp_path, "."), "half_home", name)
        assert sorted(found["quantity"]) == sorted(quantities), name
        told = [] if name == "switches" else [one for one in found["quantity"] if " the " not in one]
        stated = [one for one, share in zip(found["quantity"], found["coverage"], strict=True) if share == share]
        assert sorted(stated) == sorted(told), name


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["wind", "--out", "out"], ("unknown estimator 'wind'",)),
        (["--only", "wett", "--out", "out"], ("unknown circumstance 'wett'", "'wet'")),
        (["--slice", "3/2", "--out", "out"], ("--slice 3/2: write I/N",)),
        (["--jobs", "0", "--out", "out"], ("--jobs 0: give a number from 1",)),
        (["--file", "none.yaml", "--out", "out"], ("cannot read circumstances 'none.yaml'",)),
        (["--against", "nowhere", "--out", "out"], ("'nowhere' holds no cells",)),
        (["--out", "full"], ("'full' holds something else",)),
        ([], ("--out",)),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], parts: tuple[str, ...], railsim_here: Command, tmp_path: Path
) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").write_text("mine")
    refused(railsim_here("circumstances", *arguments), *parts)
    assert not (tmp_path / "out" / "cells.csv").exists()
