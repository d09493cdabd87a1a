"""Programs of lanes: the right-hand side and the observer of `railsim.dynamics`, run on symbols."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from railsim.contact.wheel import WheelForces, WheelState, both, cell_of, upward
from railsim.dynamics.channels import WHEEL
from railsim.dynamics.kernel import derivatives, knot
from railsim.dynamics.observe import observe
from railsim.dynamics.plant import Plant
from railsim.dynamics.wheels import evaluate, put, resultant_in_lane, wheel_row, wheel_state
from railsim.dynamics.workspace import NO_WHEELS, workspace
from railsim.lanes.opened import Opened
from railsim.lanes.structure import Cell, SymbolicPlant
from railsim.lanes.symbols import Graph, Symbol
from railsim.track.kernel import locate


@dataclass
class Program:
    """What is computed: results by the name of the row that takes them, and the exchanges between.

    Attributes
    ----------
    graph : all operations. results : name of a row -> symbol or number.
    places : cell of each look-up in the track's tables, and the level at which it is known. numbers : the same of
    numbers of the plant's other tables.
    wheels_level : that at which the states of all wheels are known, where the program asks for contacts.
    """

    graph: Graph = field(default_factory=Graph)
    results: dict[tuple[Any, ...], Any] = field(default_factory=dict)
    places: list[tuple[Any, int]] = field(default_factory=list)
    wheels_level: int = -1
    numbers: list[tuple[Any, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._cells: dict[int, tuple[Cell, Any]] = {}
        self._numbers: dict[Any, Symbol] = {}

    def __getitem__(self, index: Any) -> Symbol:
        """A number of the plant's tables: it is looked up between two loops."""
        key = (index.place if isinstance(index, Symbol) else -1 - int(index),)
        if key not in self._numbers:
            level = index.level if isinstance(index, Symbol) else 0
            self._numbers[key] = self.graph.leaf("number", len(self.numbers), level=level + 1)
            self.numbers.append((index, level))
        return self._numbers[key]

    def locate(self, s0: Any, ds: Any, cells: Any, s: Symbol) -> tuple[Cell, Any]:
        """`track.kernel.locate`: the cell is looked up between two loops."""
        if s.place not in self._cells:
            cells = self.graph.leaf("core", "cells", 0)
            position = self.graph.call("min", self.graph.call("max", s - s0, 0.0), cells * ds)
            cell = self.graph.call("min", self.graph.call("math.floor", position / ds), cells - 1.0)
            number = len(self.places)
            self.places.append((cell, s.level))
            self._cells[s.place] = Cell(number, s.level), position - cell * ds
        return self._cells[s.place]

    def knot(self, knots: Any, t: Symbol) -> tuple[str, str, Any, Any]:
        """`dynamics.kernel.knot`: the knots around t are looked up before the first loop."""
        inverse = self.graph.leaf("knot", "inverse", 0)
        return "low", "high", (t - knots["low", 0]) * inverse, inverse


def _row(graph: Graph, name: str, size: int) -> np.ndarray:
    """(size,) leaves of so many rows."""
    leaves = np.empty(size, dtype=object)
    leaves[:] = [graph.leaf(name, i) for i in range(size)]
    return leaves


def _scratch(plant: Plant) -> np.ndarray:
    return workspace(int(plant.core.joints)).astype(object)


def derivative_program(plant: Plant, size: int) -> Program:
    """dx/dt of states with `size` numbers: rows ("rate", i).

    Raises
    ------
    Untraceable : the kernels do something that lanes cannot.
    """
    program = Program()
    graph = program.graph
    symbolic = SymbolicPlant(graph, plant, program)
    placed: dict[int, int] = {}

    def take(plant: Any, i: int, side: int, k: int, s: Any, velocity: Any, spin: Any, angle: Any, local: Any, v: Any):
        placed[k] = 2 * i + side
        states[2 * i + side] = opened(wheel_state)(plant, i, side, s, velocity, spin, angle, local)

    def settle(law: Any, v: Any) -> None:
        """Nothing: all wheels are settled between two loops."""

    def resultant(plant: Any, v: Any, k: int) -> WheelForces:
        first = _forces(graph, placed[k], _SETTLED)
        return opened(both)(first, _second(opened, graph, placed[k] + count, _SETTLED)) if two else first

    states: dict[int, WheelState] = {}
    count, two = 2 * len(plant.core.radius), len(plant.core.contact_stiffness) > 2
    opened = Opened(
        graph, {locate: program.locate, knot: program.knot, put: take, evaluate: settle, resultant_in_lane: resultant}
    )
    out = np.empty(size, dtype=object)
    opened(derivatives)(symbolic, graph.leaf("time"), _row(graph, "state", size), out, _scratch(plant), NO_WHEELS)
    program.results = {("rate", i): value for i, value in enumerate(out)}
    for j, state in [*states.items(), *((j + count, state) for j, state in states.items() if two)]:
        program.results |= {("wheel", j, field): value for field, value in zip(state._fields, state, strict=True)}
        shift = state.y + graph.leaf("wheel", j, "radius_0") * state.roll - state.rail_y
        start, per_metre = (graph.leaf("wheel", j, name) for name in ("start", "per_metre"))
        cell, x = opened(cell_of)(start, per_metre, plant.contact.shape[1] - 1.0, shift)
        program.results |= {
            ("wheel", j, f"first_{name}"): v for name, v in (("cell", cell), ("x", x), ("shift", shift))
        }
    known = (value.level for name, value in program.results.items() if name[0] == "wheel" and isinstance(value, Symbol))
    program.wheels_level = max(known)
    return program


def observer_program(plant: Plant, size: int, channels: int) -> Program:
    """A row of truth, from rows of state, rates and wheels: rows ("channel", i)."""
    program = Program()
    graph = program.graph
    opened = Opened(graph, {locate: program.locate})
    count = 2 * len(plant.core.radius)
    two = len(plant.core.contact_stiffness) > 2
    kept = np.empty((count, len(WHEEL) * (2 if two else 1)), dtype=object)
    for j in range(count):
        opened(wheel_row)(_forces(graph, j, 0), kept[j])
        if two:
            opened(wheel_row)(_second(opened, graph, j + count, 0), kept[j, len(WHEEL) :])
    row = np.empty(channels, dtype=object)
    rows = (_row(graph, name, size) for name in ("state", "rate"))
    opened(observe)(SymbolicPlant(graph, plant, program), graph.leaf("time"), *rows, kept, _scratch(plant), row)
    program.results = {("channel", i): value for i, value in enumerate(row)}
    return program


_SETTLED = 9
"""Level of the wheels' forces: behind everything that their states need."""


def _second(opened: Opened, graph: Graph, wheel: int, level: int) -> WheelForces:
    """Forces of a second contact, as `contact.wheel.second_forces` gives them."""
    forces = _forces(graph, wheel, level)
    y, arm, aside = (graph.leaf("wheel", wheel, name, level=level) for name in ("y", "arm", "sigma"))
    return forces._replace(shift=y + arm + aside, beside=opened(upward)(forces))


def _forces(graph: Graph, wheel: int, level: int) -> WheelForces:
    leaves: list[Any] = [graph.leaf("wheel", wheel, f"out_{name}", level=level) for name in WheelForces._fields[:-1]]
    return WheelForces._make([*leaves, 0.0])
