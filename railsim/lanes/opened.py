"""Kernels opened for symbols: the same source, run by Python on whatever it is given."""

import math
from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

from railsim import branches
from railsim.contact.elementary import cube_root
from railsim.lanes.symbols import Graph, known

ROUNDED = {"sin": "sine", "cos": "cosine", "atan": "any_arc_tangent", "tanh": "hyperbolic_tangent"}
"""Functions of `math` and those of `contact.elementary` that do the same without branches."""


class Opened:
    """Opens kernels; `replaced` gives those that are not followed, by the kernel that they stand for."""

    def __init__(self, graph: Graph, replaced: dict[Any, Callable[..., Any]]) -> None:
        own = {branches.where: graph.where, branches.vanishes: _vanishes, branches.may: _may}
        self._replaced = replaced | own | {cube_root: graph.folded("cube_root", cube_root)}
        self._functions: dict[Any, Callable[..., Any]] = {}
        plain = {name: graph.folded(own, getattr(math, name)) for name, own in ROUNDED.items()}
        plain |= {name: graph.folded(f"math.{name}", getattr(math, name)) for name in ("sqrt", "floor")}
        self._world = {
            "math": SimpleNamespace(**plain, pi=math.pi),
            **{name: graph.folded(name, function) for name, function in (("min", min), ("max", max), ("abs", abs))},
            "int": graph.folded("math.floor", int),  # of what is not negative
        }

    def __call__(self, kernel: Any) -> Callable[..., Any]:
        """The function of a kernel; everything that it calls is opened too."""
        if kernel in self._replaced:
            return self._replaced[kernel]
        if kernel not in self._functions:
            function = kernel.py_func
            world = dict(function.__globals__)
            opened = FunctionType(function.__code__, world, function.__name__, function.__defaults__)
            self._functions[kernel] = opened
            for name in function.__code__.co_names:
                if name in self._world:
                    world[name] = self._world[name]
                elif hasattr(world.get(name), "py_func"):
                    world[name] = self(world[name])
        return self._functions[kernel]


def _vanishes(value: Any) -> bool:
    """A symbol is never known to be nought."""
    return known(value) and value == 0.0


def _may(condition: Any) -> bool:
    """A symbol may always hold."""
    return bool(condition) if known(condition) else True
