"""Sets of sensors: streams of their own, clear refusals, and a conformance test of every kind there is."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from railsim.errors import InputError
from railsim.recording import Recording, write_recording
from railsim.sensors.errors import SensorErrors
from railsim.sensors.interface import SENSORS, Sensor
from railsim.sensors.suite import build_sensor, build_sensors, data_sheets, measure_all
from railsim.truth import Truth
from tests.sensors.synthetic import write_truth

NOISY = {"noise_density": 1e-3}
BOGIE = {"kind": "accelerometer", "name": "bogie", "body": "bogie", "axes": "z", "rate": 256, "errors": NOISY}
PITCH = {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": "pitch", "rate": 256, "errors": NOISY}
SPRING = {"kind": "displacement", "name": "primary1_left", "rate": 128, "errors": "transducer"}
TACHO = {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 256}
GNSS = {"kind": "gnss", "name": "gnss", "body": "bogie", "rate": 8}
ABOUT = {"origin": "made by a test", "vehicle": {"name": "test"}}


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Truth:
    return write_truth(tmp_path_factory.mktemp("run") / "truth")


def test_one_table_a_rate_with_its_channels(truth: Truth) -> None:
    frames = measure_all(build_sensors([BOGIE, PITCH, SPRING, TACHO]), truth, 1)
    assert list(frames) == [128.0, 256.0]
    assert list(frames[128.0]) == ["time [s]", "primary1_left.displacement [m]"]
    assert list(frames[256.0])[1:3] == ["bogie.acceleration_z [m/s2]", "bogie.rate_pitch [rad/s]"]
    np.testing.assert_array_equal(frames[256.0]["time [s]"], truth.time[::4])


def test_adding_a_sensor_leaves_the_others_as_they_were(truth: Truth) -> None:
    few = measure_all(build_sensors([PITCH]), truth, 1)[256.0]
    many = measure_all(build_sensors([TACHO, BOGIE, SPRING, PITCH]), truth, 1)[256.0]
    pd.testing.assert_frame_equal(few, many.loc[:, list(few)])
    other_seed = measure_all(build_sensors([PITCH]), truth, 2)[256.0]
    assert not few.equals(other_seed)


def test_sensors_do_not_share_their_noise(truth: Truth) -> None:
    frame = measure_all(build_sensors([BOGIE, PITCH, BOGIE | {"name": "bogie2"}]), truth, 1)[256.0]
    correlation = np.corrcoef(frame.iloc[:, 1:].to_numpy().T) - np.eye(3)
    assert np.abs(correlation).max() < 5 / np.sqrt(len(frame))


def test_same_seed_same_bytes(truth: Truth, tmp_path: Path) -> None:
    suite = build_sensors([BOGIE, PITCH, SPRING, TACHO])
    about = ABOUT | {"sensors": data_sheets(suite)}
    folders = [write_recording(tmp_path / name, measure_all(suite, truth, 7), about) for name in ("a", "b")]
    for name in ("measured/256hz.parquet", "measured/128hz.parquet", "about.json"):
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ([BOGIE, BOGIE], r"an? accelerometer and an? accelerometer both give 'bogie.acceleration_z \[m/s2\]'; rename"),
        ([{"kind": "sonar", "name": "a"}], "unknown sensor 'sonar'; there are: accelerometer, displacement"),
        ([{"name": "a"}], "a sensor needs a kind; give one of: accelerometer"),
        ([BOGIE | {"rate": 300}], "300 Hz does not divide the run's 1024 Hz; use 32, 64, 128, 256, 512, 1024 Hz"),
        ([BOGIE | {"rate": 2048}], "use 32, 64, 128, 256, 512, 1024 Hz"),
        ([BOGIE | {"rate": -1}], "sensors.bogie.rate: Input should be greater than 0"),
        ([BOGIE | {"body": "bogey"}], "the run has no body 'bogey'; there are: body, bogie, wheelset1"),
        ([BOGIE | {"colour": "red"}], "sensors.bogie.colour: unknown key"),
        ([BOGIE | {"name": "the bogie"}], "name: String should match pattern"),
        ([BOGIE | {"errors": "gold"}], "unknown preset 'gold'; there are: axlebox, industrial, mems"),
        ([BOGIE | {"errors": {"noise": 1}}], "noise: unknown key; SensorErrors knows"),
        ([BOGIE | {"errors": 3}], "give the fields of the error model or the name of a preset"),
        ([TACHO | {"body": "bogie"}], "a tachometer on 'bogie' measures 'bogie.spin_angle"),
        ([TACHO | {"pulses": 0}], "pulses: Input should be greater than or equal to 1"),
        ([TACHO | {"radius_error": -1}], "radius_error: Input should be greater than -1"),
        *(
            ([GNSS | {std: -0.5}], f"{std}: Input should be greater than or equal to 0")
            for std in ("speed_std", "position_std", "height_std", "drift_std")
        ),
        ([SPRING | {"name": "primary9"}], "the run has no element 'primary9'; give \"across\", one of: primary1_left"),
        ([SPRING | {"errors": {"misalignment_std": 1e-3}}], "'misalignment_std' means nothing for this kind"),
    ],
)
def test_what_cannot_be_measured_is_one_clear_line(truth: Truth, settings: list[Any], line: str) -> None:
    with pytest.raises(InputError, match=line) as caught:
        measure_all(build_sensors(settings), truth, 1)
    assert "\n" not in str(caught.value)


def test_run_without_a_wheel_radius_is_refused(truth: Truth) -> None:
    bare = Truth(truth.folder, truth.rate, len(truth), truth.columns, {})
    with pytest.raises(InputError, match="states no 'wheel_radius"):
        measure_all(build_sensors([TACHO]), bare, 1)


def test_rates_of_an_odd_run_are_named() -> None:
    run = Truth(Path("nowhere"), 1000 / 3, 10, ["time [s]"], {})
    with pytest.raises(InputError, match=r"use .*111\.111, 166\.667, 333\.333 Hz"):
        build_sensor(BOGIE | {"rate": 200}).step(run)


def test_preset_can_be_changed_field_by_field() -> None:
    changed = build_sensor(BOGIE | {"errors": {"preset": "mems", "bandwidth": 50}})
    whole = build_sensor(BOGIE | {"errors": "mems"})
    assert changed.errors == whole.errors.but(bandwidth=50.0)


@pytest.fixture(params=sorted(SENSORS.classes()))
def sensor(request: pytest.FixtureRequest) -> Sensor:
    """Every kind with as little said as possible, at a place where each finds something to measure."""
    return build_sensor({"kind": request.param, "name": "primary1_left", "body": "wheelset1", "rate": 256})


class TestEveryKind:
    def test_table_is_what_it_promises(self, sensor: Sensor, truth: Truth) -> None:
        table = sensor.measure(truth, np.random.default_rng(1))
        assert list(table) == ["time [s]", *sensor.channels()]
        assert sensor.channels()
        for name in sensor.channels():
            assert re.fullmatch(r"primary1_left\.[a-z_]+ \[[^\]]+\]", name)
            assert table[name].dtype == np.float64
        assert np.isfinite(table.to_numpy()).all()
        np.testing.assert_array_equal(table["time [s]"], truth.time[::4])

    def test_same_stream_same_numbers(self, sensor: Sensor, truth: Truth) -> None:
        tables = [sensor.measure(truth, np.random.default_rng(3)) for _ in range(2)]
        pd.testing.assert_frame_equal(tables[0], tables[1], check_exact=True)

    def test_settings_make_the_same_sensor(self, sensor: Sensor) -> None:
        again = build_sensor(json.loads(json.dumps(sensor.settings())))
        assert again == sensor
        assert (hash(again), again.digest()) == (hash(sensor), sensor.digest())
        assert sensor.settings()["kind"] == sensor.kind

    def test_cannot_be_changed(self, sensor: Sensor) -> None:
        with pytest.raises(ValueError, match="frozen"):
            sensor.rate = 1.0  # pyright: ignore[reportAttributeAccessIssue]

    def test_data_sheet_is_json_without_secrets(self, sensor: Sensor) -> None:
        sheet = json.loads(json.dumps(sensor.data_sheet(), allow_nan=False))
        assert {"kind", "name", "body", "position", "rate", "errors", "channels"} <= set(sheet)
        assert not sensor.hidden & set(sheet)
        assert not SensorErrors.hidden & set(sheet["errors"])

    def test_its_recording_knows_the_sensor(self, sensor: Sensor, truth: Truth, tmp_path: Path) -> None:
        frames = measure_all([sensor], truth, 1)
        write_recording(tmp_path / "recording", frames, ABOUT | {"sensors": data_sheets([sensor])})
        seen = Recording.open(tmp_path / "recording").measurements
        assert seen.channels == sensor.channels()
        for name in seen.channels:
            assert seen.sensor(name) == json.loads(json.dumps(sensor.data_sheet()))

    def test_refuses_rates_and_bodies_that_the_run_has_not(self, sensor: Sensor, truth: Truth) -> None:
        for wrong in [sensor.but(rate=255.0), sensor.but(body="nobody")]:
            with pytest.raises(InputError, match="sensor 'primary1_left'"):
                wrong.measure(truth, np.random.default_rng(1))

    def test_presets_fit_the_kind(self, sensor: Sensor, truth: Truth) -> None:
        for name, errors in sensor.presets.items():
            made = build_sensor(sensor.settings() | {"errors": name})
            assert made.errors == errors
            assert len(made.measure(truth, np.random.default_rng(1)))

    def test_every_field_states_unit_and_source(self, sensor: Sensor) -> None:
        for spec in (type(sensor), SensorErrors):
            for name in spec.model_fields:
                unit, source = spec.about(name)
                assert unit, name
                assert source, name

    def test_is_documented(self, sensor: Sensor) -> None:
        assert type(sensor).__doc__ != Sensor.__doc__
        assert len(type(sensor).__doc__ or "") > 40
