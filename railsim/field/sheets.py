"""Sensors of a map: data sheets as simulated recordings have them."""

from collections.abc import Mapping, Sequence
from typing import Any

from railsim.errors import InputError
from railsim.field.tables import Notes
from railsim.sensors.inertial import InertialSensor
from railsim.sensors.interface import SENSORS, Sensor
from railsim.sensors.suite import build_sensor


def data_sheets(
    settings: Sequence[Mapping[str, Any]], rates: Mapping[str, float], notes: Notes
) -> list[dict[str, Any]]:
    """One sheet a sensor: kind, name, body, position, errors, rate and channels.

    Parameters
    ----------
    settings : as in a scenario (`kind`, `name`, `body`, `position`, `errors` ...); `channels` where the sensor's name
        does not tell them; the rate is that of the table.
    rates : sample rate in Hz by channel.
    notes : takes the channels that no sensor states.

    Raises
    ------
    InputError : unknown kind, key or channel; a sensor without a channel, or with channels of several rates.
    """
    sheets = []
    owners: dict[str, str] = {}
    for number, given in enumerate(settings):
        sheet = _sheet(dict(given), rates, f"sensors.{number}")
        for channel in sheet["channels"]:
            if channel in owners:
                raise InputError(
                    f"sensors.{number}: channel '{channel}' also belongs to sensor {owners[channel]}; give it to one"
                )
            owners[channel] = str(number)
        sheets.append(sheet)
    bare = [channel for channel in rates if channel not in owners]
    if bare:
        notes.assume(f"no sensor states {', '.join(bare)}: position and errors unknown, estimators take their defaults")
    return sheets


def _sheet(given: dict[str, Any], rates: Mapping[str, float], where: str) -> dict[str, Any]:
    stated = given.pop("channels", None)
    if stated is not None and (not isinstance(stated, list) or not all(isinstance(one, str) for one in stated)):
        raise InputError(f"{where}.channels: give a list of channels")
    unknown = [channel for channel in stated or [] if channel not in rates]
    if unknown:
        raise InputError(f"{where}: no channel '{unknown[0]}'; there are: {', '.join(rates)}")
    sensor = _sensor(given, rates, where)
    channels = stated or [channel for channel in sensor.channels() if channel in rates]
    if not channels:
        raise InputError(f"{where}: none of {', '.join(sensor.channels())} is mapped; map one, or give 'channels'")
    if len({rates[channel] for channel in channels}) > 1:
        raise InputError(f"{where}: its channels have different rates; state a sensor for each rate")
    sheet = sensor.but(rate=rates[channels[0]]).data_sheet()
    return sheet | {"channels": channels}


def _sensor(given: dict[str, Any], rates: Mapping[str, float], where: str) -> Sensor:
    """The sensor; axes that are not given are those that are mapped."""
    kind = SENSORS.classes().get(str(given.get("kind")))
    given.setdefault("rate", 1.0)
    if kind is not None and issubclass(kind, InertialSensor) and "axes" not in given:
        head = f"{given.get('name')}.{kind.quantity_name}_"
        mapped = [axis for axis in kind.axis_names if f"{head}{axis} [{kind.unit}]" in rates]
        given["axes"] = mapped or list(kind.axis_names)
    return build_sensor(given, where)
