"""Stored: named arrays in one file, each read from the disk when it is used."""

import hashlib
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from railsim.files import new_file

DIGEST = hashlib.sha256
PART = 2**24  # bytes that are read at a time
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
    """What `write_arrays` put there; nothing where there is no such file or a bit of it has changed."""
    try:
        file = path.open("rb")
    except OSError:
        return {}
    try:
        if _sound(file):
            return {name: _next(file) for name in np.lib.format.read_array(file).tolist()}
    except (OSError, ValueError):
        pass
    file.close()
    return {}


def _sound(file: BinaryIO) -> bool:
    """Whether the file ends with the digest of all before; it is at its beginning afterwards."""
    left, digest = os.fstat(file.fileno()).st_size - DIGEST().digest_size, DIGEST()
    while left > 0:
        part = file.read(min(left, PART))
        digest.update(part)
        left -= len(part)
    sound = file.read() == digest.digest()
    file.seek(0)
    return sound


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
    """Names, then arrays, in NumPy's format, then the digest of all that; whole or not at all.

    Raises
    ------
    InputError : the disk cannot be written.
    """
    with new_file(path) as aside, aside.open("wb") as file:
        for one in (np.array(list(arrays)), *arrays.values()):
            file.write(b"\0" * (-file.tell() % ALIGNED))
            np.lib.format.write_array(file, np.require(one, requirements="C"), version=(1, 0), allow_pickle=False)
        file.flush()
        with aside.open("rb") as written:
            digest = hashlib.file_digest(written, DIGEST).digest()
        file.write(digest)
