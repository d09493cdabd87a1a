"""What a recording could show before it is made, and the sizes from which effects are named."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from experiments.discrepancy.core.model import Coordinate
from experiments.discrepancy.railway.cases import VERTICAL, nominal
from experiments.discrepancy.railway.plan import Plan, Planned, draw_plan, make_plan, smallest_named
from railsim.errors import InputError

GAIN, SPRING = "sensor_gain (channel bogie.acceleration_z)", "primary_vertical_stiffness (bogie 1)"


@pytest.fixture(scope="module")
def plan() -> Plan:
    told = nominal("home", VERTICAL[:2])
    return make_plan(told, ("sensor_gain", "weak_primary_damper", "primary_vertical_stiffness"))


def test_the_smallest_size_is_where_the_fault_is_likelier_by_the_odds():
    """Of an estimate of the size, by the densities that both hypotheses give it."""
    information, healthy, least = 400.0, 0.1, 5.0
    fault = Coordinate("size", "-", 1.0, 0.5)
    found = smallest_named(information, fault, healthy, least)
    assert found is not None

    def odds(size: float) -> float:
        noise = 1.0 / information
        as_fault = norm.logpdf(size, 1.0, np.sqrt(0.5**2 + noise))
        return float(as_fault - norm.logpdf(size, 0.0, np.sqrt(healthy**2 + noise)))

    assert odds(found) >= least > odds(0.97 * found)
    assert smallest_named(1e-6, fault, healthy, least) is None and smallest_named(0.0, fault, healthy, least) is None


def test_what_the_channels_show_has_a_size_and_what_they_do_not_is_said(plan: Plan):
    told = {one.label: one for one in plan.effects}
    assert {name.partition(" (")[0] for name in told} >= {"sensor_gain", "primary_vertical_stiffness"}
    gain, spring = told[GAIN].size, told[SPRING].size
    assert gain is not None and 1.0 < gain < 1.5
    assert spring is not None and abs(np.log(spring)) > 2.0 * 0.06  # more than two deviations of its tolerance
    assert any("bogie both" in one and "do not tell it from" in one for one in plan.unseen)  # there is one bogie


def test_another_effect_takes_something_of_it_and_never_adds(plan: Plan):
    own = np.diag(plan.apart)
    assert (plan.apart >= 0.0).all() and (plan.apart <= own[:, None] * (1.0 + 1e-9)).all()
    assert {one["effect"] for one in plan.plain()["detectable_size"]} == {one.label for one in plan.effects}


def test_pairs_that_may_be_taken_for_each_other_and_their_picture(tmp_path: Path):
    apart = np.array([[50.0, 0.5, 40.0], [0.3, 60.0, 20.0], [0.1, 0.1, 0.2]])
    plan = Plan(tuple(Planned(name, "factor", 1.0, "-") for name in "abc"), apart, ())
    assert plan.confusable() == [("b", "a", 0.3), ("a", "b", 0.5)]  # c is not seen at all
    draw_plan(plan, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 1000


def test_effects_that_no_channel_shows_are_refused_with_the_reason():
    with pytest.raises(InputError, match=r"would show none of these effects \(rail_corrugation.*; add sensors"):
        make_plan(nominal("home", VERTICAL[:1]), ("rail_corrugation",))


def test_a_scenario_without_a_sensor_that_is_compared_is_refused():
    with pytest.raises(InputError, match="can be compared"):
        make_plan(nominal("home", ({"kind": "tachometer", "name": "t", "body": "wheelset1", "rate": 64},)))
