"""Changes of a model's suspension: elements weaker from the start, or from an instant of the run on."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from railsim.effects.interface import Effect, Setup, onset_field, ramp_field
from railsim.errors import InputError
from railsim.model import AXES, SCHEDULED, LinearElement, Model, NonlinearElement


class Weakened(Effect, frozen=True):
    """Base of faults that take a share of some elements' stiffness or damping away, about some axes.

    From the start the elements' own matrices are smaller (exact in both engines); with an `onset` later in the run an
    element of negative size stands beside them, which fades in and sees the displacements to first order.
    """

    onset: float = onset_field()
    ramp: float = ramp_field()

    elements: ClassVar[tuple[str, ...]]
    """Beginnings of the elements' names."""
    axes: ClassVar[tuple[str, ...]]

    def weaken(
        self, setup: Setup, stiffness: float = 1.0, damping: float = 1.0, extra: Mapping[str, float] = {}
    ) -> Setup:
        """The setup with stiffness and damping multiplied by these factors; `extra`: stiffness that is not touched, by
        axis.
        """
        found = [e for e in setup.model.elements if e.name.startswith(self.elements)]
        lost = {e.name: _lost(e, self.axes, stiffness, damping, extra) for e in found}
        acted = any(np.any(k) or np.any(c) for k, c in lost.values())
        if not acted and (stiffness != 1.0 or damping != 1.0):
            raise InputError(f"effect '{self.kind}': this vehicle has nothing there that could fail; leave it out")
        if self.onset > 0.0:
            return setup.modelled(lambda model: beside(model, lost, self.onset, self.ramp))
        return setup.modelled(lambda model: _within(model, lost))


def _lost(
    element: LinearElement, axes: Iterable[str], stiffness: float, damping: float, extra: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Diagonal changes (6,) of stiffness and damping."""
    k, c = np.zeros(6), np.zeros(6)
    for axis in axes:
        i = AXES.index(axis)
        k[i] = (stiffness - 1.0) * (element.stiffness[i, i] - extra.get(axis, 0.0))
        c[i] = (damping - 1.0) * element.damping[i, i]
    return k, c


def _within(model: Model, lost: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Model:
    """The model with changed matrices."""

    def new(element: LinearElement) -> LinearElement:
        k, c = lost[element.name]
        return replace(element, stiffness=element.stiffness + np.diag(k), damping=element.damping + np.diag(c))

    return replace(model, elements=tuple(new(e) if e.name in lost else e for e in model.elements))


def beside(model: Model, lost: Mapping[str, tuple[np.ndarray, np.ndarray]], onset: float, ramp: float) -> Model:
    """The model with scheduled elements beside the linear ones: stiffness and damping (6,) by element, from `onset`
    [s] on, in full after `ramp` [s].
    """
    added = [
        NonlinearElement(f"{e.name}_{axis}_change", e.upper, e.lower, e.position, axis, SCHEDULED, (k, c, onset, ramp))
        for e in model.elements
        if e.name in lost
        for axis, k, c in zip(AXES, *lost[e.name], strict=True)
        if k != 0.0 or c != 0.0
    ]
    return replace(model, nonlinear=(*model.nonlinear, *added))
