"""Stored: named arrays in one file, each read from the disk when it is used."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from railsim.files import new_file

ALIGNED = 64  # bytes; each array begins at a whole number of them


@dataclass(frozen=True)
class Stored:
    """An array in a file that is held open: what comes in the file's place does not change it."""

    file: BinaryIO
    begin: int
    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def size(self) -> int:
        """Of numbers."""
        return math.prod(self.shape)

    @property
    def end(self) -> int:
        """Where the next may begin."""
        return self.begin + self.size * self.dtype.itemsize

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """What is there now, as NumPy asks for it."""
        data = os.pread(self.file.fileno(), self.end - self.begin, self.begin)
        return np.frombuffer(data, self.dtype).reshape(self.shape).astype(dtype or self.dtype, copy=False)


def stored_arrays(path: Path) -> dict[str, Stored]:
    """What `write_arrays` put there; nothing where there is no such file or it is damaged."""
    try:
        file = path.open("rb")
    except OSError:
        return {}
    try:
        found = {name: _next(file) for name in np.lib.format.read_array(file).tolist()}
    except (OSError, ValueError):
        found = {}
    if not found or max(one.end for one in found.values()) > os.fstat(file.fileno()).st_size:
        file.close()
        return {}
    return found


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """The same, read, bit by bit as they were."""
    stored = stored_arrays(path)
    found = {name: np.asarray(one) for name, one in stored.items()}
    for file in {one.file for one in stored.values()}:
        file.close()
    return found


def _next(file: BinaryIO) -> Stored:
    """The array that begins at the next place."""
    file.seek(-file.tell() % ALIGNED, os.SEEK_CUR)
    np.lib.format.read_magic(file)
    shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    found = Stored(file, file.tell(), shape, dtype)
    file.seek(found.end)
    return found


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Names, then arrays, in NumPy's format; whole or not at all.

    Raises
    ------
    InputError : the disk cannot be written.
    """
    with new_file(path) as aside, aside.open("wb") as file:
        for one in (np.array(list(arrays)), *arrays.values()):
            file.write(b"\0" * (-file.tell() % ALIGNED))
            np.lib.format.write_array(file, np.require(one, requirements="C"), version=(1, 0), allow_pickle=False)
