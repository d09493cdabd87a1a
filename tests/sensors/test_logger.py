"""Errors of loggers: clock, packets, byte order and unit; a sound logger leaves every byte as it is."""

import struct
from pathlib import Path

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.sensors.errors import SensorErrors, sample_at
from railsim.sensors.logger import LoggerErrors, reversed_bytes, word
from railsim.sensors.suite import build_sensor, logged
from railsim.truth import TIME
from tests.sensors.synthetic import write_truth

RATE = 1024.0


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_a_sound_logger_is_not_written_and_a_faulty_one_is_but_not_on_the_data_sheet():
    assert "logger" not in SensorErrors(bias=1.0).model_dump(mode="json")
    faulty = SensorErrors.build({"logger": {"clock_scale": 1e-3}})
    assert faulty.model_dump(mode="json")["logger"]["clock_scale"] == 1e-3
    assert "logger" not in faulty.data_sheet()
    assert SensorErrors.build(faulty.model_dump(mode="json")) == faulty


def test_a_slow_clock_reads_a_sine_faster_and_loses_what_lies_after_the_run():
    """A sine of 5 Hz sampled 1 % too far apart is one of 5.05 Hz by the stamps."""
    time = np.arange(8 * 1024) / RATE
    logger = LoggerErrors(clock_scale=0.01)
    instants = logger.instants(time.size, RATE, rng())
    read = SensorErrors().apply(np.sin(2 * np.pi * 5.0 * time), RATE, 1, rng(), instants)
    kept = np.isfinite(read)
    assert kept.sum() == np.count_nonzero(time * 1.01 <= time[-1] + 1e-9)
    np.testing.assert_allclose(read[kept][50:-50], np.sin(2 * np.pi * 5.05 * time)[kept][50:-50], atol=1e-9)


def test_jitter_makes_an_error_of_slope_times_its_deviation():
    time = np.arange(64 * 1024) / RATE
    instants = LoggerErrors(clock_jitter=1e-4).instants(time.size, RATE, rng())
    read = SensorErrors().apply(3.0 * time, RATE, 1, rng(), instants)
    error = (read - 3.0 * time)[10:-10]
    assert np.nanstd(error) == pytest.approx(3e-4, rel=0.02)


def test_places_between_samples_are_exact_for_a_polynomial_of_fifth_order():
    values = np.arange(20.0) ** 5
    places = np.array([3.25, 10.5, 16.9])
    np.testing.assert_allclose(sample_at(values, places), places**5, rtol=1e-12)
    assert np.isnan(sample_at(values, np.array([19.5]))).all()


def test_packets_that_are_written_twice_move_what_follows():
    written = LoggerErrors(packet=10, repeated=1.0).rows(50, rng())
    assert written is not None
    np.testing.assert_array_equal(written, np.r_[0:10, 0:10, 10:20, 10:20, 20:30])


def test_overtaken_packets_change_places_and_nothing_is_lost():
    written = LoggerErrors(packet=10, reordered=1.0).rows(45, rng())
    assert written is not None
    np.testing.assert_array_equal(written, np.r_[10:20, 0:10, 30:40, 20:30, 40:45])


@pytest.mark.parametrize(("bits", "code"), [(16, "h"), (32, "i")])
def test_reversed_bytes_are_what_struct_reads_in_the_other_order(bits: int, code: str):
    counts = rng().integers(-(2 ** (bits - 1)), 2 ** (bits - 1), 200)
    read = [struct.unpack(">" + code, struct.pack("<" + code, int(one)))[0] for one in counts]
    np.testing.assert_allclose(reversed_bytes(counts * 0.01, 0.01, bits), np.array(read) * 0.01)


def test_the_word_holds_the_range():
    assert (word(1.33e-4, 4.36), word(1e-5, 78.5), word(0.1, None)) == (16, 32, 32)


def test_a_sensor_in_g_with_all_axes_of_a_packet_together(tmp_path: Path):
    settings = {"kind": "accelerometer", "name": "a", "body": "bogie", "rate": 256}
    truth = write_truth(tmp_path / "truth")
    sound, faulty = (
        build_sensor(settings | {"errors": {"preset": "mems"} | extra})
        for extra in ({}, {"logger": {"unit_scale": 1 / 9.80665, "packet": 16, "repeated": 0.3}})
    )
    plain = sound.measure(truth, rng())
    read = logged(faulty, faulty.measure(truth, rng()), rng(5))
    rows = faulty.errors.logger.rows(len(plain), rng(5).spawn(1)[0])
    assert rows is not None
    assert len(np.unique(rows)) < len(plain)
    for name in sound.channels():
        np.testing.assert_allclose(read[name], plain[name].to_numpy()[rows] / 9.80665)
    np.testing.assert_array_equal(read[TIME], plain[TIME])


def test_a_clock_that_is_off_by_more_than_a_tenth_is_refused():
    with pytest.raises(InputError, match="10 %"):
        LoggerErrors.build({"clock_scale": 0.2})


def test_a_scenario_without_a_faulty_logger_keeps_its_digest():
    values = {"track": "smooth", "vehicle": "class175", "speed": {"kind": "constant", "speed": 20.0}, "duration": 2.0}
    sensor = {"kind": "gyro", "name": "g", "body": "bogie", "rate": 256, "errors": "mems"}
    scenario = Scenario.build(values | {"sensors": [sensor]})
    assert "logger" not in str(scenario.sensors[0].settings())
