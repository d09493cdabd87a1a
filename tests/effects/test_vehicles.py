"""Every effect on every vehicle: it acts, or is refused in one line that names it; at its absent values nothing moves
otherwise, and what it is given stays as it was.
"""

import pickle
from functools import lru_cache

import pytest

from railsim.effects.interface import EFFECTS, Effect, Setup
from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.simulation import build_run
from railsim.vehicles.interface import VEHICLES
from tests.effects.rig import SENSORS, largest_difference, rows, scenario
from tests.engines.rig import Rows

BY_NAME = VEHICLES.classes()
BOTH = [(effect, vehicle) for effect in EFFECTS.classes() for vehicle in BY_NAME]


@lru_cache
def nominal(vehicle: str) -> Scenario:
    """A short run of a vehicle with the sensors that it can carry."""
    bodies = [body.name for body in BY_NAME[vehicle].build({}).model().bodies]
    sensors = [one for one in SENSORS if one.get("body", "bogie") in bodies]
    return scenario([], vehicle=vehicle, sensors=sensors, duration=0.5)


@lru_cache
def without(vehicle: str) -> Rows:
    return rows([], vehicle=vehicle, sensors=[], duration=0.5)


def taken(effect: Effect, vehicle: str) -> bool:
    """Whether the vehicle takes the effect; fails where it neither takes it nor refuses it in one line."""
    before = nominal(vehicle)
    try:
        build_run(before.but(effects=(effect,)))
    except InputError as error:
        said = str(error)
        assert effect.kind in said and "\n" not in said, said
        return False
    return True


@pytest.mark.parametrize(("name", "vehicle"), BOTH)
def test_acts_or_is_refused_in_one_line(name: str, vehicle: str):
    kind = EFFECTS.pick(name)
    assert {taken(kind.build({}), vehicle), taken(kind.at_smallest(), vehicle)} in ({True}, {False})


@pytest.mark.parametrize(("name", "vehicle"), BOTH)
def test_changes_no_motion_at_its_absent_values(name: str, vehicle: str):
    effect = EFFECTS.pick(name).at_absent()
    if taken(effect, vehicle) and effect.acts_on != "sensor":
        there = rows([effect], vehicle=vehicle, sensors=[], duration=0.5)
        assert largest_difference(there, without(vehicle)) < 1e-9


@pytest.mark.parametrize("name", list(EFFECTS.classes()))
def test_leaves_the_setup_that_it_is_given_as_it_was(name: str):
    setup = nominal("class175").setup
    before = _state(setup)
    changed = EFFECTS.pick(name).build({}).install(setup)
    assert changed.model.bodies  # changes of the model are made when it is asked for
    assert _state(setup) == before


def _state(setup: Setup) -> tuple[object, ...]:
    return setup.vehicle, setup.track.digest(), setup.sensors, setup.speed, setup.traction, pickle.dumps(setup.model)
