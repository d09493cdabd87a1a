"""Spec: the frozen, validated value object behind every vehicle, sensor, effect and scenario."""

import hashlib
import json
from collections.abc import Sequence
from typing import Any, Literal, Self, get_args

import pydantic

from railsim.errors import InputError, nearest

Role = Literal[
    "", "onset", "ramp", "distance", "time", "length", "duration", "spacing", "wavelength", "frequency", "period",
    "order", "phase", "channel", "wheelset", "bogie",
]  # fmt: skip
"""What a field says other than a size: when a fault begins and how long it grows; a distance along the track or a time
of the run at which something is, its length or duration, the spacing of many; length, frequency or period of a wave,
how many waves a turn of a wheel has; an angle of a wheel; a measured channel; number of a wheelset or of a bogie."""


def quantity(
    default: Any = ..., *, unit: str, source: str, role: Role = "", trials: Sequence[float] = (), **bounds: Any
) -> Any:
    """A field of a `Spec` that knows where its number comes from.

    Parameters
    ----------
    default : the value in SI units; omitted where it must be given.
    unit : SI unit, "-" for a pure number.
    source : publication or standard; "illustrative" where there is none.
    role : what it says other than a size; a search treats places, waves and angles each in its own way.
    trials : values that a search tries beside the default, where it tries several.
    bounds : pydantic bounds (`gt`, `ge`, `lt`, `le`).
    """
    about = {"unit": unit, "source": source, "role": role, "trials": [*map(float, trials)]}
    return pydantic.Field(default, json_schema_extra=about, **bounds)


class Spec(pydantic.BaseModel, frozen=True, extra="forbid"):
    """Immutable, hashable settings; unknown keys and values out of bounds are refused."""

    model_config = pydantic.ConfigDict(allow_inf_nan=False, ser_json_inf_nan="constants")

    @classmethod
    def build(cls, values: Any, where: str = "") -> Self:
        """Validate `values`; raise `InputError` with one line that names the first wrong key."""
        try:
            return cls.model_validate(values)
        except pydantic.ValidationError as error:
            raise InputError(_one_line(cls, error, where)) from None

    def but(self, **changes: Any) -> Self:
        """A copy with `changes`, validated again."""
        values = {name: getattr(self, name) for name in self.model_fields_set | set(changes)}
        return type(self).build(values | changes)

    def digest(self) -> str:
        """SHA-256 over the canonical JSON of all fields."""
        text = json.dumps([type(self).__name__, self.model_dump(mode="json")], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    @classmethod
    def about(cls, name: str) -> tuple[str, str]:
        """(unit, source) of a field."""
        extra = cls.model_fields[name].json_schema_extra
        return (str(extra["unit"]), str(extra["source"])) if isinstance(extra, dict) else ("", "")

    @classmethod
    def role(cls, name: str) -> str:
        """What a field says other than a size, empty where it is one; of `Role`."""
        extra = cls.model_fields[name].json_schema_extra
        return str(extra.get("role", "")) if isinstance(extra, dict) else ""

    @classmethod
    def trials(cls, name: str) -> tuple[float, ...]:
        """Values of a field that a search tries beside the default."""
        extra: Any = cls.model_fields[name].json_schema_extra
        return tuple(extra.get("trials", ())) if isinstance(extra, dict) else ()

    @classmethod
    def limits(cls, name: str) -> tuple[float | None, float | None]:
        """(least, most) value of a field, whether or not it may be reached; None where nothing is said."""
        metadata = cls.model_fields[name].metadata
        return _bound(metadata, ("ge", "gt")), _bound(metadata, ("le", "lt"))


def _bound(metadata: list[Any], keys: tuple[str, ...]) -> float | None:
    found = [float(getattr(entry, key)) for entry in metadata for key in keys if getattr(entry, key, None) is not None]
    return found[0] if found else None


def _one_line(cls: type[Spec], error: pydantic.ValidationError, where: str) -> str:
    first = error.errors()[0]
    key = ".".join([where] * bool(where) + [str(part) for part in first["loc"]])
    if first["type"] == "extra_forbidden":
        known = _owner(cls, first["loc"][:-1])
        names = sorted(known.model_fields)
        hint = nearest(str(first["loc"][-1]), names)
        return f"{key}: unknown key; {hint}{known.__name__} knows {', '.join(names)}"
    if first["type"] == "missing":
        return f"{key}: missing; add it"
    if isinstance(inner := first.get("ctx", {}).get("error"), InputError):
        return f"{key}.{inner}"
    reason = first["msg"].removeprefix("Value error, ")
    return f"{key or cls.__name__}: {reason} (got {first['input']!r})"


def _owner(cls: type[Spec], path: tuple[int | str, ...]) -> type[Spec]:
    """The nested Spec in which a wrong key stands, through lists, mappings and unions told apart by their `kind`."""
    choice = [cls]
    for part in path:
        field = choice[0].model_fields.get(str(part)) if len(choice) == 1 else None
        tagged = [one for one in choice if str(part) in _kinds(one)] if len(choice) > 1 else []
        choice = (_specs_in(field.annotation) if field else tagged) or choice
    return choice[0]


def _kinds(spec: type[Spec]) -> tuple[Any, ...]:
    """Values of the field `kind` by which a union tells its members apart."""
    field = spec.model_fields.get("kind")
    return get_args(field.annotation) if field else ()


def _specs_in(annotation: Any) -> list[type[Spec]]:
    """The Specs that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, Spec):
        return [annotation]
    return [spec for part in get_args(annotation) for spec in _specs_in(part)]
