"""The reading process: limits on time and memory, missing extras."""

import importlib
import os
import signal
import struct
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from railsim.errors import InputError
from railsim.field.guard import Answer, Guard
from railsim.field.readers.interface import Wanted

WANTED = [Wanted(None, ("a",))]


@pytest.mark.parametrize(("kind", "package"), [("mdf4", "asammdf"), ("tdms", "nptdms")])
def test_missing_extra_is_named(kind: str, package: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=r"not installed: pip install 'railsim\[field\]'"):
        importlib.import_module(f"railsim.field.readers.{kind}").read(tmp_path / "x", WANTED)


def tdms(count: int, rows: int = 4) -> bytes:
    """A TDMS segment that states `count` doubles of channel /'g'/'a' and holds `rows`."""
    paths = [b"/", b"/'g'", b"/'g'/'a'"]
    objects = b"".join(struct.pack("<I", len(p)) + p + struct.pack("<II", 0xFFFFFFFF, 0) for p in paths[:2])
    objects += (
        struct.pack("<I", len(paths[2])) + paths[2] + struct.pack("<IIIQ", 20, 10, 1, count) + struct.pack("<I", 0)
    )
    meta = struct.pack("<I", 3) + objects
    raw = struct.pack(f"<{rows}d", *range(rows))
    return struct.pack("<4sIIQQ", b"TDSm", 0x2 | 0x4 | 0x8, 4713, len(meta) + 8 * count, len(meta)) + meta + raw


def test_whole_file_of_the_builder_is_read(guard: Guard, tmp_path: Path):
    path = tmp_path / "whole.tdms"
    path.write_bytes(tdms(4))
    table = guard.read("tdms", path, WANTED)[0]
    assert list(table.columns["a"].values) == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize("count", [10**6, 10**9, 10**12, 2**60])
def test_huge_declared_size_neither_hangs_nor_takes_the_memory(guard: Guard, tmp_path: Path, count: int):
    path = tmp_path / "huge.tdms"
    path.write_bytes(tdms(count))
    try:
        table = guard.read("tdms", path, WANTED)[0]
    except InputError as error:
        assert "huge.tdms" in str(error)
        assert "\n" not in str(error)
    else:
        assert table.cut_short
        assert list(table.columns["a"].values) == [0.0, 1.0, 2.0, 3.0]


def test_reader_that_hangs_is_ended(tmp_path: Path):
    """A pipe that nobody writes to stands for a reader that never comes back."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with Guard(seconds=2.0) as guard, pytest.raises(InputError, match="no end of reading after 2 s"):
        guard.read("parquet", path, WANTED)


def test_reader_that_spins_is_ended():
    with subprocess.Popen([sys.executable, "-c", "while True: pass"], stdout=subprocess.PIPE) as process:
        with pytest.raises(TimeoutError):
            Answer(process, 0.5).line()
        process.kill()


def test_reader_that_gets_no_processor_for_longer_than_its_time_is_waited_for():
    """A stopped process stands for one that other load keeps waiting."""
    with subprocess.Popen([sys.executable, "-S", "-c", "print('done')"], stdout=subprocess.PIPE) as process:
        process.send_signal(signal.SIGSTOP)
        threading.Timer(1.2, process.send_signal, [signal.SIGCONT]).start()
        assert Answer(process, 0.5).line() == b"done"


def test_reader_that_dies_is_said_and_the_next_file_is_read(tmp_path: Path):
    path = tmp_path / "whole.tdms"
    path.write_bytes(tdms(4))
    with Guard() as guard:
        with pytest.raises(InputError, match="stops the nonsense reader|damaged|not a whole"):
            guard.read("nonsense", path, WANTED)
        assert len(guard.read("tdms", path, WANTED)) == 1


def test_a_limit_counts_what_is_used_not_what_an_allocator_sets_aside(tmp_path: Path):
    path = tmp_path / "equal.parquet"
    pd.DataFrame({"a": np.zeros(1_000_000)}).to_parquet(path)
    with Guard(memory=280_000_000) as guard:
        for _ in range(3):
            assert np.asarray(guard.read("parquet", path, WANTED)[0].columns["a"].values).size == 1_000_000
