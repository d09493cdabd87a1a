"""Changes of the creep law: friction and slopes."""

import math
from dataclasses import replace

import numpy as np

from railsim.effects.interface import Effect, Setup
from railsim.effects.track_changes import resampled, window
from railsim.errors import InputError
from railsim.model import Model
from railsim.track.track import Track
from railsim.vehicles.adhesion import Adhesion

ENDS = 2.0  # m; over which friction changes
ROWS = 0.5  # m; spacing of rows that holds these ends


def less_friction(setup: Setup, effect: Effect, factor: float, stretch: tuple[float, float] | None = None) -> Setup:
    """Friction of all contacts by `factor`, everywhere or over a stretch (begin, length) [m]."""
    del effect
    if factor == 1.0:
        return setup
    if stretch is None and setup.track.friction is None:
        return setup.modelled(
            lambda model: replace(model, law=model.law._replace(friction=factor * model.law.friction))
        )
    track = setup.track if stretch is None else resampled(setup.track, ROWS)
    base = np.full(track.s.size, setup.model.law.friction) if track.friction is None else track.friction
    share = np.ones(track.s.size) if stretch is None else window(track.s, stretch[0], stretch[1], ENDS)
    columns = track.columns() | {"friction": base * (1.0 - (1.0 - factor) * share)}
    return setup.but(track=Track(track.s, columns, track.name, track.comments))


def creep(setup: Setup, effect: Effect, adhesion: float, slip: float) -> Setup:
    """kA and kS of Polach's law by two factors.

    Raises
    ------
    InputError : another law, in which they play no part.
    """
    least, most = Adhesion.limits("k_adhesion")
    wanted = setup.model.law.k_adhesion * adhesion
    if not (least or 0.0) < wanted <= (math.inf if most is None else most) + 1e-9:
        raise InputError(f"effect '{effect.kind}': kA would be {wanted:g}; it ends at {most:g}")

    def change(model: Model) -> Model:
        law = model.law
        return replace(model, law=law._replace(k_adhesion=law.k_adhesion * adhesion, k_slip=law.k_slip * slip))

    return setup.modelled(change)


def creep_shape(setup: Setup, effect: Effect, factor: float) -> Setup:
    """kS of Polach's law by a factor, with kA + kS (the slope at zero creepage) as it was."""
    law = setup.model.law
    slip = law.k_slip * factor
    return creep(setup, effect, (law.k_adhesion + law.k_slip - slip) / law.k_adhesion, factor)
