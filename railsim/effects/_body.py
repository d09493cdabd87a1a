"""A car body that bends."""

import math
from dataclasses import replace

import numpy as np

from railsim.constants import GRAVITY
from railsim.effects.interface import Effect, Setup
from railsim.errors import InputError
from railsim.model import Body, LinearElement, Model

HELD = 1e6  # kg m2; inertia of the mode's body, whose rotations are held: serves only the absolute engine's holding
NAME = "bending"


def bending(
    setup: Setup, effect: Effect, share: float, frequency: float, lateral_ratio: float, damping: float
) -> Setup:
    """The body's mass split: 1 - share stays, `share` hangs on springs of the mode's `frequency` [Hz] with the
    `damping` ratio, vertically and laterally.

    Raises
    ------
    InputError : the vehicle has no body that moves laterally and vertically.
    """
    free = {body.name: body.free for body in setup.model.bodies}
    if not {"y", "z"} <= set(free.get("body", ())) or NAME in free:
        raise InputError(
            f"effect '{effect.kind}': the vehicle needs one body 'body' that is free in y and z; take another vehicle"
        )
    if share == 0.0:
        return setup
    return setup.modelled(lambda model: _split(model, share, frequency, lateral_ratio, damping))


def _split(model: Model, share: float, frequency: float, lateral_ratio: float, damping: float) -> Model:
    whole = model.bodies[model.index("body")]
    mass = share * whole.mass
    along = 1.0 if model.moves_along else 0.0  # one body alone is held along the track: springs carry the mode with it
    angular_frequency = 2.0 * math.pi * frequency * np.array([along, lateral_ratio, 1.0, 0.0, 0.0, 0.0])
    free = ("x", "y", "z") if model.moves_along else ("y", "z")
    mode = Body(NAME, mass, (HELD, HELD, HELD), whole.position, free, whole.origin)
    spring = LinearElement(
        NAME,
        NAME,
        "body",
        whole.position,
        np.diag(mass * angular_frequency**2),
        np.diag(2.0 * damping * mass * angular_frequency),
        (0.0, 0.0, mass * GRAVITY),
    )
    rest = tuple(replace(body, mass=body.mass - mass) if body is whole else body for body in model.bodies)
    return replace(model, bodies=(*rest, mode), elements=(*model.elements, spring))
