"""Steady curving of a vehicle from its free-body diagrams: a balance solved on its own, to check the engines by.

Nothing of the engines' equations is used. A vehicle that runs round a circle at constant speed turns about the
circle's vertical axis as one body, Omega = V / R, but for its spinning wheels. So every body has the centripetal
acceleration of its own place, its angular momentum changes by Omega x H, and the velocity of a wheel at the contact is
Omega x (place from the circle's axis) plus spin x (place from the axle): Newton's and Euler's laws in a frame at rest,
with finite rotations. The creepages of the textbooks,

    xi_x = 1 - r omega / V - kappa (y + arm),   xi_y = -psi / cos(delta),   spin = kappa cos(delta) - sin(delta) / r0,

are the first order of this. Springs pull at the middle of the two points that they join, along axes midway between both
bodies. Shared with the engines: the vehicle's parameters, the arrays of the contact functions (read here through
`scipy.interpolate.CubicSpline`) and the published creep law, `contact.polach`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from railsim.analysis.curving.contact import Side, Wheel
from railsim.analysis.curving.layout import ACROSS, ALONG, UP, Part, Suspension, check, layout
from railsim.constants import GRAVITY
from railsim.contact.functions import AXIS_A, AXIS_B, C11, C22, C23, RADIUS
from railsim.contact.polach import friction_coefficient, polach_force
from railsim.errors import InputError
from railsim.track.track import CANT_BASE
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.whole_vehicle import WholeVehicle

Vehicle = HalfVehicle | WholeVehicle

SCALES = {
    "x": 1e-4, "y": 1e-3, "z": 1e-4, "roll": 1e-3, "pitch": 1e-3, "yaw": 1e-3, "spin": 1e-3,
}  # m, rad, part of V / r0  # fmt: skip
ROWS = {"x": 0, "y": 1, "z": 2, "roll": 3, "pitch": 4, "spin": 4, "yaw": 5}  # force or moment that finds an unknown
STEPS = 6  # from straight track to the curve
SETTINGS = {"xtol": 1e-13, "eps": 1e-8, "factor": 1.0}  # of `scipy.optimize.root`, method hybr
ACCURACY = 1e-9  # of the weight of the vehicle


@dataclass(frozen=True)
class Curve:
    """A circle run at constant speed: curvature [1/m] (left +), cant [m] (right rail higher +), speed [m/s]."""

    curvature: float
    cant: float
    speed: float

    @property
    def excess(self) -> float:
        """Lateral acceleration in the track plane that is not balanced by cant [m/s2], outwards +, on a left curve."""
        lean = np.arcsin(self.cant / CANT_BASE)
        return float(self.speed**2 * self.curvature * np.cos(lean) - GRAVITY * np.sin(lean))


@dataclass(frozen=True)
class Curving:
    """A solution: `values` by the names of the unknowns [m, rad, rad/s], `wheels` by `wheel1_left`, ...

    Angles and places are relative to the track frame at each body's own distance, as in the truth channels.
    """

    values: dict[str, float]
    wheels: dict[str, Wheel]
    residual: float


@dataclass(frozen=True)
class Placed:
    """A body in the frame of the circle: its centre [m], its rotation, the track's axes under it."""

    centre: np.ndarray
    rotation: Rotation
    track: Rotation


class Balance:
    """Forces and moments that are left over at a trial state; zero in steady curving."""

    def __init__(self, vehicle: Vehicle, curve: Curve, sides: tuple[Side, Side]) -> None:
        self.vehicle, self.curve, self.sides = vehicle, curve, sides
        self.layout = layout(vehicle)
        self.angular_velocity = curve.speed * curve.curvature * UP  # Omega
        self.lean = -float(np.arcsin(curve.cant / CANT_BASE))

    def scales(self) -> np.ndarray:
        """Size of a natural step of each unknown."""
        rolling = self.curve.speed / self.vehicle.wheel_radius
        kinds = [name.partition(".")[2] for name in self.layout.unknowns]
        return np.array([SCALES[kind] * (rolling if kind == "spin" else 1.0) for kind in kinds])

    def acceleration(self, position: np.ndarray) -> np.ndarray:
        """Centripetal acceleration [m/s2] of a place [m] that turns with the vehicle."""
        return np.cross(self.angular_velocity, self.velocity(position))

    def velocity(self, position: np.ndarray) -> np.ndarray:
        """Omega x (place - the circle's axis) [m/s]: V along the centre line."""
        return self.curve.speed * ALONG + np.cross(self.angular_velocity, position)

    def placed(self, along: float, y: float, height: float, roll: float, pitch: float, yaw: float) -> Placed:
        """A body `along` metres ahead of the bogie's centre, its coordinates in the track frame there."""
        kappa = self.curve.curvature
        angle = along * kappa
        half = np.sinc(0.5 * angle / np.pi)  # sin(x) / x: chords of an arc, also on straight track
        origin = along * half * np.array([np.cos(0.5 * angle), np.sin(0.5 * angle), 0.0])
        track = Rotation.from_euler("ZX", [angle, self.lean])
        centre = origin + track.apply([0.0, y, height])
        return Placed(centre, track * Rotation.from_euler("ZYX", [yaw, pitch, roll]), track)

    def bodies(self, values: dict[str, float]) -> dict[str, Placed]:
        """All bodies at a trial state."""
        return {part.name: self.body(part, values) for part in self.layout.parts}

    def body(self, part: Part, values: dict[str, float]) -> Placed:
        """A body at a trial state; one of held yaw lies along its chord."""
        x, y, z, roll, pitch, yaw = (
            values.get(f"{part.name}.{axis}", 0.0) for axis in ("x", "y", "z", "roll", "pitch", "yaw")
        )
        if part.chord:
            yaw = self.chord_yaw(part)
        return self.placed(part.along + x, y, part.height + z, roll, pitch, yaw)

    def chord_yaw(self, part: Part) -> float:
        """Yaw [rad] of a body that points from the far end of its chord to its own place."""
        here, away = (self.placed(part.along + ahead, 0.0, 0.0, 0.0, 0.0, 0.0) for ahead in (0.0, part.chord))
        ahead = here.track.inv().apply(here.centre - away.centre)
        return float(np.arctan2(ahead[1], ahead[0]))

    def wheel(self, wheelset: Placed, coordinates: Sequence[float], side: Side) -> Wheel:
        """Contact of one wheel: Hertz pressure on the penetration, creep force by the velocity there."""
        y, z, roll, yaw, spin = coordinates
        sign = side.sign
        deepest_point = side.deepest_point(sign * y, self.vehicle.wheel_radius + z, sign * roll, sign * yaw)
        value, angle, arm = deepest_point.value, sign * deepest_point.angle, sign * deepest_point.lateral - y
        normal = side.stiffness * max(deepest_point.depth, 0.0) ** 1.5
        upright = wheelset.track.apply([0.0, -np.sin(angle), np.cos(angle)])
        axle = wheelset.rotation.apply(ACROSS)
        position = wheelset.centre + contact_arm(wheelset, axle, upright, arm, value[RADIUS])
        along = np.cross(axle, upright)
        along /= np.linalg.norm(along)
        across = np.cross(upright, along)
        slip = self.velocity(position) + spin * np.cross(axle, position - wheelset.centre)
        turning = (self.angular_velocity + spin * axle) @ upright
        creep = np.array([slip @ along, slip @ across, turning]) / self.curve.speed
        force = self.creep_force(creep, value, normal)
        total = normal * upright + force[0] * along + force[1] * across
        x, y, spin_creepage = creep
        return Wheel(
            normal, force[0], force[1], x, y, spin_creepage, float(angle), float(value[RADIUS]), total, position
        )

    def creep_force(self, creep: np.ndarray, value: np.ndarray, normal: float) -> tuple[float, float]:
        """Polach's law at the present creepages and load."""
        law = self.vehicle.adhesion
        sliding = self.curve.speed * float(np.hypot(creep[0], creep[1]))
        mu = friction_coefficient(law.friction, law.friction_ratio, law.friction_decay, sliding)
        size = np.cbrt(normal)
        x, y, spin = creep
        return polach_force(
            x, y, spin, value[AXIS_A] * size, value[AXIS_B] * size, value[C11], value[C22], value[C23],
            normal, mu, law.k_adhesion, law.k_slip,
        )  # fmt: skip

    @staticmethod
    def spring(upper: Placed, lower: Placed, suspension: Suspension) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Force on the upper body [N], moment on it [N m], and the place where both bodies are pulled [m]."""
        arms = suspension.arms
        ends = upper.centre + upper.rotation.apply(arms[0]), lower.centre + lower.rotation.apply(arms[1])
        twist = (lower.rotation.inv() * upper.rotation).as_rotvec()
        axes = lower.rotation * Rotation.from_rotvec(0.5 * twist)
        stretch = axes.inv().apply(ends[0] - ends[1])
        force = suspension.load * UP - suspension.stiffness @ stretch
        beyond = max(abs(stretch[1]) - suspension.gap, 0.0)
        force[1] -= np.sign(stretch[1]) * beyond * (suspension.stop + suspension.stop_cubic * beyond**2)
        moment = -suspension.turning @ twist
        return axes.apply(force), axes.apply(moment), 0.5 * (ends[0] + ends[1])

    def loads(self, values: dict[str, float]) -> tuple[dict[str, Placed], dict[str, np.ndarray], dict[str, Wheel]]:
        """Bodies, what is left over on each (force and moment about its centre, 6), and the wheels."""
        bodies = self.bodies(values)
        residual_forces = {part.name: self.inertia(part, bodies[part.name], values) for part in self.layout.parts}
        for suspension in self.layout.suspensions:
            upper, lower = suspension.upper, suspension.lower
            force, moment, middle = self.spring(bodies[upper], bodies[lower], suspension)
            for name, sign in ((upper, 1.0), (lower, -1.0)):
                lever = middle - bodies[name].centre
                residual_forces[name][:3] += sign * force
                residual_forces[name][3:] += sign * (moment + np.cross(lever, force))
        wheels = {}
        for i in range(1, self.layout.wheelsets + 1):
            name = f"wheelset{i}"
            coordinates = [values[f"{name}.{axis}"] for axis in ("y", "z", "roll", "yaw", "spin")]
            for side, word in zip(self.sides, ("left", "right"), strict=True):
                wheel = wheels[f"wheel{i}_{word}"] = self.wheel(bodies[name], coordinates, side)
                residual_forces[name][:3] += wheel.force
                residual_forces[name][3:] += np.cross(wheel.position - bodies[name].centre, wheel.force)
        for passing in self.layout.passings:
            place = bodies[passing.giver].centre + passing.height * UP
            self.pass_on(bodies, residual_forces, passing.giver, passing.taker, place)
        return bodies, residual_forces, wheels

    @staticmethod
    def pass_on(
        bodies: dict[str, Placed], residual_forces: dict[str, np.ndarray], giver: str, taker: str, position: np.ndarray
    ) -> None:
        """What is left over along the track (the curve's resistance) goes on to the next body at `place` [m]."""
        along = bodies[giver].track.apply(ALONG)
        force = (residual_forces[giver][:3] @ along) * along
        for name, sign in ((giver, -1.0), (taker, 1.0)):
            residual_forces[name][:3] += sign * force
            residual_forces[name][3:] += sign * np.cross(position - bodies[name].centre, force)

    def inertia(self, part: Part, body: Placed, values: dict[str, float]) -> np.ndarray:
        """Weight less mass times acceleration [N], and less the change of angular momentum [N m]; (6,)."""
        momentum = body.rotation.apply(np.array(part.moments) * body.rotation.inv().apply(self.angular_velocity))
        if "spin" in part.free:
            momentum += self.vehicle.wheelset_spin_inertia * values[f"{part.name}.spin"] * body.rotation.apply(ACROSS)
        force = -part.mass * (GRAVITY * UP + self.acceleration(body.centre))
        return np.concatenate((force, -np.cross(self.angular_velocity, momentum)))

    def residual(self, unknown: np.ndarray) -> np.ndarray:
        """A force or moment [N, N m] for each of the unknowns, which are given in natural steps."""
        bodies, residual_forces, _ = self.loads(self.named(unknown))
        rows: list[float] = []
        for part in self.layout.parts:
            body, left = bodies[part.name], residual_forces[part.name]
            both = *body.track.inv().apply(left[:3]), *body.rotation.inv().apply(left[3:])
            rows += [both[ROWS[axis]] for axis in part.free]
        return np.array(rows)

    def named(self, unknown: np.ndarray) -> dict[str, float]:
        """Unknowns by name, in m, rad, rad/s."""
        values = dict(zip(self.layout.unknowns, (unknown * self.scales()).tolist(), strict=True))
        for name in values:
            if name.endswith(".spin"):
                values[name] += self.curve.speed / self.vehicle.wheel_radius
        return values


def contact_arm(wheelset: Placed, axle: np.ndarray, upright: np.ndarray, arm: float, radius: float) -> np.ndarray:
    """From the wheelset's centre to the contact [m]: the normal of a surface of revolution meets its axis."""
    down = (upright @ axle) * axle - upright
    down *= radius / np.linalg.norm(down)
    left = wheelset.track.apply(ACROSS)
    return down + (arm - down @ left) / (axle @ left) * axle


def steady_curving(vehicle: Vehicle, curve: Curve) -> Curving:
    """Steady state of a half or whole vehicle in a circle, from the balance of its forces by `scipy.optimize.root`.

    Raises
    ------
    InputError : no such state was found (the vehicle cannot run there at this speed), or the vehicle has a payload or
        air springs.
    """
    check(vehicle)
    left, right = vehicle.pair.sides(vehicle.wheel_radius, vehicle.half_gauge)
    sides = Side(left, 1.0), Side(left if right is None else right, -1.0)
    start = Balance(vehicle, Curve(0.0, 0.0, curve.speed), sides)
    sunk = (vehicle.wheel_load / sides[0].stiffness) ** (2.0 / 3.0)
    unknown = np.array([-sunk if name.endswith(".z") else 0.0 for name in start.layout.unknowns]) / start.scales()
    weight = 2.0 * start.layout.wheelsets * vehicle.wheel_load
    balance, worst = start, 0.0
    for part in np.linspace(1.0 / STEPS, 1.0, STEPS):
        balance = Balance(vehicle, Curve(part * curve.curvature, part * curve.cant, curve.speed), sides)
        found = root(lambda x, b=balance: b.residual(x) / weight, unknown, method="hybr", options=SETTINGS)
        unknown = found.x
        worst = float(np.abs(balance.residual(unknown)).max() / weight)
        if not worst < ACCURACY:
            raise InputError(
                f"steady curving: no balance at curvature {curve.curvature:g} 1/m, cant {curve.cant:g} m and "
                f"{curve.speed:g} m/s (left over {worst:.1e} of the weight, after {part:.0%} of the way from straight "
                "track); choose a speed that suits the curve"
            )
    values = balance.named(unknown)
    return Curving(values, balance.loads(values)[2], worst)
