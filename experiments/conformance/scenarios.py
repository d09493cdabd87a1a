"""What every scenario must do."""

from collections.abc import Iterable

from estimators.interface import ESTIMATORS
from experiments.conformance.interface import Check
from railsim.scenario import Scenario, load_scenario
from railsim.settings import load_yaml

Source = str
"""Name or path."""


def says_what_it_is(source: Source) -> Iterable[str]:
    """It loads and has a description."""
    if not load_scenario(source).description:
        yield "description: say in a line what it is for"


def rebuilt_from_its_settings(source: Source) -> Iterable[str]:
    """What a recording keeps of it makes the same scenario."""
    scenario = load_scenario(source)
    if Scenario.build(load_yaml(scenario.to_yaml(), "the scenario as text")) != scenario:
        yield "is not rebuilt from its own settings"


def serves_an_estimator(source: Source) -> Iterable[str]:
    """Some estimator has all channels that it needs."""
    channels = {channel for sensor in load_scenario(source).sensors for channel in sensor.channels()}
    if not any(set(kind.build({}).needed()) <= channels for kind in ESTIMATORS.classes().values()):
        yield "no estimator has the channels that it needs; add sensors"


CHECKS: tuple[Check[Source], ...] = (says_what_it_is, rebuilt_from_its_settings, serves_an_estimator)
