"""What a sensor is: a place on a body, a sample rate, a data sheet; truth in, measured columns out."""

from abc import abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import pydantic

from railsim.errors import InputError
from railsim.registry import Kind
from railsim.sensors.errors import SensorErrors
from railsim.spec import Spec, quantity
from railsim.truth import TIME, Truth

_MOTION = ("specific_force_", "angular_velocity_")


class Sensor(Spec, frozen=True):
    """Base of every kind of sensor; the kind is the name of the module that defines it.

    `errors` may be given as fields, as the name of a preset of the kind, or as fields that change a preset
    (`{preset: mems, bandwidth: 50}`).
    """

    name: str = quantity(unit="-", source="scenario", pattern=r"^[A-Za-z][A-Za-z0-9_]*$")
    body: str = quantity(unit="-", source="scenario")
    position: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), unit="m from the centre of gravity, body axes", source="scenario"
    )
    rate: float = quantity(unit="Hz", source="scenario", gt=0)
    errors: SensorErrors = quantity(SensorErrors(), unit="-", source="data sheet of the sensor")

    presets: ClassVar[Mapping[str, SensorErrors]] = MappingProxyType({})
    hidden: ClassVar[frozenset[str]] = frozenset()
    without: ClassVar[frozenset[str]] = frozenset()
    """Fields of `SensorErrors` that mean nothing for this kind."""

    @pydantic.field_validator("errors", mode="before")
    @classmethod
    def _known_errors(cls, value: Any) -> SensorErrors:
        if isinstance(value, str):
            value = {"preset": value}
        if isinstance(value, Mapping):
            given = dict(value)
            base = cls._preset(given.pop("preset")) if "preset" in given else SensorErrors()
            value = SensorErrors.build({name: getattr(base, name) for name in base.model_fields_set} | given)
        if not isinstance(value, SensorErrors):
            raise ValueError("give the fields of the error model or the name of a preset")
        ideal = SensorErrors()
        wrong = [name for name in sorted(cls.without) if getattr(value, name) != getattr(ideal, name)]
        if wrong:
            raise ValueError(f"'{wrong[0]}' means nothing for this kind of sensor; leave it out")
        return value

    @classmethod
    def _preset(cls, name: Any) -> SensorErrors:
        if name not in cls.presets:
            raise ValueError(f"unknown preset '{name}'; there are: {', '.join(sorted(cls.presets)) or 'none'}")
        return cls.presets[name]

    @property
    def kind(self) -> str:
        """Name of the module that defines the sensor's class."""
        return type(self).__module__.rpartition(".")[2]

    @abstractmethod
    def channels(self) -> list[str]:
        """Names of the measured columns, `"<name>.<quantity> [unit]"`."""

    @abstractmethod
    def measure(self, truth: Truth, rng: np.random.Generator) -> pd.DataFrame:
        """Measured columns at the sensor's rate: "time [s]", then `channels()`.

        Raises
        ------
        InputError : the truth lacks what is measured, or the rate does not divide the truth's.
        """

    def settings(self) -> dict[str, Any]:
        """All fields with the kind, as `suite.build_sensor` reads them."""
        return {"kind": self.kind, **self.model_dump(mode="json")}

    def data_sheet(self) -> dict[str, Any]:
        """What a field engineer knows of the sensor, for about.json; real biases and the like are not in it."""
        known = self.model_dump(mode="json", exclude=set(self.hidden) | {"errors"})
        return {"kind": self.kind, **known, "errors": self.errors.data_sheet(), "channels": self.channels()}

    def step(self, truth: Truth) -> int:
        """How many samples of the truth make one of the sensor.

        Raises
        ------
        InputError : not a whole number; the line names usable rates.
        """
        ratio = truth.rate / self.rate
        step = max(1, round(ratio))
        if abs(ratio - step) > 1e-9 * ratio:
            usable = ", ".join(f"{rate:g}" for rate in _usable(truth.rate, self.rate))
            raise InputError(
                f"sensor '{self.name}': its rate of {self.rate:g} Hz does not divide the run's {truth.rate:g} Hz; "
                f"use {usable} Hz"
            )
        return step

    def need(self, truth: Truth, channel: str) -> None:
        """Raise `InputError` where the truth has not the sensor's body, or not the `channel` that it measures."""
        bodies = sorted({name.split(".")[0] for name in truth.columns if name.partition(".")[2].startswith(_MOTION)})
        if self.body not in bodies:
            raise InputError(
                f"sensor '{self.name}': the run has no body '{self.body}'; there are: {', '.join(bodies) or 'none'}"
            )
        if channel not in truth:
            raise InputError(
                f"sensor '{self.name}': a {self.kind} on '{self.body}' measures '{channel}', which the run has not; "
                "mount it on another body"
            )

    def instants(self, truth: Truth, rng: np.random.Generator) -> np.ndarray | None:
        """When samples are taken, s after the first stamp, shape (n,); None where they are as stated."""
        if not self.errors.logger.moves_instants:
            return None
        return self.errors.logger.instants(truth.time[:: self.step(truth)].size, self.rate, rng.spawn(1)[0])

    def table(self, truth: Truth, columns: list[np.ndarray]) -> pd.DataFrame:
        """Times (s) and measured `columns` in the order and units of `channels()`, each as long as the times."""
        return pd.DataFrame({TIME: truth.time[:: self.step(truth)], **dict(zip(self.channels(), columns, strict=True))})


SENSORS = Kind("sensors", "railsim.sensors", Sensor)


def _usable(rate: float, wanted: float, count: int = 6) -> list[float]:
    """The `count` rates nearest to `wanted` (by ratio) that divide `rate`, whole numbers of Hz where `rate` is one."""
    if rate == int(rate):
        rates = [float(d) for d in range(1, int(rate) + 1) if int(rate) % d == 0]
    else:
        rates = [rate / divisor for divisor in range(1, 65)]
    return sorted(sorted(rates, key=lambda one: abs(np.log(one / wanted)))[:count])
