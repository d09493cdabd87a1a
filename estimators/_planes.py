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

GRAVITY = 9.81  # m/s2
CANT_BASE = 1.5  # m; distance of the rails to which cross level refers (EN 13848-1)
NEEDED = (
    "body_mass", "body_roll_inertia", "body_height", "bogie_mass", "bogie_roll_inertia", "bogie_pitch_inertia",
    "bogie_height", "wheel_radius", "semi_wheelbase", "primary_half_spacing", "primary_vertical_stiffness",
    "primary_vertical_damping", "secondary_half_spacing", "secondary_height", "secondary_lateral_stiffness",
    "secondary_lateral_damping", "secondary_vertical_stiffness", "secondary_vertical_damping", "roll_bar_stiffness",
)  # fmt: skip
"""Nominal parameters of the vehicle that the models take, SI units."""


class System(NamedTuple):
    """dx/dt = A x + B u + E du/dt, y = C x + D u + G du/dt; shapes (n, n), (n, 2), (n, 2), (m, n), (m, 2), (m, 2)."""

    A: np.ndarray
    B: np.ndarray
    E: np.ndarray
    C: np.ndarray
    D: np.ndarray
    G: np.ndarray

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """Outputs over the two inputs at angular frequencies (rad/s), shape (frequencies, m, 2)."""
        s = 1j * np.asarray(frequency)[:, None, None]
        inside = np.linalg.solve(s * np.eye(len(self.A)) - self.A, self.B + s * self.E)
        return self.C @ inside + self.D + s * self.G

    def from_states(self, frequency: np.ndarray) -> np.ndarray:
        """Outputs over what is added to the derivatives of the states, shape (frequencies, m, n)."""
        s = 1j * np.asarray(frequency)[:, None, None]
        return self.C @ np.linalg.inv(s * np.eye(len(self.A)) - self.A)


@dataclass(frozen=True)
class Output:
    """What a sensor measures of a plane.

    Attributes
    ----------
    kind : "acceleration", "rate" or "displacement".
    position : m from the bogie's centre of gravity: x forward, y left, z up; of a displacement only x, +-1 for the
        leading and trailing wheelset.
    """

    kind: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)


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
    rows = []
    for output in outputs:
        if output.kind == "rate":
            rows.append((np.eye(6)[5], np.zeros(2), np.zeros(2)))
        elif output.kind == "acceleration":
            x = output.position[0]
            rows.append((A[3] - x * A[5], B[3] - x * B[5], E[3] - x * E[5]))
        else:
            wheelset = 0 if output.position[0] > 0 else 1
            rows.append((np.append(above[wheelset], np.zeros(3)), -np.eye(2)[wheelset], np.zeros(2)))
    return System(A, B, E, *(np.stack(part) for part in zip(*rows, strict=True)))


def roll(vehicle: Mapping[str, Any], outputs: list[Output]) -> System:
    """States: roll of bogie and body (rad), lateral place of the body against the bogie (m), their rates, the bogie's
    lateral acceleration (m/s2), which comes from outside as process noise. u is the cross level.

    The secondary springs act along the bogie's own axes: potential of gravity m g (roll_b shear - d roll_B^2 / 2 - e
    roll_b^2 / 2) for springs d below the body's and e above the bogie's centre of gravity. What the wheelsets' lateral
    shift adds to their roll is left out.
    """
    p = vehicle
    k1, c1 = (4 * p[f"primary_vertical_{name}"] * p["primary_half_spacing"] ** 2 for name in ("stiffness", "damping"))
    k2, c2 = (
        2 * p[f"secondary_vertical_{name}"] * p["secondary_half_spacing"] ** 2 for name in ("stiffness", "damping")
    )
    ky, cy = (2 * p[f"secondary_lateral_{name}"] for name in ("stiffness", "damping"))
    above, below = p["secondary_height"] - p["bogie_height"], p["body_height"] - p["secondary_height"]
    arm, load = p["bogie_height"] - p["wheel_radius"], p["body_mass"] * GRAVITY
    bogie, body, apart = np.eye(7)[:3]
    bogie_rate, body_rate, apart_rate, acceleration = np.eye(7)[3:]
    shear = apart + below * body + above * bogie
    force = ky * shear + cy * (apart_rate + below * body_rate + above * bogie_rate)
    couple = (k2 + p["roll_bar_stiffness"]) * (body - bogie) + c2 * (body_rate - bogie_rate)
    push = p["bogie_mass"] * (acceleration + GRAVITY * bogie) - force
    A = np.zeros((7, 7))
    A[:3] = bogie_rate, body_rate, apart_rate
    A[3] = -k1 * bogie - c1 * bogie_rate + couple - above * force - load * shear + arm * push
    A[3] /= p["bogie_roll_inertia"]
    A[4] = (load * below * (body - bogie) - couple - below * force) / p["body_roll_inertia"]
    A[5] = -(force + load * bogie) / p["body_mass"] - acceleration
    wheels = -0.5 / CANT_BASE / p["bogie_roll_inertia"]
    B, E = np.zeros((7, 2)), np.zeros((7, 2))
    B[3], E[3] = k1 * wheels, c1 * wheels
    rows = []
    for output in outputs:
        if output.kind == "rate":
            rows.append((bogie_rate, np.zeros(2), np.zeros(2)))
        elif output.kind == "acceleration":
            rows.append((acceleration + GRAVITY * bogie, np.zeros(2), np.zeros(2)))
        else:
            wheelset = np.eye(2)[0 if output.position[0] > 0 else 1]
            reach = p["primary_half_spacing"]
            rows.append((reach * bogie, reach / CANT_BASE * wheelset, np.zeros(2)))
    return System(A, B, E, *(np.stack(part) for part in zip(*rows, strict=True)))
