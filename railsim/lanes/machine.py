"""Sets of lanes that can run: source written to a file, compiled once, and the array that it works on."""

import importlib.util
import os
import sys
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from railsim.compiled import kernel_folder
from railsim.contact.wheel import DAMPING, DECAY, K_ADHESION, K_SLIP, RATIO
from railsim.dynamics.plant import Plant
from railsim.lanes.layout import ALIGNED, Layout
from railsim.lanes.memory import ADDRESSES
from railsim.lanes.source import Source, module_name
from railsim.lanes.structure import structure_of
from railsim.lanes.wheel_source import CONSTANTS

LANES = 16  # two registers of eight numbers; more fall out of the caches, and are harder to fill
_ONE_AT_A_TIME = threading.Lock()  # for making machines: Python 3.11 fails where two threads parse text
LAW_PLACES = (DAMPING, RATIO, DECAY, K_ADHESION, K_SLIP)


@dataclass(frozen=True)
class Machine:
    """Compiled lanes for runs of one structure.

    Attributes
    ----------
    march : fills rows of truth and advances the states. layout : rows of the array. wheels : first row of each
    contact's block. looked_up : look-ups in tables, by program. size, channels : of a state, of a row of truth.
    """

    march: Callable[..., None]
    layout: Layout
    wheels: list[int]
    looked_up: dict[str, int]
    size: int
    channels: int

    def lanes(self) -> "Lanes":
        """A set of lanes, all empty."""
        return Lanes(self)


def machine_for(plant: Plant, size: int, channels: int, lanes: int = LANES) -> Machine:
    """The machine for plants like this one, so many lanes wide; made where this process has none.

    Raises
    ------
    Untraceable : the plant has something that lanes cannot run.
    """
    with _ONE_AT_A_TIME:
        return _machine(structure_of(plant), lanes, _Kept(plant, size, channels))


class _Kept:
    """Arguments that do not count where the structure is the same."""

    def __init__(self, *values: Any) -> None:
        self.values = values

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Kept)

    def __hash__(self) -> int:
        return 0


@lru_cache(maxsize=32)
def _machine(structure: bytes, lanes: int, kept: _Kept) -> Machine:
    del structure
    plant, size, channels = kept.values
    source = Source(plant, size, channels, lanes)
    if module_name(source.wheel) not in sys.modules:
        _load(source.wheel)
    return Machine(_load(source.text).march, source.layout, source.wheels, source.looked_up, size, channels)


def _load(text: str) -> Any:
    """A module of that source; its file stays, so that the compiled code is found again."""
    name = module_name(text)
    path = kernel_folder() / "lanes" / f"{name}.py"
    path.parent.mkdir(exist_ok=True)
    os.utime(path.parent)
    if not path.is_file():
        handle, aside = tempfile.mkstemp(dir=path.parent, suffix=".part")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(aside, path)  # whole or not at all, whoever else writes it
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where Numba looks for it when it loads compiled code
    spec.loader.exec_module(module)
    return module


class Lanes:
    """Numbers of runs that advance together. A lane that was never filled copies the first one that is.

    Attributes
    ----------
    starts : row of each lane's run that comes next.
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        layout = machine.layout
        self._array = aligned(layout.size * layout.lanes)
        self._rows = self._array.reshape(layout.size, layout.lanes)
        self._addresses = np.zeros((layout.lanes, ADDRESSES), dtype=np.int64)
        self._plants: list[Plant | None] = [None] * layout.lanes
        self.starts = np.zeros(layout.lanes, dtype=np.int64)
        self._core: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        by_field: dict[str, list[tuple[int, int]]] = {}
        for name, row in layout.rows.items():
            if isinstance(name, tuple) and name[0] == "core":
                by_field.setdefault(name[1], []).append((row, name[2]))
        for name, pairs in by_field.items():
            rows, places = zip(*pairs, strict=True)
            self._core[name] = np.array(rows), np.array(places)

    def fill(self, lane: int, plant: Plant, state: np.ndarray) -> None:
        """Let a lane begin with a run of this plant, at row 0."""
        rows, layout, machine = self._rows, self._machine.layout, self._machine
        rows[:, lane] = 0.0
        for name, (at, places) in self._core.items():
            rows[at, lane] = np.asarray(plant.core[name], dtype=float).reshape(-1)[places]
        first = layout.rows["origin", 0]
        rows[first : first + machine.size, lane] = state
        for program, count in machine.looked_up.items():
            for m in range(count):
                rows[layout.row((program, "kept", m)), lane] = -1.0
        for j in range(len(machine.wheels)):
            constants = _wheel_constants(plant, j)
            for name in CONSTANTS:
                rows[layout.rows["wheel", j, name], lane] = constants[name]
            for name in ("cell_a", "cell_b"):
                rows[layout.rows["wheel", j, name], lane] = -1.0
        rows[layout.rows["begin"], lane], rows[layout.rows["end"], lane] = np.inf, -np.inf
        tables = (plant.track, plant.contact, plant.pose, plant.knots, plant.tables)
        self._addresses[lane] = [*(t.ctypes.data for t in tables), plant.core.cells, len(plant.knots)]
        self._plants[lane] = plant  # and so its tables
        self.starts[lane] = 0

    def march(self, rows: int, substeps: int, rate: float, out: np.ndarray) -> None:
        """Fill out (rows, channels x lanes), and advance all lanes."""
        self._machine.march(self._array, self._addresses, self.starts, rows, substeps, rate, out)
        self.starts += rows


def aligned(size: int) -> np.ndarray:
    """(size,) zeros at an address that fills whole lines of the cache."""
    spare = ALIGNED // 8
    raw = np.zeros(size + spare)
    first = (-raw.ctypes.data % ALIGNED) // 8
    return raw[first : first + size]


def _wheel_constants(plant: Plant, j: int) -> dict[str, float]:
    """`CONSTANTS` of a wheel."""
    core = plant.core
    second, wheel = divmod(j, 2 * len(core.radius))
    own = {
        "start": core.contact_start,
        "per_metre": 1.0 / core.contact_spacing,
        "radius_0": core.radius[wheel // 2],
        "middle": core.middle_radius[wheel % 2],
        "steeper": core.steeper[wheel // 2],
        "stiffness": core.contact_stiffness[wheel % 2 + 2 * second],
    }
    names = ("damping", "ratio", "decay", "k_adhesion", "k_slip")
    return own | dict(zip(names, core.law[list(LAW_PLACES)], strict=True))
