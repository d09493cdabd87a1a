"""Samples on one even grid: other rates, late starts, gaps, dead stretches; what cannot be used is named."""

import numpy as np

from experiments.discrepancy.recording.samples import even, grid_rate, sampled
from railsim.measurements import Measurements
from railsim.sensors.suite import build_sensor

TONES = ((7.0, 1.0, 0.3), (31.0, 0.2, 1.1))  # Hz, amplitude, phase


def _signal(time: np.ndarray) -> np.ndarray:
    return sum((a * np.sin(2.0 * np.pi * f * time + p) for f, a, p in TONES), np.zeros_like(time))


def _recording(**columns: np.ndarray) -> Measurements:
    """Accelerometer at 256 Hz from time 0 on, a gyro at 200 Hz that begins 0.3033 s later."""
    fast, late = np.arange(0.0, 20.0, 1.0 / 256.0), 0.3033 + np.arange(0.0, 19.0, 1.0 / 200.0)
    tables = {
        256.0: {"time [s]": fast, "bogie.acceleration_y [m/s2]": columns.get("y", _signal(fast))},
        200.0: {"time [s]": late, "bogie.rate_yaw [rad/s]": columns.get("yaw", _signal(late))},
    }
    return Measurements({"origin": "test", "vehicle": {}, "sensors": []}, tables)


def _sensors() -> list:
    accelerometer = {"kind": "accelerometer", "name": "bogie", "body": "bogie", "axes": ["y"], "rate": 256}
    gyro = {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": ["yaw"], "rate": 200}
    return [build_sensor(one, "test") for one in (accelerometer, gyro)]


def test_tables_of_different_rates_and_starts_come_on_one_clock():
    found = sampled(_recording(), _sensors(), 1024.0)
    assert found.rates == {"bogie.acceleration_y [m/s2]": 256.0, "bogie.rate_yaw [rad/s]": 256.0}
    assert found.slowest == 200.0
    for name, values in found.values.items():
        instants = found.begin + np.arange(len(values)) / found.rates[name]
        good = np.isfinite(values)
        assert good.mean() > 0.98, name
        inner = slice(20, -20)
        assert np.nanmax(np.abs(values - _signal(instants))[inner]) < 0.01, name


def test_gaps_and_dead_stretches_are_lost_and_nothing_else():
    time = 0.3033 + np.arange(0.0, 19.0, 1.0 / 200.0)
    yaw = _signal(time)
    yaw[1000:1400] = np.nan  # 5 to 7 s of this table
    yaw[2000:2300] = yaw[2000]  # stuck for 1.5 s
    found = sampled(_recording(yaw=yaw), _sensors(), 1024.0)
    values = found.values["bogie.rate_yaw [rad/s]"]
    instants = np.arange(len(values)) / 256.0
    lost = np.isnan(values)
    assert lost[(instants > 5.01) & (instants < 6.98)].all()
    assert lost[(instants > 10.01) & (instants < 11.48)].all()
    assert not lost[(instants < 4.98) | ((instants > 7.02) & (instants < 9.98)) | (instants > 11.52)][:-30].any()


def test_what_cannot_be_used_is_named_with_the_reason():
    time = 0.3033 + np.arange(0.0, 19.0, 1.0 / 200.0)
    dead = sampled(_recording(yaw=np.full(time.size, 0.02)), _sensors(), 1024.0)
    assert dead.left_out == ("bogie.rate_yaw [rad/s]: it always gives the same value",)
    gone = np.full(time.size, np.nan)
    gone[:1000] = _signal(time[:1000])
    assert "more than half" in sampled(_recording(yaw=gone), _sensors(), 1024.0).left_out[0]
    assert list(dead.values) == ["bogie.acceleration_y [m/s2]"]


def test_grid_rates_divide_the_model_and_are_no_slower():
    for rate in (48.8, 100.0, 200.0, 256.0, 500.0, 1000.0):
        wanted = grid_rate(rate, 1024.0)
        assert wanted >= rate and (1024.0 / wanted).is_integer()
    assert grid_rate(2000.0, 1024.0) == 1024.0


def test_a_faster_channel_is_cut_off_before_it_is_thinned():
    """700 Hz at 2 kHz would come back as 324 Hz at 1024 Hz."""
    time = np.arange(0.0, 10.0, 1.0 / 2000.0)
    high = even(time, np.sin(2.0 * np.pi * 700.0 * time), 2000.0, 1024.0)
    low = even(time, _signal(time), 2000.0, 1024.0)
    assert np.abs(high[500:-500]).max() < 1e-3
    assert np.abs(low - _signal(np.arange(len(low)) / 1024.0))[500:-500].max() < 1e-3
