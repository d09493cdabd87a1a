"""Changes of acceleration are found where they are; what the wheel does beside is no change of the vehicle's speed."""

import numpy as np
import pytest
from scipy.linalg import null_space

from experiments.discrepancy.recording.speed import KNOT, Signal, measured_speed, vehicle_speed
from railsim.measurements import TIME as TIMES
from railsim.measurements import Measurements
from railsim.scenario import load_scenario

RATE = 64.0  # Hz
TIME = np.arange(0.0, 30.0, 1.0 / RATE)
KNOTS = np.arange(0.0, 30.0 + KNOT, KNOT)


def _wheel(size: float, memory: float, rng: np.random.Generator) -> np.ndarray:
    """An autoregression with this deviation and memory [s]."""
    kept, found = np.exp(-1.0 / RATE / memory), np.zeros(len(TIME))
    for one in range(1, len(TIME)):
        found[one] = kept * found[one - 1] + size * np.sqrt(1.0 - kept**2) * rng.standard_normal()
    return found


def test_braking_begins_and_ends_where_it_does() -> None:
    rng = np.random.default_rng(2)
    true = np.interp(TIME, [0.0, 8.3, 18.1, 30.0], [24.0, 24.0, 14.2, 14.2])
    found = vehicle_speed(Signal(TIME, true + _wheel(2e-3, 0.2, rng) + 1e-3 * rng.standard_normal(len(TIME)), KNOTS))[0]
    assert np.abs(found - np.interp(KNOTS, TIME, true)).max() < 0.03  # half a knot of 1 m/s2 more is 0.06
    steady = np.diff(found) / KNOT
    assert np.abs(steady[(KNOTS[:-1] > 10.0) & (KNOTS[:-1] < 17.0)] + 1.0).max() < 0.02
    assert np.abs(steady[KNOTS[:-1] < 7.0]).max() < 0.02


def test_what_the_wheel_does_is_no_speed_of_the_vehicle() -> None:
    rng = np.random.default_rng(3)
    values = 20.0 + 3e-3 * np.sin(2.0 * np.pi * 2.0 * TIME) + 1e-3 * rng.standard_normal(len(TIME))
    assert np.std(np.diff(vehicle_speed(Signal(TIME, values, KNOTS))[0]) / KNOT) < 0.003  # the wheel: 0.027


def test_a_rough_signal_with_gaps() -> None:
    rng = np.random.default_rng(4)
    true = np.interp(TIME, [0.0, 10.0, 20.0, 30.0], [20.0, 20.0, 26.0, 26.0])
    kept = (np.arange(len(TIME)) % 16 == 0) & ((TIME < 12.0) | (TIME > 15.0))
    found = vehicle_speed(Signal(TIME[kept], (true + 0.05 * rng.standard_normal(len(TIME)))[kept], KNOTS))[0]
    assert np.sqrt(np.mean((found - np.interp(KNOTS, TIME, true)) ** 2)) < 0.04


def test_an_hour_at_a_steady_speed_and_samples_without_noise() -> None:
    knots = np.arange(0.0, 3600.0 + KNOT, KNOT)
    time = np.arange(0.0, 3600.0, 1.0)
    assert np.abs(vehicle_speed(Signal(time, np.full(len(time), 20.0), knots))[0] - 20.0).max() < 1e-3
    true = np.interp(TIME, [0.0, 10.0, 20.0, 30.0], [20.0, 20.0, 26.0, 26.0])
    assert np.abs(vehicle_speed(Signal(TIME, true, KNOTS))[0] - np.interp(KNOTS, TIME, true)).max() < 0.01


@pytest.mark.parametrize("rate", [10.0, 64.0])
def test_pulses_counted_since_the_sample_before_tell_the_speed_in_between(rate: float) -> None:
    """Of a vehicle that speeds up by 0.7 m/s2 from 10 s on; taken for that at the sample it is 0.7 / (2 rate) late."""
    time = np.arange(1.0 / rate, 30.0, 1.0 / rate)

    def way(at: np.ndarray) -> np.ndarray:
        return 20.0 * at + 0.5 * 0.7 * np.maximum(at - 10.0, 0.0) ** 2

    counted = rate * (way(time) - way(time - 1.0 / rate)) + 1e-4 * np.random.default_rng(6).standard_normal(len(time))
    sheet = {"name": "axle", "kind": "tachometer"}
    measured = Measurements(
        {"origin": "test", "vehicle": {}, "sensors": [sheet]}, {rate: {TIMES: time, "axle.speed [m/s]": counted}}
    )
    knots, found, *_ = measured_speed(measured, load_scenario("default"), 30.0)
    assert np.abs(found - 20.0 - 0.7 * np.maximum(knots - 10.0, 0.0))[knots < 29.5].max() < 0.2 * 0.7 / (2.0 * rate)


@pytest.mark.parametrize("weighted", [False, True])
def test_likelihood_and_mean_by_full_matrices(weighted: bool) -> None:
    rng = np.random.default_rng(5)
    knots, time = np.arange(9) * KNOT, np.sort(rng.uniform(0.0, 8 * KNOT, 30))
    values, weights = rng.standard_normal(30), np.exp(rng.standard_normal(7)) if weighted else np.ones(7)
    place = np.array([np.interp(time, knots, one) for one in np.eye(9)]).T
    bends = np.diff(np.eye(9), 2, axis=0)
    signal, found = Signal(time, values, knots), []
    free = null_space((place @ null_space(bends)).T)  # of what is no line
    for noise, bend, wheel, memory in ((0.5, 0.3, 0.4, 0.2), (0.7, 0.8, 0.2, 0.6)):
        apart = np.abs(knots[:, None] - knots) / memory
        walk = np.linalg.pinv(bends) @ np.diag(bend**2 * weights) @ np.linalg.pinv(bends).T
        covariance = place @ (walk + wheel**2 * np.exp(-apart)) @ place.T + noise**2 * np.eye(30)
        seen = free.T @ covariance @ free
        cost = values @ free @ np.linalg.solve(seen, free.T @ values) + np.linalg.slogdet(seen)[1]
        lines = place @ null_space(bends)
        inverse = np.linalg.inv(covariance)
        trend = np.linalg.solve(lines.T @ inverse @ lines, lines.T @ inverse @ values)
        mean = null_space(bends) @ trend + walk @ place.T @ inverse @ (values - lines @ trend)
        mine = signal.at(np.log([noise, bend, wheel, memory]), weights)
        assert np.allclose(mine[1], mean, atol=1e-8)
        found.append((mine[0], cost))
    assert found[1][0] - found[0][0] == pytest.approx(found[1][1] - found[0][1], abs=1e-6)


def test_the_wheel_that_told_the_speed_is_the_one_that_was_heard() -> None:
    lost = np.full(len(TIME), np.nan)
    sheets = [{"name": f"axle{k}", "kind": "tachometer", "body": f"wheelset{k}"} for k in (1, 2)]
    tables = {RATE: {TIMES: TIME, "axle1.speed [m/s]": np.full(len(TIME), 20.0), "axle2.speed [m/s]": lost}}
    measured = Measurements({"origin": "test", "vehicle": {}, "sensors": sheets}, tables)
    wheel = measured_speed(measured, load_scenario("default"), 30.0).wheel
    assert wheel is not None and wheel.body == "wheelset1"
