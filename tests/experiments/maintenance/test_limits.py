"""Limits by line speed, levels and classes, and where the line speed comes from."""

from pathlib import Path

import numpy as np
import pytest

from experiments.maintenance.condition import defects
from experiments.maintenance.limits import read_limits, shipped, split
from experiments.maintenance.line_speed import TRAVELLED, line_speed
from experiments.maintenance.sections import section_rows
from railsim.errors import InputError
from tests.experiments.maintenance.made_passes import ride


def test_limits_are_tighter_for_faster_lines():
    for name in ("vertical_d1 [m]", "right_lateral_d1 [m]", "twist [m/m]"):
        found = shipped().peaks(name, np.array([70.0, 110.0, 150.0, 190.0, 220.0, 290.0, 400.0]))
        assert found is not None and (np.diff(found, axis=0) <= 0.0).all() and (np.diff(found, axis=1) > 0.0).all()
    assert shipped().peaks("cross_level_d1 [m]", np.array([100.0])) is None
    assert shipped().peaks("vertical_d3 [m]", np.array([100.0])) is None
    second = shipped().peaks("vertical_d2 [m]", np.array([160.0, 161.0]))
    assert second is not None and np.isnan(second[0]).all() and second[1].tolist() == [0.014, 0.018, 0.033]


def test_a_speed_that_is_not_known_has_the_tightest_limits():
    found = shipped().peaks("vertical_d1 [m]", np.array([np.nan, 300.0]))
    assert found is not None and found[0].tolist() == found[1].tolist()


def test_classes():
    named = [shipped().quality("vertical_d1 [m]", size, 100.0) for size in (0.5, 0.9, 1.5, 2.0, 3.0, np.nan)]
    assert named == ["A", "B", "C", "D", "E", ""]
    assert shipped().quality("vertical_d2 [m]", 1.0, 100.0) == ""


def test_names_of_quantity_and_band():
    assert split("left_vertical_d1 [m]") == ("left_vertical", "D1")
    assert split("twist [m/m]") == ("twist", "")
    assert split("cross_level_d3_x [m]") == ("cross_level_d3_x", "")


def test_the_level_goes_by_the_line_speed_of_the_place(tmp_path: Path):
    one = ride(seed=1, dip=11e-3)
    size = abs(defects(one, speed=line_speed("120"))["size [mm or mm/m]"].iloc[0])
    assert 10.0 < size < 13.0
    for speed, level in (("80", None), ("120", "alert"), ("160", "intervention")):
        found = defects(one, speed=line_speed(speed))
        assert found["level"].tolist() == ([level] if level else [])
    table = tmp_path / "line.csv"
    table.write_text("from [m],line speed [km/h]\n0,80\n500,160\n600,80\n")
    found = defects(one, speed=line_speed(str(table)))
    assert found["level"].tolist() == ["intervention"] and found["speed [km/h]"].tolist() == [160.0]
    rows = section_rows(one, 200.0, speed=line_speed(str(table)))
    assert rows["line speed [km/h]"].tolist() == [80.0, 80.0, 160.0, 80.0, 80.0, 80.0]
    assert rows["level"].tolist() == ["", "", "intervention", "", "", ""]
    assert TRAVELLED.at(np.array([0.0, 30.0]), np.array([0.0, 1.0])).tolist() == [108.0, 108.0]


def test_a_peak_within_its_error_of_a_limit_could_be_of_the_next_level():
    sure, unsure = (defects(ride(seed=1, dip=11e-3, error=error), speed=line_speed("120")) for error in (1e-4, 1e-3))
    assert sure["could be"].tolist() == ["alert"]
    assert unsure["level"].iloc[0] == "alert" and unsure["could be"].iloc[0] == "intervention"


def test_the_worst_stands_first():
    one = ride(seed=1)
    series = one.series.copy()
    for place, size in ((200.0, 11e-3), (600.0, -27e-3), (900.0, 14e-3), (1000.0, -10.5e-3)):
        series["vertical_d1 [m]"] += size * np.exp(-(((series["s [m]"].to_numpy() - place) / 2.0) ** 2))
    found = defects(type(one)("mine", series), speed=line_speed("110"))
    assert found["level"].tolist()[0] == "immediate action" and found["s [m]"].iloc[0] == pytest.approx(600.0, abs=1.0)
    order = [("", "alert", "intervention", "immediate action").index(one) for one in found["level"]]
    assert order == sorted(order, reverse=True)


def test_sections_state_peak_and_class():
    rows = section_rows(ride(seed=1, dip=20e-3), 200.0, speed=line_speed("100"))
    assert rows["class"].tolist()[0] == "B" and rows["class"].iloc[2] == "E"
    assert rows["peak at [m]"].iloc[2] == pytest.approx(550.0, abs=0.5)
    assert rows["peak [mm or mm/m]"].iloc[2] == pytest.approx(-20.0, abs=3.0)
    assert rows["std error [mm or mm/m]"].to_numpy() == pytest.approx(0.1)
    assert set(section_rows(ride(seed=1), 100.0)["class"]) == {""}


def test_what_cannot_serve_is_told(tmp_path: Path):
    for text, part in (
        ("from [m],line speed [km/h]\n5,80\n5,90\n", "must rise"),
        ("from [m],line speed [km/h]\n0,-3\n", "between 0 and 1000"),
        ("place,speed\n0,80\n", "with the columns"),
    ):
        path = tmp_path / "line.csv"
        path.write_text(text)
        with pytest.raises(InputError, match=part):
            line_speed(str(path))
    with pytest.raises(InputError, match="between 0 and 1000"):
        line_speed("0")
    with pytest.raises(InputError, match="give km/h or the path"):
        line_speed("fast")
    limits = tmp_path / "limits.yaml"
    limits.write_text("source: mine\nspeeds: [{up_to: 80, vertical: {d1: {peaks: [3, 2, 5]}}}]\n")
    with pytest.raises(InputError, match="must be positive and rise"):
        read_limits(limits)
    with pytest.raises(InputError, match="cannot read"):
        read_limits(tmp_path / "nothing.yaml")
    limits.write_text("source: mine\nspeeds: [{up_to: 80, vertical: {d1: {peaks: [2, 3, 5]}}}]\n")
    found = read_limits(limits).peaks("vertical_d1 [m]", np.array([60.0]))
    assert found is not None and found[0] == pytest.approx([2e-3, 3e-3, 5e-3])
