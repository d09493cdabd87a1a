"""Adhesion as a setting: presets by name, what replaces their numbers, and what is refused."""

from typing import Any

import pytest
import yaml

from railsim import InputError, load_scenario
from railsim.contact.adhesion import CONDITIONS, LOW, VERY_LOW
from railsim.contact.wheel import CREEP_LAWS
from railsim.scenario import Scenario
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.manchester import Manchester


@pytest.mark.parametrize("name", CONDITIONS)
def test_condition_brings_its_numbers_to_the_contact(name: str) -> None:
    for given in (name, {"condition": name}):
        adhesion = Manchester.build({"adhesion": given}).adhesion
        assert {key: getattr(adhesion, key) for key in CONDITIONS[name].parameters()} == CONDITIONS[name].parameters()
    law = Manchester(adhesion=Adhesion(condition=name)).model().law
    assert (law.friction, law.k_slip) == (CONDITIONS[name].friction, CONDITIONS[name].k_slip)


def test_numbers_beside_the_condition_replace_it() -> None:
    adhesion = Adhesion.build({"condition": "low", "friction": 0.08, "law": "fastsim"})
    assert (adhesion.friction, adhesion.k_adhesion, adhesion.law) == (0.08, LOW.k_adhesion, "fastsim")


def test_another_condition_brings_other_numbers_to_a_copy_and_to_stored_text() -> None:
    low = Adhesion.build({"condition": "low", "k_slip": 0.5})
    for changed in (low.but(condition="very low"), Adhesion.build(low.model_dump() | {"condition": "very low"})):
        assert (changed.friction, changed.k_slip) == (VERY_LOW.friction, 0.5)
    assert Adhesion.build(low.model_dump()) == low


@pytest.mark.parametrize(
    ("texts", "friction", "law"),
    [
        (["vehicle.adhesion=low"], 0.06, "polach"),
        (["vehicle.adhesion=very low", "vehicle.adhesion.law=fastsim"], 0.03, "fastsim"),
        (["vehicle.adhesion.law=linear"], 0.4, "linear"),
    ],
)
def test_command_line_sets_condition_and_law(texts: list[str], friction: float, law: str) -> None:
    scenario = load_scenario("smooth", texts)
    assert scenario.model.law.friction == friction
    assert CREEP_LAWS[int(scenario.model.law.law)] == law
    again = Scenario.build(yaml.safe_load(scenario.to_yaml()))
    assert again == scenario
    assert again.model.law == scenario.model.law


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("icy", r"vehicle.adhesion: unknown condition; use one of dry, wet, low, very low \(got 'icy'\)"),
        ({"condition": 3}, r"vehicle.adhesion: unknown condition; use one of dry"),
        ({"condition": ["low"]}, r"vehicle.adhesion: unknown condition; use one of dry"),
        ({"law": "coulomb"}, r"vehicle.adhesion.law: .*'polach', 'fastsim' or 'linear'"),
        ({"condition": "low", "mu": 0.1}, r"vehicle.adhesion.mu: unknown key; Adhesion knows condition, creep"),
    ],
)
def test_wrong_adhesion_is_named_in_one_line(given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        load_scenario("smooth", {"vehicle": {"name": "manchester", "adhesion": given}})
    assert "\n" not in str(caught.value)
