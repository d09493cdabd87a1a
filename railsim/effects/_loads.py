"""Loads on bodies over time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railsim.effects.interface import Effect, Setup
from railsim.errors import InputError
from railsim.model import Load

STEPS = 128  # of a gust


def _body(setup: Setup, effect: Effect, name: str) -> None:
    known = [body.name for body in setup.model.bodies]
    if name not in known:
        raise InputError(f"effect '{effect.kind}': the vehicle has no body '{name}'; it has {', '.join(known)}")


def loaded(setup: Setup, effect: Effect, body: str, axis: str, size: float) -> Setup:
    """A constant force [N] or moment [N m] on a body."""
    _body(setup, effect, body)
    if size == 0.0:
        return setup
    load = Load(body, axis, "time", 0.0, 1.0, np.full(2, size))
    return setup.modelled(lambda model: replace(model, loads=(*model.loads, load)))


def gust(setup: Setup, effect: Effect, force: float, begin: float, length: float, height: float, over: str) -> Setup:
    """Wind of 1 - cosine with a peak `force` [N], over time [s] or distance [m]."""
    shape = 0.5 * force * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, STEPS + 1)))
    return wind(setup, effect, shape, begin, length / STEPS, height, over)


def wind(
    setup: Setup,
    effect: Effect,
    force: Sequence[float] | np.ndarray,
    begin: float,
    step: float,
    height: float,
    over: str = "time",
) -> Setup:
    """A lateral force [N] on the body, `height` [m] above the rails, at equal steps of time [s] or distance [m]."""
    _body(setup, effect, "body")
    values = np.asarray(force, dtype=float)
    if not values.any():
        return setup
    arm = height - setup.model.bodies[setup.model.index("body")].position[2]
    loads = (
        Load("body", "y", over, begin, step, values),
        Load("body", "roll", over, begin, step, -arm * values),
    )
    return setup.modelled(lambda model: replace(model, loads=(*model.loads, *loads)))
