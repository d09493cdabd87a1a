"""What plain estimates state of their error, against errors on a rigid bogie that shares no code with the model."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest

from estimators.signals.bands import BANDS, band_pass
from estimators.speed.odometry import integrate_speed
from estimators.track.alignment_accelerometer import AlignmentAccelerometer
from estimators.track.alignment_vertical import AlignmentVertical
from estimators.track.cross_level import NOWHERE_STRAIGHT, CrossLevel
from estimators.track.geometry import rails
from estimators.track.slow_motions import additions, balancing_cant
from estimators.track.track_smoother import nodding
from railsim.constants import GRAVITY
from railsim.measurements import Measurements
from tests.estimators.track_rig import RATE, flat, ride

LENGTH = 1500.0
STEADY = np.full(round(LENGTH / 20.0 * RATE), 20.0)
GYRO, ACCELEROMETER = "bogie.rate_pitch [rad/s]", "bogie.acceleration_z [m/s2]"
CURVE = ([500.0, 560.0, 940.0, 1000.0], [0.0, 1.0, 1.0, 0.0])  # m, share of it
RIGID = {"primary_vertical_stiffness": 1e9, "primary_vertical_damping": 1e5, "design_conicity": 0.0}
"""The rig's bogie follows its wheelsets."""


def _rough(seed: int):
    """A track with the shape of ERRI's vertical spectrum between 2 and 120 m."""
    generator = np.random.default_rng(seed)
    k = 2.0 * np.pi / np.geomspace(120.0, 2.0, 400)
    width = np.gradient(k)
    size = np.sqrt(2.0 * width * 2.7e-7 / ((k**2 + 0.0206**2) * (k**2 + 0.8246**2)))
    phase = generator.uniform(0.0, 2.0 * np.pi, len(k))
    grid = np.arange(-10.0, LENGTH + 10.0, 0.05)
    height = np.sum(size[:, None] * np.sin(k[:, None] * grid + phase[:, None]), axis=0)
    return lambda s: np.interp(s, grid, height)


def _but(
    measured: Measurements,
    columns: Mapping[str, np.ndarray] | None = None,
    sheets: Mapping[str, Mapping[str, float]] | None = None,
    vehicle: Mapping[str, float] | None = None,
) -> Measurements:
    """The same with other columns at 256 Hz, errors in data sheets by channel, and parameters of the vehicle."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measured.channels:
        table = tables.setdefault(measured.rate(name), {"time [s]": measured.time(name)})
        table[name] = measured[name]
    tables[RATE] |= dict(columns or {})
    stated = [
        {"name": "bogie", "channels": [name], "position": [0.0, 0.0, 0.0], "errors": dict(errors)}
        for name, errors in (sheets or {}).items()
    ]
    about = {**measured.about, "vehicle": {**measured.vehicle, **(vehicle or {})}, "sensors": stated}
    return Measurements(about, tables)


def _errors(series: pd.DataFrame, band: str, track) -> tuple[np.ndarray, np.ndarray]:
    """Error of a band and its stated deviation, far from the ends."""
    s = series["s [m]"].to_numpy()
    true = band_pass(track(s), s[1] - s[0], BANDS[band])
    inside = (s > 150.0) & (s < LENGTH - 150.0)
    return (series[f"vertical_{band} [m]"].to_numpy() - true)[inside], series[f"vertical_{band}_std [m]"].to_numpy()[
        inside
    ]


@pytest.mark.parametrize("kind", [AlignmentVertical, AlignmentAccelerometer])
def test_what_the_chord_hides_is_stated(kind: type):
    """Closed form: the gyro sees sin(k b) / (k b) of a wave, the accelerometer in the middle cos(k b)."""
    track = _rough(3)
    measured = _but(ride(STEADY, vertical=track), vehicle=RIGID)
    error, stated = _errors(kind.build({"compensate": False}).estimate(measured).series, "d1", track)
    expected = 0.08e-3 if kind is AlignmentVertical else 0.3e-3
    assert np.std(error) > expected  # so that there is something to state
    assert 0.8 < np.mean(stated) / np.std(error) < 1.5


def test_noise_of_the_sensor_is_stated_and_falls_with_speed():
    sheets = {GYRO: {"noise_density": 2e-4}}
    generator = np.random.default_rng(5)
    spreads = []
    for speed in (10.0, 20.0):
        steady = np.full(round(LENGTH / speed * RATE), speed)
        noise = 2e-4 * np.sqrt(RATE / 2.0) * generator.normal(size=len(steady))
        noisy = _but(ride(steady), {GYRO: noise}, sheets, RIGID)
        error, stated = _errors(AlignmentVertical().estimate(noisy).series, "d1", flat)
        assert np.mean(stated) == pytest.approx(np.std(error), rel=0.2)
        spreads.append(np.mean(stated))
    assert spreads[0] / spreads[1] == pytest.approx(np.sqrt(2.0), rel=0.1)


def test_braking_is_felt_across_the_axis_and_nods_the_bogie():
    speed = np.interp(np.arange(round(60 * RATE)) / RATE, [0.0, 20.0, 40.0, 60.0], [20.0, 20.0, 10.0, 10.0])
    sheets = {ACCELEROMETER: {"misalignment_std": 0.005}}
    measured = _but(ride(speed), sheets=sheets, vehicle={**RIGID, "bogie_height": 0.6})
    odometry = integrate_speed(measured)
    pulls = np.array(list(additions(measured, ACCELEROMETER, odometry)))
    middle, before = round(30 * RATE), round(10 * RATE)
    assert np.abs(pulls[:, middle]).max() == pytest.approx(0.005 * 0.5, rel=0.05)
    assert np.abs(pulls[:, before]).max() < 1e-4
    turned = np.sum(list(additions(measured, GYRO, odometry)), axis=0)
    begins = slice(round(18 * RATE), round(22 * RATE))
    expected = 18_615.0 * 0.6 / (4.0 * 1e9 * 1.28**2) * 0.5  # whole force at the bogie's height, by hand
    assert np.sum(np.abs(turned[begins])) / RATE == pytest.approx(expected, rel=0.1)


def test_a_stop_is_in_the_deviations_of_a_fused_estimate():
    """Where braking ends the bogie turns back at one place: D2 of its pitch read as slope, by hand for a step."""
    speed = np.interp(np.arange(round(60 * RATE)) / RATE, [0.0, 20.0, 40.0, 60.0], [20.0, 20.0, 10.0, 10.0])
    vehicle = {**ride(speed).vehicle, "bogie_height": 0.6}
    odometry = integrate_speed(ride(speed))
    step = 18_615.0 * 0.6 / (4.0 * vehicle["primary_vertical_stiffness"] * 1.28**2) * 0.5
    slope = step * ((odometry.time > 20.0) & (odometry.time < 40.0))
    expected = np.abs(band_pass(-slope, odometry.spacing, BANDS["d2"], integrate=1)).max()
    assert nodding(vehicle, odometry)["d2"].max() == pytest.approx(expected, rel=0.3)  # the pull is smoothed over 0.5 s


def test_cant_of_a_curve_is_error_of_a_rail_but_not_of_cross_level():
    one = {"vertical_d2 [m]": np.zeros(3), "vertical_d2_std [m]": np.full(3, 3e-4)}
    level = {"cross_level_d2 [m]": np.full(3, 1e-3), "cross_level_d2_std [m]": np.full(3, 8e-4)}
    columns = rails(one, level, {"cross_level_d2 [m]": np.array([0.0, np.nan, 2e-2])})
    assert columns["left_vertical_d2 [m]"] == pytest.approx(np.full(3, -5e-4))
    assert columns["right_vertical_d2_std [m]"] == pytest.approx([5e-4, 5e-4, np.hypot(1e-2, 5e-4)])


def _canted(bias: float, straight: bool = True) -> Measurements:
    """A curve of 600 m between straights, canted by 60 mm, with an accelerometer that has a bias."""
    measured = ride(STEADY)
    time = np.arange(len(STEADY)) / RATE
    ramp = np.interp(20.0 * time, *CURVE) if straight else np.ones(len(time))
    roll, yaw = -0.06 / 1.5 * ramp, 20.0 / 600.0 * ramp
    columns = {"bogie.rate_roll [rad/s]": np.gradient(roll, time), "bogie.rate_yaw [rad/s]": yaw}
    return _but(measured, columns | {"bogie.acceleration_y [m/s2]": 20.0 * yaw + GRAVITY * roll + bias})


def test_cant_is_counted_from_straight_track():
    series = CrossLevel().estimate(_canted(bias=0.1)).series.dropna(subset="cant [m]")
    true = 0.06 * np.interp(series["s [m]"], *CURVE)
    assert series["cant [m]"].to_numpy() == pytest.approx(true, abs=1.5e-3)
    assert len(series) > 0.9 * LENGTH / 0.125


def test_a_record_without_straight_track_says_that_biases_stay_in_cant():
    assert CrossLevel().estimate(_canted(bias=0.1)).about["warnings"] == []
    curved = CrossLevel().estimate(_canted(bias=0.1, straight=False))
    assert curved.about["warnings"] == [NOWHERE_STRAIGHT]


def test_cant_that_balances_a_curve():
    measured = _canted(bias=0.0)
    found = balancing_cant(measured, integrate_speed(measured))
    middle, end = round(750 / 0.125), round(200 / 0.125)
    assert found[middle] - found[end] == pytest.approx(1.5 * 20.0**2 / 600.0 / GRAVITY, rel=0.01)
