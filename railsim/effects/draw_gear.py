"""A vehicle that its train pulls: the body is not held at the prescribed speed."""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.errors import InputError
from railsim.model import LinearElement, Model
from railsim.spec import quantity
from railsim.speed import Driven

TRAIN = "train"  # the body that keeps the prescribed speed
USUAL = 2e-6  # m/N; healthy vehicles are on a spring of 0.5 MN/m, or a harder or softer one; illustrative
DAMPING = 0.7  # of critical, of the vehicle's mass on the draw gear; illustrative


class DrawGear(Effect, frozen=True):
    """Draw gear with a spring and a damper between the body and a train that keeps the prescribed speed.

    A whole vehicle's body is held at that speed. A real one gives way when its bogies push and pull: at some hertz the
    force of yaw dampers is as large as the inertia force of the body.
    """

    compliance: float = quantity(1e-6, unit="m/N", source=CHOSEN, ge=0.0, le=5e-6)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"compliance": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"compliance": 2e-7})
    signature: ClassVar[str] = "bogies and body pitch in another way from 1 to 10 Hz"
    references: ClassVar[tuple[str, ...]] = (
        "Cole (2006), Longitudinal train dynamics, in Iwnicki (ed.), Handbook of railway vehicle dynamics",
    )

    @classmethod
    def ordinary(cls, setup: Setup) -> Mapping[str, float]:
        """No body is held along the track."""
        del setup
        return {"compliance": USUAL}

    def install(self, setup: Setup) -> Setup:
        """The body free along the track, on the draw gear.

        Raises
        ------
        InputError : the vehicle's bogies are held along the track, or its speed is not prescribed.
        """
        if not setup.model.moves_along or TRAIN in [body.name for body in setup.model.bodies]:
            raise InputError(f"effect '{self.kind}': it needs a whole vehicle whose body is held; take another vehicle")
        if isinstance(setup.speed, Driven):
            raise InputError(
                f"effect '{self.kind}': a vehicle that drives or coasts is free along the track; leave it out"
            )
        return setup if self.compliance == 0.0 else setup.modelled(lambda model: _pulled(model, 1.0 / self.compliance))


def _pulled(model: Model, stiffness: float) -> Model:
    held = model.bodies[model.driver]
    along, mass = np.diag(np.eye(6)[0]), sum(body.mass for body in model.bodies)
    damping = 2.0 * DAMPING * math.sqrt(stiffness * mass)
    gear = LinearElement("draw_gear", held.name, TRAIN, held.position, stiffness * along, damping * along)
    bodies = tuple(replace(body, free=("x", *body.free)) if body is held else body for body in model.bodies)
    train = replace(held, name=TRAIN, free=())
    return replace(model, bodies=(*bodies, train), elements=(*model.elements, gear))
