"""Track: interpolation, totals, mirror, digest, refusals."""

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.track import Track
from railsim.track.track import UNITS


@pytest.fixture
def full_track() -> Track:
    """Every column filled with its own noise on distances that are not equal."""
    rng = np.random.default_rng(7)
    s = np.cumsum(rng.uniform(0.1, 0.4, 300))
    columns = {key: rng.normal(size=s.size) * 1e-3 for key in UNITS}
    columns["friction"] = rng.uniform(0.05, 0.5, s.size)
    columns["stiffness"] = rng.uniform(1e7, 1e8, s.size)
    return Track(s, columns, "full")


def test_rows_are_met_and_second_derivative_is_continuous(full_track: Track) -> None:
    there = full_track.at(full_track.s)
    assert np.allclose(there.curvature, full_track.curvature, rtol=0, atol=1e-15)
    spline = full_track.splines["left_vertical"]
    inner, step = full_track.s[5:-5], 1e-7
    jump = spline(inner + step, 2) - spline(inner - step, 2)
    bend = np.abs(spline(inner, 3)).max()
    assert np.abs(jump).max() < 3 * step * bend + 1e-9 * np.abs(spline(inner, 2)).max()


def test_totals_follow_the_signs_of_the_contract() -> None:
    s = np.arange(5.0)
    ones = np.ones(5)
    columns = {
        "vertical": 1 * ones,
        "cross_level": 0.2 * ones,
        "left_vertical": 0.01 * ones,
        "right_vertical": 0.02 * ones,
    }
    columns |= {"lateral": 2 * ones, "gauge_deviation": 0.4 * ones, "left_lateral": 0.03 * ones}
    there = Track(s, columns).at([2.5])
    assert there.left_vertical == pytest.approx([1 - 0.1 + 0.01])
    assert there.right_vertical == pytest.approx([1 + 0.1 + 0.02])
    assert there.left_lateral == pytest.approx([2 + 0.2 + 0.03])
    assert there.right_lateral == pytest.approx([2 - 0.2])
    assert there.cross_level == pytest.approx([0.21])
    assert there.gauge_deviation == pytest.approx([0.43])
    assert there.vertical == pytest.approx([1.015])
    assert there.lateral == pytest.approx([2.015])


def test_missing_columns_are_zero_or_the_scenarios() -> None:
    track = Track(np.arange(4.0))
    assert track.given == ()
    there = track.at([0.5, 3.0])
    assert not there.curvature.any() and not there.left_lateral.any()
    assert there.friction is None and there.stiffness is None


def test_friction_never_leaves_the_range_of_its_rows() -> None:
    friction = np.where(np.arange(50) % 10 < 5, 0.4, 0.03)
    track = Track(np.arange(50.0), {"friction": friction})
    between = track.at(np.linspace(0, 49, 5000)).friction
    assert between is not None
    assert between.min() >= 0.03 - 1e-15 and between.max() <= 0.4 + 1e-15


def test_mirror_is_exact_and_its_own_inverse(full_track: Track) -> None:
    mirror = full_track.mirrored()
    s = np.linspace(full_track.s[0], full_track.s[-1], 1001)
    here, there = full_track.at(s), mirror.at(s)
    for same in ("gradient", "friction", "stiffness"):
        assert np.array_equal(getattr(here, same), getattr(there, same))
    for turned in ("curvature", "cant"):
        assert np.array_equal(getattr(here, turned), -getattr(there, turned))
    assert np.array_equal(here.left_vertical, there.right_vertical)
    assert np.array_equal(here.right_vertical, there.left_vertical)
    assert np.array_equal(here.left_lateral, -there.right_lateral)
    assert np.array_equal(here.right_lateral, -there.left_lateral)
    assert mirror.digest() != full_track.digest()
    assert mirror.mirrored().digest() == full_track.digest()


def test_digest_sees_numbers_and_nothing_else(full_track: Track) -> None:
    again = Track(full_track.s, full_track.columns(), "other name", ["a comment"])
    assert again.digest() == full_track.digest()
    columns = full_track.columns()
    columns["vertical"] = columns["vertical"] + 1e-15
    assert Track(full_track.s, columns).digest() != full_track.digest()
    s = np.arange(4.0)
    assert Track(s, {"vertical": np.zeros(4)}).digest() == Track(s).digest()
    assert Track(s, {"friction": np.full(4, 0.3)}).digest() != Track(s).digest()


def test_arrays_cannot_be_changed(full_track: Track) -> None:
    with pytest.raises(ValueError, match="read-only"):
        full_track.vertical[0] = 1.0
    with pytest.raises(AttributeError):
        full_track.name = "x"  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize("s", [[-0.1], [3.1], [np.nan], [0.0, 4.0]])
def test_places_off_the_track_are_refused(s: list[float]) -> None:
    with pytest.raises(InputError, match="from 0 to 3 m"):
        Track(np.arange(4.0)).at(s)


@pytest.mark.parametrize(
    ("s", "columns", "message"),
    [
        ([0, 1, 2], {}, "only 3 rows"),
        ([0, 1, 1, 2], {}, "row 3: s goes from 1 to 1 m"),
        ([0, 1, 2, 3], {"vertical": [0, 1]}, "vertical must be one number per row"),
        ([0, 1, 2, 3], {"height": [0, 1, 2, 3]}, "unknown column 'height'"),
        ([0, 1, 2, 3], {"lateral": [0, 1, np.inf, 3]}, "row 3: lateral is inf"),
        ([0, np.nan, 2, 3], {}, "row 2: s is nan"),
        ([0, 1, 2, 3], {"friction": [0.3, 0.3, 0.3, 0.0]}, "row 4: friction is 0; it must be greater"),
        ([0, 1, 2, 3], {"stiffness": [1e7, -1.0, 1e7, 1e7]}, "row 2: stiffness is -1"),
        ([0, 1, 2, 3], {"cant": [0, 0, 150, 0]}, "row 3: cant is 150 m; its size must be below 1.5"),
    ],
)
def test_impossible_tracks_are_refused(s: list[float], columns: dict[str, list[float]], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        Track(s, columns, "mine")
    assert "\n" not in str(caught.value)
