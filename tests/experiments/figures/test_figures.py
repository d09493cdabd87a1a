"""Figures: the plug-ins conform, and what `publish` and the command make of one that fails its claims."""

import json
import sys
import types
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure as Picture

from experiments import figures
from experiments.cli import main
from experiments.figures.interface import Claim, Figure
from railsim.registry import discover

FIGURES: Mapping[str, Callable[[], Figure]] = dict(discover(figures, Figure))


class Parabola(Figure):
    """y = x^2, with one claim that holds and one that does not."""

    def compute(self, fast: bool) -> pd.DataFrame:
        """Some points."""
        x = np.linspace(0, 2, 5 if fast else 50)
        return pd.DataFrame({"x [-]": x, "y [-]": x**2})

    def draw(self, table: pd.DataFrame) -> Picture:
        """A line."""
        picture = Picture()
        picture.subplots().plot(table["x [-]"], table["y [-]"])
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """Its end, right and wrong."""
        end = float(table["y [-]"].to_numpy()[-1])
        return [Claim("end is four", end, "4", end == 4.0), Claim("end is five", end, "5", end == 5.0)]


@pytest.fixture
def parabola(monkeypatch: pytest.MonkeyPatch) -> str:
    """Stand in for the package of figures by one that holds `Parabola` only."""
    monkeypatch.setattr("railsim.registry.discover", lambda *_: {"test_figures": Parabola})
    return "test_figures"


@pytest.mark.parametrize("name", list(FIGURES))
def test_figure_conforms(name: str):
    figure = FIGURES[name]()
    assert figure.name == name
    assert (type(figure).__doc__ or "").strip()


def test_figure_writes_picture_and_table_and_tells_claims(
    parabola: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert main(["figure", parabola, "--out", str(tmp_path / "out"), "--fast", "--json"]) == 1
    result = json.loads(capsys.readouterr().out)["figures"][parabola]
    assert [Path(path).name for path in result["files"]] == [f"{parabola}.csv", f"{parabola}.png"]
    assert [(claim["claim"], claim["value"], claim["target"], claim["held"]) for claim in result["claims"]] == [
        ("end is four", 4.0, "4", True),
        ("end is five", 4.0, "5", False),
    ]
    assert len(pd.read_csv(tmp_path / "out" / f"{parabola}.csv")) == 5
    assert (tmp_path / "out" / f"{parabola}.png").read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {f"{parabola}.csv", f"{parabola}.png"}


def test_claims_are_printed(parabola: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["figure", "all", "--out", str(tmp_path)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[-1] for line in lines if line.startswith(parabola)] == ["held", "HELD"]
    assert len([line for line in lines if "NOT HELD" in line]) == 1


def test_a_figure_in_a_new_file_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """One new file is one new figure."""
    package = types.ModuleType("new_figures")
    package.__path__ = [str(tmp_path)]
    monkeypatch.setitem(sys.modules, "new_figures", package)
    (tmp_path / "fig99.py").write_text(
        "from tests.experiments.figures.test_figures import Parabola\n\n\nclass New(Parabola):\n    '''New.'''\n"
    )
    found: Mapping[str, Callable[[], Figure]] = dict(discover(package, Figure))
    assert found["fig99"]().name == "fig99"
