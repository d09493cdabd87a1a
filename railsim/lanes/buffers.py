"""Memory for rows of truth that is used again: pages that a process touches for the first time cost more than the
simulation that fills them.
"""

import math
import mmap
import weakref

import numpy as np

UNIT = 1 << 16  # bytes; sizes are whole multiples, so that runs of nearly one length share
MOST_FREE = 1 << 31  # bytes that wait to be used again


class Buffers:
    """Arrays from memory that comes back when the last view of it is gone."""

    def __init__(self) -> None:
        self._free: dict[int, list[mmap.mmap]] = {}

    def take(self, shape: tuple[int, ...]) -> np.ndarray:
        """An array of float64 with whatever stood there before."""
        count = math.prod(shape)
        size = -(-8 * max(count, 1) // UNIT) * UNIT
        try:
            memory = self._free[size].pop()  # in one step, for several threads take at a time
        except LookupError:
            memory = mmap.mmap(-1, size)
        flat = np.frombuffer(memory, count=count)
        weakref.finalize(flat, self._back, memory).atexit = False
        return flat.reshape(shape)

    def _back(self, memory: mmap.mmap) -> None:
        """Keep memory for the next run; where too much waits, it is of lengths that nobody asks for any more."""
        if sum(size * len(free) for size, free in self._free.items()) + len(memory) > MOST_FREE:
            self._free.clear()
        self._free.setdefault(len(memory), []).append(memory)
