"""Truth: stored as it was appended, whole or not at all, the same bytes every time."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.files import MARKER
from railsim.truth import Truth, TruthWriter

COLUMNS = ["time [s]", "speed [m/s]", "bogie.roll [rad]"]
RATE = 1024.0


def rows(count: int) -> np.ndarray:
    time = np.arange(count) / RATE
    return np.column_stack([time, 20 + np.sin(time), 1e-3 * np.cos(3 * time)])


def write(folder: Path, values: np.ndarray, chunk: int = 1000) -> Path:
    with TruthWriter(folder, COLUMNS, RATE, {"vehicle": {"name": "test"}}) as writer:
        for first in range(0, len(values), chunk):
            writer.append(values[first : first + chunk])
    return folder


def test_reads_what_was_appended(tmp_path: Path) -> None:
    values = rows(40_000)
    truth = Truth.open(write(tmp_path / "truth", values))
    assert truth.columns == COLUMNS
    assert truth.rate == RATE
    assert len(truth) == 40_000
    assert truth.duration == 39_999 / RATE
    assert truth.about == {"vehicle": {"name": "test"}}
    assert "bogie.roll [rad]" in truth
    assert "bogie.yaw [rad]" not in truth
    np.testing.assert_array_equal(truth.time, values[:, 0])
    np.testing.assert_array_equal(truth["bogie.roll [rad]"], values[:, 2])
    np.testing.assert_array_equal(truth.frame().to_numpy(), values)
    assert list(truth.frame(["speed [m/s]"]).columns) == ["speed [m/s]"]


def test_bytes_do_not_depend_on_time_or_chunks(tmp_path: Path) -> None:
    values = rows(40_000)
    one, other = write(tmp_path / "one", values, 777), write(tmp_path / "other", values, 40_000)
    assert sorted(os.listdir(one)) == sorted([MARKER, "about.json", "channels.parquet"])
    for name in os.listdir(one):
        assert (one / name).read_bytes() == (other / name).read_bytes()


def test_unknown_channel_names_similar_ones(tmp_path: Path) -> None:
    truth = Truth.open(write(tmp_path / "truth", rows(10)))
    with pytest.raises(InputError, match=r"no channel 'bogie.rol \[rad\]'; similar: bogie.roll \[rad\]"):
        truth["bogie.rol [rad]"]


def test_error_leaves_nothing_new_and_the_old_run_as_it_was(tmp_path: Path) -> None:
    folder = write(tmp_path / "truth", rows(50))
    with pytest.raises(ZeroDivisionError), TruthWriter(folder, COLUMNS, RATE, {}) as writer:
        writer.append(rows(20))
        raise ZeroDivisionError
    assert os.listdir(tmp_path) == ["truth"]
    assert len(Truth.open(folder)) == 50


def test_a_clean_exit_replaces_the_old_run(tmp_path: Path) -> None:
    folder = write(tmp_path / "truth", rows(50))
    write(folder, rows(60))
    assert os.listdir(tmp_path) == ["truth"]
    assert len(Truth.open(folder)) == 60


def test_wrong_rows_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="shape"), TruthWriter(tmp_path / "a", COLUMNS, RATE, {}) as writer:
        writer.append(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="follow each other"), TruthWriter(tmp_path / "a", COLUMNS, RATE, {}) as writer:
        writer.append(rows(20))
        writer.append(rows(20))
    with pytest.raises(ValueError, match="twice"):
        TruthWriter(tmp_path / "a", ["time [s]", "x", "x"], RATE, {})
    with pytest.raises(ValueError, match="first column"):
        TruthWriter(tmp_path / "a", ["x"], RATE, {})


@pytest.mark.parametrize("keep", [0, 3, 0.5, 0.99])
def test_cut_table_is_one_clear_line(tmp_path: Path, keep: float) -> None:
    table = write(tmp_path / "truth", rows(5000)) / "channels.parquet"
    whole = table.read_bytes()
    table.write_bytes(whole[: int(keep if keep >= 1 else keep * len(whole))])
    with pytest.raises(InputError, match="not a whole Parquet file") as caught:
        Truth.open(tmp_path / "truth")
    assert "\n" not in str(caught.value)


def test_damaged_middle_is_one_clear_line(tmp_path: Path) -> None:
    table = write(tmp_path / "truth", rows(5000)) / "channels.parquet"
    whole = bytearray(table.read_bytes())
    whole[4:400] = bytes(396)
    table.write_bytes(bytes(whole))
    truth = Truth.open(tmp_path / "truth")
    with pytest.raises(InputError, match="is damaged: its SHA-256"):
        assert truth.time.size


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"format_version": 2}, "format version 1"),
        ({"rows": 7}, "of different runs"),
        ({"columns": ["time [s]"]}, "of different runs"),
        ({"rate": -1.0}, "no valid rate"),
    ],
)
def test_description_that_does_not_fit_is_refused(tmp_path: Path, change: dict[str, object], line: str) -> None:
    about = write(tmp_path / "truth", rows(10)) / "about.json"
    about.write_text(json.dumps(json.loads(about.read_text()) | change))
    with pytest.raises(InputError, match=line):
        Truth.open(tmp_path / "truth")


def test_missing_parts_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"has no about\.json"):
        Truth.open(tmp_path / "nowhere")
    folder = write(tmp_path / "truth", rows(10))
    (folder / "channels.parquet").unlink()
    with pytest.raises(InputError, match=r"channels\.parquet' is missing"):
        Truth.open(folder)
    (folder / "about.json").write_text("{")
    with pytest.raises(InputError, match="is not JSON"):
        Truth.open(folder)


def test_output_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        write(tmp_path / "file" / "truth", rows(10))
    with pytest.raises(InputError, match="is a file"):
        write(tmp_path / "file", rows(10))
    (tmp_path / "file").rename(tmp_path / "kept")
    with pytest.raises(InputError, match="did not write"):
        write(tmp_path, rows(10))
    assert os.listdir(tmp_path) == ["kept"]
