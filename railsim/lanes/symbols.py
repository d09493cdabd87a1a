"""Symbols: what a kernel computes, as a graph of operations. A kernel that is called with symbols in place of numbers
leaves behind what it would do, whatever the numbers are.

Equal operations on equal operands are one node, and what is nought or one by structure is folded away. A symbol has no
truth value: a kernel that branches on one cannot be written out (`Untraceable`), one that selects (`branches.where`)
can.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

Operand = Any  # Symbol or number

BINARY = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
COMPARISONS = {"less": "<", "less_equal": "<=", "equal": "==", "not_equal": "!=", "both": "&", "either": "|"}


class Untraceable(Exception):  # noqa: N818
    """A kernel does something that cannot be written out for lanes."""


@dataclass(eq=False, frozen=True)
class Symbol:
    """A node: an operation on operands, or a leaf that stands for a number kept somewhere.

    Attributes
    ----------
    kind : operation, or "leaf". operands : of the operation; of a leaf its name, a tuple.
    level : how many exchanges with tables and contacts come before it is known.
    place : number of the node in its graph; operands have smaller ones.
    given : a leaf that is not nought by structure.
    """

    graph: "Graph"
    kind: str
    operands: tuple[Any, ...]
    level: int
    place: int
    given: bool = False

    __array_ufunc__ = None

    def __add__(self, other: Operand) -> Operand:
        return self.graph.add(self, other)

    def __radd__(self, other: Operand) -> Operand:
        return self.graph.add(other, self)

    def __sub__(self, other: Operand) -> Operand:
        return self.graph.subtract(self, other)

    def __rsub__(self, other: Operand) -> Operand:
        return self.graph.subtract(other, self)

    def __mul__(self, other: Operand) -> Operand:
        return self.graph.multiply(self, other)

    def __rmul__(self, other: Operand) -> Operand:
        return self.graph.multiply(other, self)

    def __truediv__(self, other: Operand) -> Operand:
        return self.graph.divide(self, other)

    def __rtruediv__(self, other: Operand) -> Operand:
        return self.graph.divide(other, self)

    def __pow__(self, power: int) -> Operand:
        if power != 2:
            raise Untraceable(f"a power of {power}")
        return self * self

    def __mod__(self, other: Operand) -> Operand:
        return self - other * self.graph.call("math.floor", self / other)

    def __neg__(self) -> Operand:
        return self.graph.subtract(0.0, self)

    def __abs__(self) -> Operand:
        return self.graph.call("abs", self)

    def __lt__(self, other: Operand) -> Operand:
        return self.graph.node("less", self, other)

    def __gt__(self, other: Operand) -> Operand:
        return self.graph.node("less", other, self)

    def __le__(self, other: Operand) -> Operand:
        return self.graph.node("less_equal", self, other)

    def __ge__(self, other: Operand) -> Operand:
        return self.graph.node("less_equal", other, self)

    def __eq__(self, other: object) -> Any:
        if self.given and other == 0.0:
            return False
        return self.graph.node("equal", self, other)

    def __ne__(self, other: object) -> Any:
        if self.given and other == 0.0:
            return True
        return self.graph.node("not_equal", self, other)

    def __hash__(self) -> int:
        return self.place

    def __and__(self, other: Operand) -> Operand:
        if known(other):
            return self if other else False
        return self.graph.node("both", self, other)

    __rand__ = __and__

    def __or__(self, other: Operand) -> Operand:
        if known(other):
            return True if other else self
        return self.graph.node("either", self, other)

    __ror__ = __or__

    def __bool__(self) -> bool:
        raise Untraceable(f"a branch on '{self.kind}'")


def known(value: Operand) -> bool:
    """Whether it is a number."""
    return not isinstance(value, Symbol)


@dataclass(eq=False)
class Graph:
    """All nodes, in the order in which they were made."""

    nodes: list[Symbol] = field(default_factory=list)
    _made: dict[tuple[Any, ...], Symbol] = field(default_factory=dict)

    def node(self, kind: str, *operands: Operand) -> Symbol:
        """The node of an operation on operands; of which at least one is a symbol."""
        key = (kind, *((o.place,) if isinstance(o, Symbol) else float(o) for o in operands))
        level = max(o.level for o in operands if isinstance(o, Symbol))
        return self._keep(key, kind, operands, level, False)

    def leaf(self, *name: Any, level: int = 0, given: bool = False) -> Symbol:
        """The leaf of that name."""
        return self._keep(("leaf", *name), "leaf", name, level, given)

    def _keep(self, key: tuple[Any, ...], kind: str, operands: tuple[Any, ...], level: int, given: bool) -> Symbol:
        if key not in self._made:
            self._made[key] = Symbol(self, kind, operands, level, len(self.nodes), given)
            self.nodes.append(self._made[key])
        return self._made[key]

    def add(self, a: Operand, b: Operand) -> Operand:
        """a + b."""
        if known(a) and known(b):
            return a + b
        if known(a) and a == 0.0:
            return b
        if known(b) and b == 0.0:
            return a
        return self.node("add", a, b)

    def subtract(self, a: Operand, b: Operand) -> Operand:
        """a - b."""
        if known(a) and known(b):
            return a - b
        if known(b) and b == 0.0:
            return a
        return self.node("subtract", a, b)

    def multiply(self, a: Operand, b: Operand) -> Operand:
        """a b; nought where one is nought by structure."""
        if known(b):
            a, b = b, a
        if known(a):
            if known(b):
                return a * b
            if a == 0.0:
                return 0.0
            if a == 1.0:
                return b
        return self.node("multiply", a, b)

    def divide(self, a: Operand, b: Operand) -> Operand:
        """a / b."""
        if known(a) and (known(b) or a == 0.0):
            return a / b if known(b) else 0.0
        return a if known(b) and b == 1.0 else self.node("divide", a, b)

    def call(self, function: str, *operands: Operand) -> Operand:
        """The result of a function of that name."""
        return self.node(f"call {function}", *operands)

    def where(self, condition: Any, yes: Operand, no: Operand) -> Operand:
        """`yes` or `no`, by a condition."""
        if known(condition):
            return yes if condition else no
        return self.node("where", condition, yes, no)

    def folded(self, function: str, plain: Callable[..., Any]) -> Callable[..., Operand]:
        """A function of numbers or symbols: that of numbers is `plain`, that of symbols is called by its name, two
        operands at a time.
        """

        def apply(*operands: Operand) -> Operand:
            if all(known(o) for o in operands):
                return plain(*operands)
            if len(operands) < 3:
                return self.call(function, *operands)
            return apply(apply(*operands[:2]), *operands[2:])

        return apply
