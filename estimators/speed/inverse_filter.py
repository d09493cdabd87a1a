"""One step of the inverse filters, with lost samples held; compiled, the same for a whole record and for `step`."""

from typing import NamedTuple

import numpy as np

from estimators.speed.wheelset_filters import Chain
from railsim.compiled import kernel


class InverseFilter(NamedTuple):
    """Filters and their state.

    Attributes
    ----------
    sections, steady : see `Chain`.
    state : of the sections, shape (4 or 6, k, 2).
    last : last good acceleration and pitch rate, shape (2,).
    settle : samples until the filters have forgotten a fault.
    counts : samples still to wait (negative: no good sample so far), shape (1,).
    """

    sections: np.ndarray
    steady: np.ndarray
    state: np.ndarray
    last: np.ndarray
    settle: int
    counts: np.ndarray


def inverse_filter(filters: Chain, rate: float, low: float) -> InverseFilter:
    """Filters at the start of a run; they settle within one period of the band's lower edge (`low`, Hz)."""
    count = np.full(1, -1, dtype=np.int64)
    return InverseFilter(
        filters.sections, filters.steady, np.zeros(filters.steady.shape), np.zeros(2), round(rate / low), count
    )


@kernel
def advance(f: InverseFilter, a: float, q: float, out: np.ndarray) -> bool:
    """Take one sample (NaN: lost, the last good one is held); `out` gets the four signals.

    Returns whether they can be used: not while samples are lost and the filters settle after it.
    """
    if np.isfinite(a) and np.isfinite(q):
        f.last[0], f.last[1] = a, q
        if f.counts[0] < 0:
            reset(f.sections, f.steady, a, q, f.state)
            f.counts[0] = f.settle
        elif f.counts[0] > 0:
            f.counts[0] -= 1
    elif f.counts[0] < 0:
        out[:] = 0.0
        return False
    else:
        f.counts[0] = f.settle
    filtered(f.sections, f.state, f.last[0], f.last[1], out)
    return f.counts[0] == 0


@kernel
def reset(sections: np.ndarray, steady: np.ndarray, a: float, q: float, state: np.ndarray) -> None:
    """Put the filters in the state that a long constant input (a, q) leaves."""
    for row in range(len(sections)):
        value = a if row == 0 or row == 2 else q
        for k in range(sections.shape[1]):
            state[row, k, 0] = steady[row, k, 0] * value
            state[row, k, 1] = steady[row, k, 1] * value


@kernel
def filtered(sections: np.ndarray, state: np.ndarray, a: float, q: float, out: np.ndarray) -> None:
    """One step of all filters: `out` gets the halved sum and difference and their inertial shares, shape (4,)."""
    for row in range(len(sections)):
        value = a if row == 0 or row == 2 else q
        for k in range(sections.shape[1]):
            b0, b1, b2, a1, a2 = (
                sections[row, k, 0],
                sections[row, k, 1],
                sections[row, k, 2],
                sections[row, k, 4],
                sections[row, k, 5],
            )
            result = b0 * value + state[row, k, 0]
            state[row, k, 0] = b1 * value - a1 * result + state[row, k, 1]
            state[row, k, 1] = b2 * value - a2 * result
            value = result
        if row < 4:
            out[row] = value
        else:
            out[2 * (row - 4)] += value
