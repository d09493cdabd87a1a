"""Source of a set of lanes: each loop over the lanes reads and writes one array at offsets that stand in the text.

So the compiler knows that no lane touches another one's numbers, and computes as many at once as its registers hold. A
look-up in a table would keep it from that: coefficients are copied into rows when a lane comes into another cell.
"""

import hashlib
from collections.abc import Iterable
from typing import Any

from railsim.dynamics.plant import POSE_CHANNELS, Plant
from railsim.lanes.layout import Layout
from railsim.lanes.memory import CELLS, KNOT_COUNT, KNOTS, POSE, TABLES, TRACK
from railsim.lanes.program import Program, derivative_program, observer_program
from railsim.lanes.symbols import BINARY, COMPARISONS, Symbol
from railsim.lanes.wheel_source import WHEEL_ROWS, wheel_text
from railsim.track.kernel import CHANNELS

WHEEL = '''"""A wheel of each of {lanes} lanes: made by railsim.lanes for the kernels of railsim.contact."""

import math

from railsim.compiled import kernel
from railsim.contact.polach import friction_coefficient, polach_force
from railsim.contact.wheel import (
    ContactPoint, Gap, WheelState, cell_of, creep_force, creepages, gap, nearer, normal_contact, resultant,
)
from railsim.lanes.memory import number_at

'''

HEADER = '''"""{lanes} lanes: made by railsim.lanes from the kernels of railsim.dynamics."""

import math

from railsim.compiled import kernel
from railsim.contact.elementary import any_arc_tangent, cosine, cube_root, hyperbolic_tangent, sine
from railsim.lanes.memory import copied, number_at
from railsim.lanes.straight import straight
from {wheel} import wheel

cubic = copied({lanes}, 4)

'''

MARCH = '''
@kernel
def march(W, A, starts, rows, substeps, rate, out):
    """Fill out (rows, channels x lanes); lane k begins with row starts[k] of its run. States are advanced."""
    h = 1.0 / (rate * substeps)
    for i in range({states}):
        W[{state} + i] = W[{origin} + i]
    for row in range(rows):
        for j in range(substeps):
            for i in range({states}):
                W[{total} + i] = 0.0
            for stage in range(4):
                ahead = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
                clock(W, A, starts, row, rate, j * h, ahead)
                derivative(W, A)
                if stage == 0 and j == 0:
                    observer(W, A)
                    for i in range({observed}):
                        out[row, i] = W[{channel} + i]
                weight = 1.0 if stage == 0 or stage == 3 else 2.0
                after = h if stage == 2 else 0.5 * h
                if stage < 3:
                    for i in range({states}):
                        W[{total} + i] += weight * W[{rate} + i]
                        W[{state} + i] = W[{origin} + i] + after * W[{rate} + i]
                else:
                    for i in range({states}):
                        new = W[{origin} + i] + h / 6.0 * (W[{total} + i] + W[{rate} + i])
                        W[{origin} + i] = new
                        W[{state} + i] = new


@kernel
def clock(W, A, starts, row, rate, since, ahead):
    """Time of each lane, and the knots around it where it passes one."""
    for k in range({lanes}):
        t = (starts[k] + row) / rate + since + ahead
        W[{time} + k] = t
        if t >= W[{begin} + k] and t < W[{end} + k]:
            continue
        last, i = A[k, {KNOT_COUNT}] - 1, 0
        while i < last - 1 and t >= number_at(A[k, {KNOTS}], (i + 1) * {columns}):
            i += 1
        j = i + 1
        if t >= number_at(A[k, {KNOTS}], last * {columns}):
            i = j = last
        begin, end = number_at(A[k, {KNOTS}], i * {columns}), number_at(A[k, {KNOTS}], j * {columns})
        W[{begin} + k] = begin if i > 0 else -math.inf
        W[{end} + k] = end if j > i else math.inf
        W[{inverse} + k] = 1.0 / (end - begin) if j > i else 0.0
{copies}
'''


def module_name(text: str) -> str:
    """Name of the module of a source."""
    return f"lanes_{hashlib.sha256(text.encode()).hexdigest()[:16]}"


class Source:
    """Text and layout of the lanes for runs with the structure of one plant.

    Attributes
    ----------
    wheel : source of a module with the contact of one wheel, the same for many structures. text : of one with `march`,
    which imports that one by its `module_name`. layout : rows of its array. wheels : first row of each wheel's block.
    """

    def __init__(self, plant: Plant, size: int, channels: int, lanes: int) -> None:
        self.lanes = lanes
        layout = self.layout = Layout(lanes)
        for name in ("origin", "state", "rate", "total"):
            layout.block(*((name, i) for i in range(size)))
        layout.block(*(("channel", i) for i in range(channels)))
        count = len(plant.core.radius) * len(plant.core.contact_stiffness)  # second contacts behind the first ones
        self.wheels = [layout.block(*(("wheel", j, name) for name in WHEEL_ROWS)) for j in range(count)]
        programs = {
            "derivative": derivative_program(plant, size),
            "observer": observer_program(plant, size, channels),
        }
        self.looked_up = {name: len(program.places) + len(program.numbers) for name, program in programs.items()}
        self._sides = 2 * len(plant.core.radius)
        self.wheel = "\n".join([WHEEL.format(lanes=lanes), wheel_text(plant, lanes)])
        parts = [HEADER.format(lanes=lanes, wheel=module_name(self.wheel))]
        parts += [self._function(name, program) for name, program in programs.items()]
        parts.append(self._march(plant, size, channels))
        self.text = "\n".join(parts)

    def _march(self, plant: Plant, size: int, channels: int) -> str:
        lanes, row = self.lanes, self.layout.row
        columns = plant.knots.shape[1]
        places = {name: row((name, 0)) * lanes for name in ("origin", "state", "rate", "total", "channel")}
        places |= {name: row(name) * lanes for name in ("time", "begin", "end")}
        copies = [
            f"        W[{row(('knot', which, column)) * lanes} + k] = "
            f"number_at(A[k, {KNOTS}], {at} * {columns} + {column})"
            for which, at in (("low", "i"), ("high", "j"))
            for column in range(columns)
            if ("knot", which, column) in self.layout.rows
        ]
        return MARCH.format(
            **places, inverse=row(("knot", "inverse", 0)) * lanes, states=size * lanes, observed=channels * lanes,
            lanes=lanes, columns=columns, KNOTS=KNOTS, KNOT_COUNT=KNOT_COUNT, copies="\n".join(copies),
        )  # fmt: skip

    def _function(self, name: str, program: Program) -> str:
        """Loops of a program, and what comes between them."""
        wanted = _Wanted(name, program, self.layout)
        loops: list[str] = []
        lines = ["@kernel", f"def {name}(W, A):"]
        for level in range(wanted.levels):
            if loop := wanted.loop(level):
                loops += [f'{name}_{level} = straight({self.lanes}, """', *loop, '""", globals())', ""]
                lines.append(f"    {name}_{level}(W)")
            lines += wanted.look_ups(level)
            if level == program.wheels_level:
                first, rows = self.wheels[0] * self.lanes, len(WHEEL_ROWS) * self.lanes
                lines += [
                    f"    for j in range({len(self.wheels)}):",
                    f"        at = {first} + j * {rows}",
                    f"        wheel(W[at : at + {rows}], A, j % 2, j % 2 + 2 * (j // {self._sides}))",
                ]
        return "\n".join([*loops, "", *lines, "", ""])


class _Wanted:
    """The operations of a program that something needs, loop by loop."""

    def __init__(self, name: str, program: Program, layout: Layout) -> None:
        self._name, self._program, self._layout = name, program, layout
        self._stores: dict[Any, Any] = dict(program.results)
        self._looked_up = [*program.places, *program.numbers]
        for m, (index, _) in enumerate(self._looked_up):
            self._stores[(name, "found", m)] = index
        self._live = self._needed(self._stores.values())
        self.levels = 1 + max(node.level for node in self._live)
        self._later = {
            operand
            for node in self._live
            for operand in node.operands
            if isinstance(operand, Symbol) and operand.level < node.level and operand.kind != "leaf"
        }
        self._columns: dict[int, set[tuple[str, int]]] = {}
        for node in self._live:
            if node.kind == "leaf" and node.operands[0] == "cell":
                _, number, table, channel, _ = node.operands
                self._columns.setdefault(number, set()).add((table, channel))

    @staticmethod
    def _needed(values: Iterable[Any]) -> set[Symbol]:
        live: set[Symbol] = set()
        ahead = [value for value in values if isinstance(value, Symbol)]
        while ahead:
            node = ahead.pop()
            if node not in live:
                live.add(node)
                if node.kind != "leaf":
                    ahead += [o for o in node.operands if isinstance(o, Symbol)]
        return live

    def _at(self, node: Symbol) -> str:
        """Where a leaf, or what an earlier loop computed, stands."""
        if node.kind != "leaf":
            return self._layout.text((self._name, "later", node.place))
        name = node.operands
        if name[0] in ("cell", "number"):
            return self._layout.text((self._name, *name))
        return self._layout.text("time" if name == ("time",) else name)

    def loop(self, level: int) -> list[str]:
        """Lines for each lane k that compute what is known at a level."""
        lines: list[str] = []
        loaded: set[Symbol] = set()

        def text(operand: Any) -> str:
            if not isinstance(operand, Symbol):
                return repr(float(operand))
            if (operand.kind == "leaf" or operand.level < level) and operand not in loaded:
                loaded.add(operand)
                lines.append(f"v{operand.place} = {self._at(operand)}")
            return f"v{operand.place}"

        for node in sorted((n for n in self._live if n.level == level and n.kind != "leaf"), key=lambda n: n.place):
            operands = [text(operand) for operand in node.operands]
            lines.append(f"v{node.place} = {_operation(node.kind, operands)}")
        stores = []
        for name, value in self._stores.items():
            if (value.level if isinstance(value, Symbol) else 0) == level:
                stores.append(f"{self._layout.text(name)} = {text(value)}")
        for node in sorted(self._later, key=lambda n: n.place):
            if node.level == level:
                stores.append(f"{self._layout.text((self._name, 'later', node.place))} = v{node.place}")
        return lines + stores if stores else []

    def look_ups(self, level: int) -> list[str]:
        """Lines that copy numbers of tables where a lane has come into another cell."""
        lines = []
        cells = len(self._program.places)
        for m, (_, known) in enumerate(self._looked_up):
            if known != level or (m < cells and m not in self._columns):
                continue
            found, kept = (self._layout.text((self._name, what, m)) for what in ("found", "kept"))
            lines += [
                f"    for k in range({self._layout.lanes}):",
                f"        found = {found}",
                f"        if found != {kept}:",
                f"            {kept} = found",
                "            cell = int(found) if found >= 0.0 else 0",
            ]
            if m < cells:
                for table, channel in sorted(self._columns[m]):
                    lines += self._copies(m, table, channel)
            else:
                number = self._layout.text((self._name, "number", m - cells))
                lines.append(f"            {number} = number_at(A[k, {TABLES}], cell)")
        return lines

    def _copies(self, m: int, table: str, channel: int) -> list[str]:
        if table == "track":
            place, address = f"(cell * {CHANNELS} + {channel}) * 4", TRACK
        else:
            row, own = divmod(channel, POSE_CHANNELS)
            place, address = f"(({row} * A[k, {CELLS}] + cell) * {POSE_CHANNELS} + {own}) * 4", POSE
        first = self._layout.block(*((self._name, "cell", m, table, channel, i) for i in range(4))) * self._layout.lanes
        return [f"            cubic(W, {first} + k, A[k, {address}], {place})"]


def _operation(kind: str, operands: list[str]) -> str:
    if kind in BINARY or kind in COMPARISONS:
        return f"{operands[0]} {(BINARY | COMPARISONS)[kind]} {operands[1]}"
    if kind == "where":
        return f"{operands[1]} if {operands[0]} else {operands[2]}"
    return f"{kind.removeprefix('call ')}({', '.join(operands)})"
