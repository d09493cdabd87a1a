"""Changes of a model's suspension: elements weaker from the start, or from an instant of the run on."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import ClassVar, NamedTuple

import numpy as np

from railsim.effects._bogies import (
    BogieEffect,
    Component,
    Place,
    bogie_names,
    chosen,
    joined,
    laws,
    nonlinear,
    places,
    springs,
    wheelset_place,
)
from railsim.effects.interface import Effect, Setup, changed, onset_field, ramp_field
from railsim.errors import InputError
from railsim.force_laws import BlowOff, BumpStop, DryFriction, ForceLaw, Maxwell, Scheduled
from railsim.model import AXES, LinearElement, Model, NonlinearElement

STABLE = 0.6  # largest product of step and decay rate of an element's own state; velocity Verlet's limit is 1
PAIR = 2  # dampers of a bogie, one a side

Lost = Mapping[str, tuple[np.ndarray, np.ndarray]]
"""Changes (6, 6) of stiffness and damping by element."""


class Weakened(BogieEffect, frozen=True):
    """Base of faults that take a share of a component's stiffness or damping away.

    From the start the elements' own matrices are smaller, and forces of dampers with a law of their own (exact in both
    engines); with an `onset` later in the run an element of negative size stands beside them, which fades in and sees
    the displacements to first order.
    """

    onset: float = onset_field()
    ramp: float = ramp_field()

    component: ClassVar[Component]

    def weaken(
        self, setup: Setup, stiffness: float = 1.0, damping: float = 1.0, extra: Mapping[str, float] = {}
    ) -> Setup:
        """The setup with stiffness and damping multiplied by these factors; `extra`: stiffness that is not touched, by
        axis.

        Raises
        ------
        InputError : the vehicle has no such bogie or component; an onset of what has a law of its own, or is coupled.
        """
        lost = {
            element.name: _lost(element, place, stiffness, damping, extra)
            for element, place in places(setup, self, self.component)
        }
        own = [element.name for element in laws(setup, self, self.component)] if damping != 1.0 else []
        acted = own or any(np.any(k) or np.any(c) for k, c in lost.values())
        if not acted and (stiffness != 1.0 or damping != 1.0):
            raise InputError(f"effect '{self.kind}': this vehicle has nothing there that could fail; leave it out")
        if self.onset > 0.0:
            coupled = [name for name, pair in lost.items() if any(np.any(m - np.diag(np.diag(m))) for m in pair)]
            if own or coupled:
                raise InputError(
                    f"effect '{self.kind}': '{(own + coupled)[0]}' of this vehicle can fail from the start only; "
                    "leave onset out"
                )
            return setup.modelled(lambda model: _beside(model, lost, self.onset, self.ramp))
        return setup.modelled(lambda model: _scaled(_within(model, lost), own, damping))


def _lost(
    element: LinearElement, place: Place, stiffness: float, damping: float, extra: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Changes (6, 6) of stiffness and damping: their diagonals, or all where the axes are coupled."""
    k, c = np.zeros((2, 6, 6))
    axes = [AXES.index(axis) for axis in place.axes]
    if place.coupled:
        own = np.ix_(axes, axes)
        k[own], c[own] = (stiffness - 1.0) * element.stiffness[own], (damping - 1.0) * element.damping[own]
        return k, c
    for axis, i in zip(place.axes, axes, strict=True):
        k[i, i] = (stiffness - 1.0) * (element.stiffness[i, i] - extra.get(axis, 0.0))
        c[i, i] = (damping - 1.0) * element.damping[i, i]
    return k, c


def _within(model: Model, lost: Lost) -> Model:
    """The model with changed matrices."""

    def new(element: LinearElement) -> LinearElement:
        k, c = lost[element.name]
        return replace(element, stiffness=element.stiffness + k, damping=element.damping + c)

    return replace(model, elements=tuple(new(e) if e.name in lost else e for e in model.elements))


def _scaled(model: Model, names: Iterable[str], factor: float) -> Model:
    """The model with the forces of these dampers multiplied; 0 takes them away."""
    kept = []
    for element in model.nonlinear:
        if element.name in names:
            if factor == 0.0:
                continue
            sizes = {n: factor * value for n, value in vars(element.law).items() if n != "velocity"}
            element = replace(element, law=replace(element.law, **sizes))
        kept.append(element)
    return replace(model, nonlinear=tuple(kept))


def _beside(model: Model, lost: Lost, onset: float, ramp: float) -> Model:
    """The model with scheduled elements beside the linear ones, from `onset` [s] on, in full after `ramp` [s]."""
    added = [
        beside_joint(e, f"{axis}_change", axis, Scheduled(k, c, onset, ramp))
        for e in model.elements
        if e.name in lost
        for axis, k, c in zip(AXES, *(np.diag(matrix) for matrix in lost[e.name]), strict=True)
        if k != 0.0 or c != 0.0
    ]
    return _with(model, *added)


def _with(model: Model, *added: NonlinearElement) -> Model:
    return replace(model, nonlinear=(*model.nonlinear, *added))


def beside_joint(element: LinearElement, what: str, axis: str, law: ForceLaw) -> NonlinearElement:
    """A nonlinear element between the same bodies at the same place."""
    return NonlinearElement(f"{element.name}_{what}", element.upper, element.lower, element.position, axis, law)


class _Damper(NamedTuple):
    """A linear damper, or a pair that moves as one: the element that holds it and its place there, what its name
    begins with, position [m], axis, damping [N s/m, N m s/rad], number of dampers, and lever of each [m].
    """

    element: LinearElement
    place: Place
    beginning: str
    position: tuple[float, float, float]
    axis: str
    damping: float
    number: int
    lever: float

    def law(self, what: str, law: ForceLaw) -> NonlinearElement:
        """A law where it is."""
        added = beside_joint(self.element, f"{self.beginning}{self.axis}_{what}", self.axis, law)
        return replace(added, position=self.position)


def _dampers(setup: Setup, effect: BogieEffect, component: Component, field: str) -> list[_Damper]:
    """Linear dampers of the chosen bogies.

    Raises
    ------
    InputError : there are none, or the vehicle's own have a law, which its `field` states.
    """
    if own := laws(setup, effect, component):
        raise InputError(
            f"effect '{effect.kind}': '{own[0].name}' of this vehicle has a law of its own; change the vehicle's "
            f"{component.name}_{field}"
        )
    found: list[_Damper] = []
    for element, place in places(setup, effect, component):
        if "x" in place.axes:
            found += _sides(element, place)
            continue
        axis = place.axes[0]
        i = AXES.index(axis)
        lever = float(getattr(setup.vehicle, f"{component.name}_half_spacing", 1.0)) if axis == "yaw" else 1.0
        damping = float(element.damping[i, i])
        found.append(_Damper(element, place, "", element.position, axis, damping, PAIR, lever))
    found = [one for one in found if one.damping > 0.0]
    if not found:
        raise InputError(f"effect '{effect.kind}': this vehicle has no such damper; take another vehicle")
    return found


def _sides(element: LinearElement, place: Place) -> list[_Damper]:
    """Both dampers of a pair along x, whose spacing its couple tells."""
    along, couple = float(element.damping[0, 0]), float(element.damping[5, 5])
    if along == 0.0:
        return []
    half = float(np.sqrt(couple / along))
    x, y, z = element.position
    return [
        _Damper(element, place, f"{side}_", (x, y + sign * half, z), "x", along / PAIR, 1, 1.0)
        for side, sign in (("left", 1.0), ("right", -1.0))
    ]


def _without_damping(model: Model, dampers: Iterable[_Damper]) -> Model:
    """The model without these linear dampers."""
    gone = {one.element.name: [AXES.index(axis) for axis in one.place.axes] for one in dampers}
    elements = []
    for element in model.elements:
        if element.name in gone:
            damping = element.damping.copy()
            damping[gone[element.name], gone[element.name]] *= 0.0
            element = replace(element, damping=damping)
        elements.append(element)
    return replace(model, elements=tuple(elements))


def in_series(setup: Setup, effect: BogieEffect, component: Component, compliance: float) -> Setup:
    """A spring of `compliance` [m/N] in series with each damper: force k z, dz/dt = v - k z / c."""
    if compliance == 0.0:
        chosen(setup, effect)
        return setup
    found = _dampers(setup, effect, component, "series_stiffness")
    added, longest = [], setup.longest_step
    for one in found:
        total = compliance / one.number / one.lever**2
        added.append(one.law("series", Maxwell(1.0 / total, one.damping)))
        longest = min(longest, STABLE * total * one.damping)
    return setup.modelled(lambda model: _with(_without_damping(model, found), *added)).but(longest_step=longest)


def blow_off(setup: Setup, effect: BogieEffect, component: Component, velocity: float, share: float) -> Setup:
    """Dampers with `share` of their damping beyond `velocity` [m/s]."""
    found = _dampers(setup, effect, component, "blow_off_velocity")
    added = [one.law("blow_off", BlowOff(one.damping, share * one.damping, velocity / one.lever)) for one in found]
    return setup.modelled(lambda model: _with(model, *added))


def friction(setup: Setup, effect: BogieEffect, axis: str, force: float, slip: float) -> Setup:
    """Friction of `force` [N, N m] beside the secondary springs, regularised over `slip` [m/s, rad/s]."""
    if force == 0.0:
        chosen(setup, effect)
        return setup
    law = DryFriction(force, slip)
    added = [beside_joint(one, f"{axis}_friction", axis, law) for one in springs(setup, effect, "secondary")]
    return setup.modelled(lambda model: _with(model, *added))


def primary_friction(setup: Setup, effect: BogieEffect, force: float, slip: float) -> Setup:
    """Vertical friction of `force` [N] at every axlebox."""
    if force == 0.0:
        chosen(setup, effect)
        return setup
    added = []
    found = springs(setup, effect, "primary")
    for wheelset in setup.model.wheelsets:
        for element in found:
            if wheelset.body not in (element.upper, element.lower):
                continue
            x, _, z = element.position
            for side, y in (("left", wheelset.axlebox_half_spacing), ("right", -wheelset.axlebox_half_spacing)):
                slider = beside_joint(element, f"friction_{side}", "z", DryFriction(force, slip))
                added.append(replace(slider, position=(x, y, z)))
    return setup.modelled(lambda model: _with(model, *added))


def bump_stop(setup: Setup, effect: BogieEffect, closed: float, offset: float) -> Setup:
    """The bump stop's gap narrower by the share `closed`, its middle at `offset` [m]."""
    stops = nonlinear(setup, effect, BumpStop)
    if not stops:
        raise InputError(f"effect '{effect.kind}': this vehicle has no bump stop; take another vehicle")

    def new(element: NonlinearElement) -> NonlinearElement:
        if element.name not in stops or not isinstance(element.law, BumpStop):
            return element
        return replace(element, law=replace(element.law, gap=element.law.gap * (1.0 - closed), middle=offset))

    def change(model: Model) -> Model:
        return replace(model, nonlinear=tuple(new(element) for element in model.nonlinear))

    return setup.modelled(change)


def asymmetric(setup: Setup, effect: BogieEffect, stage: str, share: float) -> Setup:
    """Vertical springs of a `stage` (primary, secondary) stiffer left and softer right by `share`: a force k share b
    per roll and a moment k share b per height, with the vehicle's half spacing b.
    """
    if share == 0.0:
        chosen(setup, effect)
        return setup
    names = {element.name for element in springs(setup, effect, stage)}
    arm = float(getattr(setup.vehicle, f"{stage}_half_spacing", 1.0))

    def new(element: LinearElement) -> LinearElement:
        stiffness = element.stiffness.copy()
        stiffness[2, 3] += share * arm * stiffness[2, 2]
        stiffness[3, 2] = stiffness[2, 3]
        return replace(element, stiffness=stiffness)

    def change(model: Model) -> Model:
        return replace(model, elements=tuple(new(e) if e.name in names else e for e in model.elements))

    return setup.modelled(change)


def weak_roll_bar(setup: Setup, effect: BogieEffect, factor: float) -> Setup:
    """Roll bars of `factor` times their stiffness; of one bogie by an element of negative stiffness, so that the
    springs' element stays what other effects know.
    """
    if not chosen(setup, effect) or len(bogie_names(setup.model)) == 1:
        return changed(setup, effect, roll_bar_stiffness=lambda nominal: factor * nominal)
    if factor == 1.0:
        return setup
    lost = np.zeros((6, 6))
    lost[3, 3] = (factor - 1.0) * float(getattr(setup.vehicle, "roll_bar_stiffness", 0.0))
    added = tuple(
        replace(e, name=f"roll_bar_{e.name}", stiffness=lost, damping=np.zeros((6, 6)), preload=(0.0, 0.0, 0.0))
        for e in springs(setup, effect, "secondary")
    )
    return setup.modelled(lambda model: replace(model, elements=(*model.elements, *added)))


def misaligned(setup: Setup, effect: Effect, wheelset: int, angle: float) -> Setup:
    """Wheelset whose primary suspension is at rest at a yaw `angle` [rad]: what its springs and bushings do when it is
    turned about its centre.
    """
    place = wheelset_place(setup, effect, wheelset)
    if angle == 0.0:
        return setup
    model, body = setup.model, setup.model.wheelsets[place].body
    found = joined(model, body, ("primary", "bushing"))
    if not found:
        known = ", ".join(element.name for element in model.elements)
        raise InputError(
            f"effect '{effect.kind}': the vehicle has no primary suspension (it has {known}); take another vehicle"
        )
    added = []
    for element in found:
        turned = model.point(body, element.position)[:, 6 * model.index(body) + 5]  # the wheelset is the lower body
        for axis, force in zip(AXES, element.stiffness @ turned, strict=True):
            name = "misalignment" if axis == "yaw" else f"misalignment_{axis}"
            if force != 0.0:
                added.append(beside_joint(element, name, axis, Scheduled(force=float(force) * angle)))
    return setup.modelled(lambda model: _with(model, *added))
