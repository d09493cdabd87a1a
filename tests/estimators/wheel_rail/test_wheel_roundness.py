"""Roundness of wheels: closed forms, and accelerations of wheels made by hand."""

import numpy as np
import pytest
from scipy.integrate import quad

from estimators.wheel_rail.flats import find_flat, flat_orders, follows_up_to
from estimators.wheel_rail.turns import mean_and_scatter, refined_turn
from estimators.wheel_rail.wheel_roundness import WheelRoundness
from railsim import InputError
from railsim.measurements import TIME, Measurements

RATE, SPEED, RADIUS, GAUGE = 1024.0, 15.0, 0.46, 0.75
VEHICLE = {"wheelset_mass": 1200.0, "wheel_radius": RADIUS, "half_gauge": GAUGE, "design_wheel_load": 60e3}


def record(orders: dict[int, float], radius: float = RADIUS, noise: float = 0.01, seed: int = 1) -> Measurements:
    """A left wheel with waves of these orders and amplitudes, m, in which rail and contact do not give way.

    The wheel's centre then moves as its radius does: z'' = -(m v / r)^2 A cos(m angle). A receiver gives the speed.
    """
    time = np.arange(round(40.0 * RATE)) / RATE
    left = np.zeros(len(time))
    for order, amplitude in orders.items():
        omega = order * SPEED / radius
        left -= omega**2 * amplitude * np.cos(omega * time + 0.7 * order)
    rng = np.random.default_rng(seed)
    table, sheets = {TIME: time, "wheelset1.speed [m/s]": np.full(len(time), SPEED)}, []
    for side, values in (("left", left), ("right", np.zeros(len(time)))):
        channel = f"axlebox1_{side}.acceleration_z [m/s2]"
        table[channel] = 9.81 + values + noise * np.sqrt(RATE / 2.0) * rng.standard_normal(len(time))
        place = [0.0, GAUGE if side == "left" else -GAUGE, 0.0]
        sheet = {"kind": "accelerometer", "name": f"axlebox1_{side}", "position": place, "channels": [channel]}
        sheets.append(sheet | {"errors": {"noise_density": noise, "scale_error_std": 0.01}})
    return Measurements({"origin": "test", "vehicle": VEHICLE, "sensors": sheets}, {RATE: table})


def stiff(**more: object) -> WheelRoundness:
    """The estimator that is told that the rail does not give way."""
    return WheelRoundness.build({"track_compliance": 0.0, **more})


def test_orders_of_a_flat() -> None:
    """Fourier's integral of the dip d/2 (1 + cos(2 pi x / l)), d = l^2 / (16 r)."""
    length = 0.06
    depth, half = length**2 / (16.0 * RADIUS), length / 2.0 / RADIUS

    def dip(angle: float, order: int) -> float:
        shape = -0.5 * depth * (1.0 + np.cos(2.0 * np.pi * angle * RADIUS / length))
        return shape * np.cos(order * angle) / np.pi

    found = flat_orders(length, RADIUS, 40)
    for order in (1, 7, 40):
        whole, _ = quad(dip, -half, half, args=(order,))
        assert found[order - 1] == pytest.approx(whole, rel=1e-6)


def test_a_wheel_falls_as_its_load_presses_it() -> None:
    """At the limit, before a fifth is kept, the dip's steepest bend asks for all of the load."""
    load, mass, length = 60e3, 600.0, 0.05
    speed = follows_up_to(load, mass, RADIUS) / 0.8
    depth = length**2 / (16.0 * RADIUS)
    assert mass * depth / 2.0 * (2.0 * np.pi * speed / length) ** 2 == pytest.approx(load)


@pytest.mark.parametrize("length", [0.03, 0.06, 0.1])
def test_a_flat_is_found(length: float) -> None:
    rng = np.random.default_rng(3)
    std = np.full(80, 2e-7)
    noise = std * (rng.standard_normal(80) + 1j * rng.standard_normal(80))
    turned = np.exp(-1j * np.arange(1, 81) * 2.0)
    flat = find_flat(flat_orders(length, RADIUS, 80) * turned + noise, std, RADIUS)
    assert flat is not None
    assert abs(flat.length - length) <= 2.0 * flat.length_std
    assert flat.angle == pytest.approx(2.0, abs=0.02)
    assert find_flat(noise, std, RADIUS) is None


def test_a_wave_is_no_flat() -> None:
    amplitude = np.zeros(80, dtype=complex)
    amplitude[2] = 1e-4
    assert find_flat(amplitude, np.full(80, 1e-6), RADIUS) is None


def test_scatter_of_overlapping_windows() -> None:
    """Mean of 200 draws of unit variance: 1 / sqrt(200) for each part, a sixth more for the overlap."""
    rng = np.random.default_rng(5)
    draws = rng.standard_normal((200, 50)) + 1j * rng.standard_normal((200, 50))
    mean, scatter = mean_and_scatter(draws)
    assert float(np.mean(scatter)) == pytest.approx(np.sqrt((1.0 + 1.0 / 3.0) / 200.0), rel=0.03)
    assert float(np.std(np.real(mean))) < 1.3 * float(np.mean(scatter))


@pytest.mark.parametrize("share", [-0.02, 0.0, 0.013])
def test_turn_is_refined(share: float) -> None:
    nominal, spacing = 2.0 * np.pi * RADIUS, 0.02
    s = spacing * np.arange(25_000)
    turn = nominal * (1.0 + share)
    values = sum(np.cos(2.0 * np.pi * m * s / turn) for m in (2, 3, 5)) + np.random.default_rng(1).standard_normal(
        25_000
    )
    found = refined_turn(np.stack([values, values]), spacing, nominal, 0.03, 10)
    assert found == pytest.approx(turn, rel=2e-4)


def test_nothing_periodic_keeps_the_nominal_turn() -> None:
    values = np.random.default_rng(2).standard_normal((2, 25_000))
    assert refined_turn(values, 0.02, 2.9, 0.03, 10) == 2.9


@pytest.mark.parametrize("radius", [RADIUS, 0.45])
def test_amplitudes(radius: float) -> None:
    """Waves of 60 um and 20 um; the wheel is 10 mm smaller than it is said to be in the second case."""
    found = stiff().estimate(record({3: 60e-6, 6: 20e-6}, radius))
    assert found.about["turn [m]"] == pytest.approx(2.0 * np.pi * radius, rel=2e-4)
    for order, true in ((3, 60e-6), (6, 20e-6), (5, 0.0)):
        values, std = (found.series[f"left_order_{order}{what} [m]"].to_numpy() for what in ("", "_std"))
        assert (np.abs(values - true) <= 3.0 * std).all()
        assert (std < 4e-6).all()
    assert found.about["flats"] == []


def test_what_is_beyond_the_reach_is_not_given() -> None:
    """A low-pass of 60 Hz at 15 m/s ends at order 11."""
    whole = record({3: 60e-6})
    sheets = [one | {"errors": one["errors"] | {"bandwidth": 60.0}} for one in whole.about["sensors"]]
    table = {TIME: whole.time("wheelset1.speed [m/s]"), **{name: whole[name] for name in whole}}
    found = stiff(orders=14).estimate(Measurements(dict(whole.about) | {"sensors": sheets}, {RATE: table}))
    assert found.about["reach"]["highest order"] == 11
    assert np.isnan(found.series["left_order_12 [m]"].to_numpy()).all()
    assert np.isfinite(found.series["left_order_11 [m]"].to_numpy()).all()


def test_scatter_is_no_better_than_the_bound() -> None:
    """Over many draws of noise amplitudes err by the bound of the data sheet's noise, or more."""
    wrong, bound = [], 0.0
    for seed in range(16):
        found = stiff(section=1000).estimate(record({4: 50e-6}, noise=0.1, seed=seed))
        wrong.append(float(found.series["left_order_4 [m]"].iloc[0]) - 50e-6)
        bound = found.about["bound by noise [m]"][3]
    assert 0.6 * bound < np.std(wrong) < 2.0 * bound


def test_parameters_are_needed() -> None:
    whole = record({})
    table = {TIME: whole.time("wheelset1.speed [m/s]"), **{name: whole[name] for name in whole}}
    with pytest.raises(InputError, match="'wheelset_mass', 'wheel_radius'"):
        WheelRoundness().estimate(Measurements(dict(whole.about) | {"vehicle": {}}, {RATE: table}))
