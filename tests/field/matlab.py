"""MATLAB files of version 5 and 7.3, as MATLAB lays them out."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io


def seven(path: Path, variables: dict[str, Any]) -> Path:
    """A file of version 7.3 as MATLAB lays it out: arrays by columns, cells as references, a user block."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            _put(file, name, value)
    text = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM"
    with path.open("r+b") as handle:
        handle.write(text)
    return path


def _put(group: h5py.Group, name: str, value: Any) -> None:
    if isinstance(value, dict):
        below = group.create_group(name)
        below.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, one in value.items():
            _put(below, field, one)
    elif isinstance(value, str):
        codes = np.frombuffer(value.encode("utf-16-le"), "<u2").reshape(-1, 1)
        group.create_dataset(name, data=codes).attrs["MATLAB_class"] = np.bytes_("char")
    elif isinstance(value, list):
        cells = group.file.require_group("#refs#")
        places = np.empty((1, len(value)), dtype=h5py.ref_dtype)
        for number, one in enumerate(value):
            key = f"{len(cells)}"
            _put(cells, key, one)
            places[0, number] = cells[key].ref
        group.create_dataset(name, data=places).attrs["MATLAB_class"] = np.bytes_("cell")
    else:
        group.create_dataset(name, data=np.atleast_2d(value).T).attrs["MATLAB_class"] = np.bytes_("double")


def five(path: Path, variables: dict[str, Any]) -> Path:
    """A file of version 5."""
    held = {key: np.array(one, dtype=object) if isinstance(one, list) else one for key, one in variables.items()}
    for one in held.values():
        for key, field in one.items() if isinstance(one, dict) else ():
            one[key] = np.array(field, dtype=object) if isinstance(field, list) else field
    scipy.io.savemat(path, held, oned_as="column")
    return path
