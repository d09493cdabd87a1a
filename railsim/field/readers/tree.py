"""Files that hold a tree of arrays (MATLAB, HDF5): every column of numbers or texts in it has a path.

A vector `az` in a struct `imu` is `imu.az`. Columns of a matrix are `imu.data(:,1)`, `imu.data(:,2)` and, where a list
of as many names stands beside it, also `imu.NAME`. `group: imu` of a table puts `imu` in front of its columns.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import MOST_NAMES, Wanted, column
from railsim.field.tables import Column, Table, missing

_NAMES = re.compile(r"name|label|channel|signal|head|title|field|var", re.IGNORECASE)
_UNITS = re.compile(r"unit|einheit", re.IGNORECASE)
_VALUES = re.compile(r"data|values?|samples|signals?|y", re.IGNORECASE)
_MOST_COLUMNS = 2000  # of a matrix; more are no channels
_DEEPEST = 20


@dataclass(frozen=True)
class Numbers:
    """An array of one or two dimensions; `read` gives it, or a row or column of it by (dimension, number from 0)."""

    shape: tuple[int, ...]
    read: Callable[[tuple[int, int] | None], Any]
    unit: str | None = None


@dataclass(frozen=True)
class Texts:
    """Texts, one or several."""

    values: Sequence[str]


@dataclass(frozen=True)
class Unreadable:
    """Something that is no array; `reason` says what it is and how to go on."""

    reason: str


@dataclass(frozen=True)
class Branch:
    """Members by name; `clock` gives times of an own axis in ns since 1970, where the format has one."""

    members: Mapping[str, "Node"]
    clock: Callable[[], np.ndarray] | None = None


Node = Numbers | Texts | Unreadable | Branch


@dataclass(frozen=True)
class Leaf:
    """A column: its path, further names, number of rows, unit, and what reads it."""

    path: str
    rows: int
    read: Callable[[], Any]
    unit: str | None = None
    further: tuple[str, ...] = ()


@dataclass(frozen=True)
class Columns:
    """All columns of a tree, and what cannot be read; `kind` names the format, `mark` stands between parts of paths."""

    kind: str
    mark: str
    leaves: Sequence[Leaf]
    unreadable: Mapping[str, str]
    clocks: Mapping[str, Callable[[], np.ndarray]] = field(default_factory=dict)

    def table(self, wanted: Wanted) -> Table:
        """The columns that are wanted.

        Raises
        ------
        InputError : a group or column is not there, cannot be read, or columns differ in length.
        """
        head = self._group(wanted.group)
        columns, start = {}, None
        for name in wanted.columns:
            leaf = self._leaf(head, name)
            columns[name] = column(name, leaf.read(), leaf.unit)
        clock = None
        if wanted.clock:
            clock, start = self._clock(head)
        _check_lengths(columns, clock)
        return Table(columns, clock, start)

    def _clock(self, head: str) -> tuple[np.ndarray, str]:
        read = self.clocks.get(head)
        if read is None:
            there = f"; groups with one are {', '.join(map(repr, list(self.clocks)[:10]))}" if self.clocks else ""
            raise InputError(
                f"{'group ' + repr(head) if head else self.kind} has no time axis of its own; name the column of "
                f"time, as 'time: {{kind: seconds, column: \"time\"}}'{there}"
            )
        stamps = read()
        if stamps.size == 0 or stamps.dtype.kind not in "iu":
            raise InputError(f"the timestamps of group '{head}' are no whole numbers of ns; is the file damaged?")
        since = (stamps - stamps[0]).astype(np.float64) * 1e-9
        return since, f"{np.datetime64(int(stamps[0]), 'ns')}Z"

    def _group(self, wanted: str | int | None) -> str:
        """Path of the group; "" where none is wanted."""
        if wanted is None:
            return ""
        groups = list(dict.fromkeys(head for leaf in self.leaves for head in _heads(leaf.path, self.mark)))
        if isinstance(wanted, int):
            listed = ", ".join(map(repr, groups[:20])) or "none"
            raise InputError(f"{self.kind} has no numbered groups; name one, there are: {listed}")
        plain = wanted.strip(self.mark)
        if plain in groups:
            return plain
        ending = [one for one in groups if one.endswith(self.mark + plain)]
        if len(ending) == 1:
            return ending[0]
        if ending:
            listed = ", ".join(map(repr, ending[:20]))
            raise InputError(f"{len(ending)} groups end with '{wanted}' ({listed}); name one in full")
        self._refuse_unreadable(plain)
        raise missing(wanted, groups, "group")

    def _leaf(self, head: str, name: str) -> Leaf:
        path = f"{head}{self.mark}{name}" if head else name.strip(self.mark)
        found = self._named(path) or self._named(f"{path}{self.mark}data") or self._numbered(head, name)
        if len(found) > 1:
            listed = ", ".join(f"'{_within(one.path, head, self.mark)}'" for one in found[:20])
            raise InputError(f"{len(found)} columns are called '{name}' ({listed}); name one by these")
        if found:
            return found[0]
        self._refuse_unreadable(path)
        inside = [one for one in self.leaves if not head or one.path.startswith(head + self.mark)]
        parts = [one for one in inside if one.path.startswith((f"{path}{self.mark}", f"{path}(", f"{path}{{"))]
        names = [_within((one.further or (one.path,))[0], head, self.mark) for one in parts or inside]
        if parts:
            listed = ", ".join(f"'{one}'" for one in names[:20])
            raise InputError(f"'{name}' is no single column; name one of {listed}")
        raise missing(name, names, "column")

    def _named(self, path: str) -> list[Leaf]:
        return [one for one in self.leaves if path in (one.path, *one.further)]

    def _numbered(self, head: str, name: str) -> list[Leaf]:
        """The column of a matrix by its number from 1: "#3" of the group that is a matrix, or of the only one."""
        number = re.fullmatch(r"#(\d{1,6})", name)
        inside = [one for one in self.leaves if not head or one.path.startswith((head + self.mark, head + "("))]
        return [one for one in inside if number and one.path.endswith(f"(:,{number[1]})")]

    def _refuse_unreadable(self, path: str) -> None:
        for one, reason in self.unreadable.items():
            if path == one or path.startswith((f"{one}{self.mark}", f"{one}(")):
                raise InputError(f"'{one}' {reason}")


def columns_of(tree: Branch, kind: str, mark: str) -> Columns:
    """All columns of a tree.

    Raises
    ------
    InputError : it is deeper or has more members than any that holds measurements.
    """
    leaves: list[Leaf] = []
    unreadable: dict[str, str] = {}
    clocks: dict[str, Callable[[], np.ndarray]] = {}
    for path, branch in _branches(tree, "", mark, 0):
        if branch.clock is not None:
            clocks[path] = branch.clock
        leaves += _branch_leaves(path, branch, mark)
        texts = {name: one.reason for name, one in branch.members.items() if isinstance(one, Unreadable)}
        unreadable |= {_join(path, name, mark): reason for name, reason in texts.items()}
        if len(leaves) > MOST_NAMES:
            raise InputError(f"the file states more than {MOST_NAMES} columns; damaged?")
    return Columns(kind, mark, leaves, unreadable, clocks)


def _branches(branch: Branch, path: str, mark: str, depth: int) -> Iterator[tuple[str, Branch]]:
    if depth > _DEEPEST:
        raise InputError(f"'{path[:60]}' lies more than {_DEEPEST} levels deep; damaged?")
    yield path, branch
    for name, member in branch.members.items():
        if isinstance(member, Branch):
            yield from _branches(member, _join(path, name, mark), mark, depth + 1)


def _branch_leaves(path: str, branch: Branch, mark: str) -> list[Leaf]:
    """Columns of a branch, those of branches below it left out."""
    found: list[Leaf] = []
    for name, member in branch.members.items():
        full = _join(path, name, mark)
        if isinstance(member, Texts) and len(member.values) > 1:
            values = np.array(member.values, dtype=object)
            found.append(Leaf(full, len(values), lambda values=values: values))
        elif isinstance(member, Numbers):
            found += _vectors(full, full.removesuffix(name), name, member, branch, mark)
    return found


def _vectors(full: str, head: str, name: str, numbers: Numbers, branch: Branch, mark: str) -> list[Leaf]:
    """The vector at the path `full`, or the columns (or rows, where these are longer) of a matrix."""
    shape = numbers.shape
    if len(shape) == 1 or (len(shape) == 2 and min(shape) == 1):
        unit = numbers.unit or _unit(name, branch)
        return [Leaf(full, max(shape), lambda: np.ravel(np.asarray(numbers.read(None))), unit)]
    if len(shape) != 2 or 0 in shape or min(shape) > _MOST_COLUMNS:
        return []
    across = 1 if shape[0] >= shape[1] else 0
    count = shape[across]
    titles, units = _texts(branch, count, _NAMES), _texts(branch, count, _UNITS)
    leaves = []
    for number in range(count):
        place = f"(:,{number + 1})" if across == 1 else f"({number + 1},:)"
        unit = numbers.unit or (units[number] if units else _unit(name, branch))
        read = partial(_part, numbers, (across, number))
        title = titles[number].strip() if titles else ""
        further = (f"{head}{title}", f"{full}{mark}{title}") if title else ()
        leaves.append(Leaf(f"{full}{place}", shape[1 - across], read, unit, further))
    return leaves


def _part(numbers: Numbers, place: tuple[int, int]) -> np.ndarray:
    return np.ravel(np.asarray(numbers.read(place)))


def _texts(branch: Branch, count: int, called: re.Pattern[str]) -> Sequence[str] | None:
    """The list of `count` texts beside a matrix whose own name fits; the only one of such a length serves as names."""
    lists = {name: one.values for name, one in branch.members.items() if isinstance(one, Texts)}
    fitting = {name: values for name, values in lists.items() if len(values) == count}
    named = [values for name, values in fitting.items() if called.search(name)]
    if named or called is _UNITS:
        return named[0] if len(named) == 1 else None
    others = [values for name, values in fitting.items() if not _UNITS.search(name)]
    return others[0] if len(others) == 1 else None


def _unit(name: str, branch: Branch) -> str | None:
    """What `units.NAME` beside a vector says, or `unit` beside the only one, `data`."""
    for key, member in branch.members.items():
        if not _UNITS.match(key):
            continue
        own = member.members.get(name) if isinstance(member, Branch) else member
        if isinstance(member, Texts) and not _VALUES.fullmatch(name):
            continue
        if isinstance(own, Texts) and len(own.values) == 1:
            return own.values[0] or None
    return None


def with_unit(node: Node, unit: str | None) -> Node:
    """Numbers with a unit that the format states."""
    return replace(node, unit=unit) if isinstance(node, Numbers) and unit else node


def _join(path: str, name: str, mark: str) -> str:
    """Path of a member; "(2)" of a struct array and "{2}" of a cell array follow without a mark."""
    return f"{path}{name}" if not path or name.startswith(("(", "{")) else f"{path}{mark}{name}"


def _heads(path: str, mark: str) -> list[str]:
    """Groups in which a column lies, a matrix included."""
    matrix = re.fullmatch(r"(.*)\((?::,\d+|\d+,:)\)", path)
    parts = path.split(mark)
    return [*(mark.join(parts[:count]) for count in range(1, len(parts))), *([matrix[1]] if matrix else [])]


def _within(path: str, head: str, mark: str) -> str:
    return path.removeprefix(head + mark) if head else path


def _check_lengths(columns: Mapping[str, Column], clock: np.ndarray | None) -> None:
    lengths = {name: len(one.values) for name, one in columns.items()}
    if clock is not None:
        lengths["the timestamps"] = clock.size
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"'{name}' {count}" for name, count in lengths.items())
        raise InputError(f"columns of one table differ in length ({listed}); put those of each rate in a table")
