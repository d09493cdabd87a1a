"""Designs that are kept by the values of their arguments."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from estimators.signals.remembered import MOST, remembered


@dataclass(frozen=True)
class Part:
    """An argument with an array in it."""

    values: np.ndarray
    name: str = "a"


def counted() -> tuple[Any, list[Any]]:
    calls: list[Any] = []

    @remembered
    def design(*given: Any, **named: Any) -> np.ndarray:
        calls.append((given, named))
        if given and isinstance(given[0], str):
            raise ValueError("bad")
        return np.arange(3.0)

    return design, calls


def test_equal_arguments_are_designed_once():
    design, calls = counted()
    for _ in range(3):
        design({"mass": 3.0}, np.array([1.0, 2.0]), Part(np.eye(2)), rate=2.0)
    assert len(calls) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, 1.0),
        (1, True),
        (0.0, -0.0),
        (1.0, np.nextafter(1.0, 2.0)),
        ({"mass": 3.0}, {"mass": 3}),
        ({"a": 1.0, "b": 2.0}, {"a": 2.0, "b": 1.0}),
        (np.zeros(4), np.zeros((2, 2))),
        (np.zeros(2), np.zeros(4, dtype=np.float32)),
        (Part(np.eye(2)), Part(np.eye(2), "b")),
        (Part(np.eye(2)), Part(2 * np.eye(2))),
        ([1.0], (1.0,)),
    ],
)
def test_what_differs_is_designed_again(one: Any, other: Any):
    design, calls = counted()
    design(one)
    design(other)
    design(one)
    assert len(calls) == 2


def test_nobody_changes_what_others_get():
    design, calls = counted()
    design(1.0)[:] = 7.0
    np.testing.assert_array_equal(design(1.0), [0.0, 1.0, 2.0])
    design(1.0)[:] = 8.0
    np.testing.assert_array_equal(design(1.0), [0.0, 1.0, 2.0])
    assert len(calls) == 1


def test_errors_are_raised_again_and_the_oldest_is_forgotten():
    design, calls = counted()
    for _ in range(2):
        with pytest.raises(ValueError, match="bad"):
            design("bad")
    assert len(calls) == 2
    for number in range(MOST + 1):
        design(number)
    design(0)
    assert len(calls) == 2 + MOST + 2
