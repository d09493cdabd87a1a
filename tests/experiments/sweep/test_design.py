"""Designs: which points they make, and that the indices found on them are those of a function known in closed form."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import pytest

from experiments.sweep.analysis import RESPONSE, indices
from experiments.sweep.design import column_values, read_design
from railsim.errors import InputError

SCORE = "rms error [m/s]"


def labels(given: Mapping[str, Any]) -> list[tuple[Any, ...]]:
    return [tuple(label for label, _ in row) for row in read_design(given).rows()]


def test_grid_varies_the_last_factor_fastest():
    keys = {"a.b": [1, 2], "c": {"low": 1, "high": 100, "scale": "log", "points": 3}}
    found = labels({"kind": "grid", "keys": keys})
    assert [row[0] for row in found] == [1, 1, 1, 2, 2, 2]
    assert [row[1] for row in found[:3]] == pytest.approx([1.0, 10.0, 100.0])


def test_alternatives_set_several_keys():
    keys = {"noise": {"alternatives": {"none": {"x": 0, "y": 0}, "much": {"x": 1, "y": 2}}}}
    rows = read_design({"keys": keys}).rows()
    assert rows == [(("none", {"x": 0, "y": 0}),), (("much", {"x": 1, "y": 2}),)]


def test_latin_hypercube_has_one_point_in_every_stratum():
    keys = {"a": {"low": 0, "high": 10}, "b": ["x", "y"], "n": {"low": 1, "high": 4, "integer": True}}
    found = labels({"kind": "latin_hypercube", "points": 20, "keys": keys})
    assert sorted(int(2 * row[0]) for row in found) == list(range(20))
    assert [row[1] for row in found].count("x") == 10
    assert sorted({row[2] for row in found}) == [1, 2, 3, 4]
    assert all(isinstance(row[2], int) for row in found)


def test_sobol_sequence_fills_every_dyadic_box():
    keys = {name: {"low": 0, "high": 1} for name in ("a", "b")}
    found = np.array(labels({"kind": "sobol", "points": 16, "keys": keys}), dtype=float)
    boxes = {(int(4 * a), int(4 * b)) for a, b in found}
    assert len(boxes) == 16


def test_sampled_design_depends_on_its_seed_only():
    given = {"kind": "sobol", "points": 8, "seed": 5, "keys": {"a": {"low": 2, "high": 3}}}
    assert labels(given) == labels(given)
    assert labels(given) != labels(given | {"seed": 6})


def test_indices_of_the_ishigami_function():
    """Ishigami and Homma (1990), a = 7, b = 0.1: S = 0.3139, 0.4424, 0; totals 0.5576, 0.4424, 0.2437."""
    keys = {name: {"low": -np.pi, "high": np.pi} for name in ("x1", "x2", "x3")}
    design = read_design({"kind": "sobol_indices", "points": 1024, "keys": keys})
    x = np.array([[value for value, _ in row] for row in design.rows()], dtype=float)
    assert len(x) == 1024 * 5
    y = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    frame = pd.DataFrame({"point": range(len(x)), "sensors": "all", "estimator": "it", RESPONSE: SCORE, "value": y})
    frame[["x1", "x2", "x3"]] = x
    stated = {"kind": "sobol_indices", "base": 1024, "points": len(x)}
    table, notes = indices(frame, SCORE, list(keys), stated)
    assert notes == []
    assert table["first"].to_numpy() == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)
    assert table["total"].to_numpy() == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.03)
    table, notes = indices(frame.iloc[1:], SCORE, list(keys), stated)
    assert table.empty
    assert notes == [f"it, {SCORE}: no indices, 1 of 5120 points have no value"]


def test_columns_are_numbers_or_texts():
    assert column_values([1, 2.5]) == ("number", [1.0, 2.5])
    assert column_values(["a", 2, True]) == ("text", ["a", "2", "true"])


@pytest.mark.parametrize(
    ("given", "line"),
    [
        (3, "design: give a kind and keys"),
        ({"kind": "star", "keys": {"a": [1]}}, "design.kind: unknown design 'star'; there are: grid, sobol"),
        ({"keys": {}}, "design.keys: give at least one dotted key"),
        ({"keys": {"a": []}}, "design.keys.a: has no values"),
        ({"keys": {"a": [1, 1]}}, "design.keys.a: a value appears twice"),
        ({"keys": {"a": {"low": 3, "high": 2}}}, "design.keys.a.high: 2 must be greater than low"),
        ({"keys": {"a": {"low": "x", "high": 2}}}, "design.keys.a.low: 'x' is not a number"),
        ({"keys": {"a": {"low": 0, "high": 2, "scale": "log"}}}, "design.keys.a.low: 0; a logarithmic scale"),
        ({"keys": {"a": {"low": 0, "high": 2}}}, "design.keys.a.points: missing"),
        ({"kind": "sobol", "keys": {"a": [1, 2]}}, "design.points: give the number of points"),
        ({"kind": "sobol", "points": 100, "keys": {"a": [1, 2]}}, "100 is not a power of 2"),
        ({"keys": {"a": [1]}, "point": 3}, "design.point: unknown key"),
    ],
)  # fmt: skip
def test_bad_design_says_where(given: Any, line: str):
    with pytest.raises(InputError) as caught:
        read_design(given).rows()
    assert line in str(caught.value)


def test_a_grid_too_large_is_refused_before_it_is_made():
    keys = {name: {"low": 0, "high": 1, "points": 1000} for name in "abcd"}
    with pytest.raises(InputError, match="makes 1000000000000 points, more than 1000000"):
        read_design({"keys": keys}).rows()
    with pytest.raises(InputError, match="makes 1572864 points"):
        read_design({"kind": "sobol_indices", "points": 2**19, "keys": {"a": {"low": 0, "high": 1}}}).rows()
