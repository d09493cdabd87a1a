"""What can be estimated from a recording: which estimators can run, what others lack, what each thing would bring."""

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from estimators.interface import ESTIMATORS, Estimator, Missing
from experiments.reporting.failures import plugin_code
from experiments.reporting.text import table
from railsim.errors import InputError
from railsim.measurements import TIME, Measurements

PAGE_WIDTH = 160
"""Characters of a line of the page of documentation."""
SPELLED = 3
"""So many parameters of the vehicle are named in the table; more stand below it."""


@dataclass(frozen=True)
class Readiness:
    """What one estimator needs and a recording does not have, and what channels that are not there would add."""

    estimator: str
    missing: Missing
    adds: dict[str, str]

    def stated(self) -> dict[str, object]:
        """In the shape of the command's JSON."""
        lacking = {
            "channels": list(self.missing.channels),
            "parameters": list(self.missing.parameters),
            "others": list(self.missing.others),
        }
        return {"estimator": self.estimator, "ready": not self.missing, "missing": lacking, "would add": self.adds}


def readiness(measured: Measurements) -> list[Readiness]:
    """Every estimator with its default settings, in the order of names.

    Raises
    ------
    PluginError : an estimator cannot say what it needs.
    """
    found = []
    for name, kind in ESTIMATORS.classes().items():
        with plugin_code(name, kind):
            estimator = kind.build({})
            adds = {channel: what for channel, what in estimator.adds.items() if channel not in measured}
            found.append(Readiness(name, _missing(estimator, measured), adds))
    return found


def _missing(estimator: Estimator, measured: Measurements) -> Missing:
    try:
        return estimator.missing(measured)
    except InputError as error:  # a part of the description is wrong, not missing
        return Missing(others=(str(error),))


def what_each_brings(found: Iterable[Readiness]) -> dict[str, list[str]]:
    """By channel or parameter that is not there: the estimators for which it is the last thing missing, and what it
    adds to those that can run without it. Most first.
    """
    brings: dict[str, list[str]] = {}
    for one in found:
        missing = one.missing
        if not missing:
            for channel, what in one.adds.items():
                brings.setdefault(channel, []).append(f"{one.estimator}: {what}")
        elif len(missing.channels) + len(missing.parameters) + len(missing.others) == 1:
            brings.setdefault((*missing.channels, *missing.parameters, *missing.others)[0], []).append(one.estimator)
    return dict(sorted(brings.items(), key=lambda item: -len(item[1])))


def readiness_text(found: Sequence[Readiness], columns: int | None = None) -> str:
    """The table for people: estimators that can run, what others lack, what one more thing would bring.

    columns : characters of a line; None = as long as it is.
    """
    notes = _Notes({})
    rows = [[one.estimator, "no" if one.missing else "yes", notes.short(one.missing)] for one in found]
    rows.sort(key=lambda row: row[1] == "no")
    lines = ["What can be estimated, with default settings:", ""]
    lines.append(table(["estimator", "ready", "missing"], rows, columns=columns))
    brings: dict[str, list[str]] = {}
    for thing, what in what_each_brings(found).items():
        brings.setdefault(_together(what), []).append(notes.of(thing) if thing in notes.numbers else thing)
    if notes.numbers:
        lines += ["", *(f"{notes.of(text)} {text}" for text in notes.numbers)]
    if brings:
        each = [[", ".join(things), what] for what, things in brings.items()]
        lines += ["", "What one thing more would bring:", "", table(["add", "brings"], each, columns=columns)]
    return "\n".join(lines)


def _together(what: Iterable[str]) -> str:
    """Estimators that could run, then those that would give more, each gain once."""
    gains: dict[str, list[str]] = {}
    for one in what:
        name, _, gain = one.partition(": ")
        gains.setdefault(gain, []).append(name)
    groups = sorted(gains.items(), key=lambda item: item[0] != "")
    return "; ".join(", ".join(names) + (f": {gain}" if gain else "") for gain, names in groups)


def needs_page() -> str:
    """What every estimator needs and what else it can make use of, in Markdown: docs/what_can_be_estimated.md."""
    bare, notes = _with_all_channels(), _Notes({})
    lines = []
    for name, kind in ESTIMATORS.classes().items():
        estimator = kind.build({})
        channels = [f"`{channel}`" for channel in estimator.needed()]
        lines += ["", f"### {name}", "", (kind.__doc__ or "").strip().partition("\n")[0], ""]
        needs = [*channels, notes.short(estimator.missing(bare))]
        lines.append(f"- needs {', '.join(filter(None, needs))}")
        more: dict[str, list[str]] = {}
        for channel, what in estimator.adds.items():
            more.setdefault(what, []).append(f"`{channel}`")
        lines += [f"- for {what}, add {', '.join(names)}" for what, names in more.items()]
    listed = ["", "### Notes", "", *(f"- {notes.of(text)} {text}" for text in notes.numbers)]
    wrap = partial(textwrap.wrap, width=PAGE_WIDTH, subsequent_indent="  ", break_long_words=False)
    return "\n".join(one for line in [*lines, *listed] for one in wrap(line) or [""]).strip()


def _with_all_channels() -> Measurements:
    """A recording with every required channel but speeds, and nothing else: no track, no parameter of the vehicle."""
    built = [kind.build({}) for kind in ESTIMATORS.classes().values()]
    names = dict.fromkeys(name for one in built for name in one.needed() if not name.endswith("speed [m/s]"))
    about = {"origin": "none", "vehicle": {}, "sensors": []}
    return Measurements(about, {1.0: {TIME: np.arange(2.0), **{name: np.zeros(2) for name in names}}})


class _Notes(NamedTuple):
    """What is too long for a table, by number."""

    numbers: dict[str, int]

    def short(self, missing: Missing) -> str:
        """What is missing; many parameters, and what is said in a sentence, as the number of a note."""
        parts = list(missing.channels)
        if len(missing.parameters) > SPELLED:
            names = f"vehicle parameters {', '.join(missing.parameters)}"
            parts.append(f"{len(missing.parameters)} vehicle parameters {self.of(names)}")
        else:
            parts += [f"vehicle.{name}" for name in missing.parameters]
        return ", ".join([*parts, *(self.of(text) for text in missing.others)])

    def of(self, text: str) -> str:
        """Mark of a note."""
        return f"({self.numbers.setdefault(text, len(self.numbers) + 1)})"
