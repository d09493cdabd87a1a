"""A vehicle on its draw gear: a mass on a spring; held where the gear is stiff; and what is refused."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from railsim.effects.interface import Setup
from railsim.errors import InputError
from railsim.scenario import load_scenario
from tests.effects.rig import WHOLE, rows, scenario
from tests.engines.rig import ratio

SOFT = 5e-6  # m/N


def effect(compliance: float) -> dict[str, object]:
    return {"kind": "draw_gear", "compliance": compliance}


def test_all_of_it_swings_on_a_soft_gear_as_one_mass_on_a_spring():
    model = scenario([effect(SOFT)]).effects[0].install(_plain()).model
    free, mass = model.free, np.array(model.mass)[model.free]
    squares, shapes = eigh(np.array(model.stiffness)[np.ix_(free, free)], np.diag(mass))
    along = [k for k, name in enumerate(model.names) if name.endswith(".x")]
    together = np.abs((mass[along] @ shapes[along]) / math.sqrt(mass[along].sum()))
    mode = int(np.argmax(together))
    total = sum(body.mass for body in model.bodies if body.name != "train")
    assert together[mode] > 0.99
    assert squares[mode] == pytest.approx(1.0 / SOFT / total, rel=0.02)


def test_its_damper_is_a_share_of_critical():
    setup = _plain()
    model = scenario([effect(1e-6)]).effects[0].install(setup).model
    gear = next(one for one in model.elements if one.name == "draw_gear")
    total = sum(body.mass for body in setup.model.bodies)
    assert gear.damping[0, 0] / (2.0 * math.sqrt(gear.stiffness[0, 0] * total)) == pytest.approx(0.7)


def test_a_stiff_gear_holds_the_body():
    held, stiff, soft = (rows(effects, **WHOLE) for effects in ([], [effect(1e-9)], [effect(1e-6)]))
    for name in ("body.z [m]", "bogie.pitch [rad]", "wheelset1.y [m]"):
        assert ratio(stiff[name], held[name]) < 0.02, name
    assert ratio(soft["bogie.pitch [rad]"], held["bogie.pitch [rad]"]) > 5.0 * ratio(
        stiff["bogie.pitch [rad]"], held["bogie.pitch [rad]"]
    )


def test_half_a_vehicle_and_one_that_coasts_are_refused():
    with pytest.raises(InputError, match="needs a whole vehicle"):
        scenario([effect(1e-6)], vehicle="class175")
    with pytest.raises(InputError, match="free along the track"):
        load_scenario("straight_erri_high", {**WHOLE, "speed": {"kind": "driven", "speed": 20.0},
                                             "effects": [effect(1e-6)]})  # fmt: skip


def _plain() -> Setup:
    one = scenario([], **WHOLE)
    return Setup(one.vehicle, one.geometry, (), one.speed, one.traction, 1.0)
