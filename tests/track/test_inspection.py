"""Inspection finds what is planted, and only that."""

from collections.abc import Callable

import numpy as np
import pytest

from railsim.track import Track, read_track
from railsim.track.inspection import problems

Columns = dict[str, np.ndarray]


def _columns() -> tuple[np.ndarray, Columns]:
    track = read_track("curve_r400")
    return track.s.copy(), {key: column.copy() for key, column in track.columns().items()}


def _step(s: np.ndarray, columns: Columns) -> None:
    columns["vertical"][2000:] += 0.02


def _spike(s: np.ndarray, columns: Columns) -> None:
    columns["lateral"][1500] += 0.03


def _stuck(s: np.ndarray, columns: Columns) -> None:
    columns["cross_level"][1000:1100] = columns["cross_level"][1000]


def _cant(s: np.ndarray, columns: Columns) -> None:
    columns["cant"] *= -1


def _spacing(s: np.ndarray, columns: Columns) -> None:
    s[2500:] += 0.3


def _curvature_in_km(s: np.ndarray, columns: Columns) -> None:
    columns["curvature"] *= 1000


def _vertical_in_mm(s: np.ndarray, columns: Columns) -> None:
    columns["vertical"] *= 1000


def _cant_too_high(s: np.ndarray, columns: Columns) -> None:
    columns["cant"] *= 3


def _offset(s: np.ndarray, columns: Columns) -> None:
    columns["gauge_deviation"] += 1.435e-2


def _friction(s: np.ndarray, columns: Columns) -> None:
    columns["friction"] = np.full(s.size, 3.0)


@pytest.mark.parametrize(
    ("plant", "message"),
    [
        (_step, "vertical jumps at 1 place(s): a step of 0.0"),
        (_spike, "lateral jumps at 2 place(s): a spike of"),
        (_stuck, "cross_level is stuck at"),
        (_cant, "cant leans out of the curve on"),
        (_spacing, "spacing is irregular: 1 of 5000 rows are not 0.2 m"),
        (_curvature_in_km, "curvature reaches 2.5 1/m, a radius of 0 m"),
        (_vertical_in_mm, "irregularities reach"),
        (_cant_too_high, "cant reaches 0.47"),
        (_offset, "gauge_deviation has the mean"),
        (_friction, "friction reaches 3"),
    ],
)
def test_planted_faults_are_found_and_no_others(plant: Callable[[np.ndarray, Columns], None], message: str) -> None:
    s, columns = _columns()
    plant(s, columns)
    found = problems(Track(s, columns))
    assert [text for text in found if message in text], found
    column = message.split()[0]
    assert [text for text in found if not text.startswith(column)] == []


def test_places_are_named() -> None:
    s, columns = _columns()
    _step(s, columns)
    assert "between s = 399.8 and 400 m" in problems(Track(s, columns))[0]
