"""Damage as files have it: bytes that change, lines that go, values that are something else."""

import copy
import json
from collections.abc import Callable
from typing import Any

import numpy as np

VALUES: tuple[Any, ...] = (
    None, "", "x", "‮abc", "\x1b[31m", "a" * 5000, -1, 0, 1, 3.5, 1e308, -1e308, 1e-300, 10**30, True, False,
    [], {}, [1, 2], [[]], {"a": 1}, "nan", "1e400", "12", float("nan"), float("inf"), [None] * 3,
)  # fmt: skip
"""What a value may become."""
PIECES = (
    b"", b"\x00", b"\xff\xfe", b"\r", b"\n\n", b",,,,", b";", b"nan", b"inf", b"-1", b"1e400", b"99999999999999999999",
    b"\xe2\x80\xae", b"'", b'"', b"{", b"[" * 200, b"&a [*a]", b": ", b"\t", b"0x10", b"#", b"\x1b[2J", b"9" * 400,
)  # fmt: skip
"""What is written over or between."""


def damaged_bytes(content: bytes, rng: np.random.Generator) -> bytes:
    """One to three damages at random places."""
    for _ in range(int(rng.integers(1, 4))):
        content = _BYTES[int(rng.integers(len(_BYTES)))](content, rng)
    return content


def damaged_json(content: bytes, rng: np.random.Generator) -> bytes:
    """A JSON text with one to three values that went, moved or became something else; or with damaged bytes."""
    if rng.random() < 0.2:
        return damaged_bytes(content, rng)
    values = json.loads(content)
    for _ in range(int(rng.integers(1, 4))):
        _damage_value(values, rng)
    return json.dumps(values, indent=1, ensure_ascii=bool(rng.integers(2))).encode(errors="replace")


def flipped(content: bytes, rng: np.random.Generator) -> bytes:
    """One bit changed, as by a bad disk or memory."""
    place, bit = int(rng.integers(len(content))), int(rng.integers(8))
    return content[:place] + bytes([content[place] ^ 1 << bit]) + content[place + 1 :]


def _damage_value(values: Any, rng: np.random.Generator) -> None:
    places = [place for place in _places(values) if place]
    if not places:
        return
    place = places[int(rng.integers(len(places)))]
    holder = values
    for key in place[:-1]:
        holder = holder[key]
    kind, other = int(rng.integers(5)), copy.deepcopy(VALUES[int(rng.integers(len(VALUES)))])
    if kind == 0:
        del holder[place[-1]]
    elif kind == 1 and isinstance(holder, dict):
        holder[f"{place[-1]}x"] = holder.pop(place[-1])
    elif kind == 2 and isinstance(holder, list):
        holder.append(copy.deepcopy(holder[place[-1]]))
    else:
        holder[place[-1]] = other


def _places(values: Any, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [place]
    pairs = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    for key, value in pairs:
        found += _places(value, (*place, key))
    return found


def _span(content: bytes, rng: np.random.Generator) -> tuple[int, int]:
    first = int(rng.integers(len(content) + 1))
    return first, min(len(content), first + int(rng.integers(1, 1 + max(8, len(content) // 20))))


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: int(rng.integers(len(content) + 1))]


def _left_out(content: bytes, rng: np.random.Generator) -> bytes:
    first, last = _span(content, rng)
    return content[:first] + content[last:]


def _twice(content: bytes, rng: np.random.Generator) -> bytes:
    first, last = _span(content, rng)
    return content[:last] + content[first:]


def _over(content: bytes, rng: np.random.Generator) -> bytes:
    first, piece = int(rng.integers(len(content) + 1)), PIECES[int(rng.integers(len(PIECES)))]
    return content[:first] + piece + content[first + len(piece) :]


def _between(content: bytes, rng: np.random.Generator) -> bytes:
    first, piece = int(rng.integers(len(content) + 1)), PIECES[int(rng.integers(len(PIECES)))]
    return content[:first] + piece + content[first:]


def _a_flip(content: bytes, rng: np.random.Generator) -> bytes:
    return flipped(content, rng) if content else content


def _lines_moved(content: bytes, rng: np.random.Generator) -> bytes:
    lines = content.splitlines(keepends=True)
    if len(lines) < 2:
        return content
    one, other = (int(rng.integers(len(lines))) for _ in range(2))
    lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)


_BYTES: tuple[Callable[[bytes, np.random.Generator], bytes], ...] = (
    _cut, _left_out, _twice, _over, _between, _a_flip, _lines_moved,
)  # fmt: skip
