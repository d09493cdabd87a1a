"""Linear systems over a track that the leading wheelset meets first and the trailing one a wheelbase later."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

CANT_BASE = 1.5  # m; distance of the rails to which cross level refers (EN 13848-1)


class System(NamedTuple):
    """dx/dt = A x + B u + E du/dt, y = C x + D u + G du/dt + J d2u/dt2.

    Shapes (n, n), (n, 2 q), (n, 2 q), (m, n), and (m, 2 q) for D, G and J, with q quantities of the track under the
    leading wheelset, then under the trailing one.
    """

    A: np.ndarray
    B: np.ndarray
    E: np.ndarray
    C: np.ndarray
    D: np.ndarray
    G: np.ndarray
    J: np.ndarray | None = None

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """Outputs over the inputs at angular frequencies (rad/s), shape (frequencies, m, 2 q)."""
        s = 1j * np.asarray(frequency)[:, None, None]
        twice = 0.0 if self.J is None else s**2 * self.J
        return self.C @ self.states(frequency) + self.D + s * self.G + twice

    def states(self, frequency: np.ndarray) -> np.ndarray:
        """States over the inputs, shape (frequencies, n, 2 q)."""
        s = 1j * np.asarray(frequency)[:, None, None]
        n = len(self.A) // 2
        upper = np.hstack([np.zeros((n, n)), np.eye(n)])
        if len(self.A) != 2 * n or not np.array_equal(self.A[:n], upper) or self.B[:n].any() or self.E[:n].any():
            return np.linalg.solve(s * np.eye(len(self.A)) - self.A, self.B + s * self.E)
        stiffness, damping = self.A[n:, :n], self.A[n:, n:]  # positions and their rates: half the equations
        positions = np.linalg.solve(s**2 * np.eye(n) - s * damping - stiffness, self.B[n:] + s * self.E[n:])
        return np.concatenate([positions, s * positions], axis=1)

    def only(self, chosen: list[int]) -> "System":
        """The same with some of the outputs."""
        twice = None if self.J is None else self.J[chosen]
        return self._replace(C=self.C[chosen], D=self.D[chosen], G=self.G[chosen], J=twice)

    def from_states(self, frequency: np.ndarray) -> np.ndarray:
        """Outputs over what is added to the derivatives of the states, shape (frequencies, m, n)."""
        s = 1j * np.asarray(frequency)[:, None, None]
        return self.C @ np.linalg.inv(s * np.eye(len(self.A)) - self.A)


@dataclass(frozen=True)
class Output:
    """What a sensor measures of the half vehicle.

    Attributes
    ----------
    kind : "acceleration", "rate" or "displacement" of or at the bogie; "axlebox" and "lift", the acceleration of a
        wheelset in its middle, and that of its roll times the arm y.
    position : m from the bogie's centre of gravity: x forward, y left, z up; of a displacement only x, +-1 for the
        leading and trailing wheelset.
    axis : of a rate in the lateral plane, "roll" or "yaw".
    """

    kind: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: str = "roll"
