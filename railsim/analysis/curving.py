"""Steady curving of a half vehicle from its free-body diagrams: a balance solved on its own, to check the engines by.

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
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from railsim.constants import GRAVITY
from railsim.contact.functions import AXIS_A, AXIS_B, C11, C22, C23, HALF_DISTANCE, LIFT, RADIUS, ContactFunctions
from railsim.contact.polach import friction_coefficient, polach_force
from railsim.errors import InputError
from railsim.track.track import CANT_BASE
from railsim.vehicles.half_vehicle import HalfVehicle

ACROSS, UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
UNKNOWNS = (
    *(f"wheelset{i}.{axis}" for i in (1, 2) for axis in ("y", "z", "roll", "yaw", "spin")),
    *(f"bogie.{axis}" for axis in ("y", "z", "roll", "pitch", "yaw")),
    *(f"body.{axis}" for axis in ("y", "z", "roll")),
)
SCALES = {"y": 1e-3, "z": 1e-4, "roll": 1e-3, "pitch": 1e-3, "yaw": 1e-3, "spin": 1e-3}  # m, rad, part of V / r0
STEPS = 6  # from straight track to the curve
ITERATIONS = 20  # of Newton's method for a contact, at most
LEAST_CURVATURE, USED = (
    0.5,
    0.009,
)  # 1/m, m: more curved everywhere within, or wheel and rail cannot be told apart
LARGEST = 5e-4  # m; such a step at most
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
class Wheel:
    """State of one contact: force on the wheel by parts [N], creepages [-, -, 1/m], angle [rad], radius [m]."""

    normal: float
    creep_force_x: float
    creep_force_y: float
    creepage_x: float
    creepage_y: float
    spin: float
    angle: float
    radius: float
    force: np.ndarray  # (3,) N, in the frame of the circle
    position: np.ndarray  # (3,) m


@dataclass(frozen=True)
class Curving:
    """A solution: `values` by the names of `UNKNOWNS` [m, rad, rad/s], `wheels` by `wheel1_left`, ...

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


class Stiffness(NamedTuple):
    """Both sides of a suspension [N/m, N m/rad], the load that it carries [N], and its lateral stop [m, N/m, N/m3]."""

    lateral: float
    vertical: float
    roll: float
    yaw: float
    load: float
    gap: float = np.inf
    stop: float = 0.0
    stop_cubic: float = 0.0


@dataclass(frozen=True)
class DeepestPoint:
    """Where the tilted wheel is deepest in its rail: depth along the normal [m], contact angle [rad] and place across
    the track [m] (both outwards +), and the contact functions at the place on the wheel.
    """

    depth: float
    angle: float
    lateral: float
    value: np.ndarray


class Side:
    """Profiles of one wheel and its rail as the contact functions imply them; `sign` +1 left, -1 right (mirrored).

    Where they touch at a shift u the rail has the point (b, H - r + r0) and the wheel, seen from its centre, the point
    (b - u, -r), both with the slope H'. So the tables hold both curves, and a wheel may be tilted on its rail.
    """

    def __init__(self, functions: ContactFunctions, sign: float) -> None:
        self.sign = sign
        self.splines = CubicSpline(functions.shift, functions.channels())
        self.slopes, self.second_derivatives = self.splines.derivative(), self.splines.derivative(2)
        self.stiffness, self.reach = functions.stiffness(), float(functions.shift[-1])
        self.radius = float(self.splines(0.0)[RADIUS])
        used = functions.shift[np.abs(functions.shift) < USED]
        self.separable = bool(self.second_derivatives(used)[:, LIFT].min() > LEAST_CURVATURE)

    def wheel_point(self, u: float, roll: float, yaw: float) -> tuple[np.ndarray, float]:
        """Outline of the wheel as seen along the track, from its centre [m], and the angle of the profile [rad].

        A yawed surface of revolution shows those points whose normal is square to the line of sight: they lie
        r yaw tan(delta) ahead (left) of the axle's plane.
        """
        value = self.splines(u)
        tangent = float(self.slopes(u)[LIFT])
        across = (value[HALF_DISTANCE] - u) * (1.0 - 0.5 * yaw**2) + value[RADIUS] * tangent * yaw**2
        up = value[RADIUS] * (0.5 * (tangent * yaw) ** 2 - 1.0)
        cosine, sine = np.cos(roll), np.sin(roll)
        return np.array([cosine * across - sine * up, sine * across + cosine * up]), float(np.arctan(tangent))

    def deepest_point(self, y: float, height: float, roll: float, yaw: float) -> DeepestPoint:
        """Deepest place of the wheel in the rail: both normals lie in the line that joins the two points there.

        Parameters
        ----------
        y, height : of the wheelset's centre, towards this side's rail and above the rails' level [m]; roll : lifting
        this side [rad]; yaw : [rad].
        """
        if not self.separable:
            return self.upright_deepest_point(y, height, roll, yaw)
        radius = self.radius
        wheel = rail = float(np.clip(y + radius * roll, -self.reach, self.reach))
        count = 0
        while True:
            count += 1
            value, slope = self.splines(rail), self.slopes(rail)
            point, own = self.wheel_point(wheel, roll, yaw)
            angle = float(np.arctan(slope[LIFT]))
            seen = point + np.array([y, height]) - [value[HALF_DISTANCE], value[LIFT] - value[RADIUS] + radius]
            along, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
            wheel_curvature = float(self.second_derivatives(wheel)[LIFT]) * np.cos(own) ** 2
            rail_curvature = float(self.second_derivatives(rail)[LIFT]) * np.cos(angle) ** 2
            gain = 1.0 - float(self.slopes(wheel)[HALF_DISTANCE])
            by_rail = -float(slope[HALF_DISTANCE]) / np.cos(angle) + float(seen @ normal) * rail_curvature
            jacobian = [[-gain / np.cos(own), by_rail], [-wheel_curvature, rail_curvature]]
            step = np.clip(np.linalg.solve(jacobian, [seen @ along, angle - own - roll]), -LARGEST, LARGEST)
            wheel, rail = np.clip((wheel - step[0], rail - step[1]), -self.reach, self.reach)
            if np.abs(step).max() < 1e-13 or count == ITERATIONS:
                break
        return DeepestPoint(-float(seen @ normal), angle, float(value[HALF_DISTANCE]), self.splines(wheel))

    def upright_deepest_point(self, y: float, height: float, roll: float, yaw: float) -> DeepestPoint:
        """As `deepest_point`, for profiles with straight parts: the wheel's place is that of an upright wheelset.

        Then the lift over the shift is the curve on which the wheelset slides, and the depth is the distance from it.
        """
        shift = float(np.clip(y + self.radius * roll, -self.reach, self.reach))
        u = shift
        count = 0
        while True:
            count += 1
            value, slope = self.splines(u), self.slopes(u)
            rise, half = float(slope[LIFT]), float(value[HALF_DISTANCE])
            low = height - self.radius + roll * (half - y) - 0.5 * yaw**2 * rise * (self.radius * rise - half)
            angle = float(np.arctan(rise))
            away = np.array([shift - u, low - float(value[LIFT])])
            normal, along = np.array([-np.sin(angle), np.cos(angle)]), np.array([np.cos(angle), np.sin(angle)])
            profile_curvature = float(self.second_derivatives(u)[LIFT]) * np.cos(angle) ** 2
            step = float(away @ along) / (1.0 / np.cos(angle) - float(away @ normal) * profile_curvature)
            u = float(np.clip(u + np.clip(step, -LARGEST, LARGEST), -self.reach, self.reach))
            if abs(step) < 1e-13 or count == ITERATIONS:
                break
        gain = 1.0 - float(slope[HALF_DISTANCE])
        return DeepestPoint(-float(away @ normal), float(np.arctan(rise + gain * roll)), half, value)


class Balance:
    """Forces and moments that are left over at a trial state; zero in steady curving."""

    def __init__(self, vehicle: HalfVehicle, curve: Curve, sides: tuple[Side, Side]) -> None:
        self.vehicle, self.curve, self.sides = vehicle, curve, sides
        self.angular_velocity = curve.speed * curve.curvature * UP  # Omega
        self.lean = -float(np.arcsin(curve.cant / CANT_BASE))

    def scales(self) -> np.ndarray:
        """Size of a natural step of each unknown."""
        rolling = self.curve.speed / self.vehicle.wheel_radius
        kinds = [name.partition(".")[2] for name in UNKNOWNS]
        return np.array([SCALES[kind] * (rolling if kind == "spin" else 1.0) for kind in kinds])

    def acceleration(self, position: np.ndarray) -> np.ndarray:
        """Centripetal acceleration [m/s2] of a place [m] that turns with the vehicle."""
        return np.cross(self.angular_velocity, self.velocity(position))

    def velocity(self, position: np.ndarray) -> np.ndarray:
        """Omega x (place - the circle's axis) [m/s]: V along the centre line."""
        return self.curve.speed * np.array([1.0, 0.0, 0.0]) + np.cross(self.angular_velocity, position)

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
        """All bodies at a trial state; the car body lies along the chord to the missing bogie."""
        v = self.vehicle
        chord = -2.0 * v.semi_bogie_spacing
        away = self.placed(chord, 0.0, 0.0, 0.0, 0.0, 0.0)
        here = self.placed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        ahead = here.track.inv().apply(-away.centre)
        heading = float(np.arctan2(ahead[1], ahead[0]))
        get = values.__getitem__
        bodies = {
            "body": self.placed(0.0, get("body.y"), v.body_height + get("body.z"), get("body.roll"), 0.0, heading),
            "bogie": self.placed(
                0.0, get("bogie.y"), v.bogie_height + get("bogie.z"),
                get("bogie.roll"), get("bogie.pitch"), get("bogie.yaw"),
            ),
        }  # fmt: skip
        for i, along in ((1, v.semi_wheelbase), (2, -v.semi_wheelbase)):
            name = f"wheelset{i}"
            y, z, roll, yaw = (get(f"{name}.{axis}") for axis in ("y", "z", "roll", "yaw"))
            bodies[name] = self.placed(along, y, v.wheel_radius + z, roll, 0.0, yaw)
        return bodies

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

    def spring(self, pair: tuple[Placed, Placed], arms: np.ndarray, stiffness: Stiffness) -> tuple[np.ndarray, ...]:
        """Force on the upper body [N], moment on it [N m], and the place where both bodies are pulled [m]."""
        upper, lower = pair
        ends = upper.centre + upper.rotation.apply(arms[0]), lower.centre + lower.rotation.apply(arms[1])
        twist = (lower.rotation.inv() * upper.rotation).as_rotvec()
        axes = lower.rotation * Rotation.from_rotvec(0.5 * twist)
        stretch = axes.inv().apply(ends[0] - ends[1])
        force = np.array([0.0, -stiffness.lateral * stretch[1], stiffness.load - stiffness.vertical * stretch[2]])
        beyond = max(abs(stretch[1]) - stiffness.gap, 0.0)
        force[1] -= np.sign(stretch[1]) * beyond * (stiffness.stop + stiffness.stop_cubic * beyond**2)
        moment = -np.array([stiffness.roll, 0.0, stiffness.yaw]) * twist
        return axes.apply(force), axes.apply(moment), 0.5 * (ends[0] + ends[1])

    def loads(self, values: dict[str, float]) -> tuple[dict[str, Placed], dict[str, np.ndarray], dict[str, Wheel]]:
        """Bodies, what is left over on each (force and moment about its centre, 6), and the wheels."""
        bodies = self.bodies(values)
        residual_forces = {name: self.inertia(name, body, values) for name, body in bodies.items()}
        for upper, lower, arms, stiffness in suspension(self.vehicle):
            force, moment, middle = self.spring((bodies[upper], bodies[lower]), arms, stiffness)
            for name, sign in ((upper, 1.0), (lower, -1.0)):
                lever = middle - bodies[name].centre
                residual_forces[name][:3] += sign * force
                residual_forces[name][3:] += sign * (moment + np.cross(lever, force))
        wheels = {}
        for i in (1, 2):
            name = f"wheelset{i}"
            coordinates = [values[f"{name}.{axis}"] for axis in ("y", "z", "roll", "yaw", "spin")]
            for side, word in zip(self.sides, ("left", "right"), strict=True):
                wheel = wheels[f"wheel{i}_{word}"] = self.wheel(bodies[name], coordinates, side)
                residual_forces[name][:3] += wheel.force
                residual_forces[name][3:] += np.cross(wheel.position - bodies[name].centre, wheel.force)
            self.pass_on(bodies, residual_forces, name, "bogie", bodies[name].centre)
        rod = bodies["bogie"].centre + (self.vehicle.secondary_height - self.vehicle.bogie_height) * UP
        self.pass_on(bodies, residual_forces, "bogie", "body", rod)
        return bodies, residual_forces, wheels

    @staticmethod
    def pass_on(
        bodies: dict[str, Placed], residual_forces: dict[str, np.ndarray], giver: str, taker: str, position: np.ndarray
    ) -> None:
        """What is left over along the track (the curve's resistance) goes on to the next body at `place` [m]."""
        along = bodies[giver].track.apply([1.0, 0.0, 0.0])
        force = (residual_forces[giver][:3] @ along) * along
        for name, sign in ((giver, -1.0), (taker, 1.0)):
            residual_forces[name][:3] += sign * force
            residual_forces[name][3:] += sign * np.cross(position - bodies[name].centre, force)

    def inertia(self, name: str, body: Placed, values: dict[str, float]) -> np.ndarray:
        """Weight less mass times acceleration [N], and less the change of angular momentum [N m]; (6,)."""
        mass, moments = masses(self.vehicle)[name]
        momentum = body.rotation.apply(np.array(moments) * body.rotation.inv().apply(self.angular_velocity))
        if f"{name}.spin" in values:
            momentum += self.vehicle.wheelset_spin_inertia * values[f"{name}.spin"] * body.rotation.apply(ACROSS)
        force = -mass * (GRAVITY * UP + self.acceleration(body.centre))
        return np.concatenate((force, -np.cross(self.angular_velocity, momentum)))

    def residual(self, unknown: np.ndarray) -> np.ndarray:
        """Eighteen forces and moments [N, N m] by the eighteen unknowns in natural steps."""
        bodies, residual_forces, _ = self.loads(self.named(unknown))
        rows = []
        for name in ("wheelset1", "wheelset2", "bogie", "body"):
            force = bodies[name].track.inv().apply(residual_forces[name][:3])
            moment = bodies[name].rotation.inv().apply(residual_forces[name][3:])
            rows += [*force[1:], *(moment[:1] if name == "body" else moment)]
        return np.array(rows)

    def named(self, unknown: np.ndarray) -> dict[str, float]:
        """Unknowns by name, in m, rad, rad/s."""
        values = dict(zip(UNKNOWNS, (unknown * self.scales()).tolist(), strict=True))
        for i in (1, 2):
            values[f"wheelset{i}.spin"] += self.curve.speed / self.vehicle.wheel_radius
        return values


def contact_arm(wheelset: Placed, axle: np.ndarray, upright: np.ndarray, arm: float, radius: float) -> np.ndarray:
    """From the wheelset's centre to the contact [m]: the normal of a surface of revolution meets its axis."""
    down = (upright @ axle) * axle - upright
    down *= radius / np.linalg.norm(down)
    left = wheelset.track.apply(ACROSS)
    return down + (arm - down @ left) / (axle @ left) * axle


def masses(vehicle: HalfVehicle) -> dict[str, tuple[float, tuple[float, float, float]]]:
    """Mass [kg] and moments of inertia about the body's axes [kg m2] of every body."""
    v = vehicle
    long = v.body_mass * v.semi_bogie_spacing**2 / 3.0  # pitch and yaw of the car body are held
    wheelset = v.wheelset_mass, (v.wheelset_yaw_inertia, v.wheelset_spin_inertia, v.wheelset_yaw_inertia)
    return {
        "body": (v.body_mass, (v.body_roll_inertia, long, long)),
        "bogie": (v.bogie_mass, (v.bogie_roll_inertia, v.bogie_pitch_inertia, v.bogie_yaw_inertia)),
        "wheelset1": wheelset,
        "wheelset2": wheelset,
    }


def suspension(vehicle: HalfVehicle) -> list[tuple[str, str, np.ndarray, Stiffness]]:
    """Upper body, lower body, arms from their centres to the suspension's middle [m], and its stiffness."""
    v = vehicle
    apart = v.secondary_half_spacing**2
    secondary = Stiffness(
        2.0 * v.secondary_lateral_stiffness,
        2.0 * v.secondary_vertical_stiffness,
        2.0 * v.secondary_vertical_stiffness * apart + v.roll_bar_stiffness,
        2.0 * v.secondary_longitudinal_stiffness * apart,
        v.body_mass * GRAVITY,
        v.bump_stop_gap,
        v.bump_stop_stiffness,
        v.bump_stop_cubic,
    )
    apart = v.primary_half_spacing**2
    primary = Stiffness(
        2.0 * v.primary_lateral_stiffness,
        2.0 * v.primary_vertical_stiffness,
        2.0 * v.primary_vertical_stiffness * apart,
        2.0 * v.primary_longitudinal_stiffness * apart,
        0.5 * (v.body_mass + v.bogie_mass) * GRAVITY,
    )
    heights = np.array([v.secondary_height - v.body_height, v.secondary_height - v.bogie_height])
    suspensions = [("body", "bogie", heights[:, None] * UP, secondary)]
    for i, along in ((1, v.semi_wheelbase), (2, -v.semi_wheelbase)):
        arm = np.array([along, 0.0, v.wheel_radius - v.bogie_height])
        suspensions.append(("bogie", f"wheelset{i}", np.stack((arm, np.zeros(3))), primary))
    return suspensions


def steady_curving(vehicle: HalfVehicle, curve: Curve) -> Curving:
    """Steady state of a half vehicle in a circle, from the balance of its forces by `scipy.optimize.root`.

    Raises
    ------
    InputError : no such state was found (the vehicle cannot run there at this speed).
    """
    left, right = vehicle.pair.sides(vehicle.wheel_radius, vehicle.half_gauge)
    sides = Side(left, 1.0), Side(left if right is None else right, -1.0)
    start = Balance(vehicle, Curve(0.0, 0.0, curve.speed), sides)
    sunk = (vehicle.wheel_load / sides[0].stiffness) ** (2.0 / 3.0)
    unknown = np.array([-sunk if name.endswith(".z") else 0.0 for name in UNKNOWNS]) / start.scales()
    weight = 4.0 * vehicle.wheel_load
    balance, worst = start, 0.0
    for part in np.linspace(1.0 / STEPS, 1.0, STEPS):
        balance = Balance(vehicle, Curve(part * curve.curvature, part * curve.cant, curve.speed), sides)
        found = root(lambda x, b=balance: b.residual(x) / weight, unknown, method="hybr", options=SETTINGS)
        unknown = found.x
        worst = float(np.abs(balance.residual(unknown)).max() / weight)
    if not worst < ACCURACY:
        raise InputError(
            f"steady curving: no balance at curvature {curve.curvature:g} 1/m, cant {curve.cant:g} m and "
            f"{curve.speed:g} m/s (left over {worst:.1e} of the weight); choose a speed that suits the curve"
        )
    values = balance.named(unknown)
    return Curving(values, balance.loads(values)[2], worst)
