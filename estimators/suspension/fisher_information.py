"""What bogie and body can tell of dampers, conicity and the level of an unknown track: Fisher information.

For a stationary Gaussian signal of spectrum S(f), observed for T seconds (Whittle 1953, J. R. Stat. Soc. B 15),

    I_ij = T integral from 0 to half the sample rate of tr(S^-1 dS/dp_i S^-1 dS/dp_j) df,

with S = H Q H* + R, H = C (z - F)^-1 of the very matrices that the estimators' filters are made of. No unbiased
estimate has a smaller covariance than its inverse. The parameters are those of `PARAMETERS` and the logarithm of the
level.
"""

from collections.abc import Callable

import numpy as np

from estimators.suspension.discrete_model import Discrete

POINTS = 1500
CHUNK = 250
STEP = 1e-3  # relative, for derivatives


def spectrum(system: Discrete, frequency: np.ndarray, rate: float) -> np.ndarray:
    """Two-sided spectrum of the readings times the sample rate, shape (f, m, m).

    Parameters
    ----------
    frequency : Hz, shape (f,). rate : samples per second.
    """
    blocks = []
    for part in np.array_split(frequency, max(1, len(frequency) // CHUNK)):
        z = np.exp(2j * np.pi * part / rate)
        away = z[:, None, None] * np.eye(len(system.F)) - system.F
        H = np.swapaxes(
            np.linalg.solve(np.swapaxes(away, 1, 2), np.broadcast_to(system.C.T, (len(z), *system.C.T.shape))), 1, 2
        )
        blocks.append(H @ system.Q @ np.swapaxes(H.conj(), 1, 2) + system.R)
    return np.concatenate(blocks)


def fisher(
    system: Callable[[np.ndarray], Discrete], parameters: np.ndarray, rate: float, low: float, seconds: float
) -> np.ndarray:
    """Information on `parameters`, shape (k, k).

    Parameters
    ----------
    system : matrices of given parameters; all of size one or larger than zero.
    low : lowest frequency that is used, Hz. seconds : length of the record.
    """
    frequency = np.geomspace(low, rate / 2.0, POINTS)
    middle = spectrum(system(parameters), frequency, rate)
    slopes = []
    for i, value in enumerate(parameters):
        step = np.zeros(len(parameters))
        step[i] = STEP * max(abs(value), 1e-6)
        ends = [spectrum(system(parameters + sign * step), frequency, rate) for sign in (1.0, -1.0)]
        slopes.append(np.linalg.solve(middle, (ends[0] - ends[1]) / (2.0 * step[i])))
    density = np.real(np.einsum("afij,bfji->abf", np.array(slopes), np.array(slopes)))
    return seconds * np.trapezoid(density, frequency, axis=2)
