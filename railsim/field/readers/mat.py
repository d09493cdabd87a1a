"""MATLAB files: version 4 and 5 read with scipy, version 7.3 (HDF5) with h5py."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.readers import hdf5
from railsim.field.readers.interface import Wanted
from railsim.field.readers.matlab_classes import opaque
from railsim.field.readers.tree import Branch, Node, Numbers, Texts, Unreadable, columns_of
from railsim.field.tables import Table

_MOST_ELEMENTS = 1000  # of a struct or cell array
_DEEPEST = 20
_NAMELESS = "None"  # what scipy calls an object of a class


def read(path: Path, wanted: list[Wanted]) -> list[Table]:
    """Vectors, fields of structs, columns of matrices.

    Raises
    ------
    InputError : h5py is missing for version 7.3, or a column is not in the file or no array.
    """
    with path.open("rb") as handle:
        newer = handle.read(10) == b"MATLAB 7.3"
    if newer:
        return hdf5.read(path, wanted)
    import scipy.io

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        values = scipy.io.loadmat(path, chars_as_strings=True)
        objects = _objects(path) if values.pop(_NAMELESS, None) is not None else {}
    tree = Branch({name: _node(one, name) for name, one in values.items() if not name.startswith("__")} | objects)
    columns = columns_of(tree, "a MATLAB file", ".")
    return [columns.table(one) for one in wanted]


def _objects(path: Path) -> dict[str, Node]:
    """Objects of MATLAB's classes by name, which scipy gives without one, all but the last lost."""
    from scipy.io import loadmat
    from scipy.io.matlab import varmats_from_mat

    found: dict[str, Node] = {}
    with path.open("rb") as handle:
        for name, stream in varmats_from_mat(handle):
            if name is None or name == _NAMELESS:
                held = loadmat(stream).get(_NAMELESS)
                found[_text_of(held, "s0") or "?"] = opaque(_text_of(held, "s2"))
    return found


def _node(value: Any, name: str, depth: int = 0) -> Node:
    if type(value).__name__ == "MatlabOpaque":
        return opaque(_text_of(value, "s2"))
    if type(value).__name__ == "MatlabFunction":
        return Unreadable("is a function; name a variable with numbers")
    if not isinstance(value, np.ndarray):
        return Unreadable(f"is a sparse matrix; in MATLAB: {name} = full({name})")
    if depth > _DEEPEST:
        raise InputError(f"'{name}' is nested too deep; damaged?")
    if value.dtype.names:
        return _struct(value, name, depth)
    if value.dtype.kind in "US":
        return Texts([str(one).rstrip() for one in value.ravel()])
    if value.dtype.kind == "O":
        return _cell(value, name, depth)
    if value.dtype.kind == "c":
        return Unreadable("holds complex numbers; save real and imaginary part as vectors of their own")
    return array(value)


def array(value: np.ndarray) -> Numbers:
    """An array that is in memory."""

    def part(place: tuple[int, int] | None) -> np.ndarray:
        return value if place is None else np.take(value, place[1], axis=place[0])

    return Numbers(tuple(value.shape), part)


def _text_of(value: Any, field: str) -> str:
    """A text of an object that scipy leaves as it is: its name is `s0`, its class `s2`."""
    try:
        held = value.ravel()[0][field]
        return held.decode("utf-8", "replace") if isinstance(held, bytes) else str(held)
    except (AttributeError, IndexError, KeyError, ValueError, TypeError):
        return ""


def _struct(value: np.ndarray, name: str, depth: int) -> Node:
    fields = value.dtype.names or ()
    elements = value.ravel()
    if elements.size == 1:
        return Branch({one: _node(elements[0][one], one, depth + 1) for one in fields})
    if all(np.size(elements[one][row]) == 1 for one in fields for row in range(min(elements.size, 3))):
        vectors = {one: _stacked([elements[row][one] for row in range(elements.size)]) for one in fields}
        return Branch({one: vector for one, vector in vectors.items() if vector is not None})
    if elements.size > _MOST_ELEMENTS:
        return Unreadable(f"is a struct array of {elements.size} elements; save its fields as vectors")
    return Branch(
        {
            f"({number})": Branch({field: _node(one[field], field, depth + 1) for field in fields})
            for number, one in enumerate(elements, 1)
        }
    )


def _cell(value: np.ndarray, name: str, depth: int) -> Node:
    elements = list(value.ravel())
    stacked = _stacked(elements)
    if stacked is not None:
        return stacked
    if len(elements) > _MOST_ELEMENTS:
        return Unreadable(f"is a cell array of {len(elements)} cells of different kinds; save them as vectors")
    return Branch({f"{{{number}}}": _node(one, f"{name} cell", depth + 1) for number, one in enumerate(elements, 1)})


def _stacked(elements: list[Any]) -> Node | None:
    """Cells of one text each, or of one number each, as a list; None where they are neither."""
    arrays = [one if isinstance(one, np.ndarray) and not one.dtype.names else None for one in elements]
    if not arrays or any(one is None for one in arrays):
        return None
    kinds = {one.dtype.kind for one in arrays if one is not None}
    if kinds <= {"U", "S"} and all(one is not None and one.size <= 1 for one in arrays):
        return Texts([str(one.ravel()[0]) if one is not None and one.size else "" for one in arrays])
    if kinds <= set("fiub") and all(one is not None and one.size == 1 for one in arrays):
        return array(np.array([float(one.ravel()[0]) for one in arrays if one is not None]))
    return None
