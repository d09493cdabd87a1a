"""Single wheelset with a suspended mass as an estimator knows it: from nominal parameters, and nothing else.

Equations (11) to (17) of Ward et al. (2011), Appendix 2, about the centre, with x = y - d the shift on the rails and
D = (r_L - r_R) / 2 the half difference of the rolling radii, D = lambda x for a cone, or from a table:

    m y''  = F_s - 2 f22/V (y' + r0 phi' - V psi) - 2 f23/V psi' - (W - 2 f23/r0) e D / lambda0 - W phi
    I psi'' = M_s - I_wy V/r0 phi' - 2 l f11/r0 D + 2 f23/V (y' + r0 phi' - V psi) - 2 l^2 f11/V psi' + l W s psi
    phi = s x / l,   F_s = k_y (y_m - y) + c_y (y_m' - y'),   m_m y_m'' = -F_s,   M_s = -k_psi psi - c_psi psi'

They are the elements of `vehicle.contact` with x and D as inputs. The article's cone has one number for three: the
conicity is slope of the radii, contact angle s that makes the roll, and e is zero. On real profiles they are three: the
contact moves along wheel and rail, so that the radii change by several times the contact angle. Here s, e and lambda0
are those of the new profiles, and only D is sought: the contact angles' difference is taken to grow as the radii's
does, since both come from the same travel of the contact. Were it taken as e x with the new profiles' e, a filter would
read x from the lateral force, and take a wrong conicity from it.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from estimators.vehicle.contact import ContactGeometry, Wheelset, creep_forces, gyroscopic, weight
from estimators.vehicle.creep import DRY, kalker_slopes
from estimators.vehicle.linear_model import Element, Kinematics, reduce, spring
from estimators.vehicle.parameters import given, numbers
from railsim.contact.linear import CreepCoefficients
from railsim.wheelset.parameters import Coefficients

Y, Y_RATE, YAW, YAW_RATE, MASS_Y, MASS_Y_RATE = range(6)
STATES = 6
COORDINATES = ("wheelset.y", "wheelset.yaw", "mass.y")


class WheelsetModel(NamedTuple):
    """Nominal parameters of one wheelset, and what real profiles have besides the article's numbers.

    numbers : by the symbols of the article's Appendix 1, SI units; f33 is zero, as nothing here needs it.
    s : contact angle at rest (rad). e : its change by the shift (rad/m). conicity : of the new profiles.
    """

    numbers: Coefficients
    s: float
    e: float
    conicity: float


NEEDED = (
    "wheelset_mass",
    "wheelset_yaw_inertia",
    "wheelset_spin_inertia",
    "wheel_radius",
    "half_gauge",
    "suspended_mass",
    "lateral_stiffness",
    "lateral_damping",
    "yaw_stiffness",
    "yaw_damping",
    "design_conicity",
    "design_contact_angle",
    "design_contact_angle_rate",
    "design_contact_curvature",
    "design_wheel_load",
)


def fits(vehicle: Mapping[str, Any]) -> bool:
    """Whether about.json gives all parameters of the single wheelset."""
    return given(vehicle, NEEDED)


def wheelset_model(vehicle: Mapping[str, Any], creep: float = DRY) -> WheelsetModel:
    """Parameters of the model from a recording's about.json.

    Parameters
    ----------
    vehicle : nominal parameters by field name. creep : share of Kalker's f11 and f22; his part of spin, f23, is whole,
    as in Polach's law.

    Raises
    ------
    InputError : one is missing; the line names it.
    """
    v = numbers(vehicle, NEEDED)
    slopes = kalker_slopes(v, (creep, creep, 1.0))
    symbols = Coefficients(
        m=v["wheelset_mass"],
        I=v["wheelset_yaw_inertia"],
        I_wy=v["wheelset_spin_inertia"],
        r0=v["wheel_radius"],
        l=v["half_gauge"],
        W=2.0 * v["design_wheel_load"],
        f11=slopes.f11,
        f22=slopes.f22,
        f23=slopes.f23,
        f33=0.0,
        k_y=v["lateral_stiffness"],
        f_y=v["lateral_damping"],
        k_psi=v["yaw_stiffness"],
        f_psi=v["yaw_damping"],
        m_m=v["suspended_mass"],
    )
    return WheelsetModel(symbols, v["design_contact_angle"], v["design_contact_angle_rate"], v["design_conicity"])


def linear(p: WheelsetModel, conicity: float, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """State matrix (6, 6) and input matrix (6, 2) for d and dd/dt, D = conicity x.

    Parameters
    ----------
    conicity : lambda (-). speed : V, m/s. States: y, y', psi, psi', y_m, y_m'.
    """
    a, b = np.zeros((STATES, STATES)), np.zeros((STATES, 2))
    shift, shift_rate, of_radii, state = coefficients(p, speed)
    for position, rate in ((Y, Y_RATE), (YAW, YAW_RATE), (MASS_Y, MASS_Y_RATE)):
        a[position, rate] = 1.0
    a[[Y_RATE, YAW_RATE, MASS_Y_RATE]] += state
    by_shift = shift + of_radii * conicity
    a[[Y_RATE, YAW_RATE], Y] += by_shift
    a[[Y_RATE, YAW_RATE], Y_RATE] += shift_rate
    b[[Y_RATE, YAW_RATE], 0] = -by_shift
    b[[Y_RATE, YAW_RATE], 1] = -shift_rate
    return a, b


def coefficients(p: WheelsetModel, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The equations' coefficients at a speed: accelerations y'' and psi'' by x, by x' and by D, each (2,); by the
    state, rows y'', psi'', y_m'', (3, 6).
    """
    c = p.numbers
    terms = _terms(p._replace(numbers=c._replace(f11=0.0, f22=0.0)))
    values = np.array([1.0, 1.0 / speed, speed]) @ (np.array([1.0, c.f11, c.f22]) @ terms)
    return values[:2], values[2:4], values[4:6], values[6:].reshape(3, STATES)


@lru_cache(maxsize=8)
def _terms(p: WheelsetModel) -> np.ndarray:
    """All coefficients in a row, shape (3, 3, 24): what speed does not change, what goes with 1 / speed and with speed;
    of each what no creep force makes but that of f23, then those of f11 and f22 per newton.
    """
    c = p.numbers
    wheelset = Wheelset("wheelset", c.r0, c.l, c.W, c.I_wy)
    rolling = [creep_forces(wheelset, CreepCoefficients(*one), 1.0) for one in ((0, 0, c.f23), (1, 0, 0), (0, 1, 0))]
    lasting = [[element._replace(damping=0.0) for element in elements] for elements in rolling]
    lasting[0] += [
        spring({"mass.y": 1.0, "wheelset.y": -1.0}, c.k_y, c.f_y),
        spring({"wheelset.yaw": 1.0}, c.k_psi, c.f_psi),
        *weight(wheelset, ContactGeometry(p.conicity, p.s, p.e)),
    ]
    damped = [[element._replace(stiffness=0.0) for element in elements] for elements in rolling]
    with_speed: list[list[Element]] = [gyroscopic(wheelset, 1.0), [], []]
    return np.array([[_in_a_row(p, elements) for elements in kind] for kind in (lasting, damped, with_speed)])


def _in_a_row(p: WheelsetModel, elements: Sequence[Element]) -> np.ndarray:
    """Coefficients that some elements give, in the order of `coefficients`, (24,)."""
    c, x, radii = p.numbers, "wheelset.shift", "wheelset.radius_difference"
    relations = {
        "wheelset.roll": {x: p.s / c.l},
        "wheelset.angle_difference": {radii: p.e / p.conicity},
    }
    moving = Kinematics(COORDINATES, (x, radii), relations)
    A, B, E = (part[3:] for part in reduce(elements, (c.m, c.I, c.m_m), moving, reactions=False).first_order())
    by_state = np.empty((3, STATES))
    by_state[:, [Y, YAW, MASS_Y]], by_state[:, [Y_RATE, YAW_RATE, MASS_Y_RATE]] = A[:, :3], A[:, 3:]
    return np.concatenate([B[:2, 0], E[:2, 0], B[:2, 1], by_state.ravel()])
