"""Wheels that are computed side by side have the forces that each has alone."""

import numpy as np
import pytest

from railsim.contact.wheel import CREEP, CREEP_LAWS, LAW
from railsim.dynamics.plant import build_plant
from railsim.dynamics.wheels import LANES, WHEELS, evaluate, forces_in_lane, forces_of_wheel, put
from railsim.vehicles.class175 import Class175
from tests.engines.rig import curve, make_run

SPEED, SPIN, PLACE = 20.0, 45.0, 300.0
LIFTED = 3  # lane


def coordinates(rng: np.random.Generator) -> np.ndarray:
    """(8,) y, z, roll, yaw of a wheelset in contact, and rates."""
    place = rng.uniform((-6e-3, -1.2e-3, -1e-4, -5e-3), (6e-3, -8e-4, 1e-4, 5e-3))
    return np.concatenate((place, rng.normal(0.0, (0.02, 0.01, 0.01, 0.01))))


@pytest.mark.parametrize("code", [*range(len(CREEP_LAWS)), None], ids=[*CREEP_LAWS, "no creep"])
def test_side_by_side_as_alone(code: int | None):
    run = make_run(Class175().model(), curve(600.0, 0.05), SPEED, 1.0)
    plant = build_plant(run.model, run.track, run.speed)
    plant.core.law[LAW], plant.core.law[CREEP] = code or 0, float(code is not None)
    rng = np.random.default_rng(4)
    for _ in range(50):
        lanes, local = np.zeros(WHEELS), [coordinates(rng) for _ in range(LANES)]
        local[LIFTED][1] = 0.02
        alone = []
        for k in range(LANES):
            wheel = (plant, k // 2, k % 2)
            put(*wheel, k, PLACE, SPEED, SPIN, 0.0, local[k], lanes)
            alone.append(forces_of_wheel(*wheel, PLACE, SPEED, SPIN, 0.0, local[k]))
        evaluate(plant.core.law, lanes)
        found = np.array([forces_in_lane(lanes, k) for k in range(LANES)])
        scale = np.abs(alone).max(axis=0)
        assert np.all(np.abs(found - alone) <= 1e-10 * scale + 1e-12)
        assert found[LIFTED, :6] == pytest.approx(np.zeros(6), abs=0.0)
        assert np.all(found[:LIFTED, 6] > 0.0)
