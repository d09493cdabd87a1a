"""Band filters over distance: closed forms."""

import numpy as np
import pytest

from estimators.signals.bands import (
    BANDS,
    LATERAL_BANDS,
    Band,
    band_pass,
    bands_of,
    high_pass,
    response,
    settled,
    stretches,
)

SPACING = 0.125
S = SPACING * np.arange(8000)
INSIDE = slice(2500, 5500)


@pytest.mark.parametrize("name", list(BANDS))
def test_wave_inside_a_band_passes_without_shift_and_outside_it_does_not(name: str):
    band = BANDS[name]
    middle = np.sqrt(band.shortest * band.longest)
    wave = np.sin(2 * np.pi * S / middle)
    share = 1 / (1 + (band.shortest / middle) ** 8) ** 2  # the same at both edges, as far away in octaves
    assert band_pass(wave, SPACING, band)[INSIDE] == pytest.approx(share * wave[INSIDE], abs=0.005)
    for outside in (band.shortest / 2, band.longest * 2):
        assert np.abs(band_pass(np.sin(2 * np.pi * S / outside), SPACING, band)[INSIDE]).max() < 0.006


def test_half_amplitude_at_the_edges_and_neighbours_add_up():
    edge = np.array([2 * np.pi / 25.0])
    assert response(edge, BANDS["d1"])[0] == pytest.approx(0.5, abs=1e-6)
    assert response(edge, BANDS["d2"])[0] == pytest.approx(0.5, abs=1e-3)
    k = 2 * np.pi / np.geomspace(10.0, 60.0, 50)
    both = response(k, Band(3.0, 70.0))
    assert response(k, BANDS["d1"]) + response(k, BANDS["d2"]) == pytest.approx(both, abs=0.002)


def test_double_integral_of_a_curvature_is_the_path():
    k = 2 * np.pi / 18.0
    path = 2e-3 * np.sin(k * S)
    drift = 1e-3 + 2e-7 * S  # a gyro's bias and its slope
    found = band_pass(-(k**2) * path + drift, SPACING, Band(0.0, 70.0), integrate=2)
    assert found[INSIDE] == pytest.approx(path[INSIDE], abs=2e-6)


def test_time_reversal_reverses_the_result():
    values = np.cumsum(np.random.default_rng(1).normal(size=4000))
    forward = band_pass(values, SPACING, BANDS["d2"])
    assert band_pass(values[::-1], SPACING, BANDS["d2"])[::-1] == pytest.approx(forward, abs=1e-9)


def test_gap_stays_a_gap_and_does_not_reach_the_other_side():
    values = np.sin(2 * np.pi * S / 10.0)
    values[4000:4100] = np.nan
    found = band_pass(values, SPACING, BANDS["d1"])
    assert np.array_equal(np.isnan(found), np.isnan(values))
    values[4100:] = 7.0
    assert np.array_equal(band_pass(values, SPACING, BANDS["d1"])[:4000], found[:4000])


def test_memory_has_decayed_as_stated():
    step = np.where(np.arange(8000) < 4000, 0.0, 1.0)
    left = np.abs(high_pass(step, SPACING, 25.0))
    assert left[4000 + round(50.0 / SPACING) :][:2000].max() < 0.01


def test_stretches_and_what_is_settled():
    present = np.array([1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1], dtype=bool)
    assert stretches(present) == [(0, 4), (5, 11)]
    assert np.flatnonzero(settled(present, 1.0, 2.0)).tolist() == [7, 8]


def test_lateral_quantities_reach_to_200_m():
    assert bands_of("left_lateral") == bands_of("gauge_deviation") == LATERAL_BANDS
    assert bands_of("vertical")["d3"] == Band(70.0, 150.0)


@pytest.mark.parametrize("longest", [70.0, 700.0])
def test_rows_are_filtered_each_as_if_alone(longest: float):
    """Also where a stretch is shorter than the filter's reach."""
    rows = np.random.default_rng(2).normal(size=(3, 1500))
    rows[:, 600:610] = np.nan
    band = Band(3.0, longest)
    alone = np.stack([band_pass(row, SPACING, band, integrate=2) for row in rows])
    assert np.array_equal(band_pass(rows, SPACING, band, integrate=2), alone, equal_nan=True)
