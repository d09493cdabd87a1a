"""A linear vehicle as a list of elements between named coordinates, and its reduction to the coordinates of a question.

An element is a generalised force that is linear in the motion: it does work along one direction and follows from the
position or velocity along another (the same one for a spring or a damper). A direction is a row of factors by the names
of coordinates. The vehicle is the sum of its elements; it has any number of bodies, bogies and wheelsets.

A reduction keeps some coordinates, takes some motions as given inputs, puts others as combinations of these
(kinematic relations), and holds the rest at zero:

    M q'' + C q' + K q = -(C_w w' + K_w w),   K = F' k G,

q the coordinates, w the inputs, F and G the elements' directions of force and of motion over the coordinates, and over
coordinates and inputs (virtual work; Shabana 2010, Computational Dynamics, chapters 2 and 5).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimators.vehicle.adjoint import over_forces

Row = Mapping[str, float]
"""Factors by the names of coordinates."""


class Element(NamedTuple):
    """A generalised force -(stiffness x + damping x') along a direction, x the motion along another.

    Attributes
    ----------
    force : direction on which the force does work. motion : direction whose motion makes it.
    stiffness, damping : N/m and N s/m for directions in m; N m/rad and N m s/rad for directions in rad.
    """

    force: Row
    motion: Row
    stiffness: float = 0.0
    damping: float = 0.0


def spring(direction: Row, stiffness: float, damping: float = 0.0) -> Element:
    """Spring and damper side by side, whose stretch is the motion along the direction."""
    return Element(direction, direction, stiffness, damping)


@dataclass(frozen=True)
class Reduced:
    """Equations of motion M q'' + C q' + K q = -(C_w w' + K_w w).

    Attributes
    ----------
    coordinates : names of q, n of them. inputs : names of w, m of them.
    mass : diagonal, shape (n, n).
    damping, stiffness : C and K, shape (n, n).
    input_damping, input_stiffness : C_w and K_w, shape (n, m).
    """

    coordinates: tuple[str, ...]
    inputs: tuple[str, ...]
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    input_damping: np.ndarray
    input_stiffness: np.ndarray

    def first_order(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B, E of dx/dt = A x + B w + E dw/dt with x = [q, q'], shapes (2 n, 2 n), (2 n, m), (2 n, m)."""
        n, m = self.input_stiffness.shape
        inverse = 1.0 / np.diag(self.mass)[:, None]
        A, B, E = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, m)), np.zeros((2 * n, m))
        A[:n, n:] = np.eye(n)
        A[n:, :n], A[n:, n:] = -inverse * self.stiffness, -inverse * self.damping
        B[n:], E[n:] = -inverse * self.input_stiffness, -inverse * self.input_damping
        return A, B, E

    def response(self, s: np.ndarray, together: np.ndarray | None = None) -> np.ndarray:
        """Coordinates over the inputs at complex angular frequencies (k,), shape (k, n, m).

        Parameters
        ----------
        together : inputs that move together, each set a column of the amplitudes of all inputs, shape (k, m, sets);
            the response is then over the sets.
        """
        at = np.asarray(s)[:, None, None]
        dynamic = at**2 * self.mass + at * self.damping + self.stiffness
        drive = -(self.input_stiffness + at * self.input_damping)
        return np.linalg.solve(dynamic, drive if together is None else np.einsum("knm,kms->kns", drive, together))

    def response_of(self, coordinate: str, omega: np.ndarray) -> np.ndarray:
        """One coordinate over the inputs at angular frequencies, rad/s, (k,): `response` for less, shape (k, m)."""
        read = np.array([[[float(name == coordinate) for name in self.coordinates]]])
        parts = (self.mass[None], self.damping[None], self.stiffness[None])
        acting = over_forces(*parts, read, np.zeros_like(read), np.asarray(omega))[0, :, 0]
        held, damped = (np.einsum("kn,ni->ki", acting, part) for part in (self.input_stiffness, self.input_damping))
        return -(held + 1j * np.asarray(omega)[:, None] * damped)


class Kinematics:
    """Which coordinates move freely, which motions are given, and what follows from them; all others are held at zero.

    Parameters
    ----------
    coordinates : that move freely. inputs : motions that are given.
    relations : coordinates that follow from others, each a row over coordinates, inputs and earlier relations.
    """

    def __init__(
        self, coordinates: Sequence[str], inputs: Sequence[str] = (), relations: Mapping[str, Row] | None = None
    ) -> None:
        self.coordinates, self.inputs = tuple(coordinates), tuple(inputs)
        names = (*coordinates, *inputs)
        self.size = len(names)
        self._free: _Columns = {name: ((column, 1.0),) for column, name in enumerate(coordinates)}
        self._all: _Columns = {name: ((column, 1.0),) for column, name in enumerate(names)}
        for name, row in (relations or {}).items():
            values = self.values(row)
            self._all[name] = tuple((column, value) for column, value in enumerate(values) if value)

    def values(self, direction: Row, related: bool = True) -> list[float]:
        """A direction's factors over coordinates and inputs; `related` : whether related coordinates count."""
        columns, factors = self._all if related else self._free, [0.0] * self.size
        for name, factor in direction.items():
            for column, share in columns.get(name, ()):
                factors[column] += factor * share
        return factors

    def row(self, direction: Row) -> tuple[np.ndarray, np.ndarray]:
        """A direction over the coordinates, shape (n,), and over the inputs, shape (m,)."""
        values, count = np.array(self.values(direction)), len(self.coordinates)
        return values[:count], values[count:]


_Columns = dict[str, tuple[tuple[int, float], ...]]


def reduce(
    elements: Iterable[Element], masses: Sequence[float], kinematics: Kinematics, reactions: bool = True
) -> Reduced:
    """Equations of motion in the free coordinates.

    Parameters
    ----------
    elements : of the vehicle.
    masses : of the free coordinates, kg or kg m2. What follows from others is taken to have no inertia.
    reactions : whether a force along a related coordinate acts on those that it follows from, as virtual work has it.
        Without, what it follows from is taken to move the same whatever that force.
    """
    force, motion, stiffness, damping = [], [], [], []
    for element in elements:
        motion.append(kinematics.values(element.motion))
        same = reactions and element.force is element.motion
        force.append(motion[-1] if same else kinematics.values(element.force, reactions))
        stiffness.append(element.stiffness)
        damping.append(element.damping)
    n, size = len(kinematics.coordinates), kinematics.size
    F, G = np.array(force).reshape(-1, size)[:, :n].T, np.array(motion).reshape(-1, size)
    K, C = (F * stiffness) @ G, (F * damping) @ G
    return Reduced(kinematics.coordinates, kinematics.inputs, np.diag(masses), C[:, :n], K[:, :n], C[:, n:], K[:, n:])
