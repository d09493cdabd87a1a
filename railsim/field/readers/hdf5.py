"""HDF5 files, read with h5py: MATLAB's version 7.3, RCM-DX of measuring trains, and any other with vectors.

RCM-DX (OpenRail Association, specification 2.0): a group of a data source holds `timestamp`, ns since 1970, and groups
of channels, each with `data` and the attribute `Unit`.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import MOST_NAMES, Wanted
from railsim.field.readers.matlab_classes import opaque
from railsim.field.readers.tree import Branch, Columns, Node, Numbers, Texts, Unreadable, columns_of, with_unit
from railsim.field.tables import Table

_SMALL = 10_000  # texts of a list that may hold names or units
_OUTSIDE = "lies in another file; copy its numbers into this one"
_WORDS = {
    "meter": "m", "metre": "m", "millimeter": "mm", "millimetre": "mm", "micrometer": "um", "kilometer": "km",
    "second": "s", "millisecond": "ms", "hour": "h", "degree": "deg", "radian": "rad", "hertz": "Hz", "percent": "%",
    "newton": "N", "kilonewton": "kN", "volt": "V", "ampere": "A", "gram": "g", "kilogram": "kg", "celsius": "degC",
    "kelvin": "K", "pascal": "Pa", "squared": "^2", "per": "/",
}  # fmt: skip


def read(path: Path, wanted: list[Wanted]) -> list[Table]:
    """Vectors, columns of matrices, fields of structs and channels.

    Raises
    ------
    InputError : h5py is missing, or a group or column is not in the file or no array.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            "HDF5 needs h5py, which is not installed: pip install 'railsim[field]'; or, from MATLAB, "
            f"save('{path.name}', '-v7')"
        ) from None
    try:
        opened = h5py.File(path, "r")
    except OSError as error:
        raise InputError(_broken(path, str(error))) from None
    with opened as file:
        columns = _columns(file)
        return [columns.table(one) for one in wanted]


def _broken(path: Path, reason: str) -> str:
    """What is said of a file that cannot be opened."""
    with path.open("rb") as handle:
        matlab = handle.read(6) == b"MATLAB"
    reason = reason.rpartition("(")[2].rstrip(")")
    if not matlab:
        return f"it is an HDF5 file that is not whole ({reason}); copy it again"
    cure = f"copy it again, or save it in MATLAB by save('{path.name}', '-v7')"
    return f"it is a MATLAB file (version 7.3, HDF5) that is not whole ({reason}); {cure}"


def _columns(file: Any) -> Columns:
    matlab = file.userblock_size >= 128 and any("MATLAB_class" in file[name].attrs for name in _members(file))
    tree = _Reader(matlab).branch(file)
    if matlab:
        return columns_of(tree, "a MATLAB file", ".")
    return columns_of(tree, "an HDF5 file", "/")


def _members(group: Any) -> Iterator[str]:
    """Names of members that stand in this file: links to elsewhere are left alone."""
    import h5py

    for name in group:
        if isinstance(group.get(name, getlink=True), h5py.HardLink):
            yield name


class _Reader:
    """Makes a tree of a file; every object is looked at once."""

    def __init__(self, matlab: bool) -> None:
        self._matlab = matlab
        self._seen: set[Any] = set()
        self._count = 0

    def branch(self, group: Any, depth: int = 0) -> Branch:
        members: dict[str, Node] = {}
        for name in _members(group):
            if self._matlab and name.startswith("#"):
                continue
            self._count += 1
            if self._count > MOST_NAMES or depth > 20:
                raise InputError(f"the file states more than {MOST_NAMES} members, or nests them too deep; damaged?")
            members[name] = self._node(group, name, depth)
        return Branch(members, None if self._matlab else _clock(group, members))

    def _node(self, group: Any, name: str, depth: int) -> Node:
        import h5py

        member = group[name]
        if isinstance(member, h5py.Dataset):
            return with_unit(self._dataset(member), _unit(member) or (_unit(group) if name == "data" else None))
        if not isinstance(member, h5py.Group) or member.id in self._seen:
            return Unreadable("is no array")
        self._seen.add(member.id)
        if "MATLAB_sparse" in member.attrs:
            return Unreadable(f"is a sparse matrix; in MATLAB: {name} = full({name})")
        return self.branch(member, depth + 1)

    def _dataset(self, dataset: Any) -> Node:
        import h5py

        if dataset.is_virtual or dataset.external:
            return Unreadable(_OUTSIDE)
        kind = _text(dataset.attrs.get("MATLAB_class", b""))
        if "MATLAB_object_decode" in dataset.attrs and kind != "function_handle":
            return opaque(kind)
        if dataset.attrs.get("MATLAB_empty", 0) or dataset.shape is None or dataset.size == 0:
            return Unreadable("is empty")
        if kind == "char":
            return Texts(_characters(dataset)) if dataset.size <= _SMALL**2 else Unreadable("is a long text")
        if h5py.check_ref_dtype(dataset.dtype) is h5py.Reference:
            return _references(dataset)
        if h5py.check_string_dtype(dataset.dtype) is not None:
            return _strings(dataset)
        if dataset.dtype.names:
            return Branch({one: _field(dataset, one) for one in dataset.dtype.names})
        if dataset.dtype.kind not in "fiub":
            return Unreadable(f"holds values of type {dataset.dtype}; choose one with numbers")
        return _numbers(dataset, self._matlab)


def _numbers(dataset: Any, matlab: bool) -> Node:
    """MATLAB writes its arrays by columns: the file's dimensions are the reverse of MATLAB's."""
    if dataset.ndim not in (1, 2):
        return Unreadable(f"has {dataset.ndim} dimensions; save one with a number a row")

    def part(place: tuple[int, int] | None) -> Any:
        if place is None:
            return dataset[()]
        return dataset[place[1], :] if (place[0] == 0) != matlab else dataset[:, place[1]]

    return Numbers(tuple(reversed(dataset.shape)) if matlab else tuple(dataset.shape), part)


def _field(dataset: Any, name: str) -> Node:
    """A column of a table."""
    kind = dataset.dtype[name]
    if kind.shape or kind.kind not in "fiubSO" or dataset.ndim != 1:
        return Unreadable(f"holds values of type {kind}; choose one with numbers")
    return Numbers((dataset.size,), lambda _: np.asarray(dataset.fields(name)[()]))


def _strings(dataset: Any) -> Node:
    def values() -> list[str]:
        return [_text(one) for one in np.ravel(dataset[()]).tolist()]

    if dataset.size <= _SMALL:
        return Texts(values())
    return Numbers((dataset.size,), lambda _: np.array(values(), dtype=object))


def _characters(dataset: Any) -> list[str]:
    """Rows of a char array of MATLAB, UTF-16 code units by columns."""
    codes = np.atleast_2d(np.asarray(dataset[()]).T).astype("<u2")
    return [row.tobytes().decode("utf-16-le", "replace").rstrip("\0 ") for row in codes]


def _references(dataset: Any) -> Node:
    """A cell array, or a field of a struct array: of texts, or of single numbers."""
    file, places = dataset.file, np.ravel(dataset[()])
    first = file[places[0]]
    if _text(first.attrs.get("MATLAB_class", b"")) == "char":

        def texts() -> list[str]:
            return ["".join(_characters(file[one])[:1]) if _is_text(file[one]) else "" for one in places]

        if places.size <= _SMALL:
            return Texts(texts())
        return Numbers((places.size,), lambda _: np.array(texts(), dtype=object))
    if getattr(first, "size", 0) == 1 and first.dtype.kind in "fiub":
        return Numbers((places.size,), lambda _: np.array([float(np.ravel(file[one][()])[0]) for one in places]))
    return Unreadable("is a cell or struct array of different kinds; save its parts as vectors of their own")


def _is_text(dataset: Any) -> bool:
    return _text(dataset.attrs.get("MATLAB_class", b"")) == "char" and not dataset.attrs.get("MATLAB_empty", 0)


def _clock(group: Any, members: dict[str, Node]) -> Any:
    """What reads the timestamps of a data source; None where the group is none."""
    stamps = members.get("timestamp")
    if not isinstance(stamps, Numbers) or len(stamps.shape) != 1 or group["timestamp"].dtype.kind not in "iu":
        return None
    return lambda: np.asarray(group["timestamp"][()])


def _unit(member: Any) -> str | None:
    """The attribute `Unit` or `units` in words that are known: "MeterPerSecond" is m/s."""
    for name in ("Unit", "Units", "unit", "units"):
        if name in member.attrs:
            text = _text(np.ravel(member.attrs[name]).tolist()[0] if np.size(member.attrs[name]) else "").strip()
            words = re.findall(r"[A-Z]?[a-z]+", text)
            if words and "".join(words) == text and all(word.lower() in _WORDS for word in words):
                return _joined([word.lower() for word in words])
            return text or None
    return None


def _joined(words: list[str]) -> str:
    if words == ["degree", "celsius"]:
        return "degC"
    return re.sub(r"(?<=[A-Za-z%]) (?=[A-Za-z%])", "*", " ".join(_WORDS[word] for word in words)).replace(" ", "")


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
