"""What runs must share to advance together, and their plant with symbols in place of what may differ."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from railsim.contact.wheel import CREEP, LAW
from railsim.dynamics.corunning import STATED, VOIDS
from railsim.dynamics.plant import Plant
from railsim.lanes.symbols import Graph, Untraceable

# Numbers whose noughts belong to the structure: places, directions, couplings between axes. Others may be nought in
# one lane and not in the next.
SPARSE = (
    *("position", "local", "frame_offset", "sunk", "joint_arm", "direction", "element_arms", "chord_direction"),
    *("finite_arms", "finite_stiffness", "finite_damping", "implicit"),
)
WHOLE = {"law": (CREEP, LAW), "corunning": (STATED, VOIDS)}
"""Numbers that are switches or counts."""


def structure_of(plant: Plant) -> bytes:
    """What runs in one set of lanes have in common; runs with the same one may advance together."""
    core = plant.core
    parts: list[bytes] = [repr(core.dtype).encode(), repr(plant.contact.shape[1]).encode()]
    for name in core.dtype.names:
        value = np.asarray(core[name])
        if value.dtype.kind == "i" and name != "cells":
            parts.append(value.tobytes())
        elif name in SPARSE:
            parts.append((value != 0.0).tobytes())
        elif name in WHOLE:
            parts.append(value[list(_whole(name, value.size))].tobytes())
    return b"|".join(parts)


def refused(plant: Plant) -> str | None:
    """Why a plant cannot run in lanes, or None."""
    return "rails that give way, without mass" if plant.core.compliant else None


class SymbolicPlant:
    """A plant for tracing: switches and indices are those of `plant`, all else are leaves."""

    def __init__(self, graph: Graph, plant: Plant, tables: Any) -> None:
        core = plant.core
        values: dict[str, Any] = {}
        for name in core.dtype.names:
            value = np.asarray(core[name])
            if value.dtype.kind == "i":
                values[name] = value if value.ndim else int(value)
            elif value.ndim == 0:
                values[name] = graph.leaf("core", name, 0)
            else:
                values[name] = _leaves(graph, name, value)
        self.core = SimpleNamespace(**values)
        self.track = _Coefficients(graph, "track")
        self.pose = _Poses(graph)
        self.knots = _Knots(graph)
        self.contact = _Nothing("contact")
        self.tables = tables


def _leaves(graph: Graph, name: str, value: np.ndarray) -> np.ndarray:
    """(shape of value) leaves, and numbers where the structure has them."""
    leaves = np.empty(value.shape, dtype=object)
    flat, numbers = leaves.reshape(-1), value.reshape(-1)
    for i, number in enumerate(numbers):
        sparse = name in SPARSE
        if (sparse and number == 0.0) or i in _whole(name, value.size):
            flat[i] = float(number)
        else:
            flat[i] = graph.leaf("core", name, i, given=sparse)
    return leaves


def _whole(name: str, size: int) -> tuple[int, ...]:
    """Places of a field that are switches or counts."""
    return tuple(i for i in WHOLE.get(name, ()) if i < size)


class Cell:
    """A cell of the track's tables: that of place `number`."""

    def __init__(self, number: int, level: int) -> None:
        self.number, self.level = number, level


class _Coefficients:
    """Coefficients (channels, 4) in a cell of the track's tables."""

    def __init__(self, graph: Graph, table: str) -> None:
        self._graph, self._table = graph, table

    def __getitem__(self, at: tuple[Cell, int]) -> list[Any]:
        cell, channel = at
        leaf = self._graph.leaf
        return [leaf("cell", cell.number, self._table, channel, i, level=cell.level + 1) for i in range(4)]


class _Poses(_Coefficients):
    """The same of the pose tables: (rows, cells, channels, 4)."""

    def __init__(self, graph: Graph) -> None:
        super().__init__(graph, "pose")

    def __getitem__(self, at: tuple[int, Cell, int]) -> list[Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        row, cell, channel = at
        return super().__getitem__((cell, 6 * int(row) + channel))


class _Knots:
    """The speed table between the two knots around now: rows "low" and "high"."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def __getitem__(self, at: tuple[str, int]) -> Any:
        row, column = at
        return self._graph.leaf("knot", row, int(column))


class _Nothing:
    """What no lane reads."""

    def __init__(self, what: str) -> None:
        self._what = what

    def __getitem__(self, at: Any) -> Any:
        raise Untraceable(f"a look-up in '{self._what}'")
