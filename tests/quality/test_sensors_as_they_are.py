"""Faults of loggers and boxes on data that no kind's own equations made: each is found, named and undone."""

import struct

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from experiments.fault_injection.runs import scenario, truth_of
from railsim import measure
from railsim.measurements import TIME, Measurements
from railsim.quality.draft import tables_of
from railsim.quality.inspection import inspect
from railsim.quality.interface import Finding
from railsim.quality.offset_step import lasting
from railsim.quality.packets import copies

AXES = [f"bogie.acceleration_{axis} [m/s2]" for axis in "xyz"]
RATES = [f"bogie.rate_{axis} [rad/s]" for axis in ("roll", "pitch", "yaw")]
Tables = dict[float, dict[str, np.ndarray]]


@pytest.fixture(scope="module")
def clean() -> Measurements:
    """A simulated half vehicle on poor track."""
    run = "poor, 25 m/s"
    return measure(truth_of(run, fast=True), scenario(run, "mems"), seed=8).measurements


def inspected(clean: Measurements, tables: Tables) -> tuple[list[Finding], Measurements]:
    result = inspect(Measurements(clean.about, tables, clean.track))
    return result.faults, result.cleaned


def test_nothing_is_found_in_the_clean_recording(clean: Measurements):
    assert inspect(clean).faults == []


@pytest.mark.parametrize("slow", [-0.004, 0.015])
def test_a_clock_that_runs_at_another_rate_is_found_and_mended(clean: Measurements, slow: float):
    tables = tables_of(clean)
    table = tables[1024.0]
    time = table[TIME]
    kept = time * (1 + slow) <= time[-1]
    for name in list(table)[1:]:
        table[name] = CubicSpline(time, table[name])((time * (1 + slow))[kept])
    table[TIME] = time[kept]
    faults, cleaned = inspected(clean, tables)
    assert [one.kind for one in faults] == ["clock rate"]
    assert faults[0].repair is not None
    assert faults[0].repair.amount == pytest.approx(slow, abs=3e-5)
    name = "axlebox1_left.acceleration_z [m/s2]"
    count = min(cleaned[name].size, clean[name].size)
    difference = (cleaned[name][:count] - clean[name][:count])[512:-512]
    assert np.nanstd(difference) < 0.25 * clean[name].std()


def test_packets_written_twice_are_taken_out(clean: Measurements):
    tables = tables_of(clean)
    for name in AXES:
        values = clean[name]
        tables[256.0][name] = np.concatenate([values[:3232], values[3200:3232], values[3232:-32]])
    faults, cleaned = inspected(clean, tables)
    assert [(one.kind, one.channel) for one in faults] == [("repeated", name) for name in AXES]
    assert faults[0].start == pytest.approx(3232 / 256.0)
    for name in AXES:
        np.testing.assert_array_equal(cleaned[name][:-32], clean[name][:-32])
        assert np.isnan(cleaned[name][-32:]).all()


def test_a_packet_in_the_place_of_the_next_is_left_out(clean: Measurements):
    tables = tables_of(clean)
    for name in RATES:
        tables[256.0][name][3232:3264] = clean[name][3200:3232]
    faults, cleaned = inspected(clean, tables)
    assert [(one.kind, one.channel) for one in faults] == [("repeated", name) for name in RATES]
    for name in RATES:
        assert np.isnan(cleaned[name][3232:3264]).all()
        np.testing.assert_array_equal(cleaned[name][3264:], clean[name][3264:])


def test_equal_rows_of_a_rounded_signal_are_no_packets():
    """Whole numbers from -2 to 2: many short stretches appear twice by chance."""
    rows = np.random.default_rng(1).integers(-2, 3, (1, 8000)).astype(float)
    assert copies(rows) == []
    rows[0, 5000:5064] = rows[0, 1000:1064]
    assert [first - start for first, _, start in copies(rows)] == [4000]
    assert copies(rows)[0][:2] == pytest.approx((5000, 5064), abs=5)  # a neighbour is the same once in five


def test_packets_that_changed_places_are_put_back(clean: Measurements):
    tables = tables_of(clean)
    for first in (3200, 6400):
        for name in RATES:
            values = tables[256.0][name]
            values[first : first + 64] = np.r_[values[first + 32 : first + 64], values[first : first + 32]]
    faults, cleaned = inspected(clean, tables)
    assert [(one.kind, one.channel) for one in faults] == [("reordered", name) for name in RATES]
    for name in RATES:
        np.testing.assert_array_equal(cleaned[name], clean[name])


@pytest.mark.parametrize(("names", "code", "step"), [(RATES, "h", 1.33e-4), (AXES, "i", 1.9e-4)])
def test_reversed_bytes_are_turned_back(clean: Measurements, names: list[str], code: str, step: float):
    tables = tables_of(clean)
    for name in names:
        words = [struct.pack("<" + code, round(float(one) / step)) for one in clean[name]]
        tables[256.0][name] = np.array([struct.unpack(">" + code, word)[0] for word in words]) * step
    faults, cleaned = inspected(clean, tables)
    assert sorted((one.kind, one.channel) for one in faults) == sorted(("byte order", name) for name in names)
    for name in names:
        np.testing.assert_allclose(cleaned[name], clean[name], atol=1e-9)


def test_a_box_turned_about_the_vertical_is_turned_back_with_its_gyro(clean: Measurements):
    """Its x points to the left, its y backwards."""
    tables = tables_of(clean)
    for x, y in ((AXES[0], AXES[1]), (RATES[0], RATES[1])):
        tables[256.0][x], tables[256.0][y] = clean[y].copy(), -clean[x]
    faults, cleaned = inspected(clean, tables)
    assert [one.kind for one in faults] == ["turned"]
    for name in (*AXES, *RATES):
        np.testing.assert_allclose(cleaned[name], clean[name], atol=1e-12)


def test_axleboxes_in_g_are_brought_to_metres_per_second_squared_although_their_zero_is_poor(clean: Measurements):
    tables = tables_of(clean)
    names = [f"axlebox2_left.acceleration_{axis} [m/s2]" for axis in "yz"]
    for name in names:
        tables[1024.0][name] = (clean[name] + 1.2 * name.endswith("z [m/s2]")) / 9.80665
    faults, _ = inspected(clean, tables)
    assert [one.channel for one in faults if one.kind == "unit"] == names


def test_a_roll_gyro_that_nobody_calibrated_is_found_by_the_roll_that_gravity_shows(clean: Measurements):
    """0.7 deg/s: cant in 30 s could be as much, but then gravity would show it."""
    tables = tables_of(clean)
    tables[256.0][RATES[0]] += np.radians(0.7)
    faults, cleaned = inspected(clean, tables)
    assert [(one.kind, one.channel) for one in faults] == [("offset", RATES[0])]
    assert np.mean(cleaned[RATES[0]]) == pytest.approx(0.0, abs=3e-3)


def test_a_shock_at_the_start_of_a_record_is_no_step(clean: Measurements):
    """16 rows are no level: what they hold beside the rest is the shock, not another zero."""
    values = np.random.default_rng(2).normal(9.81, 1.0, 20_000)
    values[:16] += 14.0 * np.exp(-np.arange(16) / 4.0)
    name = "axlebox2_left.acceleration_z [m/s2]"
    shaken = Measurements(clean.about, {1024.0: {TIME: np.arange(20_000) / 1024.0, name: values}})
    at_start = [(16, -3.5)]
    assert lasting(shaken, name, at_start, 3.0) == []
    values[:4096] += 4.0
    stepped = Measurements(clean.about, {1024.0: {TIME: np.arange(20_000) / 1024.0, name: values}})
    assert lasting(stepped, name, [(4096, -4.0)], 3.0) == [(4096, -4.0)]
