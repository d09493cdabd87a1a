"""Figure 8: claims held, and refused where the curves are not ordered."""

from pathlib import Path

import numpy as np
import pytest

from experiments.figures.fig08 import Fig08
from experiments.figures.interface import publish
from experiments.reporting.size import Size
from experiments.validation.adhesion_curves import CREEPAGE, LOAD


def test_claims_are_held_and_files_written(tmp_path: Path) -> None:
    result = publish(Fig08(), tmp_path, Size.FAST)
    assert [claim["claim"] for claim in result["claims"] if not claim["held"]] == []
    ordered = [claim["claim"] for claim in result["claims"] if claim["target"] == "> 1"]
    assert ordered == [
        f"{what}: {pair}"
        for what in ("largest creep force", "initial slope")
        for pair in ("dry over wet", "wet over low", "low over very low")
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fig08.csv", "fig08.png", "fig08.svg"]


def test_table_has_forces_of_both_laws_below_friction_times_load() -> None:
    table = Fig08().compute(Size.FAST)
    assert table[CREEPAGE].is_monotonic_increasing
    assert pytest.approx(39226.6, rel=1e-3) == LOAD
    assert table.shape[1] == 2 + 2 * 4
    assert np.isfinite(table.to_numpy()).all()
    assert (table.filter(regex="^dry").to_numpy() <= 0.55 * LOAD).all()


def test_claims_fail_where_wet_and_low_change_places() -> None:
    figure = Fig08()
    table = figure.compute(Size.FAST)
    swapped = table.rename(columns={"wet, Polach [N]": "low, Polach [N]", "low, Polach [N]": "wet, Polach [N]"})
    failed = {claim.claim for claim in figure.check(swapped) if not claim.held}
    assert {"largest creep force: wet over low", "initial slope: wet over low"} <= failed
