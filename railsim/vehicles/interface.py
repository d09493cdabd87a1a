"""What every vehicle is: a `Spec` that makes a `Model`."""

from abc import abstractmethod
from typing import Any

from railsim.model import Model
from railsim.spec import Spec


class Vehicle(Spec, frozen=True):
    """A vehicle or parameter set; its fields are the nominal parameters that a field engineer knows."""

    @abstractmethod
    def model(self) -> Model:
        """Bodies, elements and contacts."""

    def nominal(self) -> dict[str, Any]:
        """Flat parameters in SI for a recording's about.json."""
        return {key: value for key, value in self.model_dump(mode="json").items() if isinstance(value, int | float)}
