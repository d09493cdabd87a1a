"""Rows of points in profile files: SIMPACK, MiniProf, VAMPIRE and text with columns."""

import re
from dataclasses import dataclass
from typing import cast

import numpy as np

from railsim.errors import InputError
from railsim.profiles.orientation import GaugeSide
from railsim.profiles.profile import Kind

UNITS = {"m": 1.0, "mm": 1e-3, "inch": 0.0254}
"""Metres per unit of length."""

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?")
_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d+,\d+([eEdD][-+]?\d+)?(\s*;\s*|\s+)[-+]?\d+(,\d+)?([eEdD][-+]?\d+)?\b.*")
_KINDS: dict[str, Kind] = {"0": "rail", "1": "wheel"}
_ALIKE = 1e-5  # m; left and right sides of a file that differ by less are one


@dataclass(frozen=True)
class Rows:
    """What a file holds.

    Attributes
    ----------
    points : as in the file, in its units, shape (n, 2).
    metres : per unit of the file.
    kind : "wheel" or "rail"; None where the file does not say.
    gauge_side : sign of y on a rail's gauge side where the format fixes it.
    notes : what was taken for granted, in words.
    """

    points: np.ndarray
    metres: float
    kind: Kind | None
    gauge_side: GaugeSide | None = None
    notes: tuple[str, ...] = ()


def parse(text: str, suffix: str, name: str) -> Rows:
    """Points of a file by its ending and what it says of itself; `name` stands in front of messages.

    Raises
    ------
    InputError : one line that says what is wrong with the file.
    """
    if re.search(r"^\s*(WHEEL|RAIL)PROFILE\b", text, flags=re.MULTILINE):
        return _vampire(text, name)
    if suffix in (".prw", ".prr"):
        return _simpack(text, name, "wheel" if suffix == ".prw" else "rail")
    if suffix in (".whl", ".ban"):
        return _miniprof(text, name, "wheel" if suffix == ".whl" else "rail")
    return _columns(text, name)


def _simpack(text: str, name: str, by_suffix: Kind) -> Rows:
    """Points with the file's own shift, rotation, boundaries and mirrors, in the order of their numbers in the file."""
    head, begin, rest = text.partition("point.begin")
    if not begin:
        raise InputError(f"{name}: no 'point.begin' as SIMPACK profiles have; rename plain columns to .txt")
    body, end, _ = rest.partition("point.end")
    if not end:
        raise InputError(f"{name}: no 'point.end' (cut short?); copy the file again")
    options = head + rest.partition("point.end")[2]
    types = re.search(r"^\s*type\s*=\s*([01])\s", head, flags=re.MULTILINE)
    scale = _option(options, "units.len.f", _named_scale(options))
    if scale <= 0.0:
        raise InputError(f"{name}: units.len.f is {scale:g}; it is 1000 for mm, 1 for m, 39.37 for inch")
    points = _points([line.split("!")[0] for line in body.splitlines()], name)
    points = np.add(points, [_option(options, "shift.y", 0.0), _option(options, "shift.z", 0.0)])
    angle = _option(options, "rotate", 0.0) / (_option(options, "units.ang.f", 1.0) or 1.0)
    points = points @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    notes = (f"{name}: rotated by {np.degrees(angle):.4g} deg, as its option 'rotate' says",) if angle else ()
    for column, axis in enumerate("yz"):
        low, high = _option(options, f"bound.{axis}.min", 1.0), _option(options, f"bound.{axis}.max", 0.0)
        if low < high:
            inside = (points[:, column] >= low) & (points[:, column] <= high)
            points = _enough(points[inside], name)
            notes += (f"{name}: {int((~inside).sum())} points outside its bound.{axis} are left out",)
    return Rows(points, 1.0 / scale, _KINDS[types[1]] if types else by_suffix, notes=notes)


def _named_scale(options: str) -> float:
    named = re.search(r"^[\s!]*units\.len\s*=\s*'?(mm|m|inch|in)\b", options, flags=re.MULTILINE)
    return 1.0 / UNITS[{"in": "inch"}.get(named[1], named[1])] if named else 1e3


def _option(options: str, key: str, default: float) -> float:
    found = re.search(rf"^\s*{re.escape(key)}\s*=\s*(\S+)", options, flags=re.MULTILINE)
    return _value(found[1]) if found and _NUMBER.fullmatch(found[1]) else default


def _miniprof(text: str, name: str, kind: Kind) -> Rows:
    lines = text.splitlines()
    data = [number for number, line in enumerate(lines) if _cells(line) is not None]
    head = "\n".join(lines[: data[0]] if data else lines)
    if not re.search(r"MINI ?(WHEEL|RAIL)?PROF|^[A-Za-z]\w* *=", head, flags=re.IGNORECASE | re.MULTILINE):
        raise InputError(f"{name}: no MiniProf header before the numbers; rename plain columns to .txt")
    unit = re.search(r"\b(units?|XYUnit) *[=:] *\W*(inch|in|mm)\b", head, flags=re.IGNORECASE)
    inches = unit is not None and unit[2].lower() != "mm"
    order = re.findall(r'^"?ColumnDef *= *([A-Za-z, ;]+)', head, flags=re.IGNORECASE | re.MULTILINE)
    columns = (0, 1)
    if order:
        names = [one.strip().upper() for one in re.split(r"[,;\s]+", order[-1].strip()) if one.strip()]
        if "X" not in names or "Y" not in names:
            raise InputError(f"{name}: ColumnDef names {', '.join(names)}, a profile needs X and Y; export them too")
        columns = (names.index("X"), names.index("Y"))
    return Rows(_points(lines, name, columns), UNITS["inch" if inches else "mm"], kind)


def _vampire(text: str, name: str) -> Rows:
    """Left and right side beside each other, y from the middle of the track; the left side is taken."""
    wheel = re.search(r"^\s*WHEELPROFILE\b", text, flags=re.MULTILINE) is not None
    lines = text.splitlines()
    left, right = _points(lines, name), _points(lines, name, (2, 3))
    left = left * [np.sign(np.median(left[:, 0])) or 1.0, 1.0]
    right = right * [np.sign(np.median(right[:, 0])) or 1.0, 1.0]
    notes = ()
    if np.abs(left - right).max() > _ALIKE / UNITS["mm"]:
        notes = (f"{name}: left and right side differ; the left one is taken for both",)
    if not wheel:
        return Rows(left, UNITS["mm"], "rail", "negative", notes)
    back = re.search(r"^\s*FLANGEBACK\s+(\S+)", text, flags=re.MULTILINE)
    if back is None or not _NUMBER.fullmatch(back[1]):
        raise InputError(f"{name}: no FLANGEBACK as VAMPIRE wheels have; add 'FLANGEBACK 1360.0' (mm)")
    return Rows(left - [0.5 * _value(back[1]), 0.0], UNITS["mm"], "wheel", None, notes)


def _columns(text: str, name: str) -> Rows:
    kind = re.search(r"^[#!%] *kind: *(wheel|rail)\b", text, flags=re.IGNORECASE | re.MULTILINE)
    unit = re.search(r"^[^\d#]*\[(mm|m|inch)\]", text, flags=re.MULTILINE)
    lines = [re.split(r"[#!%]", line)[0] for line in text.splitlines()]
    points = _points(lines, name)
    side = re.search(r"^[#!%] *gauge_side: *(negative|positive)\b", text, flags=re.IGNORECASE | re.MULTILINE)
    gauge_side = cast(GaugeSide, side[1].lower()) if side else None
    return Rows(points, UNITS[unit[1] if unit else "mm"], cast(Kind, kind[1].lower()) if kind else None, gauge_side)


def _points(lines: list[str], name: str, columns: tuple[int, int] = (0, 1)) -> np.ndarray:
    """Two columns of the longest block of rows with as many numbers; a count of them in front is left out.

    Lines of a header or a summary that hold numbers stand in blocks of their own, or have another number of them.
    """
    lines = _with_points(lines, name)
    blocks: list[list[list[float]]] = [[]]
    for line in lines:
        cells = _cells(line)
        if cells is None:
            if line.strip():
                blocks.append([])
        elif blocks[-1] and len(blocks[-1][-1]) != len(cells):
            blocks.append([cells])
        else:
            blocks[-1].append(cells)
    rows = max(blocks, key=len)
    if not rows:
        raise InputError(f"{name}: no lines with two numbers (y and z); is it a profile?")
    if rows[0][0] == len(rows) - 1:
        rows = rows[1:]
    if max(columns) >= len(rows[0]):
        raise InputError(f"{name}: {len(rows[0])} numbers a row, column {max(columns) + 1} is needed; cut short?")
    return _enough(np.array([[row[columns[0]], row[columns[1]]] for row in rows]), name)


def _enough(points: np.ndarray, name: str) -> np.ndarray:
    if len(points) < 20:
        raise InputError(f"{name}: only {len(points)} points; a profile needs 20 or more")
    return points


def _with_points(lines: list[str], name: str) -> list[str]:
    """Lines with decimal points; commas between numbers become blanks."""
    rows = [line for line in lines if re.fullmatch(r"[-+\d.,;\seEdD]*\d[-+\d.,;\seEdD]*", line)]
    if any("." in line for line in rows):
        return [line.replace(",", " ") for line in lines]
    commas = [bool(_DECIMAL_COMMA.fullmatch(line)) for line in rows]
    if sum(commas) > 0.5 * len(rows):
        return [re.sub(r"(?<=\d),(?=\d)", ".", line) for line in lines]
    if rows and sum(line.count(",") == 3 and ";" not in line for line in rows) > 0.5 * len(rows):
        raise InputError(
            f"{name}: commas may be decimal marks or separate numbers; write decimal points, or ';' between numbers"
        )
    return [line.replace(",", " ") for line in lines]


def _cells(line: str) -> list[float] | None:
    """Numbers of a line that holds nothing but two or more numbers."""
    words = line.replace(",", " ").replace(";", " ").split()
    if len(words) < 2 or not all(_NUMBER.fullmatch(word) for word in words):
        return None
    return [_value(word) for word in words]


def _value(word: str) -> float:
    return float(re.sub("[dD]", "e", word))
