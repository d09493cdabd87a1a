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
    "adhesion": 7.6,
    "adhesion_wheelsets": 25.9,
    "axlebox_range": 3.8,
    "conicity_blind": 21.2,
    "contact_sensors": 38.4,
    "fig02": 1.1,
    "fig03": 1.7,
    "fig04": 0.4,
    "fig05": 0.9,
    "fig07": 32.6,
    "fig08": 0.4,
    "fig09": 8.7,
    "fig11": 5.4,
    "fig12": 9.1,
    "fig13": 5.0,
    "fig14": 0.8,
    "fig15": 0.8,
    "fig16": 1.2,
    "fig18": 6.9,
    "fig19": 2.1,
    "half_or_whole": 6.4,
    "inspection": 116.0,
    "joints": 6.7,
    "passes": 11.9,
    "suspension_faults": 18.2,
    "suspension_identifiability": 15.2,
    "suspension_particles": 2.1,
    "track_accuracy": 53.0,
    "track_sensors": 13.9,
    "track_stiffness": 31.4,
    "validation": 24.2,
}
_FULL = {
    "fig02": 9.2,
    "fig04": 12.6,
    "fig05": 1.6,
    "fig08": 0.4,
    "fig14": 1.0,
    "fig15": 0.9,
    "fig16": 1.8,
    "fig19": 9.1,
    "suspension_particles": 61.5,
}
STORED = MappingProxyType({Size.FULL: _FULL, Size.FAST: _FAST, Size.SMOKE: {}})
"""Processor time by size and figure, s, where `machine` takes `REFERENCE`; kernels were compiled before. What
is not named was not measured.
"""
REFERENCE = 0.0221
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
