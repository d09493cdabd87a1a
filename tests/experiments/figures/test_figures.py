"""Figures: the plug-ins conform, and what `publish` and the command make of one that fails its claims."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure as Picture

from experiments.cli import main
from experiments.figures.interface import FIGURES, Figure
from experiments.reporting.claims import Claim, at_least, exactly
from experiments.reporting.intervals import of_share
from experiments.reporting.size import Size


class Parabola(Figure):
    """y = x^2, with one claim that holds, one that does not, and one that two cases cannot decide."""

    def compute(self, size: Size) -> pd.DataFrame:
        """Some points."""
        x = np.linspace(0, 2, 5 if size.reduced else 50)
        return pd.DataFrame({"x [-]": x, "y [-]": x**2})

    def draw(self, table: pd.DataFrame) -> Picture:
        """A line."""
        picture = Picture()
        picture.subplots().plot(table["x [-]"], table["y [-]"])
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """Its end, right and wrong; a share of two cases."""
        end = float(table["y [-]"].to_numpy()[-1])
        return [
            Claim.definite("end is four", end, exactly(4.0)),
            Claim.definite("end is five", end, exactly(5.0)),
            Claim.sampled("half", 0.5, at_least(0.4), of_share(np.array([True, False]))),
        ]


@pytest.fixture
def parabola(monkeypatch: pytest.MonkeyPatch) -> str:
    """Stand in for the package of figures by one that holds `Parabola` only."""
    monkeypatch.setattr("railsim.registry.Kind.classes", lambda _: {"test_figures": Parabola})
    return "test_figures"


def test_figure_writes_picture_and_table_and_tells_claims(
    parabola: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert main(["figure", parabola, "--out", str(tmp_path / "out"), "--fast", "--json"]) == 1
    result = json.loads(capsys.readouterr().out)["figures"][parabola]
    assert [Path(path).name for path in result["files"]] == [f"{parabola}.{kind}" for kind in ("csv", "png", "svg")]
    assert all(set(claim) == {"claim", "value", "target", "held", "low", "high", "cases"} for claim in result["claims"])
    assert [tuple(claim.values())[:4] for claim in result["claims"]] == [
        ("end is four", 4.0, "4", True),
        ("end is five", 4.0, "5", False),
        ("half", 0.5, ">= 0.4", None),
    ]
    assert [claim["low"] for claim in result["claims"]] == [None, None, pytest.approx(0.0126, abs=1e-4)]
    assert [claim["cases"] for claim in result["claims"]] == [None, None, 2]
    assert len(pd.read_csv(tmp_path / "out" / f"{parabola}.csv")) == 5
    assert (tmp_path / "out" / f"{parabola}.png").read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"{parabola}.{kind}" for kind in ("csv", "png", "svg")
    }


def test_claims_are_printed(parabola: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["figure", "all", "--out", str(tmp_path)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.startswith(parabola) for line in lines[:6]] == [False, False, True, True, True, False]
    found = [next(word for word in ("NOT HELD", "held", "undecided") if word in line) for line in lines[2:5]]
    assert found == ["held", "NOT HELD", "undecided"]
    assert lines[4].endswith("0.0126 to 0.987, 2 cases")


def test_only_a_claim_that_is_not_held_gives_exit_code_1(
    parabola: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    undecided = Claim.sampled("half", 0.5, at_least(0.4), of_share(np.array([True, False])))
    monkeypatch.setattr(Parabola, "check", lambda self, table: [undecided])
    assert main(["figure", parabola, "--out", str(tmp_path)]) == 0


def test_a_figure_in_a_new_file_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """One new file is one new figure."""
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "fig99.py").write_text(
        "from tests.experiments.figures.test_figures import Parabola\n\n\nclass New(Parabola):\n    '''New.'''\n"
    )
    monkeypatch.setenv("RAILSIM_PLUGINS", str(tmp_path))
    assert FIGURES.pick("fig99")().name == "fig99"
