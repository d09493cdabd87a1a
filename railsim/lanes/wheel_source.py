"""Source of the contact of one wheel of every lane: where wheel and rail are nearest, then the forces."""

from railsim.contact.functions import AXIS_A, AXIS_B, BY_TURN, C11, C22, C23, CHANNELS, HALF_DISTANCE, LIFT, RADIUS
from railsim.contact.wheel import CREEP, LAW, NEAREST, NEAREST_STEPS, POLACH, WheelForces, WheelState
from railsim.dynamics.plant import Plant
from railsim.lanes.memory import CONTACT

CONSTANTS = (
    "start", "per_metre", "radius_0", "middle", "steeper", "stiffness", "damping",
    "ratio", "decay", "k_adhesion", "k_slip",
)  # fmt: skip
_FIRST = ("first_cell", "first_x", "first_shift")
_SEARCH = ("depth", "across", "along", "sigma", "arm", "yaw_factor", "x", "at", "cell", "done", "cell_a", "cell_b")
_POINT = ("normal_force", "creep_x", "creep_y", "creep_spin", "axis_a", "axis_b", "c11", "c22", "c23", "mu")
_OUT = tuple(name for name in WheelForces._fields if name != "beside")
_A = tuple(f"a{i}" for i in range(8))
_B = tuple(f"b{i}" for i in range(4 * CHANNELS))
WHEEL_ROWS = (*WheelState._fields, *_FIRST, *CONSTANTS, *_SEARCH, *_POINT, *(f"out_{name}" for name in _OUT), *_A, *_B)
"""Rows of a wheel's block."""

TEXT = '''
@kernel
def wheel(V, A, side, table):
    """Forces in one contact of one wheel of every lane; side 0 is left, `table` that of the contact functions."""
    sign = 1.0 if side == 0 else -1.0
    for k in range({L}):
        found = {first_cell}
        if found != {cell_a}:
            {cell_a} = found
            at = ((table * {cells} + (int(found) if found >= 0.0 else 0)) * {CHANNELS}) * 4
{copy_a}
    for k in range({L}):
        start, per_metre, shift, first_cell = {start}, {per_metre}, {first_shift}, {first_cell}
        g = gap(
            ({a0}, {a1}, {a2}, {a3}), ({a4}, {a5}, {a6}, {a7}), {first_x}, per_metre, sign, {radius_0},
            {y}, {z}, {roll}, {yaw}, {rail_y}, {rail_z}, 0.0,
        )
        off = g.depth <= 0.0
        step = nearer(g, 0.0)
        sigma = 0.0 if off else step
        place, x = cell_of(start, per_metre, {last}, shift - sigma)
        free = g.slope + {roll}
        {depth} = 0.0 if off else g.depth
        {across} = free if off else g.across
        {along} = g.slope if off else g.along
        {sigma} = sigma
        {arm}, {yaw_factor}, {at} = g.arm, g.yaw_factor, g.x
        {cell} = first_cell if off else place
        {x} = x
        {done} = 1.0 if off else 0.0
    for n in range({NEAREST_STEPS}):
        for k in range({L}):
            found = {cell}
            if found != {cell_b}:
                {cell_b} = found
                at = ((table * {cells} + (int(found) if found >= 0.0 else 0)) * {CHANNELS}) * 4
{copy_b}
        for k in range({L}):
            start, per_metre, shift, cell = {start}, {per_metre}, {first_shift}, {cell}
            depth, across, along, sigma = {depth}, {across}, {along}, {sigma}
            arm, yaw_factor, at, done = {arm}, {yaw_factor}, {at}, {done}
            g = gap(
                ({lift}), ({half}), {x}, per_metre, sign, {radius_0},
                {y}, {z}, {roll}, {yaw}, {rail_y}, {rail_z}, sigma,
            )
            step = nearer(g, sigma)
            active, near = done == 0.0, abs(step) < {NEAREST}
            rest = step if near else 0.0
            new_depth, new_across = g.depth - g.across * rest, g.across - g.bend * rest
            new_along = g.along - g.bend * rest
            moved = sigma + step
            place, x = cell_of(start, per_metre, {last}, shift - moved)
            ahead = cell if near else place
            finished = 1.0 if near else 0.0
            {depth} = new_depth if active else depth
            {across} = new_across if active else across
            {along} = new_along if active else along
            {sigma} = moved if active else sigma
            {arm} = g.arm if active else arm
            {yaw_factor} = g.yaw_factor if active else yaw_factor
            {at} = g.x if active else at
            {cell} = ahead if active else cell
            {x} = x
            {done} = finished if active else done
        waiting = False
        for k in range({L}):
            if {done} == 0.0:
                waiting = True
                break
        if not waiting:
            break
    for k in range({L}):
        at, depth, yaw, sigma, mu, damping = {at}, {depth}, {yaw}, {sigma}, {friction}, {damping}
        radius = {cubic_radius} + sign * {roll} * {cubic_by_turn}
        radius = radius + {steeper} * (radius - {middle})
        point = ContactPoint(depth, {across}, {along}, sigma, {arm}, {yaw_factor}, {first_shift} - sigma, 0, 0.0)
        state = WheelState(
            {y}, 0.0, {roll}, yaw, {y_rate}, {z_rate}, {roll_rate}, {yaw_rate},
            {speed}, {spin}, 0.0, 0.0, {rail_y_rate}, 0.0, {rail_z_rate}, {curvature},
        )
        contact = normal_contact(point, radius, {stiffness}, damping, {radius_0}, state)
        x, y, turning = creepages(contact)
{force}
        f_x, f_y, f_z, m_x, m_spin, m_z = resultant(point, contact, radius, yaw, force_x, force_y)
        {out_force_x}, {out_force_y}, {out_force_z} = f_x, f_y, f_z
        {out_moment_x}, {out_moment_spin}, {out_moment_z} = m_x, m_spin, m_z
        {out_normal}, {out_creep_force_x}, {out_creep_force_y} = contact.normal, force_x, force_y
        {out_creepage_x}, {out_creepage_y}, {out_spin_creepage} = x, y, turning
        {out_tangent}, {out_radius}, {out_shift}, {out_friction} = point.across, radius, point.shift, friction
'''

SLIDING = """
        slip = math.sqrt(contact.slip_x * contact.slip_x + contact.slip_y * contact.slip_y)
        falling = friction_coefficient(mu, {ratio}, {decay}, slip)
        friction = falling if depth > 0.0 else mu"""

FORCES = {
    "none": "        friction, force_x, force_y = mu, 0.0, 0.0",
    "polach": SLIDING
    + """
        force_x, force_y = polach_force(
            x, y, turning, {cubic_a} * contact.scale, {cubic_b} * contact.scale, {cubic_c11}, {cubic_c22}, {cubic_c23},
            contact.normal, friction, {k_adhesion}, {k_slip},
        )""",
    "other": SLIDING
    + """
        force_x, force_y = 0.0, 0.0
        if depth > 0.0:
            force_x, force_y = creep_force(
                {law}, x, y, turning, {cubic_a} * contact.scale, {cubic_b} * contact.scale, {cubic_c11}, {cubic_c22},
                {cubic_c23}, contact.normal, friction, {k_adhesion}, {k_slip},
            )""",
}


def wheel_text(plant: Plant, lanes: int) -> str:
    """The function `wheel`."""
    at = {name: f"V[{i * lanes} + k]" for i, name in enumerate(WHEEL_ROWS)}

    def coefficients(channel: int) -> list[str]:
        return [at[f"b{4 * channel + i}"] for i in range(4)]

    def cubic(channel: int) -> str:
        c = coefficients(channel)
        return f"({c[0]} + at * ({c[1]} + at * ({c[2]} + at * {c[3]})))"

    def copies(indent: int, names: dict[str, int]) -> str:
        return "\n".join(
            f"{' ' * indent}{at[name]} = number_at(A[k, {CONTACT}], at + {place})" for name, place in names.items()
        )

    law = plant.core.law
    kind = "none" if law[CREEP] == 0.0 else ("polach" if law[LAW] == POLACH else "other")
    first = {f"a{4 * n + i}": 4 * channel + i for n, channel in enumerate((LIFT, HALF_DISTANCE)) for i in range(4)}
    words = at | {
        "L": lanes, "cells": plant.contact.shape[1], "last": repr(plant.contact.shape[1] - 1.0), "CHANNELS": CHANNELS,
        "NEAREST": NEAREST, "NEAREST_STEPS": NEAREST_STEPS, "law": repr(float(law[LAW])),
        "lift": ", ".join(coefficients(LIFT)), "half": ", ".join(coefficients(HALF_DISTANCE)),
        "cubic_radius": cubic(RADIUS), "cubic_by_turn": cubic(BY_TURN),
        "cubic_a": cubic(AXIS_A), "cubic_b": cubic(AXIS_B),
        "cubic_c11": cubic(C11), "cubic_c22": cubic(C22), "cubic_c23": cubic(C23),
        "copy_a": copies(12, first), "copy_b": copies(16, {f"b{i}": i for i in range(4 * CHANNELS)}),
    }  # fmt: skip
    return TEXT.format(**words, force=FORCES[kind].format(**words).lstrip("\n"))
