"""Passes laid on each other: known stretch and shift, known change."""

import numpy as np
import pytest

from estimators.signals.bands import BANDS, band_pass
from estimators.track.passes import changes, laid_on, match

SPACING = 0.125


def track(rng: np.random.Generator, count: int = 9000) -> np.ndarray:
    """D1 of a random walk's heights, 1 mm."""
    values = band_pass(np.cumsum(rng.normal(size=count)), SPACING, BANDS["d1"])
    return 1e-3 * values / values.std()


def seen(values: np.ndarray, scale: float, shift: float, noise: float, rng: np.random.Generator) -> np.ndarray:
    """The same with an odometer that reads `scale` times too much from a start `shift` m earlier."""
    grid = SPACING * np.arange(int((len(values) * SPACING + shift) * scale / SPACING))
    place = grid / scale - shift
    heard = np.interp(place, SPACING * np.arange(len(values)), values, np.nan, np.nan)
    return heard + band_pass(rng.normal(size=len(grid)) * noise, SPACING, BANDS["d1"])


@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1.012, 25.0), (0.988, -40.0)])
def test_stretch_and_shift_are_found(scale: float, shift: float):
    rng = np.random.default_rng(5)
    first = track(rng)
    second = seen(first, scale, shift, 2e-4, rng)
    found = match(first, second, SPACING)
    place = SPACING * np.arange(len(first))
    inside = (place > 100.0) & (place < place[-1] - 100.0)
    assert found.other_distance(place)[inside] == pytest.approx(
        ((place + shift) * scale)[inside], abs=0.125
    )  # a cell of the grid
    error = laid_on(second, SPACING, found, place)[inside] - first[inside]
    assert np.sqrt(np.nanmean(error**2)) < 0.1e-3
    assert np.isfinite(error).mean() > 0.95


def test_what_has_grown_is_found_at_its_place_and_nothing_else():
    rng = np.random.default_rng(6)
    first = track(rng)
    place = SPACING * np.arange(len(first))
    later = first - 1e-3 * np.exp(-(((place - 500.0) / 2.0) ** 2))
    second = seen(later, 1.008, 10.0, 3e-4, rng)
    aligned = laid_on(second, SPACING, match(first, second, SPACING), place)
    events = changes(first, aligned, SPACING)
    assert len(events) == 1
    assert events[0]["s [m]"] == pytest.approx(500.0, abs=0.5)
    assert events[0]["change [m]"] == pytest.approx(-1e-3, abs=0.2e-3)
    unchanged = seen(first, 1.008, 10.0, 3e-4, rng)
    assert changes(first, laid_on(unchanged, SPACING, match(first, unchanged, SPACING), place), SPACING) == []


def test_another_track_is_not_taken_for_this_one():
    rng = np.random.default_rng(7)
    assert len(match(track(rng), track(rng), SPACING).distance) < 3
