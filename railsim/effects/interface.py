"""What an effect is: a pure change of the setup of a run, that knows its sizes, its look and its kind."""

import dataclasses
import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property, reduce
from types import MappingProxyType
from typing import Any, ClassVar, Literal, NamedTuple, Self

from railsim.errors import InputError
from railsim.model import Model
from railsim.registry import Kind
from railsim.sensors.interface import Sensor
from railsim.spec import Role, Spec, quantity
from railsim.speed import Constant, Driven, Profile, SpeedTables, Traction, speed_tables
from railsim.track.flexible import FlexibleTrack, Void
from railsim.track.track import Track
from railsim.vehicles.interface import Vehicle

PLACES = ("vehicle", "wheel", "contact", "track", "sensor", "speed", "load")
"""Where an effect can act."""

Extent = Literal["", "short", "stretch", "pulse"]
"""How something that has a place or a time lies there."""

CHOSEN = "chosen by the scenario; not known in the field"


@dataclasses.dataclass(frozen=True)
class Setup:
    """What a run really is, as against what the scenario states: effects turn one into another.

    `flexible_track`: None where rails stand still or are massless; `voids` below its sleepers. `changes` act on the
    vehicle's model in their order; `longest_step` [s] is the largest integration step that
    resolves what effects have added.
    """

    vehicle: Vehicle
    track: Track
    sensors: tuple[Sensor, ...]
    speed: Constant | Profile | Driven
    traction: tuple[Traction, ...]
    duration: float
    changes: tuple[Callable[[Model], Model], ...] = ()
    longest_step: float = math.inf
    flexible_track: FlexibleTrack | None = None
    voids: tuple[Void, ...] = ()

    def but(self, **changes: Any) -> Self:
        """A copy with some fields changed."""
        return dataclasses.replace(self, **changes)

    def modelled(self, change: Callable[[Model], Model]) -> Self:
        """A copy whose model goes through one more change."""
        return self.but(changes=(*self.changes, change))

    @cached_property
    def model(self) -> Model:
        """Bodies, elements and contacts with all changes, and what keeps a prescribed speed."""
        model = reduce(lambda model, change: change(model), self.changes, self.vehicle.model())
        if not isinstance(self.speed, Driven):
            model = self.vehicle.pulled(model, self.speed, self.duration)
        if self.flexible_track is None:
            return model
        return dataclasses.replace(model, corunning=self.flexible_track.corunning(), voids=self.voids)

    @property
    def speed_tables(self) -> SpeedTables:
        """Speed, torques and slides over time."""
        return speed_tables(self.speed, self.traction, len(self.model.wheelsets), self.duration)


class Parameter(NamedTuple):
    """A number of an effect that a fit may vary."""

    unit: str
    low: float
    high: float
    default: float
    absent: float | None  # where the effect is not there; None = this number alone does not take it away
    smallest: float | None  # value at the smallest size worth naming
    role: str = ""  # what it says other than a size, of `railsim.spec.Role`
    trials: tuple[float, ...] = ()  # values that a search tries beside the default


class Effect(Spec, frozen=True):
    """Base of every effect; its kind is the name of its module.

    A number with both bounds (`ge` or `gt`, `le` or `lt`) is one that a fit may vary between them. A field says by its
    `role` (`railsim.spec.quantity`) where it is no size: a distance along the track, a wavelength, an angle of a wheel.
    The class variables below say all else that a search for the effect must know; their defaults suit most effects.
    """

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({})
    """Field values at which it is not there: with them the motion is that of the setup without it."""
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({})
    """Field values of the smallest size worth naming; with them something that can be measured changes."""
    signature: ClassVar[str] = ""
    """In words: what it looks like."""
    advice: ClassVar[str] = ""
    """What to change in the nominal scenario where a verdict names it, as a sentence; empty: add it."""
    acts_on: ClassVar[str] = "vehicle"
    family: ClassVar[str] = ""
    """Equivalence class: effects of one family look alike to sensors on the vehicle. Empty: a class of its own."""
    extent: ClassVar[Extent] = ""
    """Of an effect with a place or a time: "short" acts within a metre or so of its place, which must be found to a
    fraction of that; "stretch" from its place on over a length; "pulse" is a load that rises and falls once."""
    named: ClassVar[bool] = True
    """Whether a verdict may name it."""
    by_registration: ClassVar[bool] = False
    """Whether the registration of recording and track finds it, so that no fit looks for it."""
    weakens: ClassVar[str] = ""
    """Damping of the vehicle that its `factor` multiplies, e.g. "secondary_lateral_damping"; empty: none."""
    references: ClassVar[tuple[str, ...]] = ()
    added: ClassVar[tuple[str, ...]] = ()
    """Fields that older records of the effect do not have."""

    @abstractmethod
    def install(self, setup: Setup) -> Setup:
        """The setup with the effect; the one given stays as it is.

        Raises
        ------
        InputError : the setup has not what the effect acts on.
        """

    @property
    def kind(self) -> str:
        """Name of the module that defines the effect."""
        return type(self).__module__.rpartition(".")[2]

    @classmethod
    def equivalence(cls) -> str:
        """The family, or the effect's own name where it has none."""
        return cls.family or cls.__module__.rpartition(".")[2]

    @classmethod
    def ordinary(cls, setup: Setup) -> Mapping[str, float]:
        """Standard deviations of its numbers about `absent` on healthy vehicles, where those have a little of it."""
        del setup
        return {}

    @classmethod
    def fields_of(cls, *roles: Role) -> list[str]:
        """Names of the fields with one of these roles."""
        return [name for name in cls.model_fields if cls.role(name) in roles]

    @classmethod
    def local(cls) -> bool:
        """Whether it has a place or a time of its own."""
        return bool(cls.fields_of("distance", "time"))

    @classmethod
    def held(cls) -> list[str]:
        """Numbers that are left as they are unless one asks for them: of a fault's growth, and angles of a wheel."""
        return cls.fields_of("onset", "ramp", "phase")

    def settings(self) -> dict[str, Any]:
        """All fields with the kind, as a scenario's `effects` holds them; without those of `added` that have their
        default.
        """
        fields = self.model_dump(mode="json")
        usual = {name for name in self.added if fields[name] == type(self).model_fields[name].default}
        return {"kind": self.kind, **{name: value for name, value in fields.items() if name not in usual}}

    @classmethod
    def at_absent(cls, **others: Any) -> Self:
        """The effect at a size where it is not there."""
        return cls.build({**others, **cls.absent})

    @classmethod
    def at_smallest(cls, **others: Any) -> Self:
        """The effect at the smallest size worth naming."""
        return cls.build({**others, **cls.smallest})

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """Numbers that a fit may vary, by field name."""
        parameters = {}
        for name, field in cls.model_fields.items():
            low, high = cls.limits(name)
            if low is None or high is None or field.annotation is not float:
                continue
            parameters[name] = Parameter(
                cls.about(name)[0],
                low,
                high,
                float(field.default),
                cls.absent.get(name),
                cls.smallest.get(name),
                cls.role(name),
                cls.trials(name),
            )
        return parameters


EFFECTS = Kind("effects", "railsim.effects", Effect)


def onset_field() -> Any:
    """Field `onset`: when a fault begins."""
    return quantity(0.0, unit="s, 0 = from the start", source=CHOSEN, role="onset", ge=0.0, le=1e5)


def ramp_field() -> Any:
    """Field `ramp`: how long a fault that begins in the run takes to grow."""
    return quantity(0.1, unit="s, from the onset to the full size", source=CHOSEN, role="ramp", gt=0.0, le=1e5)


def changed(setup: Setup, effect: Effect, **values: Callable[[Any], Any]) -> Setup:
    """The setup with fields of its vehicle passed through functions.

    Raises
    ------
    InputError : the vehicle has no such parameter.
    """
    kind = type(setup.vehicle)
    for name in values:
        if name not in kind.model_fields:
            vehicle = kind.__module__.rpartition(".")[2]
            raise InputError(f"effect '{effect.kind}': vehicle '{vehicle}' has no {name}; take another vehicle")
    fields = {name: function(getattr(setup.vehicle, name)) for name, function in values.items()}
    return setup.but(vehicle=setup.vehicle.but(**fields))
