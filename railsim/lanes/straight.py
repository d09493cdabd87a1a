"""Loops over the lanes whose body is straight-line arithmetic, handed to LLVM as it is.

Numba finds out the type of every line that it compiles. There are thousands of these lines, and every number in them is
a float64. So their types are not looked for here, which saves most of the time. LLVM is given the same as by Numba.
"""

import ast
import builtins
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

ARITHMETIC = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv", ast.BitAnd: "and_", ast.BitOr: "or_"}
ORDERED = {ast.Lt: "<", ast.LtE: "<=", ast.Eq: "=="}
BETTER = {"min": "<", "max": ">"}


def straight(lanes: int, text: str, names: Mapping[str, Any]) -> Any:
    """A function for compiled code. It takes an array W of float64, and runs the text for each k in range(lanes).

    text : lines `v = expression` or `W[row + k] = expression`, of names that earlier lines have set, numbers, elements
    `W[row + k]`, arithmetic, comparisons, `a if condition else b`, and calls. names : what the calls mean.
    """
    lines = ast.parse(text).body
    calls = {ast.unparse(one.func): len(one.args)
             for line in lines for one in ast.walk(line)
             if isinstance(one, ast.Call) and ast.unparse(one.func) not in BETTER}  # fmt: skip
    functions = {name: (_named(name, names), count) for name, count in calls.items()}

    def typed(typing_context: Any, array: Any) -> Any:
        kinds = {}
        for name, (function, count) in functions.items():
            kind = typing_context.resolve_value_type(function)
            kinds[name] = kind, typing_context.resolve_function_type(kind, (types.float64,) * count, {})

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            first = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            known = {name: _called(context, builder, *kind) for name, kind in kinds.items()}
            with cgutils.for_range(builder, context.get_constant(types.intp, lanes)) as loop:
                _Writer(builder, known, first, loop.index).write(lines)
            return context.get_dummy_value()

        return types.void(array), generate

    return intrinsic(typed)


def _named(name: str, names: Mapping[str, Any]) -> Any:
    """What a name with dots means; one that is not in `names` is a builtin."""
    first, *rest = name.split(".")
    return reduce(getattr, rest, names[first] if first in names else getattr(builtins, first))


def _called(context: Any, builder: Any, kind: Any, signature: Any) -> Callable[[Sequence[Any]], Any]:
    """Writes a call of a function with given values, and gives its result as a float64."""
    function = context.get_function(kind, signature)
    context.add_linking_libs(getattr(function, "libs", ()))
    return lambda values: context.cast(builder, function(builder, values), signature.return_type, types.float64)


class _Writer:
    """Writes lines down: `first` points to the array, `lane` is k."""

    def __init__(self, builder: Any, functions: Mapping[str, Callable[..., Any]], first: Any, lane: Any) -> None:
        self._builder, self._functions, self._first, self._lane = builder, functions, first, lane
        self._values: dict[str, Any] = {}

    def write(self, lines: Sequence[ast.stmt]) -> None:
        """One after the other."""
        for line in lines:
            assert isinstance(line, ast.Assign), ast.unparse(line)
            (target,), value = line.targets, self._value(line.value)
            if isinstance(target, ast.Name):
                self._values[target.id] = value
            else:
                self._builder.store(value, self._element(target))

    def _value(self, node: ast.expr) -> Any:
        match node:
            case ast.Name(id=name):
                return self._values[name]
            case ast.Constant(value=float(number)):
                return ir.Constant(ir.DoubleType(), number)
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=float(number))):
                return ir.Constant(ir.DoubleType(), -number)
            case ast.Subscript():
                return self._builder.load(self._element(node))
            case ast.BinOp(left=left, op=op, right=right):
                return getattr(self._builder, ARITHMETIC[type(op)])(self._value(left), self._value(right))
            case ast.Compare(left=left, ops=[ast.NotEq()], comparators=[right]):
                return self._builder.fcmp_unordered("!=", self._value(left), self._value(right))
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                return self._builder.fcmp_ordered(ORDERED[type(op)], self._value(left), self._value(right))
            case ast.IfExp(test=test, body=yes, orelse=no):
                return self._builder.select(self._value(test), self._value(yes), self._value(no))
            case ast.Call(func=ast.Name(id=("min" | "max") as name), args=[one, other]):
                first, second = self._value(one), self._value(other)
                better = self._builder.fcmp_ordered(BETTER[name], second, first)
                return self._builder.select(better, second, first)
            case ast.Call(func=function, args=arguments):
                return self._functions[ast.unparse(function)]([self._value(one) for one in arguments])
            case _:
                raise ValueError(f"lanes: no straight line: {ast.unparse(node)}")

    def _element(self, node: ast.expr) -> Any:
        """Address of `W[row + k]`."""
        match node:
            case ast.Subscript(slice=ast.BinOp(left=ast.Constant(value=row), op=ast.Add(), right=ast.Name(id="k"))):
                place = self._builder.add(self._lane.type(row), self._lane)
                return self._builder.gep(self._first, [place], inbounds=True)
            case _:
                raise ValueError(f"lanes: no element of a row: {ast.unparse(node)}")
