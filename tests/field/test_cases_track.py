"""Files of track-recording cars as they are: notations of the place, posts, places that are set on the way."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from railsim.errors import InputError
from railsim.field.importing import Imported, import_file
from railsim.track.files import read_track

COUNT = 400
PLACES = 12950.0 + 0.25 * np.arange(COUNT)


def dips(s: np.ndarray) -> np.ndarray:
    """Of the left rail, mm."""
    return 3.0 * np.sin(2 * np.pi * s / 12.0)


def run(folder: Path, header: str, cells: list[str], kilometrage: dict[str, Any], **more: Any) -> Imported:
    """Import a file whose last column is `dips` in mm, at the places of the rows."""
    rows = [f"{cell};{value:.4f}" for cell, value in zip(cells, dips(PLACES - PLACES[0]), strict=True)]
    (folder / "car.csv").write_text("\n".join([f"{header};left", *rows, ""]), encoding=more.pop("encoding", "utf-8"))
    columns = more.pop("columns", {"left_vertical [m]": {"column": "left", "unit": "mm"}})
    values = {"kind": "track", "origin": "car", "kilometrage": {"direction": "up"} | kilometrage, "columns": columns}
    (folder / "map.yaml").write_text(yaml.safe_dump(values | more))
    return import_file(folder / "car.csv", folder / "map.yaml", folder / "out.csv")


def check(folder: Path, zero: float = PLACES[0], count: int = COUNT) -> None:
    """The track file has the dips where they are."""
    track = read_track(folder / "out.csv")
    assert track.s == pytest.approx(0.25 * np.arange(count), abs=1e-6)
    assert 1e3 * track.columns()["left_vertical"] == pytest.approx(dips(track.s), abs=1e-3)
    assert f"kilometrage {zero:.10g} m" in (folder / "out.csv").read_text()


@pytest.mark.parametrize("form", ["{}+{:07.2f}", "K{}+{:.2f}", "DK{} + {:.2f}", "km {}+{:.2f}m"])
def test_kilometre_plus_metres(tmp_path: Path, form: str):
    done = run(tmp_path, "place", [form.format(int(x // 1000), x % 1000) for x in PLACES], {"column": "place"})
    check(tmp_path)
    assert "places of 'place' are written as kilometre + metres" in done.notes.assumptions


def test_kilometre_plus_metres_with_decimal_commas_and_against_the_kilometrage(tmp_path: Path):
    cells = [f"{int(x // 1000)}+{x % 1000:.2f}".replace(".", ",") for x in PLACES[::-1]]
    run(tmp_path, "place", cells, {"column": "place", "direction": "down"})
    check(tmp_path, PLACES[-1])


def test_a_place_that_is_none_and_its_cure(tmp_path: Path):
    cells = [f"{int(x // 1000)}+{x % 1000:.2f}" for x in PLACES]
    cells[7] = "-"
    with pytest.raises(InputError, match="row 9 holds '-', no place .*'lost' of 'kilometrage' and 'drop_untimed'"):
        run(tmp_path, "place", cells, {"column": "place"})
    run(tmp_path, "place", cells, {"column": "place", "lost": ["-"]}, repair=["drop_untimed", "resample", "fill"])
    track = read_track(tmp_path / "out.csv")
    assert 1e3 * track.columns()["left_vertical"] == pytest.approx(dips(track.s), abs=0.05)


def test_lost_place_among_numbers(tmp_path: Path):
    cells = [f"{x:.2f}" for x in PLACES]
    cells[7] = "n/a"
    with pytest.raises(InputError, match="'n/a'.*add it to 'lost' of 'kilometrage'"):
        run(tmp_path, "place", cells, {"column": "place"})
    lost = {"column": "place", "lost": ["n/a"]}
    with pytest.raises(InputError, match="drop_untimed"):
        run(tmp_path, "place", cells, lost)
    run(tmp_path, "place", cells, lost, repair=["drop_untimed", "resample", "fill"])


def test_metres_within_a_kilometre_and_the_column_of_kilometres(tmp_path: Path):
    cells = [f"{int(x // 1000)};{x % 1000:.2f}" for x in PLACES]
    for repair in ([], ["sort"]):
        with pytest.raises(InputError, match="set back by 1000 m at row 202.*within a kilometre is; name the"):
            run(tmp_path, "km;m", cells, {"column": "m"}, repair=repair)
    run(tmp_path, "km;m", cells, {"column": "m", "post": {"column": "km", "unit": "km"}})
    check(tmp_path)


def test_milepost_and_feet(tmp_path: Path):
    feet = PLACES / 0.3048
    cells = [f"{int(x // 5280)};{x % 5280:.6f};2.5" for x in feet]
    place = {"column": "FOOT", "unit": "ft", "post": {"column": "MP", "unit": "mi"}}
    columns: dict[str, Any] = {
        "left_vertical [m]": {"column": "left", "unit": "mm"},
        "curvature [1/m]": {"column": "CURV", "unit": "deg"},
    }
    with pytest.raises(InputError, match="deg/100ft"):
        run(tmp_path, "MP;FOOT;CURV", cells, place, columns=columns)
    columns["curvature [1/m]"]["unit"] = "deg/100ft"
    run(tmp_path, "MP;FOOT;CURV", cells, place, columns=columns)
    track = read_track(tmp_path / "out.csv")
    assert track.s[-1] == pytest.approx(0.25 * (COUNT - 1), abs=1e-3)
    assert track.columns()["curvature"] == pytest.approx(1 / 698.54, rel=1e-4)  # AREMA: 1 degree is 1746.38 m


@pytest.mark.parametrize("jump", [-0.5, -37.0, 12.0])
def test_place_that_the_car_was_given_on_the_way(tmp_path: Path, jump: float):
    places = PLACES.copy()
    places[200:] += jump
    cells = [f"{1000 + i};{x:.2f}" for i, x in enumerate(places)]
    if jump < 0:
        for repair in ([], ["sort", "drop_duplicates"]):
            with pytest.raises(InputError, match=r"set back by .*add 'continue' to repair") as caught:
                run(tmp_path, "count;m", cells, {"column": "m"}, repair=repair)
            assert "sort" not in str(caught.value)
    done = run(tmp_path, "count;m", cells, {"column": "m"}, repair=["continue"])
    check(tmp_path)
    assert any("was set at 1 places, first at row 202" in text for text in done.notes.repairs)
    run(tmp_path, "count;m", cells, {"column": "count", "scale": 0.25})
    check(tmp_path, 250.0)


def test_the_other_direction_is_named(tmp_path: Path):
    cells = [f"{x:.2f}" for x in PLACES[::-1]]
    with pytest.raises(InputError, match="goes back from .*the car ran the other way; correct 'direction'"):
        run(tmp_path, "m", cells, {"column": "m"})
    run(tmp_path, "m", cells, {"column": "m", "direction": "down"})
    check(tmp_path, PLACES[-1])


def test_rows_out_of_order_may_still_be_sorted(tmp_path: Path):
    cells = [f"{x:.2f}" for x in PLACES]
    cells[50], cells[51] = cells[51], cells[50]
    with pytest.raises(InputError, match="sort"):
        run(tmp_path, "m", cells, {"column": "m"})
    assert run(tmp_path, "m", cells, {"column": "m"}, repair=["sort"]).kind == "track"
