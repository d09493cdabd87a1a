"""Where a wheel touches its rail in steady curving, found in the profiles that the contact functions imply."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.contact.functions import HALF_DISTANCE, LIFT, RADIUS, ContactFunctions

ITERATIONS = 20  # of Newton's method for a contact, at most
LEAST_CURVATURE = 0.5  # 1/m; more curved everywhere within USED, or wheel and rail cannot be told apart
USED = 0.009  # m
LARGEST = 5e-4  # m; such a step at most


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
