"""What figures take, in seconds of processor time: as it was on this machine last, else as it was stored."""

import json
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import MappingProxyType

import numpy as np

from experiments.reporting.size import Size
from railsim.cache import cache_folder
from railsim.files import json_text, replace_file

FILE = "figure_costs.json"
_FAST = {
    "adhesion": 9.5,
    "adhesion_wheelsets": 17.4,
    "axlebox_range": 5.5,
    "conicity_blind": 59.5,
    "contact_sensors": 44.7,
    "discrepancy_sizes": 43.7,
    "fig02": 0.9,
    "fig03": 28.8,
    "fig04": 0.4,
    "fig05": 0.5,
    "fig08": 0.3,
    "fig09": 9.1,
    "fig13": 5.7,
    "fig14": 4.8,
    "fig15": 2.9,
    "fig16": 1.4,
    "fig18": 38.1,
    "fig19": 1.3,
}
STORED = MappingProxyType({Size.FULL: {}, Size.FAST: _FAST, Size.SMOKE: {}})
"""Processor time by size and figure, s, where `machine` takes `REFERENCE`; kernels were compiled before. What
is not named was not measured.
"""
REFERENCE = 0.0235
"""Processor time of `machine` where the costs were measured, s."""


def known(size: Size) -> dict[str, float]:
    """Processor time by figure, s: of the last time on this machine, else stored and scaled by this machine."""
    own = _own().get(size.value, {})
    stored = STORED[size]
    scale = machine() / REFERENCE if set(stored) - set(own) else 1.0
    return {name: scale * seconds for name, seconds in stored.items()} | own


def learn(size: Size, name: str, seconds: float) -> None:
    """Keep what a figure took, in the user's cache folder; where that cannot be written, nothing is kept."""
    own = _own()
    own.setdefault(size.value, {})[name] = seconds
    with suppress(Exception):
        replace_file(_path(), json_text(own).encode())


@cache
def machine() -> float:
    """Processor time of a fixed piece of work, s: half in Python, half in sums over arrays; the best of three."""
    return min(_work() for _ in range(3))


def _work() -> float:
    began = time.process_time()
    total = 0
    for number in range(400_000):
        total += number * number % 7
    values = np.linspace(0.0, 1.0, 100_000)
    for _ in range(40):
        values = np.sqrt(values * values + 1e-3)
    return time.process_time() - began


def _path() -> Path:
    return cache_folder().parent / FILE


def _own() -> dict[str, dict[str, float]]:
    with suppress(OSError, ValueError, AttributeError):
        found = json.loads(_path().read_text(encoding="utf-8"))
        return {
            size: {name: float(one) for name, one in costs.items() if isinstance(one, int | float)}
            for size, costs in found.items()
        }
    return {}
