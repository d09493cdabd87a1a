"""Where one wheel touches its rail: quasi-elastic search in the cross-section, with roll and yaw.

The wheel is a surface of revolution and the rail a cylinder along x, so that they touch where the wheel's outline, seen
along the rail, touches the rail's profile: the search is plane. The outline of a yawed wheel follows in closed form
from normal . x = 0; it contains the contact's longitudinal shift (r tan(delta) yaw to first order).

A rigid search (smallest vertical gap) jumps where arcs meet and where two points touch. Here wheel and rail
interpenetrate by the depth D, and with the gap g >= 0 of the outline over the lateral place Y

    I = integral (D - g)_+^(7/2) dY = constant,   weight w = (D - g)_+^(5/2) / integral of the same.

Place, angle and radius are the averages over w. (D - g)^(5/2) is, but for a factor, the square of the interpenetration
summed along x over the wheel's circle; among exponents tried it is the one that reproduces CONTACT's contact places in
the Manchester benchmark A-2.2 (to 0.02 mm with CONTACT's own D). As I is constant, d(height)/d(shift) is exactly the
average of the outline's slope: the lift has the tangent of the averaged contact angle as its derivative, so that it is
a potential. The constant belongs to a wheel load: it is I of a parabolic gap of curvature 3 1/m under Hertz's approach.
(Quasi-elastic averaging goes back to Arnold and Frischmuth 1998; with weights exp(-g / scale), a scale of about D / 4
gives nearly the same.)
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad

from railsim.contact.hertz import hertz_ellipse
from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile

POWER = 2.5
"""Exponent of the weights."""

TYPICAL_CURVATURE = 3.0
"""Sum of lateral curvatures for which Hertz's approach calibrates the interpenetration [1/m]."""

WHOLE = (-np.inf, np.inf)
"""Zone that holds all of a wheel's profile [m]."""

_STEP = 2e-5  # m; spacing of the wheel's points


@dataclass(frozen=True)
class ProfileContact:
    """Contact of one wheel, in the frame of its own side (y towards the field, z up).

    Attributes
    ----------
    height : of the wheelset's centre above its nominal height r0 over the rail's top [m]. rigid_height : without
    interpenetration. depth : interpenetration D [m].
    wheel_position, rail_position : lateral, in the profile's own coordinates [m]. rigid_wheel_position : of a rigid
    search.
    position : (x, y, z) relative to the wheelset's centre [m], on the wheel's outline. half_distance : of the contact
    from the track's centre line [m].
    angle : of the contact plane against the track plane, positive towards the flange [rad]. radius : average rolling
    radius over the contact [m].
    curvature : sum of the lateral curvatures, always positive; wheel_curvature, rail_curvature : averages of the parts
    (wheel: positive where convex) [1/m].
    """

    height: float
    rigid_height: float
    depth: float
    wheel_position: float
    rail_position: float
    rigid_wheel_position: float
    position: tuple[float, float, float]
    half_distance: float
    angle: float
    radius: float
    curvature: float
    wheel_curvature: float
    rail_curvature: float


@dataclass(frozen=True)
class Outline:
    """The wheel seen along the rail; arrays over the wheel's points, relative to the wheelset's centre [m]."""

    longitudinal: np.ndarray
    lateral: np.ndarray
    vertical: np.ndarray
    slope: np.ndarray


class Side:
    """One wheel over one rail.

    Parameters
    ----------
    wheel, rail : profiles in the frame of the side; the rail as it stands in the track (inclined).
    layout : gauge and wheelset measures.
    load : wheel load to which the interpenetration belongs [N]; small loads approach the rigid search.

    Raises
    ------
    ValueError : profiles of the wrong kind, or a rail that does not reach down to the gauge point.
    """

    def __init__(self, wheel: Profile, rail: Profile, layout: Layout, load: float = 10e3) -> None:
        if (wheel.kind, rail.kind) != ("wheel", "rail"):
            raise ValueError("a side needs a wheel and a rail profile, in this order")
        self.layout = layout
        self.content = interpenetration(load, layout.wheel_radius)
        self.rail_origin = 0.5 * layout.gauge - rail.gauge_point(layout.gauge_depth)
        self._wheel, self._rail = wheel.surface(), rail.surface()
        self._rail_top = float(self._rail.height(self._rail.top()))
        self.lateral = np.arange(self._wheel.start, self._wheel.end, _STEP)
        self._depth = self._wheel.height(self.lateral)
        self._slope = self._wheel.height(self.lateral, 1)
        self._curvature = _normal_curvature(self._slope, self._wheel.height(self.lateral, 2))

    def outline(self, roll: float = 0.0, yaw: float = 0.0) -> Outline:
        """Wheel seen along the rail for the side's own roll (field side up +) and yaw (turned to the field +) [rad]."""
        axle = np.array([-np.sin(yaw) * np.cos(roll), np.cos(yaw) * np.cos(roll), np.sin(roll)])
        ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        down = -np.cross(ahead, axle)
        radius = self.layout.wheel_radius - self._depth
        if yaw == 0.0:
            reach = self.layout.half_taping() + self.lateral
            slope = (self._slope * axle[1] + axle[2]) / (axle[1] - self._slope * axle[2])
            return Outline(
                np.zeros_like(reach), axle[1] * reach + down[1] * radius, axle[2] * reach + down[2] * radius, slope
            )
        # normal = cos(t) down + sin(t) ahead - dr/dy axle; t from normal . x = 0
        angle = np.arcsin(-self._slope * axle[0] / np.hypot(ahead[0], down[0])) - np.arctan2(down[0], ahead[0])
        along, across, up = (
            axle[i] * (self.layout.half_taping() + self.lateral)
            + radius * (np.cos(angle) * down[i] + np.sin(angle) * ahead[i])
            for i in range(3)
        )
        return Outline(along, across, up, np.gradient(up, across))

    def gap(
        self, outline: Outline, shift: float, zone: tuple[float, float] = WHOLE
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points of the wheel in the `zone` of its profile that are over the rail, with the wheelset's centre at rail
        level and at `shift` towards the field side [m]: places in `lateral`, gaps, places on the rail [m].
        """
        across = outline.lateral + shift - self.rail_origin
        inside = (across > self._rail.start) & (across < self._rail.end)
        if zone != WHOLE:
            inside &= (self.lateral > zone[0]) & (self.lateral <= zone[1])
        over = np.nonzero(inside)[0]
        return over, outline.vertical[over] - self._rail.height(across[over]), across[over]

    def height(self, gap: float) -> float:
        """Height of the wheelset's centre above nominal at which a point with that `gap` [m] just touches [m]."""
        return -gap - self.layout.wheel_radius - self._rail_top

    def contact(self, outline: Outline, shift: float, zone: tuple[float, float] = WHOLE) -> ProfileContact:
        """Contact with the wheelset's centre at `shift` towards the field side [m].

        Raises
        ------
        ValueError : wheel and rail do not overlap there.
        """
        over, gap, across = self.gap(outline, shift, zone)
        if over.size == 0:
            raise ValueError(f"wheel and rail do not overlap at a shift of {1e3 * shift:.1f} mm")
        nearest = int(np.argmin(gap))
        bottom = gap[nearest]
        near = gap - bottom < 20.0 * _deepest(self.content)
        points, gap, across = over[near], gap[near] - bottom, across[near]
        step = np.gradient(across) if across.size > 1 else np.full(1, _STEP)
        depth = _depth_for(self.content, gap, step)
        inside = np.clip(depth - gap, 0.0, None)
        weight = inside**POWER * step
        weight /= weight.sum()
        rail_slope = self._rail.height(across, 1)
        slope = outline.slope[points]
        tilt = (1.0 + slope**2) ** -1.5
        relative = weight * POWER / np.where(inside > 0.0, inside, np.inf)
        wheel_position = float(weight @ self.lateral[points])
        rail_curvature = -_normal_curvature(rail_slope, self._rail.height(across, 2))
        level = self.layout.wheel_radius + self._rail_top
        return ProfileContact(
            height=float(-bottom - depth - level),
            rigid_height=float(-bottom - level),
            depth=float(depth),
            wheel_position=wheel_position,
            rail_position=float(weight @ across),
            rigid_wheel_position=float(self.lateral[over][nearest]),
            position=(
                float(weight @ outline.longitudinal[points]),
                float(weight @ outline.lateral[points]),
                float(np.interp(wheel_position, self.lateral, outline.vertical)),
            ),
            half_distance=float(weight @ across) + self.rail_origin,
            angle=float(np.arctan(weight @ slope)),
            radius=self.layout.wheel_radius - float(weight @ self._depth[points]),
            curvature=float(relative @ (tilt * (slope - rail_slope) ** 2)),
            wheel_curvature=float(weight @ self._curvature[points]),
            rail_curvature=float(weight @ rail_curvature),
        )

    def at(self, shift: float, roll: float = 0.0, yaw: float = 0.0) -> ProfileContact:
        """Contact for one position, all in the side's own frame [m, rad]."""
        return self.contact(self.outline(roll, yaw), shift)


def interpenetration(load: float, radius: float) -> float:
    """I = integral (D - g)^(7/2) dY of the typical parabolic gap under `load` [N], wheel of `radius` [m]."""
    depth = (load / hertz_ellipse(1.0 / radius, TYPICAL_CURVATURE).stiffness) ** (2.0 / 3.0)
    half = np.sqrt(2.0 * depth / TYPICAL_CURVATURE)
    share = quad(lambda t: (1.0 - t * t) ** (POWER + 1.0), 0.0, 1.0)[0]
    return float(2.0 * half * depth ** (POWER + 1.0) * share)


def _deepest(content: float) -> float:
    """A depth that no pair reaches: that of a single edge 0.1 mm wide."""
    return (content / 1e-4) ** (1.0 / (POWER + 1.0))


def _depth_for(content: float, gap: np.ndarray, step: np.ndarray) -> float:
    """D with integral (D - gap)_+^(7/2) = content, by Newton from above (the integral is convex in D)."""
    depth = _deepest(content)
    for _ in range(60):
        inside = np.clip(depth - gap, 0.0, None)
        power = inside**POWER * step
        change = (power @ inside - content) / ((POWER + 1.0) * power.sum())
        depth -= change
        if abs(change) < 1e-13:
            break
    return depth


def _normal_curvature(slope: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Curvature of z(y), positive where hollow upwards [1/m]."""
    return second / (1.0 + slope**2) ** 1.5
