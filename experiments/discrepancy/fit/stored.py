"""Stored: named arrays in one file, read where they lie on the disk: neither unpacked nor copied."""

import math
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

ALIGNED = 64  # bytes; each array begins at a whole number of them


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """What `write_arrays` put there, bit by bit, to read only; nothing where there is no such file or it is damaged."""
    try:
        whole = np.memmap(path, np.uint8, "r")
        with path.open("rb") as file:
            return {name: _next(file, whole) for name in np.lib.format.read_array(file).tolist()}
    except (OSError, ValueError):
        return {}


def _next(file: BinaryIO, whole: np.ndarray) -> np.ndarray:
    """The array that begins at the next place, as a part of the mapped file."""
    file.seek(-file.tell() % ALIGNED, os.SEEK_CUR)
    np.lib.format.read_magic(file)
    shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    begin, size = file.tell(), math.prod(shape) * dtype.itemsize
    file.seek(size, os.SEEK_CUR)
    return np.asarray(whole[begin : begin + size]).view(dtype).reshape(shape)  # raises where the file ends before


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Names, then arrays, in NumPy's format; whole or not at all.

    Raises
    ------
    OSError : the disk cannot be written.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    with os.fdopen(handle, "wb") as file:
        for one in (np.array(list(arrays)), *arrays.values()):
            file.write(b"\0" * (-file.tell() % ALIGNED))
            np.lib.format.write_array(file, np.require(one, requirements="C"), version=(1, 0), allow_pickle=False)
    Path(name).replace(path)
