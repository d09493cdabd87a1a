"""The benchmark of a day of data, on minutes of it."""

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from experiments.benchmarks import day
from experiments.benchmarks.day import day_rows, measured, steps, tree_memory
from experiments.benchmarks.day_data import write_day
from experiments.cli import main
from railsim.errors import InputError


@pytest.mark.parametrize("ending", [".parquet", ".csv"])
def test_a_day_has_twelve_channels_and_times_that_go_on(ending: str, tmp_path: Path):
    path = tmp_path / f"day{ending}"
    mapped = write_day(path, 50.0, piece=20.0)
    table = pd.read_csv(path) if ending == ".csv" else pd.read_parquet(path)
    assert len(table) == 50 * 256 and len(table.columns) == 13
    assert table["time [s]"].diff().dropna().to_numpy() == pytest.approx(1 / 256, rel=1e-4)
    assert len(mapped["tables"][0]["channels"]) == 12 and (tmp_path / "map.yaml").is_file()


def test_every_step_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(day, "ESTIMATORS", ("speed_refined", "alignment_vertical"))
    rows = day_rows(80.0 / 3600.0, folder=tmp_path)
    named = {row["name"]: row["value"] for row in rows}
    wanted = steps(tmp_path, tmp_path / "day.parquet")
    assert all(any(name.startswith(f"{step},") for name in named) for step in wanted)
    assert (tmp_path / "condition" / "condition.html").is_file()
    assert all(0.1 < value < 2.0 for name, value in named.items() if name.endswith("memory"))
    assert named["most memory of it"] == max(value for name, value in named.items() if name.endswith(", memory"))


def test_memory_counts_the_whole_tree_of_processes():
    child = "import time; held = bytearray(150_000_000); time.sleep(20)"
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    with subprocess.Popen([sys.executable, "-c", parent]) as process:
        most = 0.0
        while most < 150e6 and process.poll() is None:
            most = max(most, tree_memory(process.pid))
        for one in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
            subprocess.run(["kill", one], check=True)
    assert 150e6 <= most < 400e6


def test_a_command_that_fails_is_told(tmp_path: Path):
    with pytest.raises(InputError, match="failed: railsim: "):
        measured(["inspect", str(tmp_path / "nothing")])
    assert main(["bench", "--day", "-1"]) == 2
