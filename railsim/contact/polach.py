"""Creep force after Polach (1999), with the reduction factors and the falling friction of Polach (2005): compiled,
without calls or branches, so that several wheels are computed side by side.
"""

import math

from railsim.compiled import inlined
from railsim.contact.elementary import arc_tangent, falling_exponential
from railsim.contact.hertz import STEEL_SHEAR

SHEAR = STEEL_SHEAR
NO_CREEPAGE = 1e-15


@inlined
def friction_coefficient(friction, ratio, decay, slip_speed):
    """mu = mu0 [(1 - A) exp(-B w) + A] at slip speed w [m/s] (Polach 2005, eq. 9); A of 1 or more: mu0."""
    kept = min(ratio, 1.0)
    return friction * ((1.0 - kept) * falling_exponential(decay * slip_speed) + kept)


@inlined
def polach_force(creep_x, creep_y, spin, a, b, c11, c22, c23, normal, friction, k_adhesion, k_slip):
    """Creep force on the wheel (x forward, y in the contact plane) [N].

    Parameters
    ----------
    creep_x, creep_y : creepages [-]; spin : spin creepage [1/m].
    a, b : longitudinal and lateral semi-axis [m]; c11, c22, c23 : Kalker's coefficients.
    normal : normal force [N]; friction : mu at the present slip; k_adhesion, k_slip : Polach's kA and kS.

    Notes
    -----
    `creep_yc` shifts the lateral creepage by spin * a where that is larger (Polach 1999, eq. 12); the translation's
    slope uses the same resultant, so that the limit of vanishing creepage is Kalker's linear law (pure creepages; kA
    = kS = 1). The resultant of translation and spin is limited to mu N (Polach's sum of both may exceed it slightly).
    """
    limit = max(friction * normal, 0.0)
    square_x = creep_x * creep_x
    square_y = creep_y * creep_y
    slip = math.sqrt(square_x + square_y)
    shifted = creep_y + spin * a
    creep_yc = shifted if abs(shifted) > abs(creep_y) else creep_y
    slip_c = math.sqrt(square_x + creep_yc * creep_yc)
    held = (limit <= 0.0) | (slip_c < NO_CREEPAGE)
    limit = 1.0 if held else limit
    over = 1.0 / (1.0 if held else slip_c)
    straight = slip <= NO_CREEPAGE
    stiffness = math.sqrt(c11 * c11 * square_x + c22 * c22 * square_y)
    gradient = 0.25 * math.pi * SHEAR * a * b * stiffness * slip_c / ((1.0 if straight else slip) * limit)
    adhesion = k_adhesion * gradient
    force = 2.0 / math.pi * limit * (adhesion / (1.0 + adhesion * adhesion) + arc_tangent(k_slip * gradient))
    secant = 0.0 if straight else force * over
    form = 1.0 + 6.3 * (1.0 - falling_exponential(a / b))
    twist = 8.0 / 3.0 * b * math.sqrt(a * b) * SHEAR * c23 * abs(creep_yc) / (limit * form)
    square = twist * twist
    delta = (square - 1.0) / (square + 1.0)
    rest = 1.0 - delta * delta
    factor = twist * (delta * delta * (delta / 3.0 - 0.5) + 1.0 / 6.0) - rest * math.sqrt(rest) / 3.0
    force_x = -secant * creep_x
    force_y = 9.0 / 16.0 * a * limit * factor * form * spin * over - secant * creep_y
    total = math.sqrt(force_x * force_x + force_y * force_y)
    share = limit / total if total > limit else 1.0
    return 0.0 if held else share * force_x, 0.0 if held else share * force_y
