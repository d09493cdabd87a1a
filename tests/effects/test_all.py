"""What holds for every effect on one vehicle: it is described, shows at its smallest size, both engines feel the same,
and a sensor's changes nothing at its absent values (of all others `test_vehicles`).
"""

import re

import numpy as np
import pytest

from railsim.effects.interface import EFFECTS
from railsim.scenario import Scenario
from railsim.simulation import measure, simulate
from railsim.truth import Truth
from tests.effects.rig import largest_difference, rows, scenario
from tests.engines.rig import Rows, ratio

BY_NAME = EFFECTS.classes()
MOTION = [f"{body}.{q}" for body in ("wheelset1", "wheelset2", "bogie") for q in ("y [m]", "z [m]", "yaw [rad]")]


@pytest.fixture(scope="module")
def without() -> Rows:
    return rows([])


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Truth:
    return simulate(scenario([]), "compiled", tmp_path_factory.mktemp("run") / "truth")


@pytest.mark.parametrize("name", list(BY_NAME))
def test_parameters_are_within_their_bounds(name: str):
    kind = BY_NAME[name]
    fields = {n: one for n, one in kind.parameters().items() if n not in kind.held()}
    assert fields, "give at least one number both bounds"
    for one in fields.values():
        assert one.low <= one.default <= one.high
    assert kind.at_smallest() != kind.at_absent()


@pytest.mark.parametrize("name", list(BY_NAME))
def test_rebuilt_from_its_settings(name: str):
    effect = BY_NAME[name].build({})
    again = scenario([effect.settings()]).effects[0]
    assert again == effect
    assert re.fullmatch(r"[a-z_]+", effect.kind)


@pytest.mark.parametrize("name", [name for name, kind in BY_NAME.items() if kind.acts_on == "sensor"])
def test_changes_no_channel_at_its_absent_values(name: str, truth: Truth):
    assert not _measured_differently(scenario([BY_NAME[name].at_absent().settings()]), truth)


@pytest.mark.parametrize("name", list(BY_NAME))
def test_shows_at_its_smallest_size(name: str, without: Rows, truth: Truth):
    there = scenario([BY_NAME[name].at_smallest().settings()])
    if there.effects[0].acts_on == "sensor":
        assert _measured_differently(there, truth)
    else:
        assert largest_difference(rows(there.effects), without) > 1e-4


@pytest.mark.parametrize("name", [name for name, kind in BY_NAME.items() if kind.acts_on != "sensor"])
def test_both_engines_feel_the_same(name: str):
    effect = BY_NAME[name].build({})
    fast, reference = (rows([effect], engine) for engine in ("compiled", "exudyn"))
    for channel in MOTION:
        assert ratio(reference[channel], fast[channel]) < 5e-3, channel


def _measured_differently(one: Scenario, truth: Truth) -> list[str]:
    """Channels that are not what they are without effects."""
    with_it, without = (measure(truth, s).measurements for s in (one, scenario([])))
    assert with_it.channels == without.channels
    return [c for c in without.channels if np.abs(with_it[c] - without[c]).max() > 1e-9 * np.abs(without[c]).max()]
