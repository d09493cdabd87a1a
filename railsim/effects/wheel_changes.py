"""Changes of wheels: around the turn, and of the rolling radius over the lateral shift."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from railsim.contact.functions import RADIUS
from railsim.effects._bogies import ALL, wheelset_place
from railsim.effects.interface import Effect, Setup
from railsim.model import Model, Wheelset

POINTS = 2048  # around a turn: 1.4 mm of the tread
STEPS_A_FLAT = 10  # integration steps while a flat passes,
SHORTEST_FLAT = 0.02  # m, or while one of this length does: 54 um deep, shorter ones move nothing
LANDING = 1.0 / 8192.0  # s; a wheel that has left the rail comes down at once, however long the flat was
STEPS_A_WAVE = 12
FASTEST_CHANGE = 1.02  # spare for a speed that varies about the prescribed one


def _on_sides(side: str) -> tuple[bool, bool]:
    return side in ("left", "both"), side in ("right", "both")


def _changed(model: Model, number: int, change: Callable[[Wheelset], Wheelset]) -> Model:
    wheelsets = tuple(change(w) if i == number else w for i, w in enumerate(model.wheelsets))
    return replace(model, wheelsets=wheelsets)


def _rounded(setup: Setup, number: int, side: str, shape: np.ndarray) -> Setup:
    """`shape` (POINTS,) [m] added to the radius of wheels of a wheelset."""

    def change(wheelset: Wheelset) -> Wheelset:
        before = wheelset.roundness or (np.zeros(POINTS), np.zeros(POINTS))
        left, right = (old + shape if there else old for old, there in zip(before, _on_sides(side), strict=True))
        return replace(wheelset, roundness=(left, right))

    return setup.modelled(lambda model: _changed(model, number, change))


def _fine(setup: Setup, length: float, steps: int) -> Setup:
    """A step that takes at least `steps` over `length` [m] of the run."""
    fastest = float(setup.speed_tables.speed.max()) * FASTEST_CHANGE
    return setup.but(longest_step=min(setup.longest_step, length / (steps * fastest)))


def flat_depth(length: float, radius: float) -> float:
    """Depth of a rounded flat [m]: length^2 / (16 r) (Newton and Clark 1979); of a fresh one it is twice that."""
    return length * length / (16.0 * radius)


def flat(setup: Setup, effect: Effect, wheelset: int, side: str, length: float, angle: float) -> Setup:
    """A rounded flat of `length` [m] with its middle at `angle` [rad]."""
    number = wheelset_place(setup, effect, wheelset)
    if length == 0.0:
        return setup
    radius = setup.model.wheelsets[number].radius
    rotation = 2.0 * np.pi * np.arange(POINTS) / POINTS - angle
    along = radius * ((rotation + np.pi) % (2.0 * np.pi) - np.pi)
    depth = flat_depth(length, radius)
    shape = np.where(np.abs(along) < length / 2, -0.5 * depth * (1.0 + np.cos(2.0 * np.pi * along / length)), 0.0)
    fine = _fine(setup, max(length, SHORTEST_FLAT), STEPS_A_FLAT)
    return _rounded(fine.but(longest_step=min(fine.longest_step, LANDING)), number, side, shape)


def wavy(setup: Setup, effect: Effect, wheelset: int, side: str, wave: tuple[float, int, float]) -> Setup:
    """A wave of amplitude [m], order and phase [rad] around the turn."""
    number = wheelset_place(setup, effect, wheelset)
    amplitude, order, phase = wave
    if amplitude == 0.0:
        return setup
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS
    radius = setup.model.wheelsets[number].radius
    fine = _fine(setup, 2.0 * np.pi * radius / order, STEPS_A_WAVE)
    return _rounded(fine, number, side, amplitude * np.cos(order * (angle - phase)))


def unbalanced(setup: Setup, effect: Effect, wheelset: int, side: str, size: tuple[float, float]) -> Setup:
    """Unbalance [kg m] and its phase [rad] on wheels of a wheelset, in place of what they had."""
    number = wheelset_place(setup, effect, wheelset)
    if size[0] == 0.0:
        return setup

    def change(nominal: Wheelset) -> Wheelset:
        left, right = (size if there else old for old, there in zip(nominal.unbalance, _on_sides(side), strict=True))
        return replace(nominal, unbalance=(left, right))

    return setup.modelled(lambda model: _changed(model, number, change))


def radius_difference(setup: Setup, difference: float) -> Setup:
    """Rolling radii of the left wheels larger, of the right ones smaller by half of `difference` [m]."""

    def new(model: Model) -> Model:
        coefficients = model.contact.coefficients.copy()
        for row in range(len(coefficients)):  # of both sides, then of their second contacts
            coefficients[row, :, RADIUS, 0] += (0.5 - row % 2) * difference
        return replace(model, contact=replace(model.contact, coefficients=coefficients))

    return setup.modelled(new)


def conicity(setup: Setup, effect: Effect, factor: float, wheelset: int | str) -> Setup:
    """Deviation of the rolling radius from that in the middle of the tread by `factor`, and what the roll adds to it;
    of one wheelset or of `all`.
    """
    only = None if wheelset == ALL else wheelset_place(setup, effect, int(wheelset))

    def worn(one: Wheelset) -> Wheelset:
        return replace(one, steeper=factor * (1.0 + one.steeper) - 1.0)

    def new(model: Model) -> Model:
        wheelsets = (worn(one) if only in (None, k) else one for k, one in enumerate(model.wheelsets))
        return replace(model, wheelsets=tuple(wheelsets))

    return setup.modelled(new)
