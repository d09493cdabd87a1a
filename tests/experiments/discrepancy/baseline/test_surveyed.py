"""What a track file says beyond its errors, against the closed form of Wiener (1949) and by what must stay."""

import numpy as np
from scipy.signal import welch

from experiments.discrepancy.baseline.surveyed import UNSURE, Surveyed, as_surveyed
from railsim.track.survey import TrackErrors
from railsim.track.track import Track

SPACING, ROWS, ERROR = 0.25, 16001, 2e-4
ERRORS = TrackErrors(vertical_std=ERROR)
CORNER = 0.2  # 1/m


def _line(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances, a stationary irregularity, and its two-sided density over the wave numbers of `rfftfreq` (m^3)."""
    waves = np.fft.rfftfreq(ROWS, SPACING)
    density = 1e-5 / (1.0 + (waves / CORNER) ** 4)
    white = np.fft.rfft(rng.standard_normal(ROWS))
    return SPACING * np.arange(ROWS), np.fft.irfft(white * np.sqrt(density / SPACING), ROWS), density


def _measured(values: np.ndarray, errors: TrackErrors = ERRORS, **more: np.ndarray) -> Surveyed:
    return Surveyed(Track(SPACING * np.arange(values.size), {"vertical": values, **more}, "line"), errors)


def test_errors_that_remain_are_those_of_the_closed_form_and_those_that_are_stated():
    rng = np.random.default_rng(1)
    _, true, density = _line(rng)
    surveyed = _measured(true + ERROR * rng.standard_normal(ROWS))
    own = ERROR**2 * SPACING
    least = np.sqrt(np.mean(density * own / (density + own)) / SPACING)
    left = float(np.std(surveyed.expected.vertical - true))
    assert 0.97 * least < left < 1.05 * least < 0.85 * ERROR
    drawn = float(np.std(surveyed.drawn(rng).vertical - surveyed.expected.vertical))
    assert 0.97 * left < drawn < 1.1 * left


def test_drawn_tracks_have_the_errors_at_the_waves_at_which_the_expected_one_has_them():
    rng = np.random.default_rng(2)
    _, true, density = _line(rng)
    surveyed = _measured(true + ERROR * rng.standard_normal(ROWS))
    waves, drawn = welch(surveyed.drawn(rng).vertical - surveyed.expected.vertical, 1.0 / SPACING, nperseg=256)
    of_both = np.interp(waves, np.fft.rfftfreq(ROWS, SPACING), density)
    own = ERROR**2 * SPACING
    want = 2.0 * own * np.maximum(of_both / (of_both + own), UNSURE)
    inside = (waves > 0.05) & (waves < 1.8)
    ratio = (drawn / want)[inside]
    assert 0.9 < ratio.mean() < 1.3 and np.abs(np.convolve(ratio, np.ones(8) / 8, "valid") - 1.1).max() < 0.45


def test_a_joint_in_a_smooth_line_stays_as_deep_as_it_was_measured():
    rng = np.random.default_rng(3)
    s = SPACING * np.arange(8001)
    errors = ERROR * rng.standard_normal(s.size)
    for half, share in ((1.5, 0.93), (0.7, 0.85)):
        dip = -2e-3 * np.clip(1.0 - np.abs(s - 1000.0) / half, 0.0, None)
        kept = _measured(dip + errors).expected.vertical
        assert share * 2e-3 < -kept.min() < 2.2e-3
        assert kept[np.abs(s - 1000.0) > 30.0].std() < 0.4 * ERROR


def test_a_file_without_errors_and_an_estimate_stay_as_they_are():
    rng = np.random.default_rng(4)
    _, true, _ = _line(rng)
    assert np.array_equal(_measured(true, TrackErrors()).expected.vertical, true)
    estimated = Surveyed(Track(SPACING * np.arange(ROWS), {"vertical": true}, "line"), ERRORS, estimated=True)
    assert np.array_equal(estimated.expected.vertical, true)
    assert np.isclose(np.std(estimated.drawn(rng).vertical - true), ERROR, rtol=0.05)


def test_what_a_filtered_file_lacks_is_left_open():
    rng = np.random.default_rng(5)
    waves = np.fft.rfftfreq(ROWS, SPACING)
    smooth = np.fft.irfft(np.where(waves < 0.5, np.fft.rfft(ERROR * rng.standard_normal(ROWS)), 0.0), ROWS)
    _, true, _ = _line(rng)
    surveyed = _measured(np.fft.irfft(np.where(waves < 0.5, np.fft.rfft(true), 0.0), ROWS) + smooth)
    at, drawn = welch(surveyed.drawn(rng).vertical - surveyed.expected.vertical, 1.0 / SPACING, nperseg=256)
    short = drawn[(at > 0.8) & (at < 1.8)].mean()
    assert np.isclose(short, 2.0 * ERROR**2 * SPACING, rtol=0.15)


def test_what_was_not_measured_and_uneven_rows_stay():
    rng = np.random.default_rng(6)
    _, true, _ = _line(rng)
    friction = np.full(ROWS, 0.3)
    surveyed = _measured(true + ERROR * rng.standard_normal(ROWS), friction=friction)
    for track in (surveyed.expected, surveyed.drawn(rng)):
        assert track.friction is not None and np.array_equal(track.friction, friction)
    s = np.cumsum(rng.uniform(0.2, 0.3, ROWS))
    uneven = Surveyed(Track(s, {"vertical": true}, "line"), ERRORS)
    assert np.array_equal(uneven.expected.vertical, true)


def test_a_line_is_surveyed_with_the_stated_errors_and_the_same_ones_each_time():
    rng = np.random.default_rng(7)
    s, true, _ = _line(rng)
    line = Track(s, {"vertical": true, "friction": np.full(ROWS, 0.3)}, "line")
    file = as_surveyed(line, ERRORS, 1)
    assert np.isclose(np.std(file.vertical - true), ERROR, rtol=0.03)
    assert file.friction is not None and np.ptp(file.friction) == 0.0
    assert np.array_equal(file.vertical, as_surveyed(line, ERRORS, 1).vertical)
    assert not np.array_equal(file.vertical, as_surveyed(line, ERRORS, 2).vertical)
