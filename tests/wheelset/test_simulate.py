"""Runs of the single wheelset: small motion, Klingel's wavelength, critical speed, symmetry, rest, order."""

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from railsim.errors import InputError
from railsim.track import Track
from railsim.track.kernel import build_tables
from railsim.wheelset import (
    RollingTable,
    WheelsetParameters,
    cone,
    conical,
    critical_speed,
    full_linear,
    rolling_table,
    simulate_linear,
    simulate_wheelset,
)
from railsim.wheelset.equations import STATES, rails_at, state_rates
from railsim.wheelset.simulate import COLUMNS

PARAMETERS = WheelsetParameters()
FREE = PARAMETERS.but(lateral_stiffness=0.0, lateral_damping=0.0, yaw_stiffness=0.0)
SHIFT = np.linspace(-0.02, 0.02, 161)


def flanged(conicity: float = 0.15) -> RollingTable:
    """Smooth profile that steepens towards the flange: cubic radius, angle its derivative."""
    return rolling_table(SHIFT, 0.45 + conicity * SHIFT + 800.0 * SHIFT**3, conicity + 2400.0 * SHIFT**2)


def wavy(size: float, length: float = 400.0, gauge: float = 0.0) -> Track:
    """Three incommensurable waves of the mean lateral displacement, one of the gauge; quiet over the first 20 m."""
    s = np.arange(0.0, length + 0.1, 0.25)
    rise = np.clip((s - 5.0) / 15.0, 0.0, 1.0) ** 3
    waves = sum(np.sin(2 * np.pi * s / wave + phase) for wave, phase in ((7.3, 0.1), (19.7, 1.3), (41.0, 2.9)))
    return Track(s, {"lateral": size * rise * waves, "gauge_deviation": gauge * rise * np.cos(s / 6.1)})


def smooth(length: float = 400.0) -> Track:
    return Track(np.linspace(0.0, length, 9))


def arrays(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Columns of a run as plain arrays."""
    return {str(name): table[name].to_numpy(dtype=float) for name in table.columns}


def spread(table: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> float:
    """Largest difference of any motion over its own standard deviation."""
    names = [name for name in COLUMNS if not name.startswith("track")]
    return max(float(np.abs(table[name] - other[name]).max() / table[name].std()) for name in names)


def test_small_motion_is_that_of_the_linear_equations():
    track, model = wavy(1e-6), full_linear(PARAMETERS, 0.15, 30.0)
    nonlinear = arrays(simulate_wheelset(PARAMETERS, flanged(), track, 30.0, 10.0, rate=512.0))
    linear = arrays(simulate_linear(model, track, 30.0, 10.0, rate=512.0))
    assert np.abs(nonlinear["wheelset.y [m]"]).max() > 1e-6
    assert spread(linear, nonlinear) < 1e-6


def test_large_motion_is_not():
    track, model = wavy(2e-3), full_linear(PARAMETERS, 0.15, 30.0)
    nonlinear = arrays(simulate_wheelset(PARAMETERS, flanged(), track, 30.0, 10.0, rate=512.0))
    assert spread(arrays(simulate_linear(model, track, 30.0, 10.0, rate=512.0)), nonlinear) > 0.1


def test_conical_contact_makes_the_equations_linear_at_any_size():
    track, model = wavy(5e-3), full_linear(PARAMETERS, 0.15, 30.0)
    nonlinear = arrays(simulate_wheelset(PARAMETERS, conical(0.15, 0.45), track, 30.0, 10.0, rate=512.0))
    assert spread(arrays(simulate_linear(model, track, 30.0, 10.0, rate=512.0)), nonlinear) < 1e-9


def wavelength(table: dict[str, np.ndarray]) -> float:
    """Mean distance of upward zero crossings of y in m, each interpolated."""
    s, y = table["s [m]"], table["wheelset.y [m]"]
    up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    crossings = s[up] - y[up] * (s[up + 1] - s[up]) / (y[up + 1] - y[up])
    assert len(crossings) >= 3
    return float(np.diff(crossings).mean())


@pytest.mark.parametrize("slope", [0.02, 0.05, 0.1, 0.2])
def test_klingel_wavelength_of_cones_at_low_speed(slope: float):
    klingel = 2 * np.pi * np.sqrt(FREE.wheel_radius * FREE.half_width / slope)
    start = (1e-3, 0.0, 0.0, 0.0, 0.0, 0.0)
    run = arrays(simulate_wheelset(FREE, cone(slope, FREE), smooth(), 2.0, 2.25 * klingel, rate=128.0, state=start))
    assert wavelength(run) == pytest.approx(klingel, rel=1e-2)


@pytest.mark.parametrize("conicity", [0.01, 0.03])
def test_klingel_wavelength_by_the_conicity_of_equation_1(conicity: float):
    """The roll term r0 dphi/dt of (16) makes it longer by the root of 1 + r0 lambda / l: 1 % at lambda = 0.033."""
    klingel = 2 * np.pi * np.sqrt(FREE.wheel_radius * FREE.half_width / conicity)
    eigenvalues = full_linear(FREE, conicity, 2.0).eigenvalues()
    oscillation = min(value.imag for value in eigenvalues if value.imag > 1e-3)
    assert 2 * np.pi * 2.0 / oscillation == pytest.approx(klingel, rel=1e-2)
    longer = np.sqrt(1 + FREE.wheel_radius * conicity / FREE.half_width)
    assert 2 * np.pi * 2.0 / oscillation == pytest.approx(klingel * longer, rel=1e-3)


@pytest.mark.parametrize(("factor", "grows"), [(0.98, False), (1.02, True)])
def test_critical_speed_in_a_run(factor: float, grows: bool):
    critical = critical_speed(PARAMETERS, 0.15)
    assert critical is not None
    speed = factor * critical
    start = (1e-4, 0.0, 0.0, 0.0, 0.0, 0.0)
    run = arrays(simulate_wheelset(PARAMETERS, flanged(), smooth(700.0), speed, 8.0, rate=256.0, state=start))
    late, early = (run["wheelset.yaw [rad]"][int(t * 256) : int((t + 2) * 256)].std() for t in (6.0, 4.0))
    assert (late > early) == grows
    rate = full_linear(PARAMETERS, 0.15, speed).eigenvalues()[0].real
    assert np.log(late / early) / 2.0 == pytest.approx(rate, abs=0.1 * abs(rate))


def test_mirrored_track_and_wheels_mirror_the_motion_to_rounding():
    """Not to the last bit: the compiler may fuse a product into a sum on one side only."""
    uneven = rolling_table(SHIFT, 0.45 + 0.15 * SHIFT, 0.15 + 20 * SHIFT**2, 0.4501 + 0.2 * SHIFT, 0.2 + 0 * SHIFT)
    mirrored = uneven._replace(coefficients=np.ascontiguousarray(uneven.coefficients[::-1]))
    track = wavy(1e-3, 150.0, gauge=2e-3)
    other = Track(track.s, {"lateral": -track.lateral, "gauge_deviation": track.gauge_deviation})
    start = np.array([1e-3, 0.0, 1e-4, 0.0, -1e-3, 0.0])
    run = arrays(simulate_wheelset(PARAMETERS, uneven, track, 30.0, 4.0, state=start))
    image = arrays(simulate_wheelset(PARAMETERS, mirrored, other, 30.0, 4.0, state=-start))
    for name in COLUMNS[:-2]:
        assert np.abs(run[name] + image[name]).max() < 1e-12 * np.abs(run[name]).max(), name
    assert run["wheelset.y [m]"].std() > 1e-4


def test_rest_stays_rest():
    run = arrays(simulate_wheelset(PARAMETERS, flanged(), smooth(), 30.0, 10.0, rate=64.0))
    assert all((run[name] == 0.0).all() for name in COLUMNS)


def test_rails_beside_their_place_carry_the_rest_with_them():
    """Constant d: only y - d may enter the contact geometry. Wider gauge: both radii are smaller, no force."""
    s = np.linspace(0.0, 400.0, 9)
    track = Track(s, {"lateral": np.full(9, 5e-3), "gauge_deviation": np.full(9, 4e-3)})
    run = arrays(simulate_wheelset(PARAMETERS, flanged(), track, 30.0, 5.0, rate=64.0, state=(5e-3, 0, 0, 0, 5e-3, 0)))
    assert np.abs(run["wheelset.y [m]"] - 5e-3).max() < 1e-14
    assert np.abs(run["wheelset.yaw [rad]"]).max() < 1e-14
    assert run["track.left_lateral [m]"] - run["track.right_lateral [m]"] == pytest.approx(4e-3)


def test_without_creep_momentum_and_energy_stay():
    """Equations (13) and (14): the suspension's forces on wheelset and mass are opposite."""
    slippery = PARAMETERS.but(
        longitudinal_creep=1e-9, lateral_creep=1e-9, lateral_spin_creep=0.0, spin_creep=0.0, load=0.0,
        lateral_damping=0.0, spin_inertia=0.0,
    )  # fmt: skip
    start = (1e-3, 0.0, 1e-3, 0.0, 0.0, 0.01)
    run = arrays(simulate_wheelset(slippery, conical(0.1, 0.45), smooth(), 20.0, 5.0, state=start))
    v, v_m = run["wheelset.y_rate [m/s]"], run["suspended_mass.y_rate [m/s]"]
    momentum = slippery.mass * v + slippery.suspended_mass * v_m
    assert momentum == pytest.approx(momentum[0], rel=1e-9)
    stretch = run["suspended_mass.y [m]"] - run["wheelset.y [m]"]
    lateral = slippery.mass * v**2 + slippery.suspended_mass * v_m**2 + slippery.lateral_stiffness * stretch**2
    turning = (
        slippery.yaw_inertia * run["wheelset.yaw_rate [rad/s]"] ** 2
        + slippery.yaw_stiffness * run["wheelset.yaw [rad]"] ** 2
    )
    assert lateral == pytest.approx(lateral[0], rel=1e-6)
    assert turning == pytest.approx(turning[0], rel=1e-4)


def test_same_numbers_as_scipy():
    track, table, speed = wavy(2e-3, 70.0, gauge=1e-3), flanged(), 30.0
    tables, c = build_tables(track), PARAMETERS.coefficients()

    def rates(t: float, state: np.ndarray) -> np.ndarray:
        out, rails = np.zeros(STATES), np.zeros(6)
        rails_at(tables, speed * t, speed, rails)
        state_rates(state, rails, c, table, speed, out)
        return out

    run = arrays(simulate_wheelset(PARAMETERS, table, track, speed, 2.0, rate=64.0))
    t = run["time [s]"]
    exact = solve_ivp(rates, (0.0, 2.0), np.zeros(STATES), t_eval=t, rtol=1e-9, atol=1e-13, max_step=2e-3).y.T
    motion = np.stack([run[name] for name in COLUMNS[:STATES]], axis=-1)
    assert np.abs(motion - exact).max(axis=0) / exact.std(axis=0) == pytest.approx(0.0, abs=1e-5)


def test_error_falls_with_the_fourth_power_of_the_step():
    track = wavy(2e-3, 70.0)
    # few kN s/m of creep damping, so that the step and not the stiffness limits it
    soft = PARAMETERS.but(lateral_creep=3e5, longitudinal_creep=3e5)

    def last(step: float) -> np.ndarray:
        run = arrays(simulate_wheelset(soft, conical(0.1, 0.45), track, 20.0, 2.0, rate=32.0, step=step))
        return np.stack([run[name][-20:] for name in COLUMNS[:2]])

    exact = last(1 / 16384)
    coarse, fine = (np.abs(last(step) - exact).max() for step in (1 / 128, 1 / 256))
    assert 11 < coarse / fine < 22


def test_accelerations_and_roll_are_the_derivatives_of_the_motion():
    run = arrays(simulate_wheelset(PARAMETERS, flanged(), wavy(2e-3, 70.0, gauge=1e-3), 30.0, 2.0, rate=8192.0))
    t = run["time [s]"]
    pairs = [
        ("wheelset.y_rate [m/s]", "wheelset.y_acceleration [m/s2]"),
        ("wheelset.yaw_rate [rad/s]", "wheelset.yaw_acceleration [rad/s2]"),
        ("suspended_mass.y_rate [m/s]", "suspended_mass.y_acceleration [m/s2]"),
    ]
    for rate, acceleration in pairs:
        difference = np.gradient(run[rate], t)[5:-5] - run[acceleration][5:-5]
        assert np.abs(difference).max() < 1e-3 * run[acceleration].std(), acceleration
    roll = np.gradient(np.gradient(run["wheelset.roll [rad]"], t), t)[5:-5]
    expected = run["wheelset.roll_acceleration [rad/s2]"][5:-5]
    assert np.abs(roll - expected).max() < 5e-3 * expected.std()


def test_runs_that_cannot_be_are_refused():
    with pytest.raises(InputError, match=r"reaches from 0 to 400 m, the run from 0 to 600 m"):
        simulate_wheelset(PARAMETERS, flanged(), smooth(), 30.0, 20.0)
    with pytest.raises(InputError, match=r"left its contact table .* 0\.02 m .* s, .* m; lower the speed"):
        simulate_wheelset(PARAMETERS, flanged(), wavy(0.02), 30.0, 10.0)
    with pytest.raises(InputError, match=r"mass: .*greater than 0"):
        PARAMETERS.but(mass=-1.0)
