"""Numbers at an address (compiled): tables that lanes share, or have of their own, without copies."""

from typing import Any

from numba import types
from numba.extending import intrinsic


def _number_at(typing_context: Any, address: Any, index: Any) -> Any:
    """The number `index` places behind an address, float64."""
    del typing_context, address, index

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        del signature
        pointer = builder.inttoptr(arguments[0], context.get_value_type(types.CPointer(types.float64)))
        return builder.load(builder.gep(pointer, [arguments[1]]))

    return types.float64(types.int64, types.int64), generate


number_at: Any = intrinsic(_number_at)


def copied(lanes: int, count: int) -> Any:
    """A function for compiled code: copy(array, to, address, index). It copies `count` numbers, from `index` places
    behind an address on, into an array of float64. There they stand `lanes` places apart, from `to` on.
    """

    def typed(typing_context: Any, array: Any, to: Any, address: Any, index: Any) -> Any:
        del typing_context, to, address, index

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            own, to, address, index = arguments
            target = context.make_array(signature.args[0])(context, builder, own).data
            source = builder.inttoptr(address, context.get_value_type(types.CPointer(types.float64)))
            for i in range(count):
                number = builder.load(builder.gep(source, [builder.add(index, index.type(i))]))
                builder.store(number, builder.gep(target, [builder.add(to, to.type(i * lanes))]))
            return context.get_dummy_value()

        return types.void(array, types.int64, types.int64, types.int64), generate

    return intrinsic(typed)


def _store_at(typing_context: Any, address: Any, index: Any, value: Any) -> Any:
    """Store a float64 `index` places behind an address."""
    del typing_context, address, index, value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        del signature
        pointer = builder.inttoptr(arguments[0], context.get_value_type(types.CPointer(types.float64)))
        builder.store(arguments[2], builder.gep(pointer, [arguments[1]]))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float64), generate


store_at: Any = intrinsic(_store_at)

TRACK, CONTACT, POSE, KNOTS, TABLES, CELLS, KNOT_COUNT = range(7)
"""Columns of the addresses of a lane; then the track's cells and the knots' number."""
ADDRESSES = 7
