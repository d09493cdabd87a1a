"""What pulls a vehicle along the track where its speed is prescribed."""

import math
from dataclasses import replace

import numpy as np

from railsim.model import LinearElement, Model

TRAIN = "train"  # the body that keeps the prescribed speed
DAMPING = 0.7  # of critical, of the vehicle's mass on the draw gear; illustrative


def pulled(model: Model, stiffness: float) -> Model:
    """The model with its body free along the track, on a spring and a damper between its centre and a train that keeps
    the prescribed speed (Cole 2006, in Iwnicki (ed.), Handbook of railway vehicle dynamics).

    stiffness : of the draw gear [N/m].
    """
    held = model.bodies[model.driver]
    along, mass = np.diag(np.eye(6)[0]), sum(body.mass for body in model.bodies)
    damping = 2.0 * DAMPING * math.sqrt(stiffness * mass)
    gear = LinearElement("draw_gear", held.name, TRAIN, held.position, stiffness * along, damping * along)
    bodies = tuple(replace(body, free=("x", *body.free)) if body is held else body for body in model.bodies)
    train = replace(held, name=TRAIN, free=())
    return replace(model, bodies=(*bodies, train), elements=(*model.elements, gear))
