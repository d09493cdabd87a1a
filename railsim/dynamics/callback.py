"""A kernel bound to its arrays once, so that calling it from Python costs one address and one number."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]
from numba.extending import intrinsic

from railsim.compiled import allocating
from railsim.contact import functions as contact_table
from railsim.dynamics.absolute import forces
from railsim.dynamics.plant import POSE_CHANNELS, Plant
from railsim.track.kernel import CHANNELS

CORE, TRACK, CONTACT, POSE, KNOTS, TABLES, Q, V, MEMORY, WORK, OUT = range(11)


def _as_pointer(typing_context: Any, address: Any) -> Any:
    """An address as a pointer."""
    del typing_context

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        del signature
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(address), generate


_pointer: Any = intrinsic(_as_pointer)


def bind_forces(
    plant: Plant, start: float, q: np.ndarray, v: np.ndarray, memory: np.ndarray, work: np.ndarray, out: np.ndarray
) -> Callable[[float], None]:
    """`forces` of `absolute` for fixed arrays: call with the time, read `out`. The arrays must outlive the
    function.
    """
    arrays = [plant.core, plant.track, plant.contact, plant.pose, plant.knots, plant.tables, q, v, memory, work, out]
    addresses = np.array([a.__array_interface__["data"][0] for a in arrays], dtype=np.int64)
    sizes = np.array(
        [
            *(len(plant.track), plant.contact.shape[1], *plant.pose.shape[:2], *plant.knots.shape, len(q)),
            *(*work.shape, len(plant.tables), len(plant.contact)),
        ],
        dtype=np.int64,
    )
    function = _compiled(np.dtype(plant.core.dtype))
    table, shape = addresses.ctypes.data, sizes.ctypes.data
    keep = (arrays, addresses, sizes)

    def call(t: float) -> None:
        function(table, shape, start, t)

    call.keep = keep  # type: ignore[attr-defined]
    return call


@lru_cache
def _compiled(core: Any) -> Callable[[int, int, float, float], None]:
    channels, contact_channels, axes = CHANNELS, contact_table.CHANNELS, POSE_CHANNELS

    @allocating
    def run(table: int, shape: int, start: float, t: float) -> None:
        at = carray(_pointer(table), 11, np.int64)
        n = carray(_pointer(shape), 11, np.int64)
        bodies = n[7] - 1
        plant = Plant(
            carray(_pointer(at[CORE]), 1, core)[0],
            carray(_pointer(at[TRACK]), (n[0], channels, 4), np.float64),
            carray(_pointer(at[CONTACT]), (n[10], n[1], contact_channels, 4), np.float64),
            carray(_pointer(at[POSE]), (n[2], n[3], axes, 4), np.float64),
            carray(_pointer(at[KNOTS]), (n[4], n[5]), np.float64),
            carray(_pointer(at[TABLES]), n[9], np.float64),
        )
        forces(
            plant, t, start,
            carray(_pointer(at[Q]), n[6], np.float64), carray(_pointer(at[V]), n[6], np.float64),
            carray(_pointer(at[MEMORY]), bodies, np.float64), carray(_pointer(at[WORK]), (n[7], n[8]), np.float64),
            carray(_pointer(at[OUT]), n[6], np.float64),
        )  # fmt: skip

    return run
