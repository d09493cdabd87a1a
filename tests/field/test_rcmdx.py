"""RCM-DX, the HDF5 of measuring trains: data sources, channels, their units in words, sessions."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from railsim.field.guard import Guard
from tests.field.imports import SPEED, UP, rate, refusal, run, values

TIME = np.arange(400) / 200
STAMPS = 1_714_730_400_000_000_000 + np.rint(TIME * 1e9).astype(np.int64)
AZ = np.round(1000 * np.sin(9 * TIME))
SESSION = "RCMDX/20240503_100000.000"


def rcmdx(path: Path, sessions: int = 1, stamps: np.ndarray = STAMPS) -> Path:
    """As the specification has it: attributes `Element`, chunks, compression, an integer channel."""
    with h5py.File(path, "w") as file:
        for number in range(sessions):
            session = file.create_group(SESSION if number == 0 else f"{SESSION[:-1]}{number}")
            session.attrs["Element"] = "SESSION"
            source = session.create_group("DFZ00/BOGIE/ACC")
            source.attrs["Element"] = "DATASOURCE"
            source.create_dataset("timestamp", data=stamps, chunks=(100,), compression="gzip")
            _channel(source, "AZ", AZ.astype(np.int32), "MillimeterPerSecondSquared")
            _channel(source, "FLAGS", np.zeros((400, 3), np.uint8), "")
            place = session.create_group("POSITION")
            place["timestamp"] = stamps[::200]
            place.create_dataset("vehicleSpeed", data=np.array([20.0, 20.5])).attrs["Unit"] = np.array(
                [b"KilometerPerHour"]
            )
    return path


def _channel(source: h5py.Group, name: str, data: np.ndarray, unit: str) -> None:
    group = source.create_group(name)
    group.attrs["Element"], group.attrs["TriggerMode"] = "CHANNEL", "TIME"
    group.create_dataset("data", data=data, chunks=True, compression="gzip").attrs["Unit"] = unit


def mapped(group: str = "ACC", column: str = "AZ", **more: Any) -> dict[str, Any]:
    table = {"group": group, "time": {"kind": "own"}, "channels": {UP: {"column": column}}} | more
    return {"origin": "test", "vehicle": "manchester", "tables": [table]}


@pytest.mark.parametrize("group", ["ACC", "BOGIE/ACC", f"{SESSION}/DFZ00/BOGIE/ACC", f"/{SESSION}/DFZ00/BOGIE/ACC"])
def test_channel_with_its_unit_and_instants(tmp_path: Path, guard: Guard, group: str):
    path = rcmdx(tmp_path / "run.rcmdx")
    both = mapped(group)
    speed = {"group": "POSITION", "time": {"kind": "own"}, "channels": {SPEED: {"column": "vehicleSpeed"}}}
    both["tables"].append(speed)
    seen = run(tmp_path, path, both, guard)
    np.testing.assert_allclose(values(seen), AZ / 1000, rtol=1e-14)
    assert rate(seen) == 200.0 and seen.measurements.about["start"] == "2024-05-03T10:00:00+00:00"
    np.testing.assert_allclose(values(seen, SPEED), np.array([20.0, 20.5]) / 3.6)
    np.testing.assert_allclose(seen.measurements.time(SPEED), [0.0, 1.0])
    by_data = run(tmp_path, path, mapped(column="AZ/data"), guard)
    np.testing.assert_array_equal(values(by_data), values(seen))


def test_sessions_are_named_in_full(tmp_path: Path, guard: Guard):
    path = rcmdx(tmp_path / "run.rcmdx", sessions=2)
    line = refusal(tmp_path, path, mapped(), guard)
    assert "2 groups end with 'ACC'" in line and f"'{SESSION}/DFZ00/BOGIE/ACC'" in line and "name one in full" in line
    assert values(run(tmp_path, path, mapped(f"{SESSION}/DFZ00/BOGIE/ACC"), guard)).size == 400


def test_what_is_not_there(tmp_path: Path, guard: Guard):
    path = rcmdx(tmp_path / "run.rcmdx")
    assert "no column 'AX'; there are: " in refusal(tmp_path, path, mapped(column="AX"), guard)
    assert "'FLAGS' is no single column; name one of 'FLAGS/data(:,1)'" in refusal(
        tmp_path, path, mapped(column="FLAGS"), guard
    )
    line = refusal(tmp_path, path, mapped("BOGIE", "ACC/AZ"), guard)
    assert f"'{SESSION}/DFZ00/BOGIE' has no time axis of its own" in line and "groups with one are" in line


def test_triggered_by_distance_the_rows_are_resampled(tmp_path: Path, guard: Guard):
    """The train brakes: stamps follow each other ever more slowly; the cure of the message works."""
    late = STAMPS + np.rint(2e8 * TIME**2).astype(np.int64)
    path = rcmdx(tmp_path / "run.rcmdx", stamps=late)
    assert "write 'repair: [resample]' in place of snap" in refusal(tmp_path, path, mapped(repair=["snap"]), guard)
    seen = run(tmp_path, path, mapped(rate=150, repair=["resample"]), guard)
    when = seen.measurements.time(UP)
    inside = values(seen)
    stamps = (late - late[0]) * 1e-9
    np.testing.assert_allclose(inside, np.interp(when, stamps, AZ) / 1000, atol=0.01)
