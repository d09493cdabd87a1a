"""Large text tables block by block: the same columns, notes and errors as by the reader of the whole file."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.field import cells, streaming
from railsim.field.map import Csv
from railsim.field.streaming import is_plain
from railsim.field.tables import Notes, Table
from railsim.field.text import read_text

ROWS = [f"{n / 4},{n * 0.25 - 3:.3f},{n % 7}" for n in range(120)]
TEXT = "time,a,b\n" + "\n".join(ROWS) + "\n"
CASES = {
    "plain": (TEXT, {}),
    "no end of the last line": (TEXT.rstrip("\n"), {}),
    "last line cut": (TEXT.rstrip("\n")[:-4] + "\n" + "30.0,2", {"broken": "drop"}),
    "last number cut": (TEXT.replace(",0\n", ",0.25\n").rstrip("\n") + "\n30.0,27.000,0.2", {}),
    "windows": (TEXT.replace("\n", "\r\n"), {}),
    "comments and blanks": ("# a logger\n\n" + TEXT.replace("\n10.0,", "\n\n# pause\n10.0,"), {}),
    "header again": (TEXT.replace("\n20.0,", "\ntime,a,b\n20.0,"), {}),
    "no header": ("\n".join(ROWS) + "\n", {"names": ["time", "a", "b"]}),
    "empty cells": (TEXT.replace(",3\n", ",\n"), {}),
    "lost marker": (TEXT.replace(",3\n", ",-999\n"), {}),
    "decimal comma": (TEXT.replace(",", ";").replace(".", ","), {}),
    "blanks": (TEXT.replace(",", "  "), {}),
    "footer": (TEXT + "end of record\n", {}),
    "too many cells": (TEXT.replace("\n15.0,", "\n15.0,1,2,"), {}),
    "too many cells, dropped": (TEXT.replace("\n15.0,", "\n15.0,1,2,"), {"broken": "drop"}),
    "text late": (TEXT.replace("\n25.0,22.000", "\n25.0,ERR"), {}),
    "dates": (TEXT.replace("time", "at").replace("\n1", "\n2024-05-03T10:00:0"), {}),
    "units in a second line": (TEXT.replace("time,a,b\n", "time,a,b\ns,m/s,-\n"), {}),
}


def read(path: Path, options: dict[str, object]) -> tuple[Table | str, Notes]:
    notes = Notes()
    wanted = {"time": [], "a": [], "b": ["-999"]}
    try:
        return read_text(path, Csv.build(options), wanted, notes), notes
    except InputError as error:
        return str(error), notes


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("block", [40, 333, 1_000_000])
def test_blocks_give_what_the_whole_gives(name: str, block: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    text, options = CASES[name]
    path = tmp_path / "x.csv"
    path.write_bytes(text.encode())
    whole, said = read(path, options)
    monkeypatch.setattr(streaming, "LARGE", 0)
    monkeypatch.setattr(streaming, "BLOCK", block)
    monkeypatch.setattr(cells, "ROWS_AT_ONCE", 17)
    found, told = read(path, options)
    if isinstance(whole, str) or isinstance(found, str):
        assert found == whole
        return
    assert told == said
    assert (found.first_row, found.mixed) == (whole.first_row, whole.mixed)
    assert np.array_equal(found.lines, whole.lines)  # pyright: ignore[reportArgumentType]
    for column in whole.columns:
        one, other = found.columns[column], whole.columns[column]
        assert (one.unit, one.fault) == (other.unit, other.fault)
        if isinstance(other.values, list):
            assert one.values == other.values
        else:
            assert np.array_equal(np.asarray(one.values), other.values, equal_nan=True)


@pytest.mark.parametrize(
    ("content", "encoding", "plain"),
    [
        (b"a,b\n1,2\n", None, True),
        (b"a,b\r\n1,2\r\n", "latin-1", True),
        (b"a,b\n1,2\n", "utf-16", False),
        (b'a,b\n"1",2\n', None, False),
        (b"a,b\r1,2\r", None, False),
        (b"a,b\n1,2\n\0\0", None, False),
        ("a,µ\n1,2\n".encode(), None, False),
    ],
)
def test_what_stands_for_itself(
    content: bytes, encoding: str | None, plain: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "x.csv"
    path.write_bytes(content)
    for block in (1, 4, 1000):
        monkeypatch.setattr(streaming, "BLOCK", block)
        assert is_plain(path, Csv.build({} if encoding is None else {"encoding": encoding})) == plain


_PROGRAM = """
import resource, sys
from pathlib import Path
import numpy as np
from railsim.field.map import Csv
from railsim.field.tables import Notes
from railsim.field.text import read_text
base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
table = read_text(Path(sys.argv[1]), Csv.build({}), {name: [] for name in "tabcdef"}, Notes())
assert np.array_equal(table.columns["t"].values, np.arange(900_000) / 256) and table.lines[-1] == 900_001
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - base) * 1024)
"""


def test_memory_is_that_of_the_numbers_and_of_a_block(tmp_path: Path):
    rows, path = 900_000, tmp_path / "x.csv"
    line = ",1.2345678,2.3456789,3.4567891,4.5678912,5.6789123,6.7891234\n"
    with path.open("w") as file:
        file.write("t,a,b,c,d,e,f\n")
        file.writelines(f"{row / 256}{line}" for row in range(rows))
    words = [sys.executable, "-c", _PROGRAM, str(path)]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=120)
    numbers = 8 * 8 * rows
    assert float(done.stdout) < 2.0 * numbers + 130e6  # the lines alone would take 120e6 more, the text 60e6 twice
