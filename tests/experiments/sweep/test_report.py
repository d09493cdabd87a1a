"""The report: one page without links to elsewhere, and the numbers in it."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.sweep import table
from experiments.sweep.analysis import RESPONSE, by_set, memory, messages, scored, smallest_sets
from experiments.sweep.contents import read_contents
from experiments.sweep.report import numbers, write_report
from experiments.sweep.store import TABLE, read_settings
from experiments.sweep.table import read_table
from railsim.errors import InputError
from tests.experiments.sweep.conftest import SWEEP, Sweeping

COSTS = {"cheap": 1.0, "good": 2.0, "dear": 3.0}
ERROR = "rms error [mm]"


def frame_of(values: dict[str, float]) -> pd.DataFrame:
    """A found score for every set of sensors."""
    rows = [{"estimator": "it", "sensors": name, RESPONSE: ERROR, "value": value} for name, value in values.items()]
    return pd.DataFrame(rows).assign(status="ok", message="")


def test_page_stands_alone(whole: Path):
    page = write_report(whole).read_text()
    assert page.count('src="data:image/png;base64,') >= 2
    assert not re.search(r'(src|href)="(?!data:)', page)
    for heading in ("Responses", "Best and worst points", "Failures and notes", "Speed and memory"):
        assert f"<h2>{heading}</h2>" in page
    assert "speed_plain needs channel" in page


def test_page_of_a_sweep_with_costs_shows_sets(sweep_file: Path, tmp_path: Path, sweeping: Sweeping):
    text = SWEEP.replace("both: [bogie.*]", "both: {channels: [bogie.*], cost: 2}").replace("[25, 30, 35]", "[30]")
    sweep_file.write_text(
        text.replace('all: ["*"]', 'all: {channels: ["*"], cost: 2.5}').replace("[0.8, 1.0]", "[1.0]")
    )
    sweeping(sweep_file, tmp_path / "out")
    assert "<h2>Sets of sensors</h2>" in write_report(tmp_path / "out").read_text()
    assert (tmp_path / "out" / "pictures" / "pareto.png").exists()
    found = {name: one["value"] for name, one in numbers(tmp_path / "out").items()}
    assert {value for name, value in found.items() if name.endswith(": its cost")} <= {2.0, 2.5}
    frame = scored(read_table(tmp_path / "out" / TABLE))
    name = next(name for name in found if name.endswith(": with the cheapest set"))
    *_, estimator, score = name.removesuffix(": with the cheapest set").split(", ")
    cheap = frame[(frame["estimator"] == estimator) & (frame[RESPONSE] == score) & (frame["sensors"] == "both")]
    assert found[name] == pytest.approx(cheap["value"].abs().mean())


def test_a_sweep_without_costs_gives_no_numbers_of_sets(whole: Path):
    assert numbers(whole) == {}


def test_a_table_is_read_in_parts_without_what_no_page_shows(whole: Path, monkeypatch: pytest.MonkeyPatch):
    page = write_report(whole).read_text()
    factors = list(read_settings(whole)["factors"])
    frame = read_table(whole / TABLE)
    monkeypatch.setattr(table, "_GROUP_ROWS", 7)
    assert sum(1 for _ in table.table_parts(whole / TABLE, ["point"])) > 2
    contents = read_contents(whole / TABLE, factors)
    assert contents.rows == len(frame) and contents.status == frame["status"].value_counts().to_dict()
    assert list(contents.scored) == ["point", *factors, "sensors", "estimator", RESPONSE, "value"]
    pd.testing.assert_frame_equal(contents.scored, scored(frame)[list(contents.scored)].reset_index(drop=True))
    assert write_report(whole).read_text() == page


def test_no_report_before_the_end(whole: Path, tmp_path: Path):
    (tmp_path / "sweep.json").write_bytes((whole / "sweep.json").read_bytes())
    with pytest.raises(InputError, match="has no table yet; run the sweep to its end first"):
        write_report(tmp_path)
    with pytest.raises(InputError, match="is not the folder of a sweep"):
        write_report(tmp_path / "nix")


@pytest.mark.parametrize(
    ("values", "front", "near"),
    [
        ({"cheap": 3.0, "good": 1.0, "dear": 0.95}, ["cheap", "good", "dear"], "good"),
        ({"cheap": 1.0, "good": 2.0, "dear": 0.5}, ["cheap", "dear"], "dear"),
        ({"good": 1.0, "dear": 1.0}, ["good"], "good"),
    ],
)
def test_front_and_smallest_sets(values: dict[str, float], front: list[str], near: str):
    found = frame_of(values)
    sets = by_set(found, ERROR, COSTS)
    assert list(sets.loc[sets["front"], "sensors"]) == front
    row = smallest_sets(["it"], found, found, COSTS, {}).iloc[0]
    assert row["cheapest"] == next(iter(values))
    assert row["cheapest near best"] == near


def test_errors_with_a_sign_count_by_their_size():
    found = pd.concat([frame_of({"cheap": -3.0, "good": 1.0}), frame_of({"cheap": 3.0, "good": 1.0})])
    sets = by_set(found, ERROR, COSTS).set_index("sensors")
    assert sets["value"].to_dict() == {"cheap": 3.0, "good": 1.0}
    assert list(sets["front"]) == [True, True]


def test_a_panel_compares_the_points_that_it_names():
    here, there = frame_of({"cheap": 3.0, "dear": 1.0}), frame_of({"cheap": 9.0, "dear": 1.0})
    found = pd.concat([here.assign(place="here"), there.assign(place="there")], ignore_index=True)
    panels = {"it all": {"score": ERROR, "at": {"place": ["here"]}}}
    rows = smallest_sets(["it"], found, found, COSTS, panels)
    assert rows[["quantity", "cheapest", "value", "best value"]].to_numpy().tolist() == [["it all", "cheap", 3.0, 1.0]]


def test_estimator_that_nothing_serves_has_a_row():
    bad = pd.DataFrame([{"estimator": "it", "sensors": "cheap", "status": "does not fit", "message": "needs more"}])
    none = frame_of({}).reindex(columns=["estimator", RESPONSE, "value"])
    row = smallest_sets(["it"], bad, none, COSTS, {}).iloc[0]
    assert (row["estimator"], row["score"]) == ("it", "none: needs more")


def test_memory_growth_is_that_after_the_settling():
    facts = [{"worker": f"w{n % 2}", "rss": 100.0 if n < 10 else 200.0 + (n == 90) * 30.0} for n in range(100)]
    series, growth = memory(facts)
    assert sorted(series) == ["w0", "w1"]
    assert growth == pytest.approx(0.15)
    assert memory(facts[:40])[1] is None


def test_failures_are_counted_by_message():
    bad = pd.DataFrame(
        {"estimator": ["a"] * 3, "status": ["failed"] * 3, "message": ["x", "y", "x"], "point": [4, 5, 2]}
    )
    found = messages(bad)
    assert found[["message", "rows", "first_point"]].to_numpy().tolist() == [["x", 2, 2], ["y", 1, 5]]
    assert np.issubdtype(found["rows"].dtype, np.integer)
