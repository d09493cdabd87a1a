"""Creep force after Polach (1999), with the reduction factors and the falling friction of Polach (2005): compiled
kernel.
"""

import math

from railsim.compiled import kernel
from railsim.contact.hertz import STEEL_SHEAR

SHEAR = STEEL_SHEAR


@kernel
def friction_coefficient(friction, ratio, decay, slip_speed):
    """mu = mu0 [(1 - A) exp(-B w) + A] at slip speed w [m/s] (Polach 2005, eq. 9)."""
    if ratio >= 1.0:
        return friction
    return friction * ((1.0 - ratio) * math.exp(-decay * slip_speed) + ratio)


@kernel
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
    limit = friction * normal
    if limit <= 0.0:
        return 0.0, 0.0
    square_x = creep_x * creep_x
    square_y = creep_y * creep_y
    slip = math.sqrt(square_x + square_y)
    shifted = creep_y + spin * a
    creep_yc = shifted if abs(shifted) > abs(creep_y) else creep_y
    slip_c = math.sqrt(square_x + creep_yc * creep_yc)
    if slip_c < 1e-15:
        return 0.0, 0.0
    shear_area = SHEAR * a * b
    force = 0.0
    if slip > 1e-15:
        stiffness = math.sqrt(c11 * c11 * square_x + c22 * c22 * square_y)
        gradient = 0.25 * math.pi * shear_area * stiffness * slip_c / (slip * limit)
        adhesion = k_adhesion * gradient
        force = 2.0 / math.pi * limit * (adhesion / (1.0 + adhesion * adhesion) + math.atan(k_slip * gradient))
    force_x = -force * creep_x / slip_c
    force_y = -force * creep_y / slip_c
    if spin != 0.0:
        root = math.sqrt(a * b)
        form = 1.0 + 6.3 * (1.0 - math.exp(-a / b))
        gradient = 8.0 / 3.0 * b * root * SHEAR * c23 * abs(creep_yc) / (limit * form)
        delta = (gradient * gradient - 1.0) / (gradient * gradient + 1.0)
        rest = 1.0 - delta * delta
        factor = gradient * (delta * delta * (delta / 3.0 - 0.5) + 1.0 / 6.0) - rest * math.sqrt(rest) / 3.0
        force_y += 9.0 / 16.0 * a * limit * factor * form * spin / slip_c
    total = math.sqrt(force_x * force_x + force_y * force_y)
    if total > limit:
        force_x *= limit / total
        force_y *= limit / total
    return force_x, force_y
