"""The settings of the benchmark: vehicles, lines, speeds and sensors as people have them (`settings.yaml`)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from railsim.scenario import Scenario, load_scenario
from railsim.settings import load_yaml

FILE = Path(__file__).with_name("settings.yaml")


@dataclass(frozen=True)
class Setting:
    """What a recording of this setting is like.

    Attributes
    ----------
    base, told : a scenario by name, and what differs from it. payload : from and to [kg]; nobody has weighed it.
    stated : whether the recording says how large the errors of its track file are.
    """

    base: str
    told: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    payload: tuple[float, float] | None = None
    stated: bool = True

    @property
    def nominal(self) -> Scenario:
        """What the inference is told of the vehicle."""
        return load_scenario(self.base, dict(self.told))


@cache
def settings() -> dict[str, Setting]:
    """All of them, by name."""
    return {name: Setting(**one) for name, one in load_yaml(FILE.read_text(encoding="utf-8"), FILE.name).items()}
