"""Folders and files that appear whole or not at all."""

import errno
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from railsim.errors import InputError
from railsim.files import MARKER, read_json, replace_file, write_folder_atomically, write_json
from railsim.parquet import read_column, read_names, write_frame


def fill(target: Path, text: str) -> None:
    with write_folder_atomically(target) as folder:
        (folder / "part").write_text(text)


def test_nothing_is_seen_before_the_end(tmp_path: Path) -> None:
    target = tmp_path / "new" / "result"
    with write_folder_atomically(target) as folder:
        (folder / "part").write_text("x")
        assert not target.exists()
        assert folder.parent.parent == target.parent
    assert sorted(os.listdir(target)) == sorted([MARKER, "part"])
    assert os.listdir(target.parent) == ["result"]


def test_old_folder_stays_until_the_new_one_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "result"
    fill(target, "old")
    with pytest.raises(KeyboardInterrupt), write_folder_atomically(target) as folder:
        (folder / "part").write_text("half")
        raise KeyboardInterrupt
    assert (target / "part").read_text() == "old"
    fill(target, "new")
    assert (target / "part").read_text() == "new"
    assert os.listdir(tmp_path) == ["result"]


def test_folder_that_became_somebody_elses_meanwhile_is_left(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did not write"), write_folder_atomically(tmp_path / "result"):
        (tmp_path / "result").mkdir()
        (tmp_path / "result" / "thesis").write_text("words")
    assert os.listdir(tmp_path / "result") == ["thesis"]


def test_writers_at_the_same_time_leave_one_whole_folder(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda i: fill(tmp_path / "result", str(i)), range(64)))
    assert os.listdir(tmp_path) == ["result"]
    assert int((tmp_path / "result" / "part").read_text()) in range(64)


def test_full_disk_is_one_clear_line_and_other_errors_stay(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="free some space"), write_folder_atomically(tmp_path / "result"):
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(FileNotFoundError), write_folder_atomically(tmp_path / "result"):
        (tmp_path / "nothing").read_text()
    assert os.listdir(tmp_path) == []


def test_json_keeps_order_and_refuses_not_a_number(tmp_path: Path) -> None:
    values = {"b": 0.1 + 0.2, "a": ["µ"]}
    write_json(tmp_path / "x.json", values)
    assert list(read_json(tmp_path / "x.json", "a test").items()) == list(values.items())
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(tmp_path / "x.json", {"a": np.nan})


def test_parquet_keeps_every_bit_and_refuses_words(tmp_path: Path) -> None:
    values = np.concatenate([np.random.default_rng(1).standard_normal(40_000), [np.nan, -0.0, 5e-324]])
    write_frame(tmp_path / "x.parquet", pd.DataFrame({"a.b [m]": values, "a [m]": values[::-1]}))
    assert read_names(tmp_path / "x.parquet") == (["a.b [m]", "a [m]"], 40_003)
    for name, due in [("a.b [m]", values), ("a [m]", values[::-1])]:
        assert read_column(tmp_path / "x.parquet", name).tobytes() == due.tobytes()
    pd.DataFrame({"a": ["word"]}).to_parquet(tmp_path / "y.parquet")
    with pytest.raises(InputError, match="column 'a' holds .*; every column must hold numbers"):
        read_names(tmp_path / "y.parquet")


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "table.txt"
    replace_file(path, b"old")
    replace_file(path, b"new")
    assert path.read_bytes() == b"new"

    def stopped(source: object, target: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("railsim.files.os.replace", stopped)
    with pytest.raises(KeyboardInterrupt):
        replace_file(path, b"newer")
    assert path.read_bytes() == b"new"
    assert [one.name for one in tmp_path.iterdir()] == ["table.txt"]


def test_a_small_file_that_would_fill_the_memory_is_refused(tmp_path: Path) -> None:
    """300 million equal values pack into a megabyte, as a damaged or hostile file may."""
    path = tmp_path / "256hz.parquet"
    equal = pa.table({"time [s]": pa.array(np.zeros(1_000_000))})
    with pq.ParquetWriter(path, equal.schema, compression="zstd") as writer:
        for _ in range(300):
            writer.write_table(equal)
    assert path.stat().st_size < 2_000_000
    with pytest.raises(InputError, match=r"MB and would take 2\.4 GB of memory"):
        read_column(path, "time [s]")
