"""What about.json must be like for a recording to be used: checked as a whole, before anything reads a part of it."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

import pydantic
from pydantic import BaseModel, ConfigDict, Field

from railsim.errors import InputError
from railsim.sensors.errors import SensorErrors

DEEPEST = 30
MOST_VALUES = 500_000

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class _Part(BaseModel):
    """A part of the description; what railsim does not know may stand in it too."""

    model_config = ConfigDict(extra="allow")


class SensorSheet(_Part):
    """Data sheet of a sensor: name, what it is, where it stands (m, body axes), Hz, its channels and errors."""

    name: str
    kind: str | None = None
    body: str | None = None
    position: tuple[Number, Number, Number] | None = None
    position_std: Number | tuple[Number, Number, Number] | None = None
    rate: Positive | None = None
    channels: tuple[str, ...] = ()
    errors: dict[str, Any] | None = None

    @pydantic.field_validator("errors")
    @classmethod
    def _check_errors(cls, given: dict[str, Any] | None) -> dict[str, Any] | None:
        for key, value in (given or {}).items():
            if key in SensorErrors.model_fields and value is not None:
                _check_error(key, value)
        return given


def _check_error(key: str, value: Any) -> None:
    """Raise `ValueError` where a number of a data sheet is none, or beyond what `SensorErrors` allows."""
    parts = value if isinstance(value, list | tuple) and len(value) == 3 and key.startswith("misalignment") else [value]
    least, most = SensorErrors.limits(key)
    for part in parts:
        if isinstance(part, bool) or not isinstance(part, int | float):
            raise ValueError(f"{key} is not a number")
        if (least is not None and part < least) or (most is not None and part > most):
            raise ValueError(
                f"{key} {part:g} is not {f'{least:g} or more' if part < (least or 0) else f'{most:g} or less'}"
            )


class TrackSheet(_Part):
    """What is known of the measured track's errors: numbers by name."""

    errors: dict[str, Number | str | bool | None | tuple[Number, ...]] | None = None


class VehicleSheet(_Part):
    """Nominal parameters by field name, SI units; a table or text where a field is one."""

    name: str | None = None


class Description(_Part):
    """The whole of about.json."""

    origin: str
    vehicle: VehicleSheet
    sensors: list[SensorSheet]
    track: TrackSheet | None = None
    measured: dict[str, dict[str, Any]] | None = None
    software: dict[str, str | None] | None = None
    start: str | None = None
    speed_source: str | None = None


_WANTED = {
    "origin": "a text that says where the recording comes from",
    "vehicle": "the vehicle's nominal parameters by name",
    "sensors": "one object a sensor",
}


def check_description(about: Mapping[str, Any]) -> None:
    """Raise `InputError` that names the first part of a recording's description that cannot be used."""
    _check_values(about)
    for key, what in _WANTED.items():
        if not isinstance(about.get(key), str if key == "origin" else list if key == "sensors" else dict):
            raise InputError(f'about.json: "{key}" is missing or of the wrong kind; give {what}')
    for number, sheet in enumerate(about["sensors"]):
        if not isinstance(sheet, dict) or not isinstance(sheet.get("name"), str):
            raise InputError(f'about.json: sensor {number + 1} has no "name"; give each sensor one')
    try:
        Description.model_validate(dict(about))
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        reason = first["msg"].removeprefix("Value error, ")
        raise InputError(f"about.json: {place}: {reason} (got {first['input']!r:.80}); mend it") from None


def _check_values(about: Mapping[str, Any]) -> None:
    """Finite numbers only, and neither deeper nor more than any description is."""
    ahead: list[tuple[Any, str, int]] = [(about, "", 0)]
    seen = 0
    while ahead:
        value, place, depth = ahead.pop()
        seen += 1
        if depth > DEEPEST or seen > MOST_VALUES:
            raise InputError(f"about.json{f': {place[:80]}' if place else ''}: nested or filled beyond use; shorten it")
        if isinstance(value, Mapping):
            ahead += [(one, f"{place}.{key}".lstrip("."), depth + 1) for key, one in value.items()]
        elif isinstance(value, list | tuple):
            ahead += [(one, f"{place}.{number}", depth + 1) for number, one in enumerate(value)]
        elif isinstance(value, int | float) and not _is_finite(value):
            raise InputError(f"about.json: {place} is not a finite number; leave it out or give one")


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:
        return False
