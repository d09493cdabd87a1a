"""Track-recording cars: kilometrage up and down, left and right, versines, runs that are shifted."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.signal import butter, sosfiltfilt

from railsim.errors import InputError
from railsim.field.importing import Imported, import_file
from railsim.track.files import read_track, write_track
from railsim.track.track import Track

COLUMNS = (
    "vertical",
    "lateral",
    "cross_level",
    "gauge_deviation",
    "left_vertical",
    "right_vertical",
    "curvature",
    "cant",
)


@pytest.fixture(scope="module")
def curve() -> Track:
    """Every column of geometry over 200 m, each with its own shape."""
    s = np.arange(801) * 0.25
    shapes = np.random.default_rng(5).standard_normal((len(COLUMNS), s.size)).cumsum(axis=1) * 1e-5
    return Track(s, dict(zip(COLUMNS, shapes, strict=True)) | {"gradient": 1e-4 * np.sin(s / 30)}, "curve")


def mapped(keys: list[str], **place: Any) -> dict[str, Any]:
    """A map of columns in mm, 1/km and per mille over kilometrage in km."""
    units = {"curvature": ("1/m", "1/km"), "gradient": ("-", "‰")}
    columns = {
        f"{key} [{units.get(key, ('m',))[0]}]": {"column": key, "unit": units.get(key, ("", "mm"))[1]} for key in keys
    }
    return {
        "kind": "track",
        "origin": "test",
        "kilometrage": {"column": "km", "unit": "km", "direction": "up"} | place,
        "columns": columns,
    }


def run(folder: Path, table: pd.DataFrame, values: dict[str, Any], name: str = "out.csv", **csv: Any) -> Imported:
    """Write the table, import it as a track."""
    table.to_csv(folder / "data.csv", index=False, **csv)
    (folder / "map.yaml").write_text(yaml.safe_dump(values))
    return import_file(folder / "data.csv", folder / "map.yaml", folder / name)


def as_recorded(track: Track, start: float) -> pd.DataFrame:
    """Rows as a car writes them that runs up the kilometrage from `start` km."""
    table = {"km": start + track.s / 1e3}
    return pd.DataFrame(table | {key: 1e3 * values for key, values in track.columns().items()})


def test_same_track_up_and_down_the_kilometrage(tmp_path: Path, curve: Track):
    """Down: the kilometrage falls along the run, decimal commas; what is left and right stays, as the car saw it."""
    up = as_recorded(curve, 12.3)
    down = up.assign(km=24.6 - up["km"])
    keys = list(curve.columns())
    done = run(tmp_path, up, mapped(keys))
    run(tmp_path, down, mapped(keys, direction="down"), "down.csv", sep=";", decimal=",")
    for name in ("out.csv", "down.csv"):
        found = read_track(tmp_path / name)
        np.testing.assert_allclose(found.s, curve.s, atol=1e-9)
        for key, values in curve.columns().items():
            np.testing.assert_allclose(found.columns()[key], values, rtol=1e-12, atol=1e-15)
    comments = read_track(tmp_path / "out.csv").comments
    assert comments[0] == "railsim import: test"
    assert [line for line in comments if line.startswith("assumption:")] == [
        f"assumption: {a}" for a in done.notes.assumptions
    ]


def test_track_turned_round_is_the_track_seen_from_its_other_end(tmp_path: Path, curve: Track):
    """A place on the left seen from one end is on the right from the other; turning twice gives the first back."""
    keys = list(curve.columns())
    run(tmp_path, as_recorded(curve, 0.0), mapped(keys, towards="down"), "down.csv")
    turned = read_track(tmp_path / "down.csv")
    there, back = curve.at(np.array([40.0])), turned.at(200.0 - np.array([40.0]))
    for key, other, sign in [
        ("left_vertical", "right_vertical", 1),
        ("left_lateral", "right_lateral", -1),
        ("cant", "cant", -1),
        ("curvature", "curvature", -1),
        ("gradient", "gradient", -1),
        ("gauge_deviation", "gauge_deviation", 1),
    ]:
        assert getattr(back, other) == pytest.approx(sign * getattr(there, key), abs=1e-9), key
    falling = as_recorded(turned, 0.0)
    falling["km"] = 0.2 - falling["km"]
    run(tmp_path, falling, mapped(keys, direction="down", towards="up"), "again.csv")
    again = read_track(tmp_path / "again.csv")
    for key, values in curve.columns().items():
        np.testing.assert_allclose(again.columns()[key], values, rtol=1e-12, atol=1e-15)


def test_sides_as_seen_up_the_kilometrage(tmp_path: Path, curve: Track):
    """A car that runs down, whose file still names the sides looking up: left and right change places."""
    down = as_recorded(curve, 0.0).assign(km=0.2 - curve.s / 1e3)
    run(tmp_path, down, mapped(["left_vertical", "lateral"], direction="down", sides="kilometrage"))
    found = read_track(tmp_path / "out.csv").columns()
    np.testing.assert_allclose(found["right_vertical"], curve.left_vertical, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found["lateral"], -curve.lateral, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("table", "change", "line"),
    [
        ({"km": [3, 2, 1, 0]}, {}, "goes back from 3000 to 2000 m at row 2"),
        ({"km": [0, 1, 1, 2]}, {}, "1000 m appears twice"),
        ({"vertical": [0, 1, None, 2]}, {}, r"vertical: 1 of 4 values are lost \(the first at 2000 m\).*'fill'"),
        ({}, {"unit": "s"}, "'s' cannot become 'm'"),
        ({}, {"column": "place"}, "no column 'place'"),
        ({}, {"direction": "north"}, "direction: Input should be 'up' or 'down'"),
    ],
)
def test_wrong_track_file_is_one_clear_line(tmp_path: Path, table: dict[str, Any], change: dict[str, Any], line: str):
    rows = pd.DataFrame({"km": [0, 1, 2, 3], "vertical": [0.0, 1.0, 2.0, 3.0]} | table)
    with pytest.raises(InputError, match=line):
        run(tmp_path, rows, mapped(["vertical"], **change))
    assert not (tmp_path / "out.csv").exists()


def test_other_files_are_not_overwritten(tmp_path: Path, curve: Track):
    (tmp_path / "thesis.csv").write_text("mine")
    with pytest.raises(InputError, match="did not write"):
        run(tmp_path, as_recorded(curve, 0.0), mapped(["vertical"]), "thesis.csv")
    assert (tmp_path / "thesis.csv").read_text() == "mine"
    for _ in range(2):
        run(tmp_path, as_recorded(curve, 0.0), mapped(["vertical"]))


def versines(track: Track, s: np.ndarray, behind: float, ahead: float) -> np.ndarray:
    """By definition: offset from the straight line between two points of the rail."""
    y, rear, front = (track.at(s + step).lateral for step in (0.0, -behind, ahead))
    return y - (ahead * rear + behind * front) / (behind + ahead)


@pytest.mark.parametrize(
    ("behind", "ahead", "d1", "d2"),
    [
        (5.0, 5.0, 0.15, 0.05),  # blind at 5 m wavelength, inside D1
        (2.6, 7.4, 0.03, 0.05),  # no blind wavelength between 3 and 70 m
    ],
)
def test_versines_become_alignment(tmp_path: Path, behind: float, ahead: float, d1: float, d2: float):
    """A track of the ERRI spectrum: error of the alignment over the alignment itself, in the ranges of EN 13848-1."""
    track = read_track("straight_erri_high")
    s = np.arange(track.s[0] + 20, track.s[-1] - 20, 0.25)
    table = pd.DataFrame({"km": s / 1e3, "lateral": 1e3 * versines(track, s, behind, ahead)})
    values = mapped(["lateral"], zero=0.0)
    values["repair"] = ["snap"]
    values["columns"]["lateral [m]"]["chord"] = {"behind": behind, "ahead": ahead}
    done = run(tmp_path, table, values)
    found = read_track(tmp_path / "out.csv")
    inside = (found.s > s[0] + 70) & (found.s < s[-1] - 70)
    true = track.at(found.s).lateral
    for shortest, longest, most in [(3.5, 25.0, d1), (25.0, 60.0, d2)]:
        band = butter(4, [1 / longest, 1 / shortest], "bandpass", fs=4.0, output="sos")
        error = sosfiltfilt(band, found.lateral - true)[inside].std()
        assert error < most * sosfiltfilt(band, true)[inside].std(), (shortest, longest)
    assert any("alignment from versines over a chord of" in text for text in done.notes.assumptions)


def test_shift_between_two_runs_is_found(tmp_path: Path):
    """The second run's odometer is off by 3.7 m at the beginning and by 1 m a kilometre more later."""
    track = read_track("straight_erri_low")
    s = np.arange(track.s[0], track.s[-1], 0.25)
    write_track(Track(s, {"vertical": track.at(s).vertical}, "first"), tmp_path / "first.csv")
    rng = np.random.default_rng(2)
    place = s - 3.7 - 1e-3 * (s - s[0])
    noisy = 1e3 * track.at(s).vertical + 0.1 * rng.standard_normal(s.size)
    values = mapped(["vertical"], zero=0.0) | {"align": {"reference": "first.csv", "column": "vertical [m]"}}
    done = run(tmp_path, pd.DataFrame({"km": place / 1e3, "vertical": noisy}), values)
    found = read_track(tmp_path / "out.csv")
    inside = (s > s[0] + 150) & (s < s[-1] - 150)
    assert np.abs(found.s - s)[inside].max() < 0.15
    assert "cross-correlation of vertical" in done.notes.repairs[-1]
    other = read_track("straight_erri_high")
    write_track(Track(s, {"vertical": other.at(s).lateral}, "first"), tmp_path / "first.csv")
    with pytest.raises(InputError, match="is it the same track and column"):
        run(tmp_path, pd.DataFrame({"km": place / 1e3, "vertical": noisy}), values)
