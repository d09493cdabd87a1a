"""Several vehicles in one model that do not touch each other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railsim.model import TRACK, Model
from tests.engines.rig import Rows


def joined(models: Sequence[Model], offsets: Sequence[float]) -> Model:
    """One model of all, each moved along the track by its offset [m]; names end in the vehicle's number from 0."""

    def named(name: str, k: int) -> str:
        return name if name == TRACK else f"{name}_{k}"

    def moved(position: tuple[float, float, float], k: int) -> tuple[float, float, float]:
        return position[0] + offsets[k], position[1], position[2]

    def ends(element, k: int):
        return replace(
            element,
            name=named(element.name, k),
            upper=named(element.upper, k),
            lower=named(element.lower, k),
            position=moved(element.position, k),
        )

    each = list(enumerate(models))
    return replace(
        models[0],
        bodies=tuple(
            replace(b, name=named(b.name, k), position=moved(b.position, k)) for k, m in each for b in m.bodies
        ),
        elements=tuple(ends(element, k) for k, m in each for element in m.elements),
        nonlinear=tuple(ends(element, k) for k, m in each for element in m.nonlinear),
        wheelsets=tuple(
            replace(w, body=named(w.body, k), frame=w.frame and named(w.frame, k)) for k, m in each for w in m.wheelsets
        ),
        loads=tuple(replace(load, body=named(load.body, k)) for k, m in each for load in m.loads),
        reference=named(models[0].reference, 0),
        chord_yaw=models[0].chord_yaw and named(models[0].chord_yaw, 0),
    )


def joined_state(models: Sequence[Model], states: Sequence[np.ndarray]) -> np.ndarray:
    """State of the joined model from those of its parts; distance and speed are those of the first."""
    cuts = []
    for model, state in zip(models, states, strict=True):
        n, w = len(model.free), len(model.wheelsets)
        cuts.append(np.split(state, np.cumsum([n, n, w, w, 2])))
    parts = [np.concatenate(pieces) for pieces in zip(*cuts, strict=True)]
    parts[4] = cuts[0][4]  # distance and speed
    return np.concatenate(parts)


def alone(model: Model, number: int, wheels: int) -> dict[str, str]:
    """Channel in the joined model by channel of the vehicle with that number, of so many wheelsets each."""
    found = {}
    for name in Rows(model, np.empty((0, 0))).names:
        head, _, quantity = name.partition(".")
        if head in [body.name for body in model.bodies]:
            found[name] = f"{head}_{number}.{quantity}"
        elif quantity and head != "position":
            kind = head.rstrip("leftrigh_").rstrip("0123456789")
            rest = head[len(kind) :]
            at, _, side = rest.partition("_")
            found[name] = f"{kind}{int(at) + number * wheels}{'_' if side else ''}{side}.{quantity}"
    return found
