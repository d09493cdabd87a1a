"""Changes of a model's suspension: elements weaker from the start, or from an instant of the run on."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from railsim.effects.interface import Effect, Setup, onset_field, ramp_field
from railsim.errors import InputError
from railsim.force_laws import BlowOff, BumpStop, DryFriction, ForceLaw, Maxwell, Scheduled
from railsim.model import AXES, LinearElement, Model, NonlinearElement

STABLE = 1.2  # largest product of step and decay rate of an element's own state


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
        weakened = [e for e in setup.model.elements if e.name.startswith(self.elements)]
        lost = {e.name: _lost(e, self.axes, stiffness, damping, extra) for e in weakened}
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
        beside_joint(e, f"{axis}_change", axis, Scheduled(k, c, onset, ramp))
        for e in model.elements
        if e.name in lost
        for axis, k, c in zip(AXES, *lost[e.name], strict=True)
        if k != 0.0 or c != 0.0
    ]
    return replace(model, nonlinear=(*model.nonlinear, *added))


def joint(setup: Setup, effect: Effect, name: str) -> LinearElement:
    """The element of that name.

    Raises
    ------
    InputError : the vehicle has none.
    """
    for element in setup.model.elements:
        if element.name == name:
            return element
    known = ", ".join(element.name for element in setup.model.elements)
    raise InputError(
        f"effect '{effect.kind}': the vehicle has no element '{name}' (it has {known}); take another vehicle"
    )


def beside_joint(element: LinearElement, what: str, axis: str, law: ForceLaw) -> NonlinearElement:
    """A nonlinear element between the same bodies at the same place."""
    return NonlinearElement(f"{element.name}_{what}", element.upper, element.lower, element.position, axis, law)


def _with_damping(model: Model, name: str, axis: str, factor: float, added: NonlinearElement) -> Model:
    """The model with an element's damping about one axis multiplied, and a nonlinear element more."""
    i = AXES.index(axis)
    elements = []
    for element in model.elements:
        if element.name == name:
            damping = element.damping.copy()
            damping[i, i] *= factor
            element = replace(element, damping=damping)
        elements.append(element)
    return replace(model, elements=tuple(elements), nonlinear=(*model.nonlinear, added))


def _damping(setup: Setup, effect: Effect, name: str, axis: str) -> tuple[LinearElement, float]:
    element = joint(setup, effect, name)
    i = AXES.index(axis)
    if element.damping[i, i] <= 0.0:
        raise InputError(f"effect '{effect.kind}': this vehicle has no such damper; take another vehicle")
    return element, float(element.damping[i, i])


def in_series(setup: Setup, effect: Effect, name: str, axis: str, compliance: float) -> Setup:
    """A spring of `compliance` [m/N, rad/N m] in series with an element's damper: force k z, dz/dt = v - k z / c."""
    if compliance == 0.0:
        return setup
    element, damping = _damping(setup, effect, name, axis)
    added = beside_joint(element, f"{axis}_series", axis, Maxwell(1.0 / compliance, damping))
    setup = setup.modelled(lambda model: _with_damping(model, name, axis, 0.0, added))
    return setup.but(longest_step=min(setup.longest_step, STABLE * compliance * damping))


def blow_off(setup: Setup, effect: Effect, name: str, axis: str, velocity: float, share: float) -> Setup:
    """An element's damper with `share` of its damping beyond `velocity` [m/s, rad/s]."""
    element, damping = _damping(setup, effect, name, axis)
    added = beside_joint(element, f"{axis}_blow_off", axis, BlowOff(damping, share * damping, velocity))
    return setup.modelled(lambda model: replace(model, nonlinear=(*model.nonlinear, added)))


def friction(setup: Setup, effect: Effect, name: str, axis: str, force: float, slip: float) -> Setup:
    """Friction of `force` [N, N m] beside an element, regularised over `slip` [m/s, rad/s]."""
    if force == 0.0:
        return setup
    added = beside_joint(joint(setup, effect, name), f"{axis}_friction", axis, DryFriction(force, slip))
    return setup.modelled(lambda model: replace(model, nonlinear=(*model.nonlinear, added)))


def primary_friction(setup: Setup, effect: Effect, force: float, slip: float) -> Setup:
    """Vertical friction of `force` [N] at every axlebox."""
    if force == 0.0:
        return setup
    added = []
    for wheelset in setup.model.wheelsets:
        element = joint(setup, effect, wheelset.body.replace("wheelset", "primary"))
        x, _, z = element.position
        for side, y in (("left", wheelset.axlebox_half_spacing), ("right", -wheelset.axlebox_half_spacing)):
            slider = beside_joint(element, f"friction_{side}", "z", DryFriction(force, slip))
            added.append(replace(slider, position=(x, y, z)))
    return setup.modelled(lambda model: replace(model, nonlinear=(*model.nonlinear, *added)))


def bump_stop(setup: Setup, effect: Effect, closed: float, offset: float) -> Setup:
    """The bump stop's gap narrower by the share `closed`, its middle at `offset` [m]."""
    if not any(isinstance(element.law, BumpStop) for element in setup.model.nonlinear):
        raise InputError(f"effect '{effect.kind}': this vehicle has no bump stop; take another vehicle")

    def new(element: NonlinearElement) -> NonlinearElement:
        if not isinstance(element.law, BumpStop):
            return element
        return replace(element, law=replace(element.law, gap=element.law.gap * (1.0 - closed), middle=offset))

    def change(model: Model) -> Model:
        return replace(model, nonlinear=tuple(new(element) for element in model.nonlinear))

    return setup.modelled(change)


def asymmetric(setup: Setup, effect: Effect, name: str, prefix: str, share: float) -> Setup:
    """Vertical springs of the elements whose names begin with `name` stiffer left and softer right by `share`: a force
    k share b per roll and a moment k share b per height, with the vehicle's half spacing b.
    """
    if share == 0.0:
        return setup
    if not any(element.name.startswith(name) for element in setup.model.elements):
        joint(setup, effect, name)
    arm = float(getattr(setup.vehicle, f"{prefix}_half_spacing", 1.0))

    def new(element: LinearElement) -> LinearElement:
        stiffness = element.stiffness.copy()
        stiffness[2, 3] += share * arm * stiffness[2, 2]
        stiffness[3, 2] = stiffness[2, 3]
        return replace(element, stiffness=stiffness)

    def change(model: Model) -> Model:
        return replace(model, elements=tuple(new(e) if e.name.startswith(name) else e for e in model.elements))

    return setup.modelled(change)


def misaligned(setup: Setup, effect: Effect, wheelset: int, angle: float) -> Setup:
    """Wheelset whose primary suspension is at rest at a yaw `angle` [rad]: the moment of its yaw stiffness."""
    if angle == 0.0:
        return setup
    element = joint(setup, effect, f"primary{wheelset}")
    moment = float(element.stiffness[5, 5]) * angle  # the wheelset is the lower body: it is turned to the left
    added = beside_joint(element, "misalignment", "yaw", Scheduled(force=moment))
    return setup.modelled(lambda model: replace(model, nonlinear=(*model.nonlinear, added)))
