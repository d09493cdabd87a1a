"""Linear models of the half vehicle over a track whose wheelsets follow the rails, from its nominal parameters.

Every plane is dx/dt = A x + B u + E du/dt with the outputs y = C x + D u + G du/dt, where u is the track's irregularity
under the leading and the trailing wheelset. Axes as everywhere: z up, pitch nose down, roll left side up, right rail
higher is positive cross level.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from railsim.errors import InputError

CANT_BASE = 1.5  # m; distance of the rails to which cross level refers (EN 13848-1)
NEEDED = (
    "body_mass", "bogie_mass", "bogie_pitch_inertia", "wheel_radius", "secondary_height", "wheelset_mass",
    "semi_wheelbase", "primary_vertical_stiffness", "primary_vertical_damping", "secondary_vertical_stiffness",
    "secondary_vertical_damping",
)  # fmt: skip
"""Nominal parameters of the vehicle that the models take, SI units."""


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
        stiff, damped = self.A[n:, :n], self.A[n:, n:]  # places and their rates: half the equations
        places = np.linalg.solve(s**2 * np.eye(n) - s * damped - stiff, self.B[n:] + s * self.E[n:])
        return np.concatenate([places, s * places], axis=1)

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
    """What a sensor measures of a plane.

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


class Rigid(NamedTuple):
    """A plane with masses: M q'' + C q' + K q = P u + R du/dt."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    push: np.ndarray
    rub: np.ndarray

    def first_order(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B, E with the states [q, q']."""
        n = len(self.mass)
        inverse = np.linalg.inv(self.mass)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ self.stiffness, -inverse @ self.damping]])
        none = np.zeros((n, 2))
        return A, np.vstack([none, inverse @ self.push]), np.vstack([none, inverse @ self.rub])


def check_vehicle(vehicle: Mapping[str, Any]) -> None:
    """Raise `InputError` that names the first nominal parameter that is missing."""
    for name in NEEDED:
        if not isinstance(vehicle.get(name), int | float):
            raise InputError(f"track_smoother needs the vehicle's '{name}'; give it in about.json under \"vehicle\"")


def vertical(vehicle: Mapping[str, Any], outputs: list[Output]) -> System:
    """States: heights of bogie and body, bogie's pitch (m, rad), their rates. u is the mean height of the rails."""
    p = vehicle
    a = p["semi_wheelbase"]
    k1, c1 = 2 * p["primary_vertical_stiffness"], 2 * p["primary_vertical_damping"]
    k2, c2 = 2 * p["secondary_vertical_stiffness"], 2 * p["secondary_vertical_damping"]
    above = np.array([[1.0, 0.0, -a], [1.0, 0.0, a]])  # the bogie over the leading and trailing wheelset
    between = np.array([-1.0, 1.0, 0.0])
    plane = Rigid(
        np.diag([p["bogie_mass"], p["body_mass"], p["bogie_pitch_inertia"]]),
        c1 * above.T @ above + c2 * np.outer(between, between),
        k1 * above.T @ above + k2 * np.outer(between, between),
        k1 * above.T,
        c1 * above.T,
    )
    A, B, E = plane.first_order()
    rows, twice = [], np.zeros((len(outputs), 2))
    for number, output in enumerate(outputs):
        wheelset = 0 if output.position[0] > 0 else 1
        if output.kind == "rate":
            rows.append((np.eye(6)[5], np.zeros(2), np.zeros(2)))
        elif output.kind == "acceleration":
            x = output.position[0]
            rows.append((A[3] - x * A[5], B[3] - x * B[5], E[3] - x * E[5]))
        elif output.kind == "axlebox":
            rows.append((np.zeros(6), np.zeros(2), np.zeros(2)))
            twice[number, wheelset] = 1.0
        else:
            rows.append((np.append(above[wheelset], np.zeros(3)), -np.eye(2)[wheelset], np.zeros(2)))
    C, D, G = (np.stack(part) for part in zip(*rows, strict=True))
    return System(A, B, E, C, D, G, twice if twice.any() else None)
