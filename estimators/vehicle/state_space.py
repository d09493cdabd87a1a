"""Linear systems over a track that the leading wheelset meets first and the trailing one a wheelbase later."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimators.vehicle.adjoint import over_forces

CANT_BASE = 1.5  # m; distance of the rails to which cross level refers (EN 13848-1)


class System(NamedTuple):
    """dx/dt = A x + B u + E du/dt, y = C x + D u + G du/dt + J d2u/dt2.

    Shapes (n, n), (n, 2 q), (n, 2 q), (m, n), and (m, 2 q) for D, G and J, with q quantities of the track under the
    leading wheelset, then under the trailing one. An unknown force may push a coordinate: it changes the coordinate's
    acceleration a, and y by `feels` a at once, shape (m, n / 2); nothing where None.
    """

    A: np.ndarray
    B: np.ndarray
    E: np.ndarray
    C: np.ndarray
    D: np.ndarray
    G: np.ndarray
    J: np.ndarray | None = None
    feels: np.ndarray | None = None

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """Outputs over the inputs at angular frequencies (rad/s), shape (frequencies, m, 2 q)."""
        if self.second_order:
            return responses([self], frequency)[0]
        s = 1j * np.asarray(frequency)[:, None, None]
        twice = 0.0 if self.J is None else s**2 * self.J
        return self.C @ self.states(frequency) + self.D + s * self.G + twice

    @property
    def second_order(self) -> bool:
        """Whether the first half of the states are positions, the others their rates."""
        n = len(self.A) // 2
        upper = np.hstack([np.zeros((n, n)), np.eye(n)])
        return (
            len(self.A) == 2 * n and np.array_equal(self.A[:n], upper) and not self.B[:n].any() and not self.E[:n].any()
        )

    def states(self, frequency: np.ndarray) -> np.ndarray:
        """States over the inputs, shape (frequencies, n, 2 q)."""
        s = 1j * np.asarray(frequency)[:, None, None]
        n = len(self.A) // 2
        if not self.second_order:
            return np.linalg.solve(s * np.eye(len(self.A)) - self.A, self.B + s * self.E)
        positions = np.linalg.solve(self._dynamic_stiffness(s), self.B[n:] + s * self.E[n:])
        return np.concatenate([positions, s * positions], axis=1)

    def _dynamic_stiffness(self, s: np.ndarray) -> np.ndarray:
        """Of unit masses, from positions alone: half the equations, shape (frequencies, n / 2, n / 2)."""
        n = len(self.A) // 2
        return s**2 * np.eye(n) - s * self.A[n:, n:] - self.A[n:, :n]

    def transfer(self, frequency: np.ndarray) -> "Transfer":
        """Outputs over inputs and forces; the first half of the states are positions, the others their rates."""
        of_inputs, of_white = _through([self], np.asarray(frequency, dtype=float))
        feels = 0.0 if self.feels is None else self.feels
        return Transfer(of_inputs[0], of_white[0] + feels, of_white[0])

    def only(self, chosen: list[int]) -> "System":
        """The same with some of the outputs."""
        twice, feels = (None if part is None else part[chosen] for part in (self.J, self.feels))
        return self._replace(C=self.C[chosen], D=self.D[chosen], G=self.G[chosen], J=twice, feels=feels)


def responses(systems: Sequence[System], frequency: np.ndarray) -> np.ndarray:
    """`System.response` of several systems that are alike but for their numbers, shape (systems, frequencies, m, 2 q).

    The first half of the states are positions, the others their rates. One equation is solved for each output, the
    adjoint one, where `System.response` solves one for each input.
    """
    return _through(systems, np.asarray(frequency, dtype=float))[0]


def _through(systems: Sequence[System], omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outputs over the inputs and over the acceleration given to each coordinate, (systems, frequencies, m, ...)."""
    A, B, E, C, D, G = (np.stack(part)[:, None] for part in zip(*(one[:6] for one in systems), strict=True))
    n, s = A.shape[-1] // 2, 1j * omega[:, None, None]
    lower, mass = A[:, 0, n:], np.broadcast_to(np.eye(n), (len(systems), n, n))
    acting = over_forces(mass, -lower[..., n:], -lower[..., :n], C[:, 0, :, :n], C[:, 0, :, n:], omega)
    pushed, dragged = (np.einsum("vkmn,vni->vkmi", acting, part[:, 0, n:]) for part in (B, E))  # not the threaded BLAS
    found = pushed + D + s * (dragged + G)
    if any(one.J is not None for one in systems):
        twice = [np.zeros(D.shape[2:]) if one.J is None else one.J for one in systems]
        found += s**2 * np.stack(twice)[:, None]
    return found, acting


class Transfer(NamedTuple):
    """Responses of the outputs of a system at frequencies.

    Attributes
    ----------
    of_inputs : over the inputs, shape (frequencies, m, 2 q).
    of_forces : over the acceleration that an unknown force gives to each coordinate, shape (frequencies, m, n / 2).
    of_white_forces : the same for white noise, whose own acceleration no sensor shows.
    """

    of_inputs: np.ndarray
    of_forces: np.ndarray
    of_white_forces: np.ndarray


@dataclass(frozen=True)
class Output:
    """What a sensor measures of the half vehicle.

    Attributes
    ----------
    kind : "acceleration", "rate" or "displacement" of or at the bogie; in the vertical plane also its "height", and
        "body acceleration", that of the body over it; in the lateral one its "angle"; "axlebox" and "lift", the
        acceleration of a wheelset in its middle, and that of its roll times the arm y.
    position : m from the bogie's centre of gravity: x forward, y left, z up; of a displacement only x, +-1 for the
        leading and trailing wheelset.
    axis : of a rate or an angle in the lateral plane, "roll" or "yaw".
    """

    kind: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: str = "roll"
