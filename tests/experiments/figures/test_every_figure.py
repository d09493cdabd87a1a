"""Every figure, with every section of the validation report in one of them: computed, drawn and checked in seconds."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import pandas as pd
import pytest

from experiments import figures
from experiments.figures.interface import Figure, publish
from experiments.reporting.size import Size
from experiments.validation.interface import sections
from railsim.registry import discover

FIGURES: Mapping[str, Callable[[], Figure]] = dict(discover(figures, Figure))


@pytest.fixture(scope="module", autouse=True)
def runs_of_its_own(tmp_path_factory: pytest.TempPathFactory):
    """No run that another test or a user has left; the figures share theirs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.mark.parametrize("name", list(FIGURES))
def test_figure_is_computed_drawn_and_checked(name: str, tmp_path: Path):
    made = publish(FIGURES[name](), tmp_path, Size.SMOKE)
    assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert len(pd.read_csv(tmp_path / f"{name}.csv", low_memory=False)) > 0
    assert all(Path(path).stat().st_size > 0 for path in made["files"])
    assert made["claims"], "a figure without a claim checks nothing"
    json.dumps(made, allow_nan=False)
    for claim in made["claims"]:
        assert claim["held"] in (True, False, None)
        assert claim["value"] is not None or claim["held"] is not True, claim
        assert (claim["low"], claim["high"]) == (None, None) or claim["cases"], claim
    if name == "validation":
        checked = {part.name for part in sections() if not part.lacking()}
        written = {path.stem for path in tmp_path.glob("validation_*.png")}
        assert {stem.split("_", 2)[2] for stem in written} == checked
