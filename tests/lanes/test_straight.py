"""Lines that go to LLVM as they are do what Python does with them, lane by lane."""

import math
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.errors import LoweringError

from railsim.contact.elementary import sine
from railsim.lanes.straight import straight

LANES = 5
LINES = """
v1 = W[0 + k]
v2 = W[5 + k]
v3 = v1 - -2.5
v4 = v3 * v2
v5 = v4 / 3.0
v6 = v1 < v2
v7 = v1 <= 0.25
v8 = v6 & v7
v9 = v5 if v8 else v1
v10 = v2 == v2
v11 = v1 != 0.0
v12 = v10 | v11
v13 = min(v9, 0.5)
v14 = max(v13, v2)
v15 = math.floor(v14)
v16 = abs(v1)
v17 = math.sqrt(v16)
v18 = sine(v17)
v19 = v18 + v15
W[10 + k] = v19
W[15 + k] = v9 if v12 else 7.0
W[20 + k] = v14
"""


def _compiled(text: str) -> Any:
    loop = straight(LANES, text, {"math": math, "sine": sine})
    return numba.njit(lambda numbers: loop(numbers))


def test_each_kind_of_line_gives_the_numbers_of_python():
    rng = np.random.default_rng(5)
    numbers = rng.uniform(-1.0, 1.0, 25)
    expected = numbers.copy()
    _compiled(LINES)(numbers)
    for k in range(LANES):
        exec(LINES, {"W": expected, "k": k, "math": math, "sine": math.sin})
    np.testing.assert_allclose(numbers, expected, rtol=1e-14)
    assert np.ptp(numbers[10:]) > 0.1


def test_minimum_and_maximum_with_nan_are_those_of_python():
    numbers = np.full(15, math.nan)
    numbers[:5] = 1.0
    _compiled("v1 = W[5 + k]\nv2 = max(v1, 0.0)\nv3 = min(0.0, v1)\nW[0 + k] = v2\nW[10 + k] = v3")(numbers)
    assert np.isnan(numbers[:5]).all() and not numbers[10:].any()
    assert math.isnan(max(math.nan, 0.0)) and min(0.0, math.nan) == 0.0


@pytest.mark.parametrize("line", ["v1 = W[k]", "v1 = 3", "v1 = W[0 + k] ** 2.0"])
def test_another_line_is_refused(line: str):
    with pytest.raises((LoweringError, KeyError, ValueError), match="straight line|element of a row|Pow"):
        _compiled(line)(np.zeros(5))
