"""Running cross-correlation of two signals over a sliding window, sums updated in place."""

import numpy as np

from railsim.compiled import inlined, kernel


@kernel
def slide(x: np.ndarray, y: np.ndarray, new_x: float, new_y: float, n: int, first: int, sums: np.ndarray) -> None:
    """Move the window on by one sample: equation (10) of Ward et al. 2011, all lags.

    Parameters
    ----------
    x, y : the last N samples, each kept twice one after the other, shape (2 N,): every stretch is then contiguous.
    new_x, new_y : sample number n.
    first : the smallest lag in samples; `sums[k]` belongs to lag first + k, which must stay below N.
    sums : sum over the window of x(i) y(i + lag), shape (lags,); updated.
    """
    subtract_oldest(x, y, n, first, sums)
    put(x, n, new_x)
    put(y, n, new_y)
    add_newest(x, y, n, first, sums)


@kernel
def slide_both(
    x: np.ndarray, y: np.ndarray, new_x: float, new_y: float, n: int, first: int, ahead: np.ndarray, behind: np.ndarray
) -> None:
    """`slide` with the sums in both directions: `ahead[k]` of x(i) y(i + lag), `behind[k]` of y(i) x(i + lag)."""
    subtract_oldest(x, y, n, first, ahead)
    subtract_oldest(y, x, n, first, behind)
    put(x, n, new_x)
    put(y, n, new_y)
    add_newest(x, y, n, first, ahead)
    add_newest(y, x, n, first, behind)


@inlined
def put(x: np.ndarray, n: int, value: float) -> None:
    """Sample number n in place of the oldest."""
    size = len(x) // 2
    x[n % size] = x[n % size + size] = value


@inlined
def subtract_oldest(x: np.ndarray, y: np.ndarray, n: int, first: int, sums: np.ndarray) -> None:
    """Take the products with the oldest x out of the sums, before sample n replaces it."""
    size = len(x) // 2
    p = n % size
    if n >= size:
        oldest = x[p]
        for k in range(len(sums)):
            sums[k] -= oldest * y[p + first + k]


@inlined
def add_newest(x: np.ndarray, y: np.ndarray, n: int, first: int, sums: np.ndarray) -> None:
    """Add the products with sample n of y to the sums."""
    size = len(x) // 2
    newest = n % size + size
    for k in range(len(sums)):
        sums[k] += x[newest - first - k] * y[newest]


@kernel
def recompute(x: np.ndarray, y: np.ndarray, n: int, first: int, sums: np.ndarray) -> None:
    """The sums afresh after sample n, which drops what rounding has left in them."""
    size = len(x) // 2
    start = n % size + 1
    for k in range(len(sums)):
        lag = first + k
        total = 0.0
        for i in range(start, start + size - lag):
            total += x[i] * y[i + lag]
        sums[k] = total


@kernel
def runner_up(sums: np.ndarray, k: int) -> float:
    """Largest correlation outside the lobe of peak `k`, which ends where the sums change sign; 0 if none."""
    left = k
    while left >= 0 and sums[left] > 0:
        left -= 1
    right = k
    while right < len(sums) and sums[right] > 0:
        right += 1
    highest = 0.0
    for j in range(left + 1):
        highest = max(highest, sums[j])
    for j in range(right, len(sums)):
        highest = max(highest, sums[j])
    return highest
