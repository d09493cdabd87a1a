"""Models larger than the half vehicle, and wheelsets far from the reference."""

from dataclasses import replace

import numpy as np
import pytest

from railsim.dynamics.moving_frame import pose
from railsim.dynamics.plant import build_plant
from railsim.model import Model
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import curve, make_run

RADIUS = 600.0


def yaws(model: Model, s: float) -> list[float]:
    """Yaw [rad] in a circle's middle at `s` [m] by pose table: of the chord, then of each wheelset's place."""
    run = make_run(model, curve(RADIUS, 0.0, 380.0), 20.0, 0.1)
    plant, here = build_plant(run.model, run.track, run.speed), np.empty(12)
    found = []
    for row in range(len(plant.pose)):
        pose(plant, row, s, here)
        found.append(float(here[5]))
    return found


def test_chord_is_known_by_name_and_a_wheelset_far_behind_keeps_the_direction_of_its_own_track():
    """A chord of length c turns by c / 2R, the track as far behind by c / R."""
    model = Manchester().model()
    behind = 12.0
    bodies = tuple(
        replace(body, position=(-behind, *body.position[1:])) if body.name == "wheelset2" else body
        for body in model.bodies
    )
    chord, first, second = yaws(replace(model, bodies=bodies), 250.0)
    assert chord == pytest.approx(-model.trailing_pivot / (2.0 * RADIUS), rel=1e-3)
    assert first == pytest.approx(1.28 / RADIUS, rel=1e-3)
    assert second == pytest.approx(-behind / RADIUS, rel=1e-3)
    short = yaws(replace(model, trailing_pivot=4.0), 250.0)[0]
    assert short == pytest.approx(-4.0 / (2.0 * RADIUS), rel=1e-3)
    assert yaws(replace(model, chord_yaw=None), 250.0)[0] == 0.0
