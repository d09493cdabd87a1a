"""What every vehicle is: a `Spec` that makes a `Model`."""

from abc import abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from railsim.model import Model
from railsim.profiles.pair import ProfilePair
from railsim.registry import Files, Kind
from railsim.spec import Spec, quantity
from railsim.speed import Constant, Profile


class Vehicle(Spec, frozen=True):
    """A vehicle or parameter set; its fields are the nominal parameters that a field engineer knows."""

    label: str = quantity("", unit="-", source="file that holds the parameters, where there is one")
    assumed: tuple[str, ...] = quantity((), unit="-", source="names of what it leaves to its base")

    derived: ClassVar[Mapping[str, tuple[str, str]]] = MappingProxyType({})
    """Unit and source of what `design` gives."""

    @property
    def kind(self) -> str:
        """Name of the module that defines the vehicle's class."""
        return type(self).__module__.rpartition(".")[2]

    @property
    def name(self) -> str:
        """Name of the file that holds the parameters, or else of the class's module."""
        return self.label or self.kind

    def settings(self) -> dict[str, Any]:
        """All fields with the name, as `lookup.build_vehicle` reads them."""
        plain = self.model_dump(mode="json")
        label, assumed = plain.pop("label"), plain.pop("assumed")
        if not label:
            return {"name": self.name, **plain}
        return {"name": label, "base": self.kind, "assumed": assumed, **plain}

    def assumptions(self) -> list[str]:
        """What the files of a vehicle and of its profiles do not say, each in a line."""
        names = ", ".join(self.assumed)
        said = [f"vehicle '{self.label}': as of '{self.kind}': {names}"] if names else []
        pair = getattr(self, "pair", None)
        return said + (pair.assumptions() if isinstance(pair, ProfilePair) else [])

    @abstractmethod
    def model(self) -> Model:
        """Bodies, elements and contacts."""

    def pulled(self, model: Model, speed: Constant | Profile, duration: float) -> Model:
        """The model as it runs for `duration` [s] where the speed is prescribed; as it is, where the vehicle is held at
        that speed.
        """
        del speed, duration
        return model

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


VEHICLES = Kind("vehicles", "railsim.vehicles", Vehicle)
PARAMETER_SETS = Files("vehicles", "railsim/vehicles", ".yaml", "vehicle")
"""Vehicles that are the change of another one."""
