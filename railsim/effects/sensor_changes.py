"""Faults of one measured channel."""

from collections.abc import Callable
from typing import Any, ClassVar

from railsim.effects.interface import Effect, Setup
from railsim.errors import InputError
from railsim.sensors.inertial import InertialSensor
from railsim.sensors.interface import Sensor
from railsim.spec import quantity


class ChannelEffect(Effect, frozen=True):
    """Base of faults of one channel, named as in a recording but for its unit: the real sensor is another than its data
    sheet says; random numbers of all sensors stay what they are.
    """

    channel: str = quantity(
        "bogie.acceleration_y", unit="-, channel without its unit", source="scenario", role="channel"
    )

    acts_on: ClassVar[str] = "sensor"

    def faulty(self, setup: Setup, **changes: Callable[[Any], Any]) -> Setup:
        """The setup with fields of the sensor's error model passed through functions.

        Raises
        ------
        InputError : there is no such channel, or its sensor cannot have that fault.
        """
        sensors: list[Sensor] = []
        for sensor in setup.sensors:
            own = [name.partition(" [")[0] for name in sensor.channels()]
            if self.channel not in own:
                sensors.append(sensor)
                continue
            others, faulty = _split(sensor, own.index(self.channel))
            fields = {name: change(getattr(faulty.errors, name)) for name, change in changes.items()}
            sensors += [*others, faulty.but(errors=faulty.errors.but(**fields))]
        if len(sensors) == len(setup.sensors) and all(a is b for a, b in zip(sensors, setup.sensors, strict=True)):
            known = ", ".join(name.partition(" [")[0] for sensor in setup.sensors for name in sensor.channels())
            raise InputError(f"effect '{self.kind}': no channel '{self.channel}'; there are: {known or 'none'}")
        return setup.but(sensors=tuple(sensors))


def _split(sensor: Sensor, number: int) -> tuple[list[Sensor], Sensor]:
    """The sensor's other axes, and the one of channel `number` on its own; one of another kind stays whole."""
    if not isinstance(sensor, InertialSensor) or len(sensor.axes) == 1:
        return [], sensor
    axis = sensor.axes[number]
    return [sensor.but(axes=tuple(a for a in sensor.axes if a != axis))], sensor.but(axes=(axis,))
