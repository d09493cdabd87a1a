"""Elements of a wheelset's contacts with its rails: creep forces, weight, gyroscopic moment.

The rails lie rail_y to the left and are rolled by rail_roll. Of a wheelset's lateral shift u between them follow
(Wickens 2003, section 2.5: wheel and rail heads are arcs; half gauge l, rolling radius r, contact angle at rest delta)

    u = y + r roll - rail_y,   roll = rail_roll + delta u / l,
    radius_difference = lambda u,   angle_difference = e u + (n - 1) roll,

half the differences of the left and the right wheel's rolling radius and contact angle: lambda the conicity, e the
change of the contact angle with u, n the contact's movement on the wheel over u. Creepages of a wheel (Ward et al.
2011, (11) to (17)), with forces linear in them:

    lateral (y' + r roll')/V - yaw,   along the track l yaw'/V + radius_difference / r,
    spin yaw'/V - angle_difference / r.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from estimators.vehicle.linear_model import Element, Row, spring
from estimators.vehicle.parameters import Parameters
from estimators.vehicle.suspension import Bogie
from railsim.contact.linear import CreepCoefficients


@dataclass(frozen=True)
class Wheelset:
    """What its contacts need of a wheelset.

    Attributes
    ----------
    name : of its coordinates. radius : of its wheels, m. half_gauge : half the contacts' distance, m.
    load : weight that stands on both wheels, N. spin_inertia : about the axle, kg m2.
    """

    name: str
    radius: float
    half_gauge: float
    load: float
    spin_inertia: float = 0.0


def wheelsets(p: Parameters, bogies: Sequence[Bogie]) -> list[Wheelset]:
    """All wheelsets under their nominal load, the leading one first."""
    names = [name for bogie in bogies for name in bogie.wheelsets]
    load, inertia = 2.0 * p["design_wheel_load"], p.get("wheelset_spin_inertia", 0.0)
    return [Wheelset(name, p["wheel_radius"], p["half_gauge"], load, inertia) for name in names]


@dataclass(frozen=True)
class ContactGeometry:
    """Linear contact geometry of wheels on rails.

    Attributes
    ----------
    conicity : lambda. angle : contact angle at rest, rad, by which the weight turns a wheelset that yaws further.
    angle_rate : e, rad/m. gain : n. roll : wheelset's roll over its shift, rad/m.
    """

    conicity: float
    angle: float
    angle_rate: float
    gain: float = 1.0
    roll: float = 0.0

    def relations(self, wheelset: Wheelset) -> dict[str, Row]:
        """Coordinates of a wheelset that follow from its lateral position and from the rails."""
        name, shift = wheelset.name, f"{wheelset.name}.shift"
        free = 1.0 / (1.0 - wheelset.radius * self.roll)  # roll and shift depend on each other
        own = {f"{name}.y": free, f"{name}.rail_y": -free, f"{name}.rail_roll": free * wheelset.radius}
        return {
            shift: own,
            f"{name}.roll": {f"{name}.rail_roll": 1.0, shift: self.roll},
            f"{name}.radius_difference": {shift: self.conicity},
            f"{name}.angle_difference": {shift: self.angle_rate, f"{name}.roll": self.gain - 1.0},
        }


def relations(geometry: ContactGeometry, of: Iterable[Wheelset]) -> dict[str, Row]:
    """Coordinates of several wheelsets that follow from others."""
    rows: dict[str, Row] = {}
    for wheelset in of:
        rows |= geometry.relations(wheelset)
    return rows


def cones(p: Parameters) -> ContactGeometry:
    """Assumption: as on cones, one number is slope of the radii and contact angle, the contact does not move on the
    wheel, and wheelsets roll as the rails do; yet contact angles change with the shift as the profiles have it.
    """
    return ContactGeometry(p["design_conicity"], p["design_conicity"], p["design_contact_angle_rate"])


def arcs(p: Parameters) -> ContactGeometry:
    """Wheel and rail heads as arcs, from conicity, change of the contact angle and curvature (Wickens 2003)."""
    rate, gain = p["design_contact_angle_rate"], 1.0
    if rate > 0.0:
        between = 1.0 / rate  # R_w - R_r; the contact's curvature is 1 / R_r - 1 / R_w
        product = between / p["design_contact_curvature"]
        gain = rate * (between / 2.0 + float(np.sqrt(between**2 / 4.0 + product)))
    angle = p["design_conicity"] / gain
    return ContactGeometry(p["design_conicity"], angle, rate, gain, angle / p["half_gauge"])


def creep_forces(
    wheelset: Wheelset,
    slopes: CreepCoefficients,
    speed: float,
    *,
    spin_of_angles: bool = True,
    moment_of_spin: bool = True,
) -> list[Element]:
    """Creep forces of both wheels.

    Parameters
    ----------
    slopes : of one wheel. speed : V, m/s.
    spin_of_angles : whether wheels spin by their contact angles' difference; the lateral force of that spin takes away
        most of what gravity gives.
    moment_of_spin : whether lateral creepage and spin make the moment of f23 about the vertical axis.
    """
    f11, f22, f23 = slopes
    radius, arm, yaw = wheelset.radius, wheelset.half_gauge, {f"{wheelset.name}.yaw": 1.0}
    lateral = contact_motion(wheelset)
    elements = [
        spring(lateral, 0.0, 2.0 * f22 / speed),
        Element(lateral, yaw, -2.0 * f22, 2.0 * f23 / speed),
        spring(yaw, 0.0, 2.0 * f11 * arm**2 / speed),
        Element(yaw, {f"{wheelset.name}.radius_difference": 1.0}, 2.0 * f11 * arm / radius),
    ]
    if spin_of_angles:
        elements.append(Element(lateral, {f"{wheelset.name}.angle_difference": 1.0}, -2.0 * f23 / radius))
    if moment_of_spin:
        elements += [Element(yaw, lateral, 0.0, -2.0 * f23 / speed), spring(yaw, 2.0 * f23)]
    return elements


def weight(wheelset: Wheelset, geometry: ContactGeometry, *, along_axle: bool = False) -> list[Element]:
    """Gravitational stiffness: the load W works through the lift e u^2 / 2 + n roll u - delta l yaw^2 / 2.

    Parameters
    ----------
    along_axle : whether forces are those along the axle, where a load that leans with the wheelset is none.
    """
    name, load, lateral = wheelset.name, wheelset.load, contact_motion(wheelset)
    elements = [
        Element(lateral, {f"{name}.angle_difference": 1.0}, load),
        Element({f"{name}.roll": 1.0}, {f"{name}.shift": 1.0}, load * geometry.gain),
        spring({f"{name}.yaw": 1.0}, -load * geometry.angle * wheelset.half_gauge),
    ]
    return elements if along_axle else [*elements, Element(lateral, {f"{name}.roll": 1.0}, load)]


def gyroscopic(wheelset: Wheelset, speed: float) -> list[Element]:
    """Moment about the vertical axis on wheels that turn at V / r while they roll."""
    moment = wheelset.spin_inertia * speed / wheelset.radius
    return [Element({f"{wheelset.name}.yaw": 1.0}, {f"{wheelset.name}.roll": 1.0}, 0.0, moment)]


def contact_motion(wheelset: Wheelset) -> Row:
    """Lateral movement of a wheelset where it touches the rails."""
    return {f"{wheelset.name}.y": 1.0, f"{wheelset.name}.roll": wheelset.radius}
