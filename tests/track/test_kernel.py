"""Tables of the compiled kernels against the track they come from."""

import numba
import numpy as np
import pytest

from railsim.errors import InputError
from railsim.track import CANT_BASE, Track, kernel, read_track
from railsim.track.kernel import TrackTables, build_tables, sample

RAILS = {
    kernel.LEFT_VERTICAL: "left_vertical",
    kernel.RIGHT_VERTICAL: "right_vertical",
    kernel.LEFT_LATERAL: "left_lateral",
    kernel.RIGHT_LATERAL: "right_lateral",
}


@pytest.fixture(scope="module")
def curve() -> Track:
    """The shipped curve on a hill."""
    track = read_track("curve_r400")
    gradient = 0.02 * np.sin(track.s / 60)
    return Track(track.s, track.columns() | {"gradient": gradient}, "hill")


@pytest.fixture(scope="module")
def tables(curve: Track) -> TrackTables:
    return build_tables(curve)


@pytest.fixture(scope="module")
def places(curve: Track) -> np.ndarray:
    return np.random.default_rng(3).uniform(0, curve.length, 20_000)


def test_rails_and_design_are_the_tracks_own(curve: Track, tables: TrackTables, places: np.ndarray) -> None:
    there = curve.at(places)
    for channel, key in RAILS.items():
        assert np.abs(sample(tables, channel, places) - getattr(there, key)).max() < 1e-14
    assert np.abs(sample(tables, kernel.CURVATURE, places) - there.curvature).max() < 1e-5 / 400
    assert np.abs(sample(tables, kernel.ROLL, places) + np.arcsin(there.cant / CANT_BASE)).max() < 1e-9
    assert np.abs(np.sin(sample(tables, kernel.GRADIENT, places)) - there.gradient).max() < 1e-9


def test_derivatives_match_differences(tables: TrackTables) -> None:
    inside = tables.ds * (np.arange(10, tables.count - 10) + 0.5)
    step = 1e-3
    for channel in range(kernel.LEFT_FRICTION):
        low, mid, high = (sample(tables, channel, inside + d) for d in (-step, 0, step))
        first, second = (high - low) / (2 * step), (high - 2 * mid + low) / step**2
        scale = np.abs(sample(tables, channel, inside)).max()
        third = np.abs(
            tables.coefficients[:, channel, 3]
        ).max()  # the central difference of a cubic is off by c3 step^2
        assert np.abs(sample(tables, channel, inside, 1) - first).max() < 2 * third * step**2 + 1e-12 * scale
        assert np.abs(sample(tables, channel, inside, 2) - second).max() < 1e-8 * scale


def test_second_derivative_is_continuous_across_cells(tables: TrackTables) -> None:
    c, x = tables.coefficients, tables.ds
    for channel in range(kernel.LEFT_FRICTION):
        before, after = c[:-1, channel], c[1:, channel]
        value = before[:, 0] + x * (before[:, 1] + x * (before[:, 2] + x * before[:, 3])) - after[:, 0]
        slope = before[:, 1] + x * (2 * before[:, 2] + 3 * x * before[:, 3]) - after[:, 1]
        bend = 2 * before[:, 2] + 6 * x * before[:, 3] - 2 * after[:, 2]
        size = [np.abs(c[:, channel, i]).max() for i in range(3)]
        assert np.abs(value).max() < 1e-12 * max(size[0], 1e-9)
        assert np.abs(slope).max() < 1e-10 * max(size[1], 1e-9)
        if channel != kernel.CURVATURE:  # defined as the slope of the heading: its own slope is continuous, no more
            assert np.abs(bend).max() < 1e-8 * max(size[2], 1e-9)


def test_heading_and_centre_line_agree(tables: TrackTables, places: np.ndarray) -> None:
    curvature = sample(tables, kernel.CURVATURE, places)
    assert np.abs(sample(tables, kernel.HEADING, places, 1) - curvature).max() < 1e-17
    assert np.abs(sample(tables, kernel.HEADING, places, 2) - sample(tables, kernel.CURVATURE, places, 1)).max() < 1e-16
    heading, climb = sample(tables, kernel.HEADING, places), sample(tables, kernel.GRADIENT, places)
    tangent = {
        kernel.EAST: np.cos(heading) * np.cos(climb),
        kernel.NORTH: np.sin(heading) * np.cos(climb),
        kernel.UP: np.sin(climb),
    }
    for channel, direction in tangent.items():
        assert np.abs(sample(tables, channel, places, 1) - direction).max() < 5e-9


def test_circle_closes() -> None:
    radius = 200.0
    s = np.linspace(0, 2 * np.pi * radius, 2001)
    tables = build_tables(Track(s, {"curvature": np.full(s.size, 1 / radius)}))
    end = [sample(tables, channel, s[-1:])[0] for channel in (kernel.EAST, kernel.NORTH, kernel.HEADING)]
    assert end == pytest.approx([0, 0, 2 * np.pi], abs=1e-9)
    half = sample(tables, kernel.NORTH, s[-1:] / 2)[0]
    assert half == pytest.approx(2 * radius, abs=1e-9)  # the circle lies to the left


def test_mirror_of_the_track_mirrors_the_tables(curve: Track, tables: TrackTables) -> None:
    mirror = build_tables(curve.mirrored()).coefficients
    here = tables.coefficients
    for channel in (kernel.CURVATURE, kernel.ROLL, kernel.HEADING, kernel.NORTH):
        assert np.array_equal(here[:, channel], -mirror[:, channel])
    for channel in (kernel.EAST, kernel.UP, kernel.GRADIENT):
        assert np.array_equal(here[:, channel], mirror[:, channel])
    assert np.array_equal(here[:, kernel.LEFT_VERTICAL], mirror[:, kernel.RIGHT_VERTICAL])
    assert np.array_equal(here[:, kernel.LEFT_LATERAL], -mirror[:, kernel.RIGHT_LATERAL])


def test_friction_is_nan_where_the_scenario_gives_it(tables: TrackTables) -> None:
    assert not tables.friction_given
    assert np.isnan(tables.coefficients[:, kernel.LEFT_FRICTION]).all()
    s = np.linspace(0, 10, 41)
    steps = np.where(s < 5, 0.4, 0.05)
    slippery = build_tables(Track(s, {"friction": steps}))
    assert slippery.friction_given
    for channel in (kernel.LEFT_FRICTION, kernel.RIGHT_FRICTION):
        assert sample(slippery, channel, s) == pytest.approx(steps)
        between = sample(slippery, channel, np.linspace(0, 10, 999))
        assert between.min() > 0.05 - 1e-12 and between.max() < 0.4 + 1e-12


def test_coarse_and_irregular_rows_are_kept() -> None:
    coarse = Track(np.linspace(10, 110, 11), {"vertical": np.sin(np.arange(11.0)) * 1e-3})
    fine = build_tables(coarse)
    assert fine.ds <= kernel.WIDEST_CELL
    places = np.linspace(10, 110, 777)
    assert np.abs(sample(fine, kernel.LEFT_VERTICAL, places) - coarse.at(places).left_vertical).max() < 1e-14
    s = np.cumsum(np.random.default_rng(1).uniform(0.1, 0.5, 400))
    uneven = Track(s, {"lateral": 2e-3 * np.sin(2 * np.pi * s / 5)})
    places = np.linspace(s[0], s[-1], 5000)
    error = sample(build_tables(uneven), kernel.LEFT_LATERAL, places) - uneven.at(places).left_lateral
    assert np.abs(error).max() < 1e-6


def test_distances_outside_are_clamped(tables: TrackTables) -> None:
    ends = sample(tables, kernel.EAST, [0.0, 1000.0])
    assert np.array_equal(sample(tables, kernel.EAST, [-5.0, 1005.0]), ends)
    assert np.array_equal(sample(tables, kernel.EAST, [-np.inf, np.inf]), ends)
    assert np.isnan(sample(tables, kernel.EAST, [np.nan])).all()


def test_too_many_cells_are_refused() -> None:
    s = np.concatenate([np.linspace(0, 1, 5), [2e5]])
    with pytest.raises(InputError, match="cells, more than"):
        build_tables(Track(s))


@numba.njit
def _through_plain_arguments(s0: float, ds: float, count: int, coefficients: np.ndarray, s: float) -> float:
    cell, x = kernel.locate(s0, ds, count, s)
    return kernel.value(coefficients, cell, 7, x) + kernel.slope(coefficients, cell, 7, x) * 0.0


def test_kernels_serve_other_kernels(curve: Track, tables: TrackTables) -> None:
    found = _through_plain_arguments(tables.s0, tables.ds, tables.count, tables.coefficients, 321.123)
    assert found == pytest.approx(curve.at([321.123]).left_vertical[0], abs=1e-15)
    assert tables.coefficients.flags.c_contiguous
