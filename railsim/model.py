"""Model: a vehicle as bodies, elements and wheelsets: plain numbers and names that both engines read.

Coordinates are small displacements from the nominal place in the vehicle frame: the track frame at the reference
distance s (the bogie's centre), x forward, y left, z up from rail level. Six per body in the order of `AXES`; those
that a body does not list as free are held. A body far from the reference refers to the track frame at a place of its
own, `Body.origin` ahead of s: in a curve the frames of a long vehicle are turned against each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from railsim.contact.functions import ContactTable
from railsim.contact.wheel import ContactLaw
from railsim.errors import InputError
from railsim.force_laws import ForceLaw
from railsim.track.flexible import CoRunning, Void

TRACK = "track"  # in place of an element's lower body: it acts on the upper one alone
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
PLACED = 1e-9  # m; farther from its place an axle is not there


@dataclass(frozen=True)
class Body:
    """Rigid body: mass [kg], principal inertia about its centre of gravity [kg m2], nominal place [m], free axes.

    `origin`: how far ahead of the reference the track frame stands to which its coordinates refer [m]. `sunk`: how far
    its nominal place is below its design height, under a payload [m]; channels count heights from the latter.
    """

    name: str
    mass: float
    inertia: tuple[float, float, float]
    position: tuple[float, float, float]
    free: tuple[str, ...]
    origin: float = 0.0
    sunk: float = 0.0


@dataclass(frozen=True)
class LinearElement:
    """Linear spring and damper between two bodies, with its axes midway between both bodies' orientations.

    `stiffness` and `damping` (6, 6) act on the displacement and small rotation of `upper` relative to `lower` at
    `position` (vehicle frame, common to both bodies at rest); `preload` is the force on `upper` at rest [N] in x, y,
    z. `finite`: displacements are so large (centimetres in curves) that the compiled engine evaluates the element to
    second order in the rotations instead of through K and C; Exudyn always does.
    """

    name: str
    upper: str
    lower: str
    position: tuple[float, float, float]
    stiffness: np.ndarray
    damping: np.ndarray
    preload: tuple[float, float, float] = (0.0, 0.0, 0.0)
    finite: bool = False


@dataclass(frozen=True)
class NonlinearElement:
    """Force by a law along one direction of relative movement at `position` (vehicle frame)."""

    name: str
    upper: str
    lower: str
    position: tuple[float, float, float]
    axis: str
    law: ForceLaw


@dataclass(frozen=True)
class Load:
    """Force [N] or moment [N m] on a body's centre of gravity along one axis of the track frame, linear between
    `values` at equal steps of time [s] or of the body's distance [m] from `start`; held at both ends.
    """

    body: str
    axis: str
    over: str  # "time" or "distance"
    start: float
    step: float
    values: np.ndarray


@dataclass(frozen=True)
class Wheelset:
    """The wheels of a body: spin inertia [kg m2], nominal radius [m], and the half spacing of the axleboxes [m].

    `frame`: body that the axleboxes carry, to which displacement transducers reach; None = there are none.
    `roundness`: deviation of the left and the right wheel's radius [m] over one turn at equal angles, as many of each
    wheel of a model; a point's angle is the spin angle at which it touches the rail. `unbalance`: mass times radius
    [kg m] and that angle [rad], left and right. `steeper` [-]: rolling radii differ from the one in the middle of
    the tread by 1 + `steeper` times what the contact functions say.
    """

    body: str
    spin_inertia: float
    radius: float
    axlebox_half_spacing: float
    frame: str | None = None
    roundness: tuple[np.ndarray, np.ndarray] | None = None
    unbalance: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))
    steeper: float = 0.0


@dataclass(frozen=True)
class LongitudinalPath:
    """How longitudinal forces go from the wheelsets to the vehicle: every wheelset pulls `frame` at its axle's height,
    `frame` pulls what it carries at `rod_height` [m above the rails], and what drives or brakes a wheelset stands on
    `frame`.

    `frame` must be free to pitch. All else that acts along the track (resistance, and what holds a prescribed speed)
    acts on what is carried, whose pitch is held.
    """

    frame: str
    rod_height: float


@dataclass(frozen=True)
class Model:
    """All of a vehicle.

    `reference`: body whose distance is s.
    `trailing_pivot`: distance from the reference back to the missing bogie [m]; a body listed in `chord_yaw` keeps
    the direction of that chord. `path`: None = longitudinal forces pitch nothing. `corunning`: the track under each
    wheelset, None = rails stand still or are massless; `voids` below its sleepers.
    """

    bodies: tuple[Body, ...]
    elements: tuple[LinearElement, ...]
    nonlinear: tuple[NonlinearElement, ...]
    wheelsets: tuple[Wheelset, ...]
    contact: ContactTable
    law: ContactLaw
    reference: str
    trailing_pivot: float = 0.0
    chord_yaw: str | None = None
    path: LongitudinalPath | None = None
    vertical_load: dict[str, float] = field(default_factory=dict)
    loads: tuple[Load, ...] = ()
    corunning: CoRunning | None = None
    voids: tuple[Void, ...] = ()

    def index(self, name: str) -> int:
        """Place of a body in `bodies`.

        Raises
        ------
        InputError : there is no such body.
        """
        names = [body.name for body in self.bodies]
        if name not in names:
            raise InputError(f"model: there is no body '{name}'; there are {', '.join(names)}")
        return names.index(name)

    def check(self) -> None:
        """Refuse what the engines would take silently for something else.

        Raises
        ------
        InputError : one line that names the part which does not fit.
        """
        names = [body.name for body in self.bodies]
        if len(set(names)) < len(names):
            raise InputError(f"model: two bodies have one name; names are {', '.join(names)}")
        if not self.wheelsets:
            raise InputError("model: a vehicle needs a wheelset")
        if self.bodies[self.index(self.reference)].position[0] != 0.0:
            raise InputError(f"model: the reference body '{self.reference}' must stand at x = 0")
        for element in self.elements:
            if TRACK in (element.upper, element.lower):
                raise InputError(f"model: the linear element '{element.name}' must join two bodies")
        for element in self.nonlinear:
            if element.axis not in AXES:
                raise InputError(f"model: element '{element.name}' acts along '{element.axis}', not one of {AXES}")
        for wheelset in self.wheelsets:
            _, y, z = self.bodies[self.index(wheelset.body)].position
            if y != 0.0 or abs(z - wheelset.radius) > PLACED:
                raise InputError(
                    f"model: the axle of '{wheelset.body}' must stand at y = 0 and a radius above the rails"
                )
        if self.chord_yaw is not None and (
            "yaw" in self.bodies[self.index(self.chord_yaw)].free or self.trailing_pivot <= 0.0
        ):
            raise InputError(f"model: '{self.chord_yaw}' keeps a chord's direction: hold its yaw, give trailing_pivot")
        if self.path is not None:
            self._check_path(self.path)
        self._check_frames()

    def _check_frames(self) -> None:
        """Bodies that are free along the track, and elements between track frames."""
        held = [body.name for body in self.bodies if "x" not in body.free]
        if self.moves_along and (len(held) != 1 or self.path is not None):
            raise InputError(
                "model: where bodies are free along the track, one body alone is held to the prescribed motion, and "
                f"there is no longitudinal path; held are {', '.join(held) or 'none'}"
            )
        for element in self.elements:
            if self.joins_frames(element) and not element.finite:
                raise InputError(
                    f"model: the element '{element.name}' joins bodies in two track frames; make it 'finite'"
                )
        for wheelset in self.wheelsets:
            if wheelset.frame is not None and self.origin(wheelset.body) != self.origin(wheelset.frame):
                raise InputError(f"model: '{wheelset.body}' and '{wheelset.frame}' need the same origin")

    @property
    def moves_along(self) -> bool:
        """Whether bodies are free along the track."""
        return any("x" in body.free for body in self.bodies)

    @property
    def driver(self) -> int:
        """Place of the body whose distance follows the prescribed motion: the only one that is held along the track,
        or the reference.
        """
        if not self.moves_along:
            return self.index(self.reference)
        return next(i for i, body in enumerate(self.bodies) if "x" not in body.free)

    def origin(self, name: str) -> float:
        """Origin of a body's coordinates ahead of the reference [m]."""
        return self.bodies[self.index(name)].origin

    def joins_frames(self, element: "LinearElement | NonlinearElement") -> bool:
        """Whether an element joins bodies whose coordinates refer to different track frames."""
        return element.lower != TRACK and self.origin(element.upper) != self.origin(element.lower)

    def _check_path(self, path: LongitudinalPath) -> None:
        if "pitch" not in self.bodies[self.index(path.frame)].free:
            raise InputError(f"model: the path's frame '{path.frame}' must be free to pitch")
        if any(wheelset.frame != path.frame for wheelset in self.wheelsets):
            raise InputError(f"model: a longitudinal path needs all wheelsets under '{path.frame}'; leave it out")
        if len({wheelset.radius for wheelset in self.wheelsets}) > 1:
            raise InputError("model: a longitudinal path needs wheelsets of one radius; leave it out")

    @cached_property
    def free(self) -> np.ndarray:
        """Indices of the free coordinates among the 6 per body."""
        return np.array([6 * i + AXES.index(a) for i, body in enumerate(self.bodies) for a in AXES if a in body.free])

    @property
    def names(self) -> list[str]:
        """Free coordinates by name, e.g. `bogie.pitch`."""
        return [f"{self.bodies[i // 6].name}.{AXES[i % 6]}" for i in self.free]

    @cached_property
    def mass(self) -> np.ndarray:
        """Diagonal of the mass matrix over all coordinates, (6 bodies,)."""
        return np.concatenate([[b.mass] * 3 + list(b.inertia) for b in self.bodies])

    @cached_property
    def stiffness(self) -> np.ndarray:
        """K over all coordinates, geometric stiffness of the preloads included [N/m, N/rad, N m/rad]."""
        return self.assembled(self.elements)[0]

    @cached_property
    def damping(self) -> np.ndarray:
        """C over all coordinates."""
        return self.assembled(self.elements)[1]

    def assembled(self, elements: Sequence[LinearElement]) -> tuple[np.ndarray, np.ndarray]:
        """K and C of some of the elements."""
        stiffness, damping = np.zeros((2, len(self.mass), len(self.mass)))
        for element in elements:
            relative = self.relative(element.upper, element.lower, element.position)
            stiffness += relative.T @ element.stiffness @ relative + self._geometric(element)
            damping += relative.T @ element.damping @ relative
        return stiffness, damping

    @cached_property
    def preload(self) -> np.ndarray:
        """Generalised forces of the preloads of all but the finite elements, and of the static vertical loads at
        rest [N, N m].
        """
        total = np.zeros(len(self.mass))
        for element in self.elements:
            if not element.finite:
                total += self.relative(element.upper, element.lower, element.position)[:3].T @ np.array(element.preload)
        for name, load in self.vertical_load.items():
            total[6 * self.index(name) + 2] -= load
        return total

    def point(self, name: str, position: tuple[float, float, float]) -> np.ndarray:
        """(6, coordinates): small displacement and rotation of a body's point given in the vehicle frame."""
        index = self.index(name)
        x, y, z = np.subtract(position, self.bodies[index].position)
        jacobian = np.zeros((6, len(self.mass)))
        jacobian[:, 6 * index : 6 * index + 6] = np.eye(6)
        jacobian[:3, 6 * index + 3 : 6 * index + 6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return jacobian

    def relative(self, upper: str, lower: str, position: tuple[float, float, float]) -> np.ndarray:
        """(6, coordinates): displacement and rotation of `upper` relative to `lower`, or to the track frame."""
        if lower == TRACK:
            return self.point(upper, position)
        return self.point(upper, position) - self.point(lower, position)

    def _geometric(self, element: LinearElement) -> np.ndarray:
        """Second derivative of -F0 . u, u = A_mid^T (p_upper - p_lower) to second order in the rotations of both
        bodies.
        """
        force = np.array(element.preload)
        if not force.any():
            return np.zeros((len(self.mass),) * 2)
        arms = [
            np.subtract(element.position, self.bodies[self.index(n)].position) for n in (element.upper, element.lower)
        ]
        points = [self.point(n, element.position) for n in (element.upper, element.lower)]
        count = len(self.mass)
        upper, lower = points[0][3:], points[1][3:]
        moved = points[0][:3] - points[1][:3]
        hessian = np.zeros((count, count))
        for rotation, arm, sign in ((upper, arms[0], 1.0), (lower, arms[1], -1.0)):
            # F . (1/2 phi x (phi x d)) = 1/2 [(F . phi)(phi . d) - (F . d) phi . phi]
            product = np.outer(force @ rotation, arm @ rotation)
            hessian -= sign * (0.5 * (product + product.T) - float(force @ arm) * rotation.T @ rotation)
        # -1/2 F . ((phi_u + phi_l) x u) = 1/2 (phi_u + phi_l) . (F x u)
        skew = np.array([[0.0, -force[2], force[1]], [force[2], 0.0, -force[0]], [-force[1], force[0], 0.0]])
        twist = 0.5 * (upper + lower).T @ skew @ moved
        return hessian - (twist + twist.T)
