"""Ride comfort against published weightings, and closed forms of sine waves."""

import numpy as np
import pytest

from estimators.ride.ride_comfort import BLOCK, RideComfort
from estimators.ride.weighting import HORIZONTAL, VERTICAL, sperling, sperling_index
from railsim import InputError
from railsim.measurements import TIME, Measurements

RATE = 256.0
NAMES = [f"body.acceleration_{axis} [m/s2]" for axis in "xyz"]


def record(length: float, frequency: float = 2.0, errors: dict[str, float] | None = None) -> Measurements:
    """Sine waves of 0.1, 0.2 and 0.3 m/s2 along the three axes, gravity on the last."""
    time = np.arange(round(length * RATE)) / RATE
    wave = np.sin(2.0 * np.pi * frequency * time)
    table = {TIME: time} | {name: (0.1 + 0.1 * i) * wave + 9.81 * (i == 2) for i, name in enumerate(NAMES)}
    sheet = {"kind": "accelerometer", "name": "body", "body": "body", "channels": NAMES, "errors": errors or {}}
    return Measurements({"origin": "test", "vehicle": {}, "sensors": [sheet]}, {RATE: table})


@pytest.mark.parametrize(
    ("frequency", "published"),
    [(0.5, 0.853), (1.0, 1.011), (2.0, 0.890), (4.0, 0.512), (8.0, 0.253), (16.0, 0.125), (31.5, 0.0632)],
)
def test_horizontal_weighting_is_that_of_iso_2631(frequency: float, published: float) -> None:
    """W_d of ISO 2631-1:1997, table 3; EN 12299 uses the same."""
    assert abs(HORIZONTAL.response(np.array([frequency]))[0]) == pytest.approx(published, rel=0.005)


def test_vertical_weighting_follows_its_asymptotes() -> None:
    """BS 6841, table 3: 0.4 below 2 Hz, f / 5 up to 5 Hz, 1 up to 16 Hz, 16 / f beyond; the filter is within 20 %."""
    for frequency, asymptote in ((1.0, 0.4), (1.6, 0.4), (8.0, 1.0), (12.5, 1.0), (31.5, 16 / 31.5), (50.0, 0.32)):
        assert abs(VERTICAL.response(np.array([frequency]))[0]) == pytest.approx(asymptote, rel=0.2)


def test_sperling_weighs_most_between_4_and_6_hz() -> None:
    frequency = np.arange(0.5, 30.0, 0.01)
    for vertical in (True, False):
        assert 4.0 < frequency[np.argmax(sperling(frequency, vertical))] < 6.5
    assert sperling_index(np.array([0.1]))[0] == pytest.approx(4.42 * 0.1**0.3)


def test_a_sine_has_the_rms_of_its_weighted_amplitude() -> None:
    found = RideComfort().estimate(record(60.0)).series.iloc[2:-2]
    for axis, size, weighting in zip("xyz", (0.1, 0.2, 0.3), (HORIZONTAL, HORIZONTAL, VERTICAL), strict=True):
        expected = size * abs(weighting.response(np.array([2.0]))[0]) / np.sqrt(2.0)
        assert found[f"comfort_{axis} [m/s2]"].to_numpy() == pytest.approx(expected, rel=1e-3)


def test_mean_comfort_is_that_of_the_percentiles_and_needs_five_minutes() -> None:
    assert RideComfort().estimate(record(60.0)).series["mean_comfort [-]"].isna().to_numpy().all()
    found = RideComfort().estimate(record(320.0)).series
    parts = [found[f"comfort_{axis} [m/s2]"].iloc[30] for axis in "xyz"]
    assert found["mean_comfort [-]"].iloc[62] == pytest.approx(6.0 * np.linalg.norm(parts), rel=1e-3)


def test_noise_is_taken_out_and_stated() -> None:
    quiet = RideComfort().estimate(record(60.0)).series["comfort_y [m/s2]"].to_numpy()
    density, off = 0.05, []
    for seed in range(12):
        noisy, rng = record(60.0, errors={"noise_density": density}), np.random.default_rng(seed)
        table = {TIME: noisy.time(NAMES[0])}
        table |= {
            name: noisy[name] + density * np.sqrt(RATE / 2) * rng.standard_normal(len(noisy[name])) for name in NAMES
        }
        found = RideComfort().estimate(Measurements(noisy.about, {RATE: table})).series
        off.append((found["comfort_y [m/s2]"].to_numpy() - quiet) / found["comfort_y_std [m/s2]"].to_numpy())
    assert abs(np.mean(off)) < 0.3
    assert 0.85 < np.mean(np.abs(off) < 2.0) <= 1.0


def test_a_block_with_lost_samples_is_not_given() -> None:
    whole = record(30.0)
    table = {TIME: whole.time(NAMES[0])} | {name: whole[name].copy() for name in NAMES}
    lost = slice(round(11.0 * RATE), round(12.0 * RATE))
    table[NAMES[1]][lost] = np.nan
    found = RideComfort().estimate(Measurements(whole.about, {RATE: table})).series
    assert list(np.flatnonzero(found["valid [-]"] < 0.5)) == [int(11.0 // BLOCK)]
    assert np.isnan(found["comfort_y [m/s2]"].iloc[2])


def test_what_is_missing_is_said() -> None:
    with pytest.raises(InputError, match="needs channels 'floor.acceleration_y"):
        RideComfort(sensor="floor").estimate(record(10.0))
