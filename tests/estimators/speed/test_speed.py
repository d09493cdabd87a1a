"""Speed estimators on the throw-away vehicle: accuracy, delay, faults, and the same numbers online."""

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimator, OnlineEstimator
from estimators.signals.correlation import slide_both
from estimators.speed.speed_plain import SpeedPlain
from estimators.speed.speed_refined import SpeedRefined
from railsim.errors import InputError
from railsim.measurements import Measurements
from tests.estimators.bogie_rig import INNER, MEMS, NOMINAL, measurements, ride

A, Q = "bogie.acceleration_z [m/s2]", "bogie.rate_pitch [rad/s]"
X = "bogie.acceleration_x [m/s2]"
BOTH = [SpeedPlain(), SpeedRefined()]
KMH = 3.6
SETTLED = 8000  # samples: filters, first search, first seconds of the lock
OFF_NOMINAL = {
    "bogie_mass": 1.1 * NOMINAL["bogie_mass"],
    "bogie_pitch_inertia": 0.9 * NOMINAL["bogie_pitch_inertia"],
    "primary_vertical_stiffness": 1.05 * NOMINAL["primary_vertical_stiffness"],
    "primary_vertical_damping": 1.15 * NOMINAL["primary_vertical_damping"],
    "secondary_vertical_stiffness": 0.9 * NOMINAL["secondary_vertical_stiffness"],
    "body_mass": 1.1 * NOMINAL["body_mass"],
}


def steady(speed: float, duration: float = 30.0) -> np.ndarray:
    return np.full(round(duration * INNER), speed)


def speeding_up(before: float = 12.0, after: float = 8.0) -> np.ndarray:
    """40 to 48 m/s at 1 m/s2, as figure 19."""
    ramp = 40 + np.arange(round(8 * INNER)) / INNER
    return np.concatenate([steady(40, before), ramp, steady(48, after)])


def errors(estimator: Estimator, recording: Measurements, speed: np.ndarray, skip: int = SETTLED) -> np.ndarray:
    """Estimated minus true speed in km/h after `skip` samples; NaN where there is no estimate."""
    series = estimator.estimate(recording).series
    return (series["speed [m/s]"].to_numpy() - speed)[skip:] * KMH


def largest(values: np.ndarray) -> float:
    assert np.isfinite(values).all()
    return float(np.abs(values).max())


# the paper's largest errors, section 5.2, and what issue 2 asks of the refined variant
@pytest.mark.parametrize(("speed", "paper", "target"), [(50 / KMH, 0.22, 0.05), (100 / KMH, 0.65, 0.15)])
def test_steady_speed(speed: float, paper: float, target: float) -> None:
    recording, true = ride(steady(speed), np.random.default_rng(1))
    assert largest(errors(SpeedPlain(), recording, true)) <= paper
    assert largest(errors(SpeedRefined(), recording, true)) <= target / 2


@pytest.mark.parametrize(("speed", "bound"), [(50 / KMH, 0.08), (100 / KMH, 0.15)])
def test_steady_speed_with_sensor_noise(speed: float, bound: float) -> None:
    recording, true = ride(steady(speed), np.random.default_rng(1), noise=MEMS)
    off = errors(SpeedRefined(), recording, true)
    assert largest(off) <= bound
    assert np.sqrt(np.mean(off**2)) < 0.3 * np.sqrt(np.nanmean(errors(SpeedPlain(), recording, true) ** 2))


@pytest.mark.parametrize("speed", [5.0, 10.0, 30.0, 60.0])
@pytest.mark.parametrize("noise", [None, MEMS])
def test_range_of_speeds(speed: float, noise: dict[str, float] | None) -> None:
    recording, true = ride(steady(speed), np.random.default_rng(7), noise=noise)
    assert largest(errors(SpeedRefined(), recording, true)) < (0.003 if noise is None else 0.01) * speed * KMH


def test_truncation_is_all_that_the_plain_peak_adds() -> None:
    """Whole lags at 1 kHz are 50.05 and 49.79, 100.65 and 99.57 km/h."""
    for speed in (50.0, 100.0):
        recording, _ = ride(steady(speed / KMH, 20), np.random.default_rng(3))
        found = SpeedPlain().estimate(recording).series["speed [m/s]"].to_numpy()[SETTLED:] * KMH
        lag = 2.6 * KMH * 1000 / speed
        whole = [2.6 * KMH * 1000 / np.ceil(lag), 2.6 * KMH * 1000 / np.floor(lag)]
        assert all(np.isclose(value, whole, atol=1e-9).any() for value in np.unique(found))


def test_delay_of_the_plain_peak_is_stated_while_the_speed_changes() -> None:
    recording, true = ride(speeding_up(), np.random.default_rng(5))
    series = SpeedPlain().estimate(recording).series
    error = series["speed [m/s]"].to_numpy() - true
    covered = np.abs(error) <= 2.0 * series["speed_std [m/s]"].to_numpy()
    ramp = slice(round(17 * 1000), round(20 * 1000))  # 1 kHz; a window after the ramp began
    assert np.nanmax(np.abs(error[ramp])) > 0.5
    assert np.mean(covered[ramp]) > 0.85
    before = slice(SETTLED, round(12 * 1000))
    assert np.nanmean(series["speed_std [m/s]"].to_numpy()[before]) < 0.5


def test_plain_sums_are_wrong_and_the_inverse_mends_them() -> None:
    recording, true = ride(steady(100 / KMH), np.random.default_rng(2))
    assert np.nanmean(np.abs(errors(SpeedPlain(inverse=False), recording, true))) > 1.0
    assert largest(errors(SpeedPlain(), recording, true)) <= 0.65


def test_wrong_parameters_hardly_matter_to_the_refined_variant() -> None:
    recording, true = ride(steady(100 / KMH, 40), np.random.default_rng(4), truth=OFF_NOMINAL)
    off = errors(SpeedRefined(), recording, true)
    blind = SpeedRefined(inertia_spread=0, gain_spread=0, lead_spread=0, damping_spread=0, secondary_spread=0)
    assert largest(off) < 0.15
    assert np.sqrt(np.mean(off**2)) < 0.2 * np.sqrt(np.mean(errors(blind, recording, true) ** 2))


def test_sensor_errors_of_gain_and_lead_are_found() -> None:
    recording, true = ride(steady(100 / KMH, 40), np.random.default_rng(5))
    lead = 1
    late = measurements(recording.time(A)[lead:], recording[A][:-lead], 1.02 * recording[Q][lead:], 1000.0)
    assert largest(errors(SpeedRefined(lead_spread=1e-3), late, true[:-lead], 2 * SETTLED)) < 0.15


@pytest.mark.parametrize("noise", [None, MEMS])
def test_speeding_up(noise: dict[str, float] | None) -> None:
    recording, true = ride(speeding_up(), np.random.default_rng(6), noise=noise)
    plain, refined = (errors(one, recording, true, 0) for one in BOTH)
    ramp = slice(16_000, 20_000)  # steady acceleration, the window of 4 s is full of it
    assert -2.6 * KMH < np.mean(plain[ramp]) < -1.4 * KMH  # half a window's delay: 2 m/s
    assert abs(np.mean(refined[ramp])) < 0.05 * abs(np.mean(plain[ramp]))
    assert largest(refined[SETTLED:]) < 0.4 * largest(plain[SETTLED:])


def with_forward(recording: Measurements, speed: np.ndarray, rng: np.random.Generator) -> Measurements:
    """The recording with a biased, noisy longitudinal accelerometer; speed at `INNER`."""
    forward = np.gradient(speed, 1 / INNER)[::4] + 0.1 + rng.normal(scale=0.02, size=len(recording.time(A)))
    table = {"time [s]": recording.time(A), A: recording[A], Q: recording[Q], X: forward}
    about = {**recording.about, "sensors": [{"name": "bogie", "channels": [A, X], "rate": 1000.0}]}
    return Measurements(about, {1000.0: table})


def test_longitudinal_accelerometer_shows_the_onset() -> None:
    rng = np.random.default_rng(17)
    speed = speeding_up()
    plain, true = ride(speed, rng, noise=MEMS)
    driven = with_forward(plain, speed, rng)
    off = errors(SpeedRefined(), driven, true)
    assert largest(off) < 0.6
    assert largest(off) < 0.3 * largest(errors(SpeedRefined(), plain, true))


def test_noisy_gyro_while_speeding_up_loses_neither_the_speed_nor_the_honesty() -> None:
    """The search looks back 2 s and remembers better times: a lock that follows must not be given up for it."""
    rng = np.random.default_rng(21)
    speed = speeding_up(8, 6)
    plain, true = ride(speed, rng, noise=MEMS)
    time, loud = plain.time(A), plain[Q].copy()
    part = (time > 9) & (time < 16)
    loud[part] += rng.normal(scale=0.05, size=int(part.sum()))  # more than the bogie pitches; 25 times its data sheet
    recording = with_forward(measurements(time, plain[A], loud, 1000.0), speed, rng)
    series = SpeedRefined().estimate(recording).series
    off = np.abs(series["speed [m/s]"].to_numpy() - true)[SETTLED:]
    assert np.isfinite(off).all()
    assert np.sqrt(np.mean(off**2)) < 0.5
    assert np.mean(off < 2 * series["speed_std [m/s]"].to_numpy()[SETTLED:]) > 0.9


@pytest.mark.parametrize("seed", [3, 5])
def test_noise_of_one_sensor_is_no_travel_time(seed: int) -> None:
    """It is in both wheelsets' signals, and correlates in both directions; seeds with which a peak of it stands out."""
    rng = np.random.default_rng(seed)
    time = np.arange(30_000) / 1000
    a, q = 9.81 + rng.normal(scale=1e-3, size=time.size), rng.normal(scale=0.5, size=time.size)
    series = SpeedRefined(reach=0.8).estimate(measurements(time, a, q, 1000.0)).series
    assert series["valid [-]"].to_numpy().max() == 0


def test_online_with_longitudinal_accelerometer_gives_the_same_numbers() -> None:
    rng = np.random.default_rng(18)
    speed = speeding_up(8, 2)
    recording = with_forward(ride(speed, rng, noise=MEMS)[0], speed, rng)
    whole = SpeedRefined().estimate(recording).series
    run = SpeedRefined().online(recording.about, 1000.0)
    values = zip(recording.time(A), recording[A], recording[Q], recording[X], strict=True)
    rows = [run.step({"time [s]": t, A: a, Q: q, X: x}) for t, a, q, x in values]
    pd.testing.assert_frame_equal(pd.DataFrame(rows), whole, check_exact=True)


def test_braking_to_a_stand_and_starting_again() -> None:
    ramp = np.arange(round(15 * INNER)) / INNER
    speed = np.concatenate([steady(15, 10), 15 - ramp, steady(0, 15), ramp, steady(15, 10)])
    recording, true = ride(speed, np.random.default_rng(8), noise=MEMS)
    standing = np.abs(recording.time(A) - 35) < 5
    found = valid = np.empty(0)
    for estimator in BOTH:
        series = estimator.estimate(recording).series
        found, valid = series["speed [m/s]"].to_numpy(), series["valid [-]"].to_numpy() > 0
        assert np.array_equal(valid, np.isfinite(found))
        assert not valid[standing].any()
        assert valid[-3000:].all()
    rolling = np.logical_and(valid, true > 3)
    assert np.abs(found - true)[rolling].max() * KMH < 4
    assert np.abs(found - true)[-3000:].max() * KMH < 0.5


@pytest.mark.parametrize("estimator", BOTH, ids=lambda one: one.name)
def test_online_gives_the_same_numbers(estimator: SpeedPlain | SpeedRefined) -> None:
    recording, _ = ride(speeding_up(8, 2), np.random.default_rng(9), noise=MEMS)
    time, a, q = recording.time(A), recording[A].copy(), recording[Q].copy()
    a[9000:9010], q[11000] = np.nan, np.nan
    kept = np.ones(len(time), dtype=bool)
    kept[12_000:12_300] = False
    recording = measurements(time[kept], a[kept], q[kept], 1000.0)
    whole = estimator.estimate(recording).series
    assert isinstance(estimator, OnlineEstimator)
    run = estimator.online(recording.about, 1000.0)
    rows = [
        run.step({"time [s]": t, A: x, Q: y})
        for t, x, y in zip(recording.time(A), recording[A], recording[Q], strict=True)
    ]
    pd.testing.assert_frame_equal(pd.DataFrame(rows), whole, check_exact=True)


def test_lost_samples_and_gaps_are_survived() -> None:
    recording, true = ride(steady(20), np.random.default_rng(10), noise=MEMS)
    time, a, q = recording.time(A), recording[A].copy(), recording[Q].copy()
    a[10_000:10_300] = np.nan
    q[15_000:15_003] = np.nan
    kept = np.ones(len(time), dtype=bool)
    kept[20_000:20_700] = False
    faulty = measurements(time[kept], a[kept], q[kept], 1000.0)
    series = SpeedRefined().estimate(faulty).series
    assert len(series) == kept.sum()
    off = (series["speed [m/s]"].to_numpy() - true[kept])[SETTLED:] * KMH
    assert largest(off) < 0.3
    std = series["speed_std [m/s]"].to_numpy()
    assert std[11_000] > std[9_900]  # less certain after a second without measurements


def test_starting_with_lost_samples() -> None:
    recording, true = ride(steady(20, 15), np.random.default_rng(11))
    a, q = recording[A].copy(), recording[Q].copy()
    a[:500], q[:700] = np.nan, np.nan
    series = SpeedRefined().estimate(measurements(recording.time(A), a, q, 1000.0)).series
    assert series["valid [-]"].to_numpy()[:700].max() == 0
    assert np.abs(series["speed [m/s]"].to_numpy() - true)[-1000:].max() < 0.05


def test_slow_disturbances_of_a_curve_do_not_matter() -> None:
    """Cant and yaw rate put ramps on both sensors: 0.3 m/s2 and 4 mrad/s within 3 s."""
    recording, true = ride(steady(100 / KMH), np.random.default_rng(12))
    ramp = np.interp(recording.time(A), [10, 13, 20, 23], [0, 1, 1, 0])
    curve = measurements(recording.time(A), recording[A] + 0.3 * ramp, recording[Q] + 4e-3 * ramp, 1000.0)
    assert largest(errors(SpeedRefined(), curve, true)) < 0.05


def test_accelerometer_before_the_centre_of_gravity() -> None:
    recording, true = ride(steady(100 / KMH), np.random.default_rng(13))
    lever = 0.5
    moved = recording[A] - lever * np.gradient(recording[Q], 1e-3)
    sheet = {"name": "bogie", "channels": [A], "position": [lever, 0.0, 0.0]}
    about = {**recording.about, "sensors": [sheet]}
    table = {"time [s]": recording.time(A), A: moved, Q: recording[Q]}
    assert largest(errors(SpeedRefined(), Measurements(about, {1000.0: table}), true)) < 0.05


@pytest.mark.parametrize("rate", [250.0, 500.0, 2000.0])
def test_other_sample_rates(rate: float) -> None:
    recording, true = ride(steady(100 / KMH), np.random.default_rng(14), rate=rate)
    assert largest(errors(SpeedRefined(), recording, true, round(8 * rate))) < 0.1


def test_stated_uncertainty_covers_the_error() -> None:
    """Over several rides, since the error of one is nearly constant."""
    squares = []
    for seed in range(15, 20):
        recording, true = ride(steady(20), np.random.default_rng(seed), noise=MEMS)
        series = SpeedRefined().estimate(recording).series
        ratio = (series["speed [m/s]"].to_numpy() - true) / series["speed_std [m/s]"].to_numpy()
        squares.append(np.mean(ratio[SETTLED:] ** 2))
    assert 0.05 < np.mean(squares) < 1.5


@pytest.mark.parametrize("estimator", BOTH, ids=lambda one: one.name)
def test_bad_input_is_one_clear_line(estimator: SpeedPlain | SpeedRefined) -> None:
    recording, _ = ride(steady(20, 2), np.random.default_rng(16))
    table = {"time [s]": recording.time(A), A: recording[A], Q: recording[Q]}
    vehicle = {**NOMINAL, "bogie_mass": -1.0}
    with pytest.raises(InputError, match="bogie_mass"):
        estimator.estimate(Measurements({**recording.about, "vehicle": vehicle}, {1000.0: table}))
    with pytest.raises(InputError, match="rate_pitch"):
        estimator.estimate(Measurements(recording.about, {1000.0: {key: table[key] for key in ("time [s]", A)}}))
    slow = {key: value[::40] for key, value in table.items()}
    with pytest.raises(InputError, match="too low"):
        estimator.estimate(Measurements(recording.about, {25.0: slow}))
    halves = {1000.0: {key: table[key] for key in ("time [s]", A)}, 500.0: {"time [s]": table["time [s]"][::2]}}
    halves[500.0][Q] = table[Q][::2]
    with pytest.raises(InputError, match="same rate"):
        estimator.estimate(Measurements(recording.about, halves))
    with pytest.raises(InputError, match="narrow"):
        estimator.but(low=20.0).online(recording.about, 1000.0)
    run = estimator.online(recording.about, 1000.0)
    run.step({"time [s]": 1.0, A: 9.81, Q: 0.0})
    with pytest.raises(InputError, match="order of time"):
        run.step({"time [s]": 1.0, A: 9.81, Q: 0.0})


def test_running_sums_of_both_directions_are_those_of_the_window():
    size, first, lags, count = 40, 3, 12, 150
    x, y = np.random.default_rng(3).normal(size=(2, count))
    held, ahead, behind = np.zeros((2, 2 * size)), np.zeros(lags), np.zeros(lags)
    for n in range(count):
        slide_both(held[0], held[1], x[n], y[n], n, first, ahead, behind)
    a, b = x[-size:], y[-size:]
    assert ahead == pytest.approx([a[:-lag] @ b[lag:] for lag in range(first, first + lags)], abs=1e-12)
    assert behind == pytest.approx([b[:-lag] @ a[lag:] for lag in range(first, first + lags)], abs=1e-12)
