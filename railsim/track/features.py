"""Discrete features of a track (joints, switches, voids, corrugation): comment lines `feature: {json}` of its file.

They are part of the truth: a scorer reads them, a track measurement (`railsim.track.survey`) does not hand them over.
"""

import dataclasses
import json
import math
from collections.abc import Iterable
from typing import Any

from railsim.errors import InputError
from railsim.track.track import Track

MARK = "feature: "
"""Beginning of a comment line that states a feature."""

SIDES = ("left", "right", "both")
_KEYS = {
    "kind": "kind",
    "s": "s [m]",
    "side": "side",
    "depth": "depth [m]",
    "angle": "angle [rad]",
    "half_length": "half_length [m]",
    "length": "length [m]",
    "wavelength": "wavelength [m]",
    "label": "label",
}


@dataclasses.dataclass(frozen=True)
class Feature:
    """One feature.

    Attributes
    ----------
    kind : "joint", "void", "corrugation", "switch toe", "switch heel", "crossing".
    s : distance of its middle (of its beginning where it has a length), m.
    side : the rail it is on: "left", "right" or "both".
    depth : of the rail's lowest point below the undisturbed rail, m; amplitude of a corrugation; mean of both rails
        where `side` is "both".
    angle : total dip angle 2 alpha of the rail, rad; of a crossing the angle between the tracks is in `label`.
    half_length : from the middle to where the dip ends, m.
    length : how far it reaches from `s` on, m.
    wavelength : m.
    label : name in a drawing.
    """

    kind: str
    s: float
    side: str = "both"
    depth: float | None = None
    angle: float | None = None
    half_length: float | None = None
    length: float | None = None
    wavelength: float | None = None
    label: str = ""

    def stated(self) -> dict[str, Any]:
        """What is known of it, by `"name [unit]"`, as JSON holds it."""
        return {_KEYS[key]: value for key, value in dataclasses.asdict(self).items() if value not in (None, "")}

    def comment(self) -> str:
        """The comment line, without the `#`."""
        return MARK + json.dumps(self.stated())


def features(track: Track) -> list[Feature]:
    """Features that the track's comments state, in the order of distance.

    Raises
    ------
    InputError : a line that begins as a feature does is not one; the message names what is wrong.
    """
    found = [parse(comment) for comment in track.comments if comment.startswith(MARK)]
    return sorted(found, key=lambda feature: feature.s)


def with_features(track: Track, stated: Iterable[Feature]) -> Track:
    """The track with the features stated in comment lines at the end of the others."""
    return Track(track.s, track.columns(), track.name, [*track.comments, *(feature.comment() for feature in stated)])


def parse(comment: str) -> Feature:
    """Feature of a comment line.

    Raises
    ------
    InputError : not JSON, or not a feature.
    """
    try:
        values = json.loads(comment.removeprefix(MARK))
    except ValueError:
        raise InputError(f"'{comment[:60]}' is not JSON; write '# {MARK}{{\"kind\": ..., \"s [m]\": ...}}'") from None
    return from_stated(values)


def from_stated(values: Any) -> Feature:
    """Feature of what `Feature.stated` gives.

    Raises
    ------
    InputError : an unknown key, a missing kind or place, or a size that is not a number.
    """
    comment = json.dumps(values)
    if not isinstance(values, dict):
        raise InputError(f"'{comment[:60]}' holds no keys; write '# {MARK}{{\"kind\": ..., \"s [m]\": ...}}'")
    names = {key: name for name, key in _KEYS.items()}
    unknown = [key for key in values if key not in names]
    if unknown:
        raise InputError(f"'{comment[:60]}': unknown key '{unknown[0]}'; a feature has {', '.join(names)}")
    fields: dict[str, Any] = {names[key]: value for key, value in values.items()}
    _check(fields, comment)
    return Feature(**fields)


def _check(fields: dict[str, Any], comment: str) -> None:
    for key in ("kind", "s"):
        if key not in fields:
            raise InputError(f"'{comment[:60]}': '{_KEYS[key]}' is missing; every feature states it")
    if fields.get("side", "both") not in SIDES:
        raise InputError(f"'{comment[:60]}': side is '{fields['side']}'; it must be {', '.join(SIDES)}")
    for key, value in fields.items():
        if key in ("kind", "side", "label"):
            right = isinstance(value, str)
        else:
            right = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not right:
            raise InputError(f"'{comment[:60]}': {_KEYS[key]} is {value!r}; give a text or a number as the key needs")
