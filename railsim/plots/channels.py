"""Pictures of channels over time or distance: what sensors measured, or what really happened."""

import difflib
import fnmatch
import math
import re
import textwrap
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from railsim.errors import InputError
from railsim.plots.style import COLOURS, MOST_LINES, MOST_PANELS, SHOWN, Picture, frame, legend, thin

UNITS = SHOWN | {
    "rad/s": ("°/s", math.degrees(1.0)),
    "rad": ("mrad", 1e3),
    "N": ("kN", 1e-3),
    "N m": ("kN m", 1e-3),
    "m/s2": ("m/s²", 1.0),
}
"""Units of these pictures, and the factor to them."""
SMALL = {"m": 1.0, "rad": 1.0, "rad/s": 10.0}
"""Only values below these, in SI units, take such a unit: positions stay in m, turning wheels in rad/s."""
USUAL_TRUTH = (
    "speed",
    "track1.*_vertical",
    "wheelset*.y",
    "bogie.specific_force_*",
    "bogie.angular_velocity_*",
)
"""Channels of the truth that are drawn when none are named."""
NAMED = 5
"""Channels that are named where they are not drawn."""
_AXIS = re.compile(r"^(left|right)_|(_(x|y|z|roll|pitch|yaw|left|right|east|north|up)|\d+)+$")
_WHICH = re.compile(r"\d+(_left|_right)?$")

Line = Callable[[str], tuple[np.ndarray, np.ndarray]]
"""Places and values of a channel, both of shape (n,), in SI units."""


class Group(NamedTuple):
    """Channels that share a panel, what they are, and their unit."""

    words: str
    unit: str
    names: tuple[str, ...]


def chosen(names: Sequence[str], wanted: Iterable[str]) -> list[str]:
    """Those of `names` that are wanted, in their order: full names, or patterns such as "bogie.*" without a unit.

    Raises
    ------
    InputError : something that is wanted fits no channel; the line names similar ones.
    """
    found: set[str] = set()
    for pattern in wanted:
        fitting = {name for name in names if name == pattern or fnmatch.fnmatchcase(_bare(name), pattern)}
        if not fitting:
            bare = [_bare(name) for name in names]
            similar = ", ".join(difflib.get_close_matches(_bare(pattern), bare, 3, 0.5)) or ", ".join(bare[:5])
            raise InputError(f"no channel fits '{pattern}'; there are, for example: {similar}")
        found |= fitting
    return [name for name in names if name in found]


def usual(names: Sequence[str]) -> list[str]:
    """Channels of the truth that are drawn when none are named; all where it has none of these."""
    few = [name for name in names if any(fnmatch.fnmatchcase(_bare(name), one) for one in USUAL_TRUTH)]
    return few or list(names)


def groups(names: Iterable[str]) -> list[Group]:
    """Channels by kind of sensor, quantity and unit, a few in each panel."""
    found: dict[tuple[str, str], list[str]] = {}
    for name in names:
        sensor, _, quantity = _bare(name).rpartition(".")
        words = f"{_WHICH.sub('', sensor)} {_AXIS.sub('', quantity) or quantity}".replace("_", " ").strip()
        found.setdefault((words, _unit(name)), []).append(name)
    return [Group(words, unit, tuple(part)) for (words, unit), together in found.items() for part in _parts(together)]


def channels_picture(title: str, names: Sequence[str], line: Line, along: str) -> Picture:
    """Panels of channels over the axis `along`; what does not fit is named in the title."""
    panels = groups(names)
    left_out = [_bare(name) for panel in panels[MOST_PANELS:] for name in panel.names]
    if left_out:
        more = f" and {len(left_out) - NAMED} more" if len(left_out) > NAMED else ""
        told = f"not drawn: {', '.join(left_out[:NAMED])}{more}; name them to see them"
        title = "\n".join([title, *textwrap.wrap(told, 100)])
    shown = panels[:MOST_PANELS]
    figure, axes = frame((1.5,) * max(1, len(shown)), title)
    for panel, place in zip(shown, axes[:, 0], strict=False):
        lines = [line(name) for name in panel.names]
        unit, factor = _unit_shown(panel.unit, [values for _, values in lines])
        for (x, values), label, colour in zip(lines, labels(panel.names), COLOURS, strict=False):
            place.plot(*thin(x, factor * values), color=colour, lw=0.9, label=label)
        place.set_ylabel("\n".join([*textwrap.wrap(panel.words, 18), f"[{unit}]"]), fontsize=8)
        legend(place)
    axes[-1, 0].set_xlabel("distance [m]" if along == "s [m]" else along)
    return figure


def labels(names: Sequence[str]) -> list[str]:
    """Names of lines in one panel: without what all of them share, the sensor or the quantity."""
    parts = [_bare(name).rpartition(".") for name in names]
    for kept, shared in ((0, 2), (2, 0)):
        if len(names) > 1 and len({part[shared] for part in parts}) == 1 and all(part[kept] for part in parts):
            return [part[kept] for part in parts]
    return [_bare(name) for name in names]


def rows_between(time: np.ndarray, begin: float | None, end: float | None) -> slice:
    """Rows of `time` (s, shape (n,)) from `begin` on and before `end`; None is the record's own end."""
    first = 0 if begin is None else int(np.searchsorted(time, begin))
    last = len(time) if end is None else int(np.searchsorted(time, end))
    return slice(first, last)


def _unit_shown(unit: str, all_values: Sequence[np.ndarray]) -> tuple[str, float]:
    """Unit of a panel and the factor to it."""
    known = [np.abs(values[np.isfinite(values)]) for values in all_values]
    largest = max((float(one.max()) for one in known if one.size), default=0.0)
    return UNITS[unit] if unit in UNITS and largest < SMALL.get(unit, math.inf) else (unit, 1.0)


def _parts(names: list[str]) -> list[list[str]]:
    return [names[first : first + MOST_LINES] for first in range(0, len(names), MOST_LINES)]


def _bare(name: str) -> str:
    """A channel's name without its unit."""
    return name.partition(" [")[0]


def _unit(name: str) -> str:
    return name.partition(" [")[2].removesuffix("]")
