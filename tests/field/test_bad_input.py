"""What is wrong with a file or its map is one clear line; nothing is written."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from railsim import Recording
from railsim.errors import InputError
from railsim.field.importing import Imported, import_file

CHANNEL = "bogie.rate_pitch [rad/s]"
HEADER = "t,pitch"
ROWS = "\n".join(f"{i / 100:.2f},{i}" for i in range(50))
GYRO = {"kind": "gyro", "name": "bogie", "body": "bogie", "errors": "mems"}


def mapped(**more: Any) -> dict[str, Any]:
    """A map for one table with one channel; keys of the table and of the channel may be given."""
    channel: dict[str, Any] = {"column": "pitch", "unit": "deg/s"} | more.pop("channel", {})
    table: dict[str, Any] = {"time": {"kind": "seconds", "column": "t"}, "channels": {CHANNEL: channel}}
    return {"origin": "test", "vehicle": "manchester", "tables": [table | more.pop("table", {})]} | more


def run(folder: Path, text: str | bytes, values: Any) -> Imported:
    """Import a CSV file into `out`."""
    file, map_file = folder / "data.csv", folder / "map.yaml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    map_file.write_text(values if isinstance(values, str) else yaml.safe_dump(values))
    return import_file(file, map_file, folder / "out")


def samples(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times and values that were imported."""
    seen = Recording.open(folder / "out").measurements
    return seen.time(CHANNEL), np.rad2deg(seen[CHANNEL])


GOOD = f"{HEADER}\n{ROWS}\n"
SWAPPED = GOOD.replace("0.10,10\n0.11,11", "0.11,11\n0.10,10")
DOUBLED = GOOD.replace("0.10,10\n", "0.10,10\n0.10,10\n0.10,99\n")


@pytest.mark.parametrize(
    ("text", "values", "line"),
    [
        (GOOD, mapped(channel={"unit": "m/s"}), "'m/s' cannot become 'rad/s'"),
        (GOOD, mapped(channel={"unit": "deg/seg"}), r"rate_pitch \[rad/s\].unit.*unknown unit 'deg/seg'"),
        (GOOD, mapped(channel={"unit": None}), "neither the map nor the file states the unit of 'pitch'"),
        (GOOD.replace("pitch", "pitch [g]"), mapped(channel={"column": "pitch [g]"}), "the map says 'deg/s', .* 'g'"),
        (GOOD, mapped(channel={"column": "pich"}), "no column 'pich'; there are: 'pitch'"),
        (GOOD, mapped(channel={"sing": -1}), r"sing: unknown key; did you mean 'sign'\? Channel knows column"),
        (GOOD, mapped(table={"time": {"kind": "rows", "col": "t"}}), "rows.col: unknown key; Rows knows kind"),
        (GOOD, mapped(table={"rate": 200}), "rows are stated 0.005 s apart and are 0.01 s apart; correct the rate"),
        (GOOD, mapped(table={"repair": ["sort", "snap", "resample"]}), "name one of the two"),
        (GOOD, mapped(table={"time": {"kind": "rows"}}), "needs a 'rate'"),
        (GOOD, mapped(table={"time": {"kind": "own"}}), "no time axis of its own"),
        (GOOD, mapped(table={"group": 1}), "has no groups"),
        (GOOD, mapped(format="tdms"), "is a text file, the map says TDMS"),
        (GOOD, mapped(vehicle="class999"), r"none is called 'class999'; did you mean 'class175'\? there"),
        (GOOD, mapped(vehicle={"name": "mine", "bogie_mass": "heavy"}), "bogie_mass: 'heavy' is not a number"),
        (GOOD, mapped(speed_source="gnss.speed [m/s]"), "no channel 'gnss.speed"),
        (GOOD, mapped(track="nix.csv"), "no track"),
        (GOOD, mapped(sensors=[GYRO | {"kind": "giro"}]), "unknown sensor 'giro'; did you mean 'gyro'"),
        (GOOD, mapped(sensors=[GYRO | {"name": "body"}]), "none of body.rate_roll"),
        (GOOD, mapped(sensors=[GYRO, GYRO]), "also belongs to sensor 0"),
        (GOOD, "tables: [", "is not YAML"),
        (GOOD, "[1, 2]", "must hold keys and values"),
        (GOOD, "origin: a\norigin: b\n", "key 'origin' appears twice"),
        ("", mapped(), "is empty"),
        ("\n\n", mapped(), "has no header"),
        (f"{HEADER}\n", mapped(), "no separator|no rows"),
        ("t,pitch\n0,1\n", mapped(), "1 rows are left"),
        (SWAPPED, mapped(), "goes back from 0.11 to 0.1 s at row 12 .*'sort' to repair"),
        (DOUBLED, mapped(), r"time 0.1 s appears twice \(2 such rows, row 12 .*'drop_duplicates' to repair"),
        (GOOD.replace("0.10,", ","), mapped(), "1 rows have none, the first is row 11 .*'drop_untimed'"),
        (GOOD.replace(",10\n", ",x\n"), mapped(), "column 'pitch' row 12 holds 'x', no number.*'lost'"),
        (GOOD.replace(",10\n", ",10,5\n"), mapped(), "line 12: 3 cells for 2 columns"),
        (GOOD.replace(",10\n", "\n"), mapped(), "line 12: 1 cells for 2 columns"),
        (GOOD.replace("t,pitch", "t,pitch,pitch").replace("\n0.", "\n1,0."), mapped(), "2 columns are called 'pitch'"),
        (GOOD.replace(",", ";").replace(".", ",").replace("0,10;10", "0.10;10"), mapped(), "state csv.decimal"),
        (GOOD.encode("utf-16-le"), mapped(), "UTF-16 without mark.*csv.encoding"),
        (GOOD.encode() + "0.5,1 # Brücke".encode("latin-1"), mapped(), "line 52: byte .* state csv.encoding"),
        (GOOD, mapped(csv={"encoding": "unicode_escape"}), "unknown encoding"),
        (b"PK\x03\x04" + b"0" * 100, mapped(), "is an archive; unpack it"),
        (b"UnFinMF " + b"0" * 100, mapped(), "unfinished MDF4"),
    ],
)  # fmt: skip
def test_one_clear_line_and_nothing_written(tmp_path: Path, text: str | bytes, values: Any, line: str):
    with pytest.raises(InputError, match=line) as caught:
        run(tmp_path, text, values)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_unsorted_rows_are_sorted_where_the_map_asks(tmp_path: Path):
    done = run(tmp_path, SWAPPED, mapped(table={"repair": ["sort"]}))
    time, values = samples(tmp_path)
    np.testing.assert_allclose(time, np.arange(50) / 100)
    np.testing.assert_allclose(values, np.arange(50), atol=1e-12)
    assert done.notes.repairs == ["time: rows sorted; it went back at 1 places, first at row 12 of the data"]


def test_doubled_rows_keep_the_first(tmp_path: Path):
    done = run(tmp_path, DOUBLED, mapped(table={"repair": ["drop_duplicates"]}))
    assert samples(tmp_path)[1] == pytest.approx(np.arange(50))
    assert done.notes.repairs == ["time: 2 rows with the one before left out, 1 of them with other values"]


def test_markers_of_lost_samples_are_lost(tmp_path: Path):
    text = GOOD.replace(",10\n", ",-9999\n").replace(",11\n", ",ERR\n").replace(",12\n", ",\n")
    run(tmp_path, text, mapped(channel={"lost": [-9999, "ERR"]}))
    values = samples(tmp_path)[1]
    assert np.flatnonzero(np.isnan(values)).tolist() == [10, 11, 12]


def test_gaps_are_empty_and_jitter_goes_where_the_map_asks(tmp_path: Path):
    rng = np.random.default_rng(3)
    keep = np.r_[0:20, 30:50]
    stamps = keep / 100 + rng.uniform(-0.002, 0.002, keep.size)
    lines = [f"{t:.6f},{i}" for t, i in zip(stamps, keep, strict=True)]
    text = "\n".join([HEADER, *lines])
    done = run(tmp_path, text, mapped(table={"repair": ["snap"], "rate": 100}))
    time, values = samples(tmp_path)
    np.testing.assert_allclose(np.diff(time), 0.01, rtol=1e-9)
    np.testing.assert_allclose(values, np.where((np.arange(50) < 20) | (np.arange(50) >= 30), np.arange(50), np.nan))
    assert "10 missing rows left empty" in done.notes.repairs[0]
    run(tmp_path, text, mapped(table={"repair": ["resample"], "rate": 100}))
    time, values = samples(tmp_path)
    at = np.interp(time, stamps, keep)
    good = np.isfinite(values)
    assert np.isnan(values[(time > stamps[19] + 1e-6) & (time < stamps[20] - 1e-6)]).all()
    np.testing.assert_allclose(values[good], at[good], atol=0.25)
    with pytest.raises(InputError, match="'snap' to repair"):
        run(tmp_path, text, mapped(table={"rate": 103}))
    run(tmp_path, text, mapped(table={"rate": 100}))  # the median of the steps is 2 % off, the rate is not
    assert Recording.open(tmp_path / "out").measurements.rate(CHANNEL) == 100.0
    done = run(tmp_path, text, mapped())
    assert np.array_equal(samples(tmp_path)[0], np.round(stamps, 6))
    assert any("1 gaps of up to" in text for text in done.notes.assumptions)
    assert any("steps jitter by" in text for text in done.notes.assumptions)


def test_clock_that_runs_slow_sets_the_rate(tmp_path: Path):
    """1000.5 Hz by a clock that was stated as 1000 Hz: after 4 s two samples would fall on one place."""
    text = "\n".join([HEADER, *(f"{i / 1000.5:.9f},{i}" for i in range(4000))])
    done = run(tmp_path, text, mapped(table={"repair": ["snap"], "rate": 1000}))
    seen = Recording.open(tmp_path / "out").measurements
    assert seen.rate(CHANNEL) == pytest.approx(1000.5, rel=1e-6)
    assert not np.isnan(seen[CHANNEL]).any()
    assert "the clock's real step is" in done.notes.repairs[0]
