"""What pulls a vehicle along the track where its speed is prescribed."""

import math
from dataclasses import replace

import numpy as np

from railsim.model import LinearElement, Load, Model
from railsim.speed import Constant, Profile

TRAIN = "train"  # the body that keeps the prescribed speed
DAMPING = 0.7  # of critical, of the vehicle's mass on the draw gear; illustrative
STEP = 2.0**-8  # s, between the values of the pull; illustrative: far below the periods of bodies along the track


def pulled(model: Model, stiffness: float, speed: Constant | Profile, duration: float) -> Model:
    """The model with its body free along the track, on a spring and a damper between its centre and a train that keeps
    the prescribed speed (Cole 2006, in Iwnicki (ed.), Handbook of railway vehicle dynamics).

    The train pulls with what accelerates the vehicle: the speed is that of the vehicle too, whatever the draw gear.

    stiffness : of the draw gear [N/m].
    duration : of the run [s].
    """
    held = model.bodies[model.driver]
    along, mass = np.diag(np.eye(6)[0]), sum(body.mass for body in model.bodies)
    damping = 2.0 * DAMPING * math.sqrt(stiffness * mass)
    gear = LinearElement("draw_gear", held.name, TRAIN, held.position, stiffness * along, damping * along)
    bodies = tuple(replace(body, free=("x", *body.free)) if body is held else body for body in model.bodies)
    train = replace(held, name=TRAIN, free=())
    loads = model.loads
    acceleration = _acceleration(speed, duration)
    if acceleration.any():
        spinning = sum(wheelset.spin_inertia / wheelset.radius**2 for wheelset in model.wheelsets)
        loads = (*loads, Load(held.name, "x", "time", 0.0, STEP, (mass + spinning) * acceleration))
    return replace(model, bodies=(*bodies, train), elements=(*model.elements, gear), loads=loads)


def _acceleration(speed: Constant | Profile, duration: float) -> np.ndarray:
    """Mean accelerations [m/s2] over a step about each of the instants a step apart, from 0 to `duration` [s]."""
    middle = STEP * np.arange(math.ceil(duration / STEP) + 1)
    before, after = np.maximum(middle - 0.5 * STEP, 0.0), middle + 0.5 * STEP
    return np.diff(np.interp([before, after], *speed.knots(duration)), axis=0)[0] / (after - before)
