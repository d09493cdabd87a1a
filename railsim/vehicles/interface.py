"""What every vehicle is: a `Spec` that makes a `Model`."""

from abc import abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from railsim.model import Model
from railsim.spec import Spec


class Vehicle(Spec, frozen=True):
    """A vehicle or parameter set; its fields are the nominal parameters that a field engineer knows."""

    derived: ClassVar[Mapping[str, tuple[str, str]]] = MappingProxyType({})
    """Unit and source of what `design` gives."""

    @abstractmethod
    def model(self) -> Model:
        """Bodies, elements and contacts."""

    def nominal(self) -> dict[str, Any]:
        """Flat parameters in SI for a recording's about.json."""
        plain = self.model_dump(mode="json").items()
        return {key: value for key, value in plain if isinstance(value, int | float)} | self.design()

    def design(self) -> dict[str, float]:
        """Design values that follow from nested fields, by the names of `derived`."""
        return {}

    @classmethod
    def about(cls, name: str) -> tuple[str, str]:
        """(unit, source) of a field, or of a design value."""
        return cls.derived[name] if name in cls.derived else super().about(name)
