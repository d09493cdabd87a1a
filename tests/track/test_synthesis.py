"""Design geometry against the closed forms of circle and clothoid."""

import numpy as np
import pytest
from scipy.special import fresnel

from railsim.errors import InputError
from railsim.track import Track, kernel
from railsim.track.kernel import build_tables, sample
from railsim.track.synthesis import Segment, Transition, design, distances, fade_in

RADIUS, RAMP = 400.0, 60.0


def _clothoid(distance: float) -> tuple[float, float]:
    """Along and across the start's tangent, m, after `distance` of a clothoid that reaches 1/RADIUS after RAMP."""
    scale = np.sqrt(np.pi * RADIUS * RAMP)
    sine, cosine = fresnel(distance / scale)
    return float(scale * cosine), float(scale * sine)


@pytest.mark.parametrize("side", [1, -1])
def test_clothoid_is_the_fresnel_integral(side: int) -> None:
    s = distances(160, 0.2)
    pieces = [Segment(40), Transition(RAMP), Segment(60, curvature=side / RADIUS, cant=side * 0.1)]
    sharp = design(pieces, s, rounding=0.0)
    assert sharp["curvature"][s == 70.0] == pytest.approx(side / RADIUS / 2)
    tables = build_tables(Track(s, sharp))
    for distance in (20.0, 59.0):
        along, across = _clothoid(distance)
        where = [40 + distance]
        assert sample(tables, kernel.EAST, where)[0] == pytest.approx(40 + along, abs=1e-6)
        assert sample(tables, kernel.NORTH, where)[0] == pytest.approx(side * across, abs=1e-5)
        assert sample(tables, kernel.HEADING, where)[0] == pytest.approx(
            side * distance**2 / (2 * RADIUS * RAMP), abs=1e-6
        )


def test_rounding_keeps_heading_and_centre_of_the_ramp() -> None:
    s = distances(700, 0.2)
    arc = Segment(300, curvature=1 / RADIUS, cant=0.15, gradient=0.01)
    pieces = [Segment(100), Transition(60), arc, Transition(60), Segment(180)]
    smooth, sharp = design(pieces, s), design(pieces, s, rounding=0.0)
    for key in ("curvature", "cant", "gradient"):
        apart = np.abs(smooth[key] - sharp[key])
        corners = np.min(np.abs(s[:, None] - np.array([100, 160, 460, 520])), axis=1)
        assert apart[corners >= 2.0].max() < 1e-15
        assert 0 < apart.max() < np.abs(sharp[key]).max() * 0.3 / RAMP + 1e-12
    tables = build_tables(Track(s, smooth))
    assert sample(tables, kernel.HEADING, [700.0])[0] == pytest.approx((300 + 60) / RADIUS, abs=1e-9)
    assert sample(tables, kernel.UP, [700.0])[0] == pytest.approx(0.01 * 360, abs=1e-9)
    bend = np.abs(np.diff(smooth["cant"], 2)) / 0.2**2
    assert bend.max() == pytest.approx(2 / 4.0 * 0.15 / RAMP, rel=0.05)  # no more than the raised cosine's peak


def test_whole_circle_of_arcs_closes() -> None:
    """Two half turns with transitions between straights that are parallel: an oval comes back to its start."""
    half = np.pi * RADIUS - RAMP  # with two half ramps it turns by pi
    arc = Segment(half, curvature=1 / RADIUS)
    turn = [Segment(50), Transition(RAMP), arc, Transition(RAMP), Segment(50)]
    length = 2 * (100 + half + 2 * RAMP)
    s = np.linspace(0, length, 15_001)
    tables = build_tables(Track(s, design([*turn, *turn], s)))
    end = [sample(tables, channel, [length])[0] for channel in (kernel.EAST, kernel.NORTH, kernel.HEADING)]
    assert end == pytest.approx([0, 0, 2 * np.pi], abs=1e-6)


def test_constant_pieces_hold_beyond_the_line() -> None:
    found = design([Segment(10, curvature=0.002, cant=0.05)], np.array([-1.0, 5.0, 20.0]))
    assert found["curvature"].tolist() == [0.002] * 3
    assert found["cant"].tolist() == [0.05] * 3


@pytest.mark.parametrize(
    ("pieces", "message"),
    [
        ([], "no pieces"),
        ([Segment(100), Segment(100, curvature=0.01)], "pieces 1 and 2 meet with a step"),
        ([Segment(100), Transition(20)], "stands at an end or beside another"),
        ([Transition(20), Segment(100)], "stands at an end or beside another"),
        ([Segment(100), Transition(20), Transition(20), Segment(100)], "stands at an end or beside another"),
        ([Segment(100), Transition(3), Segment(100)], "piece 2 is 3 m long; make it at least 4 m"),
        ([Segment(-1)], "piece 1 is -1 m long"),
        ([Segment(float("nan"))], "piece 1 is nan m long"),
    ],
)
def test_impossible_lines_are_refused(pieces: list[Segment | Transition], message: str) -> None:
    with pytest.raises(InputError, match=message):
        design(pieces, distances(100, 1))


def test_fade_in_is_smooth_and_complete() -> None:
    s = np.linspace(0, 60, 60_001)
    factor = fade_in(s, 25, 20)
    assert factor[s <= 25].max() == 0
    assert factor[s >= 45].min() == 1
    assert factor[s == 35.0] == pytest.approx(0.5)
    assert (
        np.abs(np.diff(factor, 3)).max() / 1e-9 < 60 / 20**3 * 1.1
    )  # a bounded third derivative: no step in the second


def test_distances_are_round_numbers() -> None:
    s = distances(2000, 0.2)
    assert s.size == 10_001
    assert s[3] == 0.6
    assert s[-1] == 2000
