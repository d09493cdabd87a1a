"""What the binary formats hold beside plain numbers: their own times, scaled integers, lost samples, texts."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter

from railsim import Recording
from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.field.importing import import_file

SPEED, RATE = "gnss.speed [m/s]", "bogie.rate_pitch [rad/s]"
START = datetime(2024, 5, 3, 10, 0, 0, tzinfo=UTC)


def run(path: Path, tables: list[dict[str, Any]], guard: Guard) -> Recording:
    """Import with a map of these tables."""
    map_file, out = path.with_suffix(".yaml"), path.parent / "out"
    map_file.write_text(yaml.safe_dump({"origin": "test", "vehicle": "manchester", "tables": tables}))
    import_file(path, map_file, out, guard)
    return Recording.open(out)


def test_scaled_integers_and_invalid_samples_of_mdf4(guard: Guard, tmp_path: Path):
    """16 bits over 250 deg/s: what comes back is within half a step of what went in."""
    time = np.arange(500) / 100
    true = 200 * np.sin(time)
    step = 250 / 2**15
    invalid = np.isin(np.arange(500), [7, 8, 9])
    raw = np.round(true / step).astype(np.int16)
    conversion: Any = {"a": step, "b": 0.0}
    with MDF(version="4.10") as file:
        file.header.start_time = START
        file.append([Signal(raw, time, name="q", unit="deg/s", conversion=conversion, invalidation_bits=invalid)])
        file.save(tmp_path / "x.mf4")
    seen = run(tmp_path / "x.mf4", [{"time": {"kind": "own"}, "channels": {RATE: {"column": "q"}}}], guard).measurements
    found = np.rad2deg(seen[RATE])
    assert np.flatnonzero(np.isnan(found)).tolist() == [7, 8, 9]
    assert np.nanmax(np.abs(found - true)) <= step / 2 * (1 + 1e-9)
    assert seen.about["start"] == "2024-05-03T10:00:00+00:00"
    assert f"{RATE}: unit 'deg/s', as the file states" in seen.about["assumptions"]


def test_groups_of_tdms_that_begin_at_different_instants(guard: Guard, tmp_path: Path):
    """The second waveform begins 1.5 s after the first and stays there."""
    with TdmsWriter(tmp_path / "x.tdms") as file:
        for number, rate in enumerate([10, 50]):
            begin = np.datetime64(START.replace(tzinfo=None), "ms") + np.timedelta64(1500 * number, "ms")
            wave = {"wf_increment": 1 / rate, "wf_start_time": begin}
            file.write_segment([ChannelObject(f"g{number}", "v", np.arange(20.0), properties=wave)])
    tables = [
        {"group": "g0", "time": {"kind": "own"}, "channels": {SPEED: {"column": "v", "unit": "km/h"}}},
        {"group": 1, "time": {"kind": "own"}, "channels": {RATE: {"column": "v", "unit": "deg/s"}}},
    ]
    seen = run(tmp_path / "x.tdms", tables, guard).measurements
    assert seen.time(SPEED)[:2] == pytest.approx([0.0, 0.1])
    assert seen.time(RATE)[:2] == pytest.approx([1.5, 1.52])
    assert seen.about["start"] == "2024-05-03T10:00:00+00:00"
    with pytest.raises(InputError, match=r"the file has 2 groups \(0 'g0', 1 'g1'\); name one by 'group:'"):
        run(tmp_path / "x.tdms", [{k: v for k, v in tables[0].items() if k != "group"}], guard)
    with pytest.raises(InputError, match="no group 'g7'; there are: 'g"):
        run(tmp_path / "x.tdms", [tables[0] | {"group": "g7"}], guard)


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_instants_and_categories_of_parquet(guard: Guard, tmp_path: Path, zone: str | None):
    stamps = pd.date_range("2024-05-03 12:00", periods=40, freq="20ms", tz=zone)
    values = pd.Series(np.arange(40)).astype(str).astype("category")
    frame = pd.DataFrame({"at": stamps, "v": values, "w": np.arange(40, dtype=np.int16)})
    frame.to_parquet(tmp_path / "x.parquet")
    channels = {SPEED: {"column": "v", "unit": "m/s", "lost": ["7"]}, RATE: {"column": "w", "unit": "rad/s"}}
    seen = run(
        tmp_path / "x.parquet", [{"time": {"kind": "iso", "column": "at"}, "channels": channels}], guard
    ).measurements
    assert seen.about["start"] == ("2024-05-03T12:00:00+00:00" if zone is None else "2024-05-03T10:00:00+00:00")
    assert seen.rate(RATE) == 50.0
    np.testing.assert_array_equal(seen[RATE], np.arange(40))
    np.testing.assert_array_equal(seen[SPEED], np.where(np.arange(40) == 7, np.nan, np.arange(40)))


def test_units_of_parquet_fields_and_columns_of_lists(guard: Guard, tmp_path: Path):
    fields = [
        pa.field("t", pa.float64()),
        pa.field("v", pa.float32(), metadata={"unit": "mph"}),
        pa.field("l", pa.list_(pa.int8())),
    ]
    table = pa.table([np.arange(8.0), np.full(8, 50, np.float32), [[1]] * 8], schema=pa.schema(fields))
    pq.write_table(table, tmp_path / "x.parquet")
    tables = [{"time": {"kind": "seconds", "column": "t"}, "channels": {SPEED: {"column": "v"}}}]
    assert run(tmp_path / "x.parquet", tables, guard).measurements[SPEED] == pytest.approx(22.352)
    tables[0]["channels"][SPEED]["column"] = "l"
    with pytest.raises(InputError, match="column 'l' holds list"):
        run(tmp_path / "x.parquet", tables, guard)


def test_file_that_was_cut_while_it_was_written_is_said(guard: Guard, tmp_path: Path):
    path = tmp_path / "x.tdms"
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("g", "v", np.arange(1000.0), properties={"wf_increment": 0.1})])
    path.write_bytes(path.read_bytes()[:-800])
    seen = run(
        path, [{"time": {"kind": "own"}, "channels": {SPEED: {"column": "v", "unit": "m/s"}}}], guard
    ).measurements
    np.testing.assert_array_equal(seen[SPEED], np.arange(900.0))
    assert seen.about["repairs"] == ["the TDMS file ends within its last segment: what is there is taken"]
