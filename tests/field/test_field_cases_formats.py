"""Axes that a format has of its own, and several files of one recording."""

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
from asammdf.blocks.v4_blocks import ChannelConversion
from asammdf.blocks.v4_constants import CONVERSION_TYPE_LIN
from nptdms import ChannelObject, TdmsWriter

from experiments.cli import main
from railsim import Recording
from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.field.importing import import_file
from tests.field.imports import SPEED, UP, csv, followed, mapped, proposed, rate, refusal, run, time, told, values

AT = np.arange(400)
AZ = 9.8 + 0.01 * np.sin(AT)
OWN = {"kind": "own"}


def tdms(path: Path, waves: dict[str, dict[str, Any]]) -> Path:
    """Channels of one group with the properties of their waveforms."""
    with TdmsWriter(path) as file:
        channels = [
            ChannelObject("G", name, AZ, properties={"unit_string": "m/s^2"} | own) for name, own in waves.items()
        ]
        file.write_segment(channels)
    return path


def mdf(path: Path, *groups: dict[str, Any], version: str = "4.10", start: datetime | None = None) -> Path:
    """Groups with a channel az over their master."""
    with MDF(version=version) as file:
        file.header.start_time = start or datetime(2024, 5, 3, 10, tzinfo=UTC)
        for number, group in enumerate(groups):
            extra = [Signal(group["also"], AT / 100, name="clock", unit="s")] if "also" in group else []
            file.append(
                [Signal(AZ + number, AT / 100, name="az", unit="m/s^2"), *extra], comment=group.get("comment", "")
            )
            for key, value in group.get("master", {}).items():
                setattr(file.groups[number].channels[0], key, value)
            if "acq_name" in group:
                changed: Any = file.groups[number].channel_group
                changed.acq_name = group["acq_name"]
        group = groups[0].get("flags")
        if group is not None:
            header: Any = file.header
            header.time_flags = group
        file.save(path, overwrite=True)
    return path


def test_tdms_channels_of_different_increments_get_a_table_each(guard: Guard, tmp_path: Path):
    path = tdms(tmp_path / "x.tdms", {"az": {"wf_increment": 0.01}, "v": {"wf_increment": 0.1}})
    both = mapped(OWN, group="G")
    both["tables"][0]["channels"][SPEED] = {"column": "v", "unit": "m/s", "other_unit_in_file": True}
    line = refusal(tmp_path, path, both, guard)
    assert "'az' every 0.01 s" in line and "'v' every 0.1 s" in line
    assert proposed(line, "group: ") == {"group": "G"} and proposed(line, "time:") == {"time": OWN}
    apart = mapped(OWN, group="G")
    apart["tables"].append({"group": "G", "time": OWN, "channels": {SPEED: both["tables"][0]["channels"][SPEED]}})
    seen = run(tmp_path, path, apart, guard)
    assert (time(seen)[-1], time(seen, SPEED)[-1]) == pytest.approx((3.99, 39.9))


@pytest.mark.parametrize(
    "wave",
    [{"wf_start_offset": -2.0}, {"wf_start_offset": -2000.0, "wf_increment": 10.0, "wf_xunit_string": "ms"}],
)
def test_tdms_offset_and_unit_of_the_axis(guard: Guard, tmp_path: Path, wave: dict[str, Any]):
    start = {"wf_start_time": np.datetime64("2024-05-03T08:00:00", "us"), "wf_increment": 0.01}
    seen = run(tmp_path, tdms(tmp_path / "x.tdms", {"az": start | wave}), mapped(OWN, group="G"), guard)
    assert seen.measurements.about["start"] == "2024-05-03T07:59:58+00:00"
    assert rate(seen) == 100.0
    np.testing.assert_allclose(time(seen), AT / 100, atol=1e-9)


def test_tdms_spectrum_is_no_recording(guard: Guard, tmp_path: Path):
    path = tdms(tmp_path / "x.tdms", {"az": {"wf_increment": 0.5, "wf_xunit_string": "Hz"}})
    assert "is in 'Hz' (wf_xunit_string), no time" in refusal(tmp_path, path, mapped(OWN, group="G"), guard)


def test_tdms_scaled_integers(guard: Guard, tmp_path: Path):
    """16 bits with two linear scales of the driver."""
    scale = {
        "NI_Number_Of_Scales": np.int32(2), "NI_Scaling_Status": "unscaled", "wf_increment": 0.01,
        "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.001,
        "NI_Scale[0]_Linear_Y_Intercept": 0.0, "NI_Scale[0]_Linear_Input_Source": np.uint32(0xFFFFFFFF),
        "NI_Scale[1]_Scale_Type": "Linear", "NI_Scale[1]_Linear_Slope": 9.80665,
        "NI_Scale[1]_Linear_Y_Intercept": 0.0, "NI_Scale[1]_Linear_Input_Source": np.uint32(0),
    }  # fmt: skip
    with TdmsWriter(tmp_path / "x.tdms") as file:
        raw = (1000 * np.sin(AT)).astype(np.int16)
        file.write_segment([ChannelObject("G", "az", raw, properties={"unit_string": "m/s^2"} | scale)])
    seen = run(tmp_path, tmp_path / "x.tdms", mapped(OWN, group="G"), guard)
    np.testing.assert_allclose(values(seen), raw * 9.80665e-3)


@pytest.mark.parametrize("zone", [None, "Europe/Berlin", "+09:00"])
def test_mdf_start_in_local_time(guard: Guard, tmp_path: Path, zone: str | None):
    path = mdf(tmp_path / "x.mf4", {"flags": 1}, start=datetime(2024, 5, 3, 10, tzinfo=UTC))
    seen = run(tmp_path, path, mapped(OWN | ({"zone": zone} if zone else {}), group=0), guard)
    hour = {None: 10, "Europe/Berlin": 8, "+09:00": 1}[zone]
    assert seen.measurements.about["start"] == f"2024-05-03T{hour:02d}:00:00+00:00"
    assert told(seen, "in local time") == (zone is None)


def test_mdf_over_distance_is_refused(guard: Guard, tmp_path: Path):
    master = {"sync_type": 3, "unit": "m", "name": "way"}
    bare = refusal(tmp_path, mdf(tmp_path / "x.mf4", {"master": master}), mapped(OWN, group=0), guard)
    assert "'way' [m], is a distance, no time" in bare
    path = mdf(tmp_path / "y.mf4", {"master": master, "also": AT / 50.0})
    line = refusal(tmp_path, path, mapped(OWN, group=0), guard)
    assert rate(run(tmp_path, path, followed(mapped(OWN, group=0), proposed(line, "time:")), guard)) == 50.0


def test_mdf_over_an_index_takes_the_rate_of_the_map(guard: Guard, tmp_path: Path):
    path = mdf(tmp_path / "x.mf4", {"master": {"sync_type": 4, "unit": ""}})
    line = refusal(tmp_path, path, mapped(OWN, group=0), guard)
    seen = run(tmp_path, path, followed(mapped(OWN, group=0, rate=200), proposed(line, "time:")), guard)
    assert rate(seen) == 200.0 and values(seen).size == AT.size


def test_mdf_3(guard: Guard, tmp_path: Path):
    seen = run(tmp_path, mdf(tmp_path / "x.mdf", {}, version="3.30"), mapped(OWN, group=0), guard)
    np.testing.assert_allclose(values(seen), AZ)
    assert rate(seen) == 100.0


@pytest.mark.parametrize("named", ["comment", "acq_name"])
def test_mdf_groups_by_comment_or_name(guard: Guard, tmp_path: Path, named: str):
    path = mdf(tmp_path / "x.mf4", *({named: f"axle {number}"} for number in (1, 2, 3)))
    line = refusal(tmp_path, path, mapped(OWN), guard)
    assert "1 'axle 2': time az" in line
    by_number = run(tmp_path, path, followed(mapped(OWN), proposed(line, "group: ")), guard)
    np.testing.assert_allclose(values(by_number), AZ)
    np.testing.assert_allclose(values(run(tmp_path, path, mapped(OWN, group="axle 2"), guard)), AZ + 1)


def test_mdf_groups_of_one_name_go_by_number(guard: Guard, tmp_path: Path):
    path = mdf(tmp_path / "x.mf4", *({"acq_name": "CAN"} for _ in range(2)))
    line = refusal(tmp_path, path, mapped(OWN, group="CAN"), guard)
    assert "2 groups 'CAN'" in line
    np.testing.assert_allclose(values(run(tmp_path, path, followed(mapped(OWN), proposed(line, "group: ")), guard)), AZ)


def test_mdf_text_in_place_of_a_value_is_lost(guard: Guard, tmp_path: Path):
    conversion: Any = {"val_0": 255.0, "text_0": b"signal not available", "default": b""}
    raw = np.where(AT < 10, 255, AT % 50).astype(np.uint8)
    path = tmp_path / "x.mf4"
    with MDF(version="4.10") as file:
        file.append([Signal(raw, AT / 100, name="az", unit="m/s^2", conversion=conversion)], acq_name="g")
        written: Any = file.groups[0].channels[1].conversion
        linear = ChannelConversion(conversion_type=CONVERSION_TYPE_LIN, a=0.02, b=-1.0)
        written.referenced_blocks["default_addr"] = linear
        file.save(path)
    seen = run(tmp_path, path, mapped(OWN, group=0), guard)
    np.testing.assert_allclose(values(seen), np.where(AT < 10, np.nan, 0.02 * raw - 1))


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_parquet_instants_without_a_zone_take_that_of_the_map(guard: Guard, tmp_path: Path, zone: str | None):
    frame = pd.DataFrame({"t": pd.date_range("2024-05-03 12:00", periods=400, freq="10ms"), "az": AZ})
    frame.to_parquet(tmp_path / "x.parquet")
    asked = mapped({"kind": "iso", "column": "t"} | ({"zone": zone} if zone else {}))
    seen = run(tmp_path, tmp_path / "x.parquet", asked, guard)
    assert seen.measurements.about["start"] == f"2024-05-03T{10 if zone else 12}:00:00+00:00"
    assert told(seen, "without a zone")


@pytest.mark.parametrize("kind", ["duration", "time"])
def test_parquet_durations(guard: Guard, tmp_path: Path, kind: str):
    ticks = pa.array((10 * AT).tolist(), type=pa.int32() if kind == "time" else pa.int64())
    column = ticks.cast(pa.time32("ms") if kind == "time" else pa.duration("ms"))
    pq.write_table(pa.table({"t": column, "az": AZ}), tmp_path / "x.parquet")
    seen = run(tmp_path, tmp_path / "x.parquet", mapped(), guard)
    np.testing.assert_allclose(time(seen), AT / 100, atol=1e-12)
    assert told(seen, "durations")


def phone(folder: Path) -> dict[str, Any]:
    """Files of one phone, one a sensor, by the seconds since it began; and the map to them."""
    (folder / "Accelerometer.csv").write_text(csv({"t": AT / 100, "az": AZ}))
    (folder / "Gyroscope.csv").write_text(csv({"t": (AT + 0.5) / 50, "x": 0.1 * np.sin(AT)}))
    (folder / "Location.csv").write_text(csv({"t": 0.5 + np.arange(4), "speed": 15 + 0.1 * np.arange(4)}))
    base = {"kind": "seconds", "column": "t"}
    pitch = {"body.rate_pitch [rad/s]": {"column": "x", "unit": "rad/s"}}
    asked = mapped(file="Accelerometer.csv")
    asked["tables"] += [
        {"file": "Gyroscope.csv", "time": base, "channels": pitch},
        {"file": "Location.csv", "time": base, "channels": {SPEED: {"column": "speed", "unit": "m/s"}}},
    ]
    return asked


@pytest.mark.parametrize("given", ["folder", "first", "all"])
def test_phone_with_a_file_a_sensor(tmp_path: Path, given: str):
    asked = phone(tmp_path)
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(asked))
    names = {"folder": ["."], "first": ["Gyroscope.csv"], "all": ["Location.csv", "Gyroscope.csv", "Accelerometer.csv"]}
    paths = [str(tmp_path / name) for name in names[given]]
    assert main(["import", *paths, "--map", str(tmp_path / "map.yaml"), "--out", str(tmp_path / "out")]) == 0
    seen = Recording.open(tmp_path / "out")
    assert (rate(seen), rate(seen, "body.rate_pitch [rad/s]"), rate(seen, SPEED)) == (100.0, 50.0, 1.0)
    assert time(seen, SPEED)[0] == pytest.approx(0.5)
    np.testing.assert_allclose(values(seen, SPEED), 15 + 0.1 * np.arange(4))
    files = seen.measurements.about["import"]["files"]
    assert [one["file"] for one in files] == ["Accelerometer.csv", "Gyroscope.csv", "Location.csv"]
    assert told(seen, "clocks of the files are one")


def test_file_that_no_table_reads_is_named_with_the_line_to_write(tmp_path: Path):
    asked = phone(tmp_path)
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(asked | {"tables": [mapped()["tables"][0]]}))
    paths = [str(tmp_path / name) for name in ("Accelerometer.csv", "Location.csv")]
    with pytest.raises(InputError, match="no table reads 'Location.csv'") as caught:
        import_file(paths, tmp_path / "map.yaml", tmp_path / "out")
    assert proposed(str(caught.value), "file:") == {"file": "Location.csv"}


def test_files_that_share_no_time_are_refused_unless_moved(tmp_path: Path):
    asked = phone(tmp_path)
    late = csv({"t": 1000.5 + np.arange(4), "speed": 15 + 0.1 * np.arange(4)})
    (tmp_path / "Location.csv").write_text(late)
    line = refusal(tmp_path, tmp_path / "Accelerometer.csv", asked)
    assert "no time in common" in line and "'time_offset'" in line
    moved = followed(asked, {"time_offset": -1000.0}, 2)
    assert time(run(tmp_path, tmp_path / "Accelerometer.csv", moved), SPEED)[0] == pytest.approx(0.5)


def test_file_beyond_the_folder_is_refused(tmp_path: Path):
    asked = phone(tmp_path)
    line = refusal(tmp_path, tmp_path / "Accelerometer.csv", followed(asked, {"file": "../secret.csv"}, 1))
    assert "leave folders out" in line
    assert UP in str(asked)


def test_tables_of_one_rate_at_different_times_come_to_one_axis(tmp_path: Path):
    asked = phone(tmp_path)
    (tmp_path / "Gyroscope.csv").write_text(csv({"t": (AT + 0.3) / 100, "x": 0.1 * np.sin(0.1 * AT)}))
    line = refusal(tmp_path, tmp_path / "Accelerometer.csv", asked)
    cured = followed(asked, proposed(line, "repair:"), 1)
    seen = run(tmp_path, tmp_path / "Accelerometer.csv", cured)
    turn = values(seen, "body.rate_pitch [rad/s]")
    np.testing.assert_allclose(turn[1:], 0.1 * np.sin(0.1 * (AT[1:] - 0.3)), atol=1e-4)
    assert np.isnan(turn[0]) and rate(seen, "body.rate_pitch [rad/s]") == 100.0


def test_instants_of_parquet_are_not_taken_for_numbers(guard: Guard, tmp_path: Path):
    frame = pd.DataFrame({"t": pd.date_range("2024-05-03 12:00", periods=400, freq="10ms", tz="UTC"), "az": AZ})
    frame.to_parquet(tmp_path / "x.parquet")
    line = refusal(tmp_path, tmp_path / "x.parquet", mapped({"kind": "seconds", "column": "t", "unit": "ms"}), guard)
    seen = run(tmp_path, tmp_path / "x.parquet", followed(mapped(), proposed(line, "time:")), guard)
    assert rate(seen) == 100.0 and seen.measurements.about["start"] == "2024-05-03T12:00:00+00:00"


def test_rows_of_several_sensors_in_parquet(guard: Guard, tmp_path: Path):
    mixed = {"t": np.repeat(AT / 100, 2), "sensor": ["acc", "gyro"] * AT.size, "az": np.c_[AZ, 0 * AZ].ravel()}
    pd.DataFrame(mixed).to_parquet(tmp_path / "x.parquet")
    assert "'rows: {where: ...}'" in refusal(tmp_path, tmp_path / "x.parquet", mapped(), guard)
    cured = followed(mapped(), {"rows": {"where": {"sensor": "acc"}}})
    np.testing.assert_allclose(values(run(tmp_path, tmp_path / "x.parquet", cured, guard)), AZ)
