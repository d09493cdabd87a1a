"""How effects of the library are made from the values of their coordinates."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from railsim.effects.interface import Effect as Plugin

Choices = dict[str, object]


class Maker(Protocol):
    """Makes an effect."""

    def make(self, values: np.ndarray) -> Plugin:
        """With these values of its own coordinates; raises `InputError` where there is no such effect."""
        ...


@dataclass(frozen=True)
class Installed:
    """How an effect is made: its plug-in, choices that are fixed, fields that are its own coordinates."""

    plugin: type[Plugin]
    choices: Choices
    fields: tuple[str, ...]

    def make(self, values: np.ndarray) -> Plugin:
        """With these values, each within what the plug-in allows.

        Raises
        ------
        InputError : a value is not finite, or they do not fit together.
        """
        found = dict(self.choices)
        for name, value in zip(self.fields, values, strict=True):
            low, high = self.plugin.limits(name)
            found[name] = float(min(max(value, -math.inf if low is None else low), math.inf if high is None else high))
        return self.plugin.build(found)
