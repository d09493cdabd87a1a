"""Creep force by FASTSIM, the fast algorithm for the simplified theory of rolling contact (Kalker 1982): kernels.

The surface of the contact ellipse is a bed of springs with one flexibility for each of the two creepages and one for
spin (L1, L2, L3), so that the creep force of a contact without slip is Kalker's linear law. Traction builds up along
strips in the rolling direction, from the leading edge to the trailing one, and is held below friction times a
parabolic pressure. Cells are as long as their strip allows (Kalker's grid); the tractions stand in their middles.
"""

import itertools
import math

from railsim.compiled import inlined, kernel
from railsim.contact.polach import SHEAR

STRIPS, CELLS = 10, 16  # within 1 % of mu N (rms; at most 5 %) of a fine grid in combined creepage and spin
FULL_SLIDING = 0.5 * math.pi - 1e-4  # share of mu N, times pi / 2, beyond which FASTSIM slides everywhere


@inlined
def held(p_x, p_y, bound, ratio):
    """A cell's traction brought back to its bound where it is beyond, see `fastsim_band`."""
    square = p_x * p_x + p_y * p_y
    if square > bound * bound:
        if ratio != 1.0:
            excess = (math.sqrt(square) - bound) * square  # over `weight`: the g of a mean flexibility
            weight = bound * (p_x * p_x + ratio * p_y * p_y)
            p_x *= weight + ratio * excess
            p_y *= weight + excess
            square = p_x * p_x + p_y * p_y
        share = bound / math.sqrt(square)
        p_x *= share
        p_y *= share
    return p_x, p_y


@kernel
def fastsim_band(creep_x, creep_y, spin_x, spin_y, low, high, strips, cells, first, ratio):
    """Creep force of the part low < y < high of the unit circle as a share of mu N: Kalker's problem in his numbers.

    Parameters
    ----------
    creep_x, creep_y : ux = a vx / (mu p0 L1), uy = a vy / (mu p0 L2), with p0 = 2 N / (pi a b).
    spin_x, spin_y : fx = a b phi / (mu p0 L3), fy = a^2 phi / (mu p0 L3).
    strips, cells : strips across the part, cells along each.
    first : share of a cell that the first step is long; 0.5 leads to the cell's middle, where the traction is taken.
    ratio : C22 / C11 = L1 / L2, for friction's direction; 1 = Kalker's scheme.

    Returns
    -------
    Force along x and y, and what full sliding would be on the same cells.

    Notes
    -----
    With x forward the slip is (ux - fx y, uy + fy x), the traction of adhesion dp/dx = slip from p = 0 at the leading
    edge, and its bound 1 - x^2 - y^2; the force opposes the creepage. Kalker scales a traction beyond the bound back
    along its own direction, which for L1 unlike L2 is not that of the slip: with C22 = 0.8 C11 full sliding would be up
    to 6 degrees off. Here a cell's traction q becomes (qx / (1 + g), qy / (1 + ratio g)), friction against the slip for
    either flexibility, with g as for a mean one and then scaled to the bound.
    """
    height, step = (high - low) / strips, 2.0 / cells
    total_x = total_y = capacity = 0.0
    for strip in range(0, strips, 2):  # two at a time: neither waits for the other's square roots
        y = low + (strip + 0.5) * height
        y2, share = y + height, 1.0
        if strip + 1 == strips:
            y2, share = y, 0.5
        square, square2 = 1.0 - y * y, 1.0 - y2 * y2
        edge, edge2 = math.sqrt(square), math.sqrt(square2)
        slip, slip2 = creep_x - spin_x * y, creep_x - spin_x * y2
        p_x = p_y = q_x = q_y = 0.0
        sum_x = sum_y = sum_x2 = sum_y2 = sum_bound = 0.0
        length, before = first * step, 1.0
        for cell in range(cells):  # x, length and bound are shares of what they are in the middle of a strip
            x = 1.0 - (cell + 0.5) * step
            turning = spin_y * 0.5 * (before + x)
            bound = 1.0 - x * x
            p_x -= slip * (length * edge)
            q_x -= slip2 * (length * edge2)
            p_y -= (creep_y + turning * edge) * (length * edge)
            q_y -= (creep_y + turning * edge2) * (length * edge2)
            p_x, p_y = held(p_x, p_y, square * bound, ratio)
            q_x, q_y = held(q_x, q_y, square2 * bound, ratio)
            before, length = x, step
            sum_x, sum_y = sum_x + p_x, sum_y + p_y
            sum_x2, sum_y2 = sum_x2 + q_x, sum_y2 + q_y
            sum_bound += bound
        total_x += share * step * (edge * sum_x + edge2 * sum_x2)
        total_y += share * step * (edge * sum_y + edge2 * sum_y2)
        capacity += share * step * sum_bound * (square * edge + square2 * edge2)
    scale = height / (0.5 * math.pi)
    return scale * total_x, scale * total_y, scale * capacity


def kalker_1982(
    creep_x: float, creep_y: float, spin_x: float, spin_y: float, cells: int, strips: int
) -> tuple[float, float]:
    """Creep force as a share of mu N on the grid that gives the values printed by Kalker (1982).

    Strips are at most 2 / `strips` high, and where the pole of the spin lies in the contact they end at its height.
    The grid depends on the creepages and full sliding is mu N only nearly, so that `fastsim_force` does without.
    """
    marks = [-1.0, 1.0]
    if spin_x != 0.0 and spin_y != 0.0 and math.hypot(creep_y / spin_y, creep_x / spin_x) < 1.0:
        marks.insert(1, creep_x / spin_x)
    force_x = force_y = 0.0
    for low, high in itertools.pairwise(marks):
        count = int((high - low) * strips / 2.0) + 1
        part_x, part_y, _ = fastsim_band(creep_x, creep_y, spin_x, spin_y, low, high, count, cells, 0.5, 1.0)
        force_x, force_y = force_x + part_x, force_y + part_y
    return force_x, force_y


@kernel
def fastsim_reduced(creep_x, creep_y, spin, a, b, c11, c22, c23, normal, friction, slope, strips, cells):
    """Creep force on the wheel [N] by FASTSIM with flexibilities L1, L2, L3 divided by `slope`.

    Parameters
    ----------
    creep_x, creep_y : creepages [-]; spin : spin creepage [1/m].
    a, b : longitudinal and lateral semi-axis [m]; c11, c22, c23 : Kalker's coefficients.
    normal : normal force [N]; friction : mu at the present slip; slope : share of Kalker's initial slope, 1 = clean.
    """
    limit = friction * normal
    if limit <= 0.0:
        return 0.0, 0.0
    # a / (mu p0 L) with L1 = 8 a / (3 G C11), L2 = 8 a / (3 G C22), L3 = pi a sqrt(a / b) / (4 G C23)
    scale = slope * SHEAR * math.pi * a * b / (2.0 * limit)
    shear = 0.375 * scale
    twist = 4.0 / math.pi * c23 * math.sqrt(b / a) * scale * spin
    part_x, part_y, capacity = fastsim_band(
        shear * c11 * creep_x, shear * c22 * creep_y, twist * b, twist * a, -1.0, 1.0, strips, cells, 0.5, c22 / c11
    )
    return limit * part_x / capacity, limit * part_y / capacity


@kernel
def creep_gradient(creep_x, creep_y, spin, a, b, c11, c22, normal, friction):
    """Polach's gradient of tangential stress e: the linear creep force as a multiple of 4 mu N / pi.

    Spin enters by the lateral creepage that it shifts, as in `polach_force`; here C22 goes with the shifted creepage,
    so that e is continuous where the other creepages vanish.
    """
    limit = friction * normal
    if limit <= 0.0:
        return 0.0
    shifted = creep_y + spin * a
    creep_yc = shifted if abs(shifted) > abs(creep_y) else creep_y
    stiff_x, stiff_y = c11 * creep_x, c22 * creep_yc
    return 0.25 * math.pi * SHEAR * a * b * math.sqrt(stiff_x * stiff_x + stiff_y * stiff_y) / limit


@kernel
def equivalent_slope(gradient, k_adhesion, k_slip):
    """The single factor k = kA = kS with which Polach's formula gives the same force as with kA and kS.

    Solves k e / (1 + (k e)^2) + atan(k e) = kA e / (1 + (kA e)^2) + atan(kS e) by Newton's method; the left side is
    concave in k e, so that it converges from below. At e = 0: (kA + kS) / 2, the share of Kalker's initial slope.
    """
    middle = 0.5 * (k_adhesion + k_slip)
    if k_adhesion == k_slip or gradient < 1e-6:
        return middle
    adhesion = k_adhesion * gradient
    target = min(adhesion / (1.0 + adhesion * adhesion) + math.atan(k_slip * gradient), FULL_SLIDING)
    reached = 0.5 * target
    for _ in range(60):
        root = 1.0 + reached * reached
        change = 0.5 * root * root * (target - reached / root - math.atan(reached))
        reached += change
        if change < 1e-9 * reached:
            break
    return reached / gradient


@kernel
def spiryagin_slope(gradient, initial, rest, decay):
    """Factor on Kalker's slope k = k0 (alpha + (1 - alpha) / (1 + beta e)) of the modified FASTSIM.

    Spiryagin, Polach and Cole (2013), Creep force modelling for rail traction vehicles based on the Fastsim algorithm.

    Parameters
    ----------
    gradient : e, with Kalker's slope already reduced by k0. initial, rest, decay : k0, alpha, beta.
    """
    return initial * (rest + (1.0 - rest) / (1.0 + decay * gradient))


@kernel
def fastsim_force(
    creep_x, creep_y, spin, a, b, c11, c22, c23, normal, friction, k_adhesion, k_slip, strips=STRIPS, cells=CELLS
):
    """Creep force on the wheel (x forward, y in the contact plane) [N]: arguments and signs of `polach_force`.

    `k_adhesion` and `k_slip` lower the slope by `equivalent_slope`, so that both laws share one set of adhesion
    parameters; with kA = kS = 1 this is FASTSIM as Kalker wrote it. `friction` is mu at the present slip velocity (one
    value for the contact, as in Spiryagin et al. 2013). Unlike in Polach's law, spin's force is lowered with the rest.
    """
    gradient = creep_gradient(creep_x, creep_y, spin, a, b, c11, c22, normal, friction)
    slope = equivalent_slope(gradient, k_adhesion, k_slip)
    return fastsim_reduced(creep_x, creep_y, spin, a, b, c11, c22, c23, normal, friction, slope, strips, cells)
