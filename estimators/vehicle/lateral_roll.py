"""Linear lateral and roll motion of the half vehicle on nominal parameters: wheelsets that run on creep, bogie, body.

Coordinates to the left and left side up: y and yaw of both wheelsets; y, roll and yaw of the bogie; y and roll of the
body. The rails' centre line lies at d, the right rail higher than the left by x. Of the rails and of its own shift u a
wheelset has its roll (Wickens 2003, section 2.5: wheel and rail heads that are arcs, contact angle delta at rest,
change e of it with u, wheel's contact moves by n u; half gauge l, radius r)

    u = y + r roll - d,   roll = -x / (2 l) + delta u / l,   lift = e u^2 / 2 + n roll u - delta l yaw^2 / 2

and the weight on it works through that lift (gravitational stiffness). Creepages of a wheelset: lateral
(y' + r roll')/V - yaw; along (l yaw'/V + lambda u / r) on either side; spin yaw'/V - (e u + (n - 1) roll) / r, whose
lateral force takes away most of the gravitational stiffness. Suspension forces have the geometric stiffness of the
load that they carry.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from estimators.vehicle.bump_stop import STIFFNESS as STOP
from estimators.vehicle.planes import Output, System
from railsim.constants import GRAVITY
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import CreepCoefficients
from railsim.contact.polach import polach_force
from railsim.errors import InputError

Y1, YAW1, Y2, YAW2, Y, ROLL, YAW, BODY, BODY_ROLL = range(9)
MOVES = 9
D1, X1, D2, X2 = range(MOVES, MOVES + 4)  # the inputs behind the coordinates: path and cross level under both wheelsets
NEEDED = (
    "body_mass", "body_roll_inertia", "body_height", "bogie_mass", "bogie_roll_inertia", "bogie_yaw_inertia",
    "bogie_height", "wheelset_mass", "wheelset_yaw_inertia", "wheelset_spin_inertia", "wheel_radius", "half_gauge",
    "semi_wheelbase", "primary_half_spacing", "primary_longitudinal_stiffness", "primary_longitudinal_damping",
    "primary_lateral_stiffness", "primary_lateral_damping", "primary_vertical_stiffness", "primary_vertical_damping",
    "secondary_half_spacing", "secondary_height", "secondary_longitudinal_stiffness", "secondary_lateral_stiffness",
    "secondary_lateral_damping", "secondary_vertical_stiffness", "secondary_vertical_damping", "roll_bar_stiffness",
    "design_conicity", "design_contact_angle_rate", "design_contact_curvature", "design_wheel_load",
)  # fmt: skip
"""Nominal parameters that the plane takes, SI units."""
CREEP, SPIN = "creep", "spin"
"""Keys among the parameters: factors of all creep coefficients, and of f23 alone beyond that; 1 where not given."""
FRICTION, K_ADHESION, K_SLIP = 0.4, 1.0, 0.4  # Polach (2005), dry; friction illustrative
CREEPAGE = 2e-4  # illustrative: conicity / radius times a shift of 0.7 mm
LEAST_ANGLE = 0.01  # rad; cylindrical wheels have spin by their roll


def fits(vehicle: Mapping[str, Any]) -> bool:
    """Whether about.json gives all parameters."""
    return all(isinstance(vehicle.get(name), int | float) for name in NEEDED)


class Contact:
    """Wheel and rail heads as arcs: what follows from conicity, rate of the contact angle and curvature.

    Attributes
    ----------
    angle : delta, rad. gain : n, wheel contact's movement over the shift. roll : delta / l, rad per m of shift.
    shift : u over y + r times the roll by the rails alone.
    """

    def __init__(self, p: Mapping[str, float]) -> None:
        rate = p["design_contact_angle_rate"]
        if rate > 0.0:
            between = 1.0 / rate  # R_w - R_r; the contact's curvature is 1 / R_r - 1 / R_w
            product = between / p["design_contact_curvature"]
            self.gain = rate * (between / 2.0 + np.sqrt(between**2 / 4.0 + product))
        else:
            self.gain = 1.0
        self.angle = p["design_conicity"] / self.gain
        self.roll = self.angle / p["half_gauge"]
        self.shift = 1.0 / (1.0 - p["wheel_radius"] * self.roll)


def lateral(vehicle: Mapping[str, float], outputs: Sequence[Output], speed: float) -> System:
    """States: the nine coordinates (m, rad), then their rates; inputs path and cross level under the leading wheelset,
    then under the trailing one.
    """
    mass, damping, stiffness = matrices(vehicle, speed)
    inverse = np.linalg.inv(mass)
    own = slice(0, MOVES)
    A = np.block(
        [[np.zeros((MOVES, MOVES)), np.eye(MOVES)], [-inverse @ stiffness[own, own], -inverse @ damping[own, own]]]
    )
    none = np.zeros((MOVES, 4))
    B = np.vstack([none, -inverse @ stiffness[own, MOVES:]])
    E = np.vstack([none, -inverse @ damping[own, MOVES:]])
    rows = [_row(vehicle, output, A, B, E) for output in outputs]
    C, D, G = (np.stack(part) for part in zip(*rows, strict=True))
    twice = np.stack([_lift(vehicle, output)[MOVES:] for output in outputs])
    return System(A, B, E, C, D, G, twice if twice.any() else None)


def followed(
    vehicle: Mapping[str, Any], speed: float, wave_number: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bogie's yaw over the slope of the rails' path, and over that of the height r phi; its roll over the rails' roll
    phi. Everything under the bogie's centre, complex, shapes (n,); 1, 0, 1 at wave number 0.

    Parameters
    ----------
    vehicle : nominal parameters by field name, SI units. speed : V, m/s. wave_number : rad/m, shape (n,).

    Raises
    ------
    InputError : a parameter is missing.
    """
    for name in NEEDED:
        if not isinstance(vehicle.get(name), int | float):
            raise InputError(
                f"vehicle parameter '{name}' is {vehicle.get(name)!r}; about.json must give a number in SI"
            )
    k = np.asarray(wave_number, dtype=float)
    moving = np.where(k == 0.0, 1.0, k)
    lead, trail = np.split(lateral(vehicle, [Output("rate")], speed).states(moving * speed), 2, axis=2)
    ahead = np.exp(1j * moving * vehicle["semi_wheelbase"])[:, None, None]
    states = lead * ahead + trail / ahead
    by_roll = -2.0 * vehicle["half_gauge"] * states[:, :, 1]
    path, height = states[:, YAW, 0] / (1j * moving), by_roll[:, YAW] / (1j * moving * vehicle["wheel_radius"])
    still = k == 0.0
    return np.where(still, 1.0, path), np.where(still, 0.0, height), np.where(still, 1.0, by_roll[:, ROLL])


def matrices(p: Mapping[str, float], speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass (9, 9); damping and stiffness over coordinates and inputs (13, 13), of which the first nine rows count."""
    mass = np.diag(
        [
            *(2 * (p["wheelset_mass"], p["wheelset_yaw_inertia"])),
            p["bogie_mass"], p["bogie_roll_inertia"], p["bogie_yaw_inertia"],
            p["body_mass"], p["body_roll_inertia"],
        ]
    )  # fmt: skip
    stiffness = _suspension(p, "stiffness") + _weight(p)
    damping = _suspension(p, "damping")
    for wheelset in (0, 1):
        _creep(p, speed, wheelset, damping, stiffness)
    return mass, damping, stiffness


def shift_and_roll(p: Mapping[str, float], wheelset: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows (13,) of a wheelset's shift u between the rails and of its roll."""
    contact = Contact(p)
    shift, roll = np.zeros(MOVES + 4), np.zeros(MOVES + 4)
    roll[(X1, X2)[wheelset]] = -0.5 / p["half_gauge"]
    shift += p["wheel_radius"] * roll
    shift[(Y1, Y2)[wheelset]] += 1.0
    shift[(D1, D2)[wheelset]] -= 1.0
    shift *= contact.shift
    return shift, roll + contact.roll * shift


def _unit(**places: float) -> np.ndarray:
    row = np.zeros(MOVES + 4)
    for name, value in places.items():
        row[globals()[name]] = value
    return row


def _shears(p: Mapping[str, float]) -> tuple[list[np.ndarray], np.ndarray]:
    """Lateral movement of the bogie over each wheelset, and of the body over the bogie, at the springs' height."""
    low, high = p["bogie_height"] - p["wheel_radius"], p["secondary_height"] - p["bogie_height"]
    arm = p["semi_wheelbase"]
    primary = [_unit(Y=1.0, ROLL=low, YAW=arm, Y1=-1.0), _unit(Y=1.0, ROLL=low, YAW=-arm, Y2=-1.0)]
    below = p["body_height"] - p["secondary_height"]
    return primary, _unit(BODY=1.0, BODY_ROLL=below, Y=-1.0, ROLL=high)


def _suspension(p: Mapping[str, float], kind: str) -> np.ndarray:
    """Springs or dampers, (13, 13)."""
    primary, secondary = _shears(p)
    across = 2.0 * p[f"secondary_lateral_{kind}"] + (p.get(STOP, 0.0) if kind == "stiffness" else 0.0)
    total = across * np.outer(secondary, secondary)
    turn = 2.0 * p.get(f"secondary_longitudinal_{kind}", 0.0) * p["secondary_half_spacing"] ** 2
    if kind == "damping":
        turn += 2.0 * p.get("yaw_damper_damping", 0.0) * p.get("yaw_damper_half_spacing", 0.0) ** 2
    total[YAW, YAW] += turn
    tilt = 2.0 * p[f"secondary_vertical_{kind}"] * p["secondary_half_spacing"] ** 2
    tilt += p["roll_bar_stiffness"] if kind == "stiffness" else 0.0
    between = _unit(BODY_ROLL=1.0, ROLL=-1.0)
    total += tilt * np.outer(between, between)
    reach = 2.0 * p["primary_half_spacing"] ** 2
    for wheelset, yaw in ((0, YAW1), (1, YAW2)):
        total += 2.0 * p[f"primary_lateral_{kind}"] * np.outer(primary[wheelset], primary[wheelset])
        turned = _unit(YAW=1.0)
        turned[yaw] -= 1.0
        total += reach * p[f"primary_longitudinal_{kind}"] * np.outer(turned, turned)
        rolled = _unit(ROLL=1.0) - shift_and_roll(p, wheelset)[1]
        total += reach * p[f"primary_vertical_{kind}"] * np.outer(rolled, rolled)
    return total


def _weight(p: Mapping[str, float]) -> np.ndarray:
    """Second derivative of gravity's potential: lift of the wheelsets, tilted springs, centres above their springs."""
    primary, secondary = _shears(p)
    contact = Contact(p)
    body, frame = p["body_mass"] * GRAVITY, (p["body_mass"] + p["bogie_mass"]) * GRAVITY
    total = np.zeros((MOVES + 4, MOVES + 4))

    def product(weight: float, one: np.ndarray, other: np.ndarray) -> None:
        total[:] += weight * (np.outer(one, other) + np.outer(other, one))

    bogie_roll, body_roll = _unit(ROLL=1.0), _unit(BODY_ROLL=1.0)
    for wheelset, yaw in ((0, YAW1), (1, YAW2)):
        shift, roll = shift_and_roll(p, wheelset)
        load = 2.0 * p["design_wheel_load"]
        product(0.5 * load * p["design_contact_angle_rate"], shift, shift)
        product(load * contact.gain, shift, roll)
        total[yaw, yaw] -= load * contact.angle * p["half_gauge"]
        product(0.5 * frame, primary[wheelset], 0.5 * (bogie_roll + roll))
    low, high = p["bogie_height"] - p["wheel_radius"], p["secondary_height"] - p["bogie_height"]
    total[ROLL, ROLL] -= frame * low + body * high
    total[BODY_ROLL, BODY_ROLL] -= body * (p["body_height"] - p["secondary_height"])
    product(body, secondary, 0.5 * (bogie_roll + body_roll))
    return total


def _creep(p: Mapping[str, float], speed: float, wheelset: int, damping: np.ndarray, stiffness: np.ndarray) -> None:
    """Creep forces of one wheelset and the gyroscopic moment of its spin are added."""
    radius, arm = p["wheel_radius"], p["half_gauge"]
    contact = Contact(p)
    slopes = creep_slopes(
        1.0 / radius, p["design_contact_curvature"], p["design_wheel_load"], max(contact.angle, LEAST_ANGLE) / radius
    )
    f11, f22, f23 = (p.get(CREEP, 1.0) * one for one in slopes)
    f23 *= p.get(SPIN, 1.0)
    shift, roll = shift_and_roll(p, wheelset)
    yaw = np.zeros(MOVES + 4)
    yaw[(YAW1, YAW2)[wheelset]] = 1.0
    place = np.zeros(MOVES + 4)
    place[(Y1, Y2)[wheelset]] = 1.0
    slip = contact.shift * (place + 0.0)  # work of a lateral force at the contact, by the wheelset's y
    moved = place + radius * roll
    angle = p["design_contact_angle_rate"] * shift + (contact.gain - 1.0) * roll
    damping += 2.0 * f22 / speed * np.outer(slip, moved) + 2.0 * f23 / speed * np.outer(slip, yaw)
    stiffness += np.outer(slip, -2.0 * f22 * yaw - 2.0 * f23 * angle / radius)
    damping += 2.0 * f11 * arm**2 / speed * np.outer(yaw, yaw)
    damping += p["wheelset_spin_inertia"] * speed / radius * np.outer(yaw, roll)
    stiffness += 2.0 * f11 * arm * p["design_conicity"] / radius * np.outer(yaw, shift)


@lru_cache(maxsize=64)
def creep_slopes(along: float, across: float, load: float, spin: float) -> CreepCoefficients:
    """Slopes of one wheel's creep force (Polach's law) about its spin at rest, for creepages of the size `CREEPAGE`.

    The spin of a wheel that stands on a sloping tread is a lateral creepage several times as large as those that come
    and go. About it the law's slope along the track is not that of f11 but goes towards f22, by 8 %.

    Parameters
    ----------
    along, across : sums of the curvatures, 1/m. load : of the wheel, N. spin : creepage at rest, 1/m.
    """
    ellipse = hertz_ellipse(along, across)
    a, b = ellipse.longitudinal * load ** (1.0 / 3.0), ellipse.lateral * load ** (1.0 / 3.0)
    constants = (a, b, *kalker_coefficients(a / b), load, FRICTION, K_ADHESION, K_SLIP)
    nodes, weights = np.polynomial.hermite_e.hermegauss(6)
    rest = polach_force(0.0, 0.0, spin, *constants)[1]
    f11 = f22 = 0.0
    for x, share in zip(nodes, weights / weights.sum(), strict=True):
        for y, other in zip(nodes, weights / weights.sum(), strict=True):
            force = polach_force(x * CREEPAGE, y * CREEPAGE, spin, *constants)
            f11 -= share * other * force[0] * x / CREEPAGE
            f22 -= share * other * (force[1] - rest) * y / CREEPAGE
    more, less = (polach_force(0.0, 0.0, factor * spin, *constants)[1] for factor in (1.1, 0.9))
    return CreepCoefficients(f11, f22, (less - more) / (0.2 * spin))


def _row(
    p: Mapping[str, float], output: Output, A: np.ndarray, B: np.ndarray, E: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """C, D, G of one output."""
    x, _, z = output.position
    states = np.eye(2 * MOVES)
    if output.kind == "rate":
        return states[MOVES + (YAW if output.axis == "yaw" else ROLL)], np.zeros(4), np.zeros(4)
    if output.kind == "acceleration":
        pick = states[MOVES + Y] - z * states[MOVES + ROLL] + x * states[MOVES + YAW]
        return pick @ A + GRAVITY * states[ROLL], pick @ B, pick @ E
    wheelset = 0 if output.position[0] > 0 else 1
    roll = shift_and_roll(p, wheelset)[1]
    if output.kind == "axlebox":
        pick = states[MOVES + (Y1, Y2)[wheelset]]
        return (
            pick @ A + GRAVITY * np.append(roll[:MOVES], np.zeros(MOVES)),
            pick @ B + GRAVITY * roll[MOVES:],
            pick @ E,
        )
    if output.kind == "lift":
        pick = np.append(np.zeros(MOVES), _lift(p, output)[:MOVES])
        return pick @ A, pick @ B, pick @ E
    across = p["primary_half_spacing"] * (_unit(ROLL=1.0) - roll)
    return np.append(across[:MOVES], np.zeros(MOVES)), across[MOVES:], np.zeros(4)


def _lift(p: Mapping[str, float], output: Output) -> np.ndarray:
    """Row (13,) over the accelerations of coordinates and inputs of what an axlebox feels of its wheelset's roll."""
    if output.kind != "lift":
        return np.zeros(MOVES + 4)
    return output.position[1] * shift_and_roll(p, 0 if output.position[0] > 0 else 1)[1]
