"""How far a rail gives way under a wheel, against the balance of forces that it solves, solved by SciPy."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from railsim.contact.wheel import CREEP, WheelOnRail, WheelState, wheel_forces
from railsim.dynamics.extras import TRACK_LOSS, rail_deflection, rail_deflection_of_two
from railsim.dynamics.plant import build_plant
from railsim.effects.track_changes import RIGID
from railsim.profiles.pair import ProfilePair
from railsim.track.kernel import build_tables
from railsim.vehicles.manchester import Manchester
from tests.effects.rig import scenario

SOFTNESS = 2e-8  # m/N
PLACE = 40.0  # m


@pytest.fixture(scope="module")
def plant() -> Any:
    """A vehicle on rails of the same compliance everywhere."""
    setup = scenario([{"kind": "soft_track", "softness": SOFTNESS, "variation": 0.0}]).setup
    return build_plant(setup.model, build_tables(setup.track), setup.speed_tables)


def _state(local: np.ndarray, height: float) -> WheelState:
    """A wheel at 30 m/s on a rail of that height [m], without friction."""
    return WheelState._make([*local, 30.0, 65.0, 0.0, 0.0, 0.0, height, 0.0, 0.0])


def _balance(plant: Any, side: int, local: np.ndarray, depth: float) -> float:
    """What presses the rail down by more than it bears [N], at rest at the height of zero."""
    core = plant.core
    law = np.array(core.law)
    law[CREEP] = 0.0  # without creep
    pressed, contact = 0.0, 0.0
    for row in range(side, len(core.contact_stiffness), 2):
        wheel = WheelOnRail(
            core.contact_start, core.contact_spacing, plant.contact[row], core.contact_stiffness[row],
            1.0 - 2.0 * side, core.radius[0],
        )  # fmt: skip
        forces = wheel_forces(wheel, law, _state(local, core.static_deflection - depth))
        contact += 1.5 * np.cbrt(forces.normal * core.contact_stiffness[row] ** 2) / (1.0 + forces.tangent**2)
        pressed += forces.force_z
    closing = -local[5] - core.unbalance[0, side, 2] * local[6]
    support = 1.0 / (SOFTNESS + RIGID)
    return pressed - support * depth - TRACK_LOSS * support * closing * contact / (contact + support)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("lift", [-1.5e-3, 0.0, 5e-4, 5e-3])
def test_rail_bears_what_presses_it(plant: Any, side: int, lift: float):
    """Under heavy and light wheels, on the tread and where the flange begins, and under a wheel that flies."""
    rng = np.random.default_rng(4)
    size = np.array([2.5e-3, 0.0, 2e-4, 3e-3, 1e-2, 1e-2, 1e-2, 1e-2])
    for _ in range(40):
        local = size * rng.standard_normal(8)
        local[1] += lift
        found = rail_deflection(plant, 0, side, PLACE, _state(local, 0.0)) + plant.core.static_deflection
        true = brentq(lambda d, at=local: _balance(plant, side, at, d), -0.02, 0.02, xtol=1e-14)
        assert abs(found - true) < 1e-8, local
        if lift == 5e-3:
            assert found == pytest.approx(0.0, abs=1e-12)


def test_rail_bears_tread_and_flange_together():
    """On the profiles S1002 and 60E1, where both contacts of a wheel press one rail."""
    given = scenario([{"kind": "soft_track", "softness": SOFTNESS, "variation": 0.0}])
    setup = given.but(vehicle=Manchester(pair=ProfilePair(kind="profiles", contacts=2))).setup
    plant = build_plant(setup.model, build_tables(setup.track), setup.speed_tables)
    second = 0
    for y in np.linspace(6.2e-3, 6.7e-3, 11):
        local = np.array([y, np.interp(y, [6.2e-3, 6.7e-3], [1e-4, 4e-4]), 1e-4, 2e-3, 1e-3, 1e-3, 0.0, 0.0])
        found = rail_deflection_of_two(plant, 0, 0, PLACE, _state(local, 0.0)) + plant.core.static_deflection
        true = brentq(lambda d, at=local: _balance(plant, 0, at, d), -0.02, 0.02, xtol=1e-14)
        assert abs(found - true) < 1e-8, local
        row = WheelOnRail(
            plant.core.contact_start, plant.core.contact_spacing, plant.contact[2], plant.core.contact_stiffness[2],
            1.0, plant.core.radius[0],
        )  # fmt: skip
        state = _state(local, plant.core.static_deflection - found)
        second += wheel_forces(row, np.array(plant.core.law), state).normal > 1e3
    assert second > 3
