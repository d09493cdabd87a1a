"""Responses of stacks of linear vehicles at many frequencies, by one equation for each output: compiled.

An output a q of M q'' + C q' + K q = f follows the force f by y, where y Z = a and Z = K + s C + s^2 M at s = i omega.
"""

import numpy as np

from railsim.compiled import kernel


def over_forces(
    mass: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    read: np.ndarray,
    read_rate: np.ndarray,
    omega: np.ndarray,
) -> np.ndarray:
    """Outputs over a force on each coordinate, complex, shape (vehicles, frequencies, m, n).

    Parameters
    ----------
    mass, damping, stiffness : M, C and K of each vehicle, shape (vehicles, n, n).
    read, read_rate : outputs over positions and over their rates, shape (vehicles, m, n).
    omega : angular frequencies, rad/s, shape (frequencies,).
    """
    vehicles, m, n = read.shape
    out = np.empty((vehicles, len(omega), m, n), dtype=complex)
    work = np.empty((n, n + m), dtype=complex)
    M, C, K = _plain(mass), _plain(damping), _plain(stiffness)
    _solve(M, C, K, _plain(read), _plain(read_rate), _plain(omega), work, out)
    return out


def _plain(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=float)


@kernel
def _solve(
    mass: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    read: np.ndarray,
    read_rate: np.ndarray,
    omega: np.ndarray,
    work: np.ndarray,
    out: np.ndarray,
) -> None:
    """Gaussian elimination with row pivots; what does not act on a row is left out, as most of a vehicle does not."""
    m, n = read.shape[1], read.shape[2]
    for vehicle in range(len(read)):
        for place in range(len(omega)):
            w = omega[place]
            for i in range(n):
                for j in range(n):
                    real = stiffness[vehicle, j, i] - w * w * mass[vehicle, j, i]
                    work[i, j] = complex(real, w * damping[vehicle, j, i])
                for row in range(m):
                    work[i, n + row] = complex(read[vehicle, row, i], w * read_rate[vehicle, row, i])
            _eliminate(work, n)
            for row in range(n, n + m):
                for i in range(n - 1, -1, -1):
                    total = work[i, row]
                    for j in range(i + 1, n):
                        total -= work[i, j] * out[vehicle, place, row - n, j]
                    out[vehicle, place, row - n, i] = total / work[i, i]


@kernel
def _eliminate(work: np.ndarray, n: int) -> None:
    """Upper triangle of the first n columns, the others along with them."""
    width = work.shape[1]
    for column in range(n):
        best, size = column, -1.0
        for i in range(column, n):
            square = work[i, column].real ** 2 + work[i, column].imag ** 2
            if square > size:
                best, size = i, square
        if best != column:
            for j in range(column, width):
                work[column, j], work[best, j] = work[best, j], work[column, j]
        for i in range(column + 1, n):
            if work[i, column] != 0.0:
                factor = work[i, column] / work[column, column]
                for j in range(column + 1, width):
                    work[i, j] -= factor * work[column, j]
