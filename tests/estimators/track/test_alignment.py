"""Estimators of track geometry: closed forms on a rigid bogie, signs, mirror images, time reversal, standstill."""

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from estimators.track.alignment_accelerometer import AlignmentAccelerometer
from estimators.track.alignment_lateral import AlignmentLateral
from estimators.track.alignment_vertical import AlignmentVertical
from estimators.track.cross_level import CrossLevel
from railsim import InputError
from tests.estimators.track_rig import ARM, RATE, ride, wave

STEADY = np.full(round(40 * RATE), 15.0)


def inside(estimate: Estimate, margin: float = 180.0) -> pd.DataFrame:
    """Rows that are not near the ends."""
    series = estimate.series
    place = series["s [m]"]
    return series.loc[(place > margin) & (place < float(place.iloc[-1]) - margin)]


@pytest.mark.parametrize("length", [5.0, 10.0, 20.0])
def test_vertical_is_the_chord_and_with_compensation_the_track(length: float):
    measured = ride(STEADY, vertical=wave(length), bias=1e-3)
    chord = np.sin(2 * np.pi * ARM / length) / (2 * np.pi * ARM / length)
    for compensate, share in ((False, chord), (True, 1.0)):
        rows = inside(AlignmentVertical(compensate=compensate, regularisation=1e-5).estimate(measured))
        true = share * wave(length)(rows["s [m]"].to_numpy())
        assert rows["vertical [m]"].to_numpy() == pytest.approx(true, abs=5e-5)
        in_band = 1 / (1 + (length / 25.0) ** 8) / (1 + (3.0 / length) ** 8)
        assert rows["vertical_d1 [m]"].to_numpy() == pytest.approx(in_band * true, abs=5e-5)


def test_alignment_of_a_speeding_train_is_that_of_a_steady_one():
    speed = np.interp(np.arange(round(50 * RATE)) / RATE, [0, 50], [6.0, 24.0])
    rows = inside(AlignmentVertical(compensate=True).estimate(ride(speed, vertical=wave(12.0))))
    assert rows["vertical [m]"].to_numpy() == pytest.approx(wave(12.0)(rows["s [m]"].to_numpy()), abs=1e-4)


@pytest.mark.parametrize("domain", ["space", "time"])
@pytest.mark.parametrize("place", [0.0, ARM])
def test_accelerometer_gives_the_path_of_its_own_place(domain: str, place: float):
    measured = ride(STEADY, vertical=wave(20.0), place=place)
    settings = AlignmentAccelerometer.build({"domain": domain, "compensate": False})
    rows = inside(settings.estimate(measured))
    s = rows["s [m]"].to_numpy() - place  # where the bogie's centre was
    k = 2 * np.pi / 20.0
    slope = 2e-3 * np.cos(k * s) * np.sin(k * ARM) / ARM
    path = 2e-3 * np.sin(k * s) * np.cos(k * ARM) + place * slope
    assert rows["vertical [m]"].to_numpy() == pytest.approx(path, abs=5e-5)


def test_left_is_positive_and_a_mirror_changes_the_sign():
    found = []
    for sign in (1.0, -1.0):
        measured = ride(STEADY, lateral=wave(20.0, sign * 2e-3), cross_level=wave(30.0, sign * 2e-3))
        lateral = inside(AlignmentLateral(compensation=False).estimate(measured))
        level = inside(CrossLevel().estimate(measured))
        found.append((lateral["lateral [m]"].to_numpy(), level["cross_level [m]"].to_numpy()))
        s = lateral["s [m]"].to_numpy()
        chord = np.sinc(2 * ARM / 20.0)
        assert found[-1][0] == pytest.approx(sign * chord * wave(20.0)(s), abs=3e-5)
        mean = np.cos(2 * np.pi * ARM / 30.0)
        assert found[-1][1] == pytest.approx(sign * mean * wave(30.0)(s), abs=3e-5)
    for one, other in zip(*found, strict=True):
        assert one == pytest.approx(-other, abs=1e-9)


def test_twist_is_the_slope_of_cross_level_over_the_base():
    rows = inside(CrossLevel(base=3.0).estimate(ride(STEADY, cross_level=wave(30.0))))
    s = rows["s [m]"].to_numpy()
    true = np.cos(2 * np.pi * ARM / 30.0) * (wave(30.0)(s + 1.5) - wave(30.0)(s - 1.5)) / 3.0
    assert rows["twist [m/m]"].to_numpy() == pytest.approx(true, abs=5e-6)


def test_backwards_over_the_track_gives_the_reversed_alignment():
    length = float(np.sum((STEADY[1:] + STEADY[:-1]) / 2 / RATE))

    def bump(s: np.ndarray) -> np.ndarray:
        return 3e-3 * np.exp(-(((s - 0.4 * length) / 4.0) ** 2))

    there = AlignmentVertical(compensate=True).estimate(ride(STEADY, vertical=bump)).series
    back = AlignmentVertical(compensate=True).estimate(ride(STEADY, vertical=lambda s: bump(length - s))).series
    place = there["s [m]"].to_numpy()
    reversed_ = np.interp(length - place, place, back["vertical [m]"].to_numpy())
    middle = slice(800, -800)
    assert there["vertical [m]"].to_numpy()[middle] == pytest.approx(reversed_[middle], abs=5e-5)


@pytest.mark.parametrize("kind", [AlignmentVertical, AlignmentLateral, AlignmentAccelerometer, CrossLevel])
def test_stop_leaves_a_gap_and_no_blow_up(kind: type):
    time = np.arange(round(140 * RATE)) / RATE
    speed = np.interp(time, [0, 40, 50, 80, 90, 140], [12.0, 12.0, 0.0, 0.0, 12.0, 12.0])
    measured = ride(speed, vertical=wave(15.0), lateral=wave(15.0), cross_level=wave(15.0), bias=2e-3)
    settings = kind.build({"compensation": False} if kind is AlignmentLateral else {})
    series = settings.estimate(measured).series
    quantity = next(name for name in ("vertical [m]", "lateral [m]", "cross_level [m]") if name in series)
    values, valid = series[quantity].to_numpy(), series["valid [-]"].to_numpy() > 0.5
    stop = 540.0  # m
    at = np.abs(series["s [m]"].to_numpy() - stop) < 0.5
    assert np.isnan(values[at]).all()
    assert not valid[np.abs(series["s [m]"].to_numpy() - stop) < 20.0].any()
    assert np.nanmax(np.abs(values)) < 10e-3
    assert np.isfinite(values[valid]).all()
    assert valid.mean() > 0.8
    middle = valid & (series["s [m]"].to_numpy() < 450.0) & (series["s [m]"].to_numpy() > 150.0)
    assert np.abs(values[middle]).max() < 2.2e-3


def test_missing_channel_or_speed_is_named():
    measured = ride(STEADY)
    assert AlignmentVertical().fits(measured)
    assert not AlignmentAccelerometer(sensor="bogie_lead").fits(measured)
    with pytest.raises(InputError, match="needs channel 'bogie_lead.acceleration_z"):
        AlignmentAccelerometer(sensor="bogie_lead").estimate(measured)
    with pytest.raises(InputError, match="needs vehicle parameters"):
        AlignmentLateral().estimate(measured)
