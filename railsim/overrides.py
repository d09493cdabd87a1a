"""Dotted keys: change one value deep inside plain lists and mappings."""

from typing import Any

from railsim.errors import InputError

_SHORT = {"vehicle": "name", "errors": "preset", "adhesion": "condition"}
"""Keys that may hold a bare name, and the key under which their long form holds it."""


def override(values: Any, key: str, value: Any) -> Any:
    """A copy of `values` with the value at the dotted `key` replaced; missing mappings on the way are made.

    In a list a part of the key is a place from 0, or the `name` of entries (all that have it are changed).

    Raises
    ------
    InputError : no such place in a list, or a part of the key leads into a plain value.
    """
    return _set(values, key.split("."), value, key)


def _set(values: Any, parts: list[str], value: Any, key: str) -> Any:
    part, rest = parts[0], parts[1:]
    if isinstance(values, list):
        indices = _indices(values, part, key)
        return [_inner(old, rest, part, value, key) if at in indices else old for at, old in enumerate(values)]
    if values is None:
        values = {}
    if not isinstance(values, dict):
        raise InputError(f"{key}: '{part}' leads into the value {values!r}; shorten the key")
    return {**values, part: _inner(values.get(part), rest, part, value, key)}


def _inner(old: Any, rest: list[str], part: str, value: Any, key: str) -> Any:
    if not rest:
        return value
    if isinstance(old, str) and part in _SHORT:
        old = {_SHORT[part]: old}
    return _set(old, rest, value, key)


def _indices(values: list[Any], part: str, key: str) -> list[int]:
    if part.isdigit():
        indices = [int(part)] if int(part) < len(values) else []
    else:
        indices = [at for at, one in enumerate(values) if isinstance(one, dict) and one.get("name") == part]
    if not indices:
        raise InputError(f"{key}: no entry '{part}' in a list of {len(values)}; give a place from 0 or a name")
    return indices
