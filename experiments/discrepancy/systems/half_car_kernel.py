"""Motion of a half car in compiled loops: many points in one call.

Position Verlet (Swope, Andersen, Berens and Wilson 1982) with the velocities that forces need carried half a step on by
the accelerations before: second order, one evaluation of the forces a step. States: body, pitch, front and rear axle, a
third body on the body.
"""

from typing import Any

import numba
import numpy as np

STATES = 5
OUTPUTS = 12
"""Accelerations of the axles and of the body over them (4), front travel, suspension forces (2), tyre forces (2),
rates of travel (2), rear travel."""

FRICTION_RATE = 0.008  # m/s; below it friction falls with the rate
SQUARE_RATE = 0.15  # m/s; rate at which a square part of 1 is as large as the damper's force
PROGRESSION = 100.0  # 1/m; at 10 mm a tyre's progression of 1 doubles its force
GRID = 0.05  # m, of a road

_compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


@_compiled
def suspension(d, e, spring, damper, one_sided, square, friction, gap, stop):
    """Force [N] by travel d [m] and its rate e [m/s]."""
    force = spring * d + damper * (e + one_sided * abs(e) + square * e * abs(e) / SQUARE_RATE)
    force += friction * e / (abs(e) + FRICTION_RATE)
    if stop > 0.0:
        if d > gap:
            force += stop * (d - gap)
        elif d < -gap:
            force += stop * (d + gap)
    return force


@_compiled
def heights(road, places, seen):
    """Cubic (Catmull and Rom) heights [m] at places [m] along a road with points each `GRID`."""
    for i in range(places.shape[0]):
        x = places[i] / GRID
        m = min(max(int(x), 1), road.shape[0] - 3)
        f = x - m
        p0, p1, p2, p3 = road[m - 1], road[m], road[m + 1], road[m + 2]
        curved = 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + f * (3.0 * (p1 - p2) + p3 - p0)
        seen[i] = p1 + 0.5 * f * (p2 - p0 + f * curved)


@_compiled
def accelerate(p, z, v, held, roads, t, a, out):
    """Accelerations `a` (STATES,) and what acts, at positions z, velocities v, travel `held` (2,) in the springs behind
    dampers, heights and rates of the road.
    """
    mass, inertia, front, rear = p[0], p[1], p[11], p[12]
    d1, d2 = z[0] - front * z[1] - z[2], z[0] + rear * z[1] - z[3]
    e1, e2 = v[0] - front * v[1] - v[2], v[0] + rear * v[1] - v[3]
    s1 = suspension(d1, e1, p[4], p[6], p[26], p[28], p[13], p[15], p[16]) + p[31] * held[0]
    s2 = suspension(d2, e2, p[5], p[7], p[27], p[29], p[14], p[17], p[18]) + p[32] * held[1]
    x1, x2 = z[2] - roads[0], z[3] - roads[1]
    t1 = p[8] * x1 * (1.0 + PROGRESSION * p[30] * x1) + p[10] * (v[2] - roads[2])
    t2 = p[9] * x2 * (1.0 + PROGRESSION * p[30] * x2) + p[10] * (v[3] - roads[3])
    third = p[20] * (z[4] - z[0] - 0.5 * z[1]) + p[21] * (v[4] - v[0] - 0.5 * v[1])
    tone = 0.0
    if p[23] != 0.0 or p[24] != 0.0:
        tone = p[23] * np.cos(2.0 * np.pi * p[22] * t) + p[24] * np.sin(2.0 * np.pi * p[22] * t)
    a[0] = (third - s1 - s2 + (tone if p[25] == 0.0 else 0.0)) / mass
    a[1] = (front * s1 - rear * s2 + 0.5 * third) / inertia
    a[2] = (s1 - t1 + (tone if p[25] == 1.0 else 0.0)) / p[2]
    a[3] = (s2 - t2 + (tone if p[25] == 2.0 else 0.0)) / p[3]
    a[4] = -third / p[19] if p[19] > 0.0 else 0.0
    out[0], out[1], out[2], out[3], out[4] = a[2], a[3], a[0] - front * a[1], a[0] + rear * a[1], d1
    out[5], out[6], out[7], out[8], out[9], out[10], out[11] = s1, s2, t1, t2, e1, e2, d2


@_compiled
def move(p, r1, r2, h, lead, sub, out):
    """Outputs (OUTPUTS, samples), each the mean over `sub` steps, after `lead` steps from rest.

    p : (35,) parameters. r1, r2 : (steps + 2,) heights [m] in the middles of the steps, from the step before the first.
    """
    z, v, a, now = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES), np.zeros(OUTPUTS)
    carried, roads, total, held = np.zeros(STATES), np.zeros(4), np.zeros(OUTPUTS), np.zeros(2)
    base = p[11] + p[12]
    z[0], z[1], z[2], z[3] = (p[12] * r1[0] + p[11] * r2[0]) / base, (r2[0] - r1[0]) / base, r1[0], r2[0]
    z[4] = z[0] + 0.5 * z[1]
    for i in range(lead + out.shape[1] * sub):
        roads[0], roads[1] = r1[i + 1], r2[i + 1]
        roads[2], roads[3] = (r1[i + 2] - r1[i]) / (2.0 * h), (r2[i + 2] - r2[i]) / (2.0 * h)
        for k in range(STATES):
            z[k] += 0.5 * h * v[k]
            carried[k] = v[k] + 0.5 * h * a[k]
        accelerate(p, z, carried, held, roads, (i + 0.5 - lead) * h, a, now)
        for k in range(2):
            held[k] = (held[k] + h * now[9 + k]) / (1.0 + h * p[33 + k])
        for k in range(STATES):
            v[k] += h * a[k]
            z[k] += 0.5 * h * v[k]
        if i >= lead:
            for k in range(OUTPUTS):
                total[k] += now[k]
            if (i - lead) % sub == sub - 1:
                for k in range(OUTPUTS):
                    out[k, (i - lead) // sub] = total[k] / sub
                    total[k] = 0.0


@_compiled
def many(parameters, roads, which, places, apart, h, lead, sub, out):
    """`move` at all points.

    parameters : (points, 35). roads : (roads, length), of which each point has `which`. places : (points, steps + 2) of
    the front axle along the road [m]; `apart` [m] of the rear one behind it. out : (points, OUTPUTS, samples).
    """
    r1, r2 = np.zeros(places.shape[1]), np.zeros(places.shape[1])
    for point in range(parameters.shape[0]):
        heights(roads[which[point]], places[point], r1)
        heights(roads[which[point]], places[point] - apart, r2)
        move(parameters[point], r1, r2, h, lead, sub, out[point])
