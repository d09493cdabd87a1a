"""What every sensor must do."""

from collections.abc import Iterable
from functools import cache

import numpy as np
import pandas as pd

from experiments.conformance.interface import UNIT, Check, described, fields_with_unit_and_source
from experiments.conformance.recordings import channels_by_scenario, recording
from railsim.errors import InputError
from railsim.sensors.interface import Sensor
from railsim.truth import TIME, Truth

Kind = type[Sensor]
RATE = 64.0  # Hz


@cache
def _mounted(kind: Kind) -> tuple[Sensor, Truth]:
    """The sensor on the first body of a shipped run on which it measures something."""
    reason = ""
    for name in list(channels_by_scenario())[:3]:
        truth = recording(name, 10.0).truth
        assert truth is not None
        bodies = dict.fromkeys(["bogie", *(channel.partition(".")[0] for channel in truth.columns if "." in channel)])
        for body in bodies:
            for mounting in ({"body": body}, {}):  # some kinds are named after their place
                try:
                    sensor = kind.build({"name": body, "rate": RATE, **mounting})
                    sensor.measure(truth, np.random.default_rng(1))
                except InputError as error:
                    reason = reason or str(error)
                else:
                    return sensor, truth
    raise InputError(f"measures nothing on any body of a shipped run; the first says: {reason}")


def _measured(kind: Kind, seed: int) -> pd.DataFrame:
    sensor, truth = _mounted(kind)
    return sensor.measure(truth, np.random.default_rng(seed))


def rebuilt_from_its_settings(kind: Kind) -> Iterable[str]:
    """Its settings, as a scenario holds them, make the same sensor."""
    sensor, _ = _mounted(kind)
    given = {name: value for name, value in sensor.settings().items() if name != "kind"}
    if kind.build(given) != sensor:
        yield "is not rebuilt from its own settings"


def channels_with_units(kind: Kind) -> Iterable[str]:
    """Each channel is '<name>.<quantity> [unit]', and is what it measures."""
    sensor, _ = _mounted(kind)
    for name in sensor.channels():
        if not UNIT.fullmatch(name) or not name.startswith(f"{sensor.name}."):
            yield f"channel '{name}' is not '{sensor.name}.<quantity> [unit]'"
    columns = [str(name) for name in _measured(kind, 1).columns]
    if columns != [TIME, *sensor.channels()]:
        yield f"measures columns {columns}, not 'time [s]' and {sensor.channels()}"


def samples_at_its_rate(kind: Kind) -> Iterable[str]:
    """It measures over the whole run at its rate, finite numbers or lost samples (NaN)."""
    sensor, truth = _mounted(kind)
    table = _measured(kind, 1)
    if len(table) != len(truth.time[:: sensor.step(truth)]):
        yield f"gives {len(table)} samples for {truth.duration:g} s at {sensor.rate:g} Hz"
    if np.isinf(table.to_numpy(dtype=float)).any():
        yield "gives infinity; leave what is lost empty (NaN)"


def random_by_its_generator_alone(kind: Kind) -> Iterable[str]:
    """The same generator gives the same samples."""
    if not _measured(kind, 3).equals(_measured(kind, 3)):
        yield "gives other samples for the same generator; draw from `rng` only"


def data_sheet_hides_what_is_not_known(kind: Kind) -> Iterable[str]:
    """What a field engineer cannot know is not on the data sheet."""
    sensor, _ = _mounted(kind)
    shown = set(sensor.hidden) & set(sensor.data_sheet())
    if shown:
        yield f"data sheet tells the hidden {', '.join(sorted(shown))}"


CHECKS: tuple[Check[Kind], ...] = (
    described,
    fields_with_unit_and_source,
    rebuilt_from_its_settings,
    channels_with_units,
    samples_at_its_rate,
    random_by_its_generator_alone,
    data_sheet_hides_what_is_not_known,
)
