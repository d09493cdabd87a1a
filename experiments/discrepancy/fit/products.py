"""Products of whitened derivatives, piece by piece as the processor's cache holds them, on both cores."""

import numpy as np

from experiments.discrepancy.baseline.frames import REDUNDANCY
from experiments.discrepancy.baseline.parallel import in_parallel

WEIGHT = 1.0 / np.sqrt(REDUNDANCY)


def normal_equations(jacobian: np.ndarray, residual: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """J^T J and J^T r over some frames."""

    def part(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # frame by frame, which the processor's cache holds
        normal, gradient = np.zeros((len(jacobian), len(jacobian))), np.zeros(len(jacobian))
        for place in places:
            flat = WEIGHT * jacobian[:, place].reshape(len(jacobian), -1).astype(float)
            normal += flat @ flat.T
            gradient += flat @ (WEIGHT * residual[place]).ravel()
        return normal, gradient

    halves = in_parallel(part, np.array_split(np.flatnonzero(frames), 2))
    return halves[0][0] + halves[1][0], halves[0][1] + halves[1][1]


def added(rows: np.ndarray, factors: np.ndarray, one: np.ndarray) -> np.ndarray:
    """rows + factors x one, row by row, each of which the processor's cache holds."""
    found = np.empty_like(rows)

    def add(row: int) -> None:
        np.multiply(one, factors[row], out=found[row])
        found[row] += rows[row]

    in_parallel(add, range(len(rows)))
    return found
