"""Encodings, separators, decimal marks: stated, or found by a rule and said."""

from pathlib import Path
from typing import Any

import pytest

from railsim.errors import InputError
from railsim.field import cells as parsing
from railsim.field.map import Csv
from railsim.field.tables import Notes
from railsim.field.text import read_text

CHINESE = "时间,俯仰角速度\n0.0,1.5\n0.1,2.5\n"
FRENCH = "temps;tangage °/s\n0,0;1,5\n0,1;2,5\n"


def read(folder: Path, data: bytes, names: list[str], **options: object) -> tuple[list[list[float]], Notes]:
    path, notes = folder / "data.csv", Notes()
    path.write_bytes(data)
    table = read_text(path, Csv.build(options), {name: [] for name in names}, notes)
    return [list(map(float, table.columns[name].values)) for name in names], notes


@pytest.mark.parametrize("encoding", ["utf-8", "gb18030", "utf-16", "utf-8-sig"])
def test_chinese(tmp_path: Path, encoding: str):
    stated = {"encoding": encoding} if encoding == "gb18030" else {}
    found, notes = read(tmp_path, CHINESE.encode(encoding), ["时间", "俯仰角速度"], **stated)
    assert found == [[0.0, 0.1], [1.5, 2.5]]
    assert stated or any(text.startswith(f"encoding {encoding.removesuffix('-sig')}") for text in notes.assumptions)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "cp1252", "utf-16"])
def test_french_with_decimal_commas(tmp_path: Path, encoding: str):
    stated = {} if encoding == "utf-16" else {"encoding": encoding}
    found, notes = read(tmp_path, FRENCH.encode(encoding), ["temps", "tangage °/s"], **stated)
    assert found == [[0.0, 0.1], [1.5, 2.5]]
    assert "decimal mark ',': the only one in the first rows" in notes.assumptions


@pytest.mark.parametrize("encoding", ["gb18030", "latin-1"])
def test_other_encodings_are_not_guessed(tmp_path: Path, encoding: str):
    text = CHINESE if encoding == "gb18030" else FRENCH
    with pytest.raises(InputError, match="is not utf-8; state csv.encoding"):
        read(tmp_path, text.encode(encoding), ["x"])


def test_mixed_encodings_are_refused_or_replaced_where_asked(tmp_path: Path):
    data = "t,v,remark\n0,1,Brücke\n".encode() + "1,2,Brücke\n".encode("latin-1")
    with pytest.raises(InputError, match="line 3: byte .* mixes encodings"):
        read(tmp_path, data, ["t"], encoding="utf-8")
    found, notes = read(tmp_path, data, ["t", "v"], encoding="utf-8", undecodable="replace")
    assert found == [[0, 1], [1, 2]]
    assert notes.repairs == ["1 lines hold bytes that are not utf-8; these became '�'"]


def test_thousands_units_row_comments_and_quotes(tmp_path: Path):
    text = '# logger 7\n# 2024\nkm|"left, level"\n[m]|[mm]\n"1.234,5"|-0,5\n1.234,75|0,5\n'
    path, notes = tmp_path / "data.csv", Notes()
    path.write_text(text)
    options = Csv.build({"units_row": True, "thousands": ".", "decimal": ","})
    table = read_text(path, options, {"km": [], "left, level": []}, notes)
    assert list(table.columns["km"].values) == [1234.5, 1234.75]
    assert list(table.columns["left, level"].values) == [-0.5, 0.5]
    assert [table.columns[name].unit for name in ("km", "left, level")] == ["m", "mm"]
    assert notes.assumptions == ["columns are separated by '|': header and first rows have 2 cells each"]


def test_point_in_a_text_with_decimal_commas_is_no_number(tmp_path: Path):
    path = tmp_path / "data.csv"
    path.write_text("t;v\n" + "".join(f"{i};1,5\n" for i in range(300)) + "300;1.5\n")
    table = read_text(path, Csv(), {"v": []}, Notes())
    assert table.columns["v"].fault == (300, "1.5")


@pytest.mark.parametrize(
    "cells",
    [
        {},
        {"v": {7: "", 8: "nan"}},
        {"v": {40: "lost"}},
        {"n": {41: "12.5"}},
        {"n": {3: "99999999999999999999"}},
        {"v": {30: "True"}},
        {"when": {5: ""}},
        {"v": {20: '"1'}},
        {"v": {45: "1,2"}},
    ],
)
def test_long_tables_read_in_parts_are_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cells: dict[str, Any]):
    """Whole numbers that become others in a later part, words, broken rows: as where all is read at once."""
    rows = [
        {"t": f"{n / 10:.1f}", "v": f"{n * 1.7:.3f}", "n": f"{n}", "when": f"2024-05-03T10:00:{n:02d}"}
        for n in range(50)
    ]
    for name, changes in cells.items():
        for row, cell in changes.items():
            rows[row][name] = cell
    path = tmp_path / "data.csv"
    path.write_text("t,v,n,when\n" + "".join(",".join(row.values()) + "\n" for row in rows))

    def read() -> Any:
        try:
            table = read_text(path, Csv(), dict.fromkeys("tvn", []) | {"when": []}, Notes(), frozenset(["when"]))
        except InputError as error:
            return str(error)
        return {name: (list(map(str, one.values)), one.fault) for name, one in table.columns.items()}

    at_once = read()
    monkeypatch.setattr(parsing, "ROWS_AT_ONCE", 7)
    assert read() == at_once
