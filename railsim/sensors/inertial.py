"""What accelerometers and rate gyros share: up to three perpendicular axes on one mount."""

import functools
from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import pydantic

from railsim.sensors.interface import Sensor
from railsim.spec import quantity
from railsim.truth import Truth


class InertialSensor(Sensor, frozen=True):
    """A sensor of a vector by its components along its own axes, which a misalignment turns against the body's."""

    axes: tuple[str, ...] = quantity(unit="-", source="scenario", min_length=1)

    axis_names: ClassVar[tuple[str, str, str]]
    quantity_name: ClassVar[str]
    unit: ClassVar[str]

    @pydantic.field_validator("axes", mode="before")
    @classmethod
    def _known_axes(cls, value: Any) -> tuple[str, ...]:
        given = [value] if value in cls.axis_names else list(value) if isinstance(value, (str, list, tuple)) else []
        if not given or not set(given) <= set(cls.axis_names) or len(set(given)) != len(given):
            raise ValueError(f"give some of {', '.join(cls.axis_names)}, each once")
        return tuple(name for name in cls.axis_names if name in given)

    @abstractmethod
    def component(self, truth: Truth, axis: int) -> np.ndarray:
        """The true quantity along body axis 0, 1 or 2, shape (n,)."""

    def channels(self) -> list[str]:
        """One column an axis."""
        return [f"{self.name}.{self.quantity_name}_{axis} [{self.unit}]" for axis in self.axes]

    def measure(self, truth: Truth, rng: np.random.Generator) -> pd.DataFrame:
        """Turn into the sensor's axes and pass each through the error model; each axis has its own random stream."""
        step = self.step(truth)
        mounting, *streams = rng.spawn(4)
        directions = self.errors.mounting(mounting)
        instants = self.instants(truth, rng)
        component = functools.cache(lambda axis: self.component(truth, axis))  # each axis of a turned one asks for all
        columns = []
        for axis in self.axes:
            number = self.axis_names.index(axis)
            signal = np.zeros(len(truth))
            for own in np.flatnonzero(directions[:, number]):
                signal += directions[own, number] * component(int(own))
            if self.errors.cross_talk:
                signal += self.errors.cross_talk * component((number + 1) % 3)
            columns.append(self.errors.apply(signal, truth.rate, step, streams[number], instants))
        return self.table(truth, columns)
