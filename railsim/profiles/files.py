"""Profile files: SIMPACK .prw/.prr, MiniProf .whl/.ban, and text with two columns."""

import os
import re
from pathlib import Path
from typing import Literal, cast

import numpy as np

from railsim.distribution import shipped_folder
from railsim.errors import InputError
from railsim.profiles.orientation import GaugeSide, oriented
from railsim.profiles.profile import Kind, Profile

UNITS = {"m": 1.0, "mm": 1e-3, "inch": 0.0254}
"""Metres per unit of length."""

Units = Literal["m", "mm", "inch"]

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?")


def shipped_profiles() -> list[str]:
    """Names of the profiles that come with the program."""
    return sorted(path.stem for path in shipped_folder("track_data", "profiles").glob("*.csv"))


def read_profile(
    source: str | os.PathLike[str],
    kind: Kind | None = None,
    units: Units | None = None,
    gauge_side: GaugeSide | None = None,
) -> Profile:
    """Read a wheel or rail profile and turn it into the common frame of `Profile`.

    Sides and directions are found from the shape (flange, sides of the head), not from flags in the file: columns may
    be mirrored, z may point up or down, points may run either way. Only the first two columns are used.

    Parameters
    ----------
    source : path of a file (.prw, .prr, .whl, .ban, anything else: two columns of text), or the name of a shipped one.
    kind : "wheel" or "rail"; needed for text that does not say "kind: wheel" in a comment.
    units : of the file's lengths; default: what its header states, else mm.
    gauge_side : sign of y on a rail's gauge side in the file; default: the side that is there, and negative where
    both are. A measured wheel counts y from its flange back (taping line at 70 mm) or from the taping line.

    Raises
    ------
    InputError : one line that says what is wrong with the file and how to mend it.
    """
    name, text = _text(source)
    suffix = Path(source).suffix.lower()
    if suffix in (".prw", ".prr"):
        rows, stated, profile_kind = _simpack(text, name)
        profile_kind = profile_kind or ("wheel" if suffix == ".prw" else "rail")
    elif suffix in (".whl", ".ban"):
        rows, stated, profile_kind = _miniprof(text, name)
        profile_kind = "wheel" if suffix == ".whl" else "rail"
    else:
        rows, stated, profile_kind = _columns(text)
    kind = kind or profile_kind
    if kind not in ("wheel", "rail"):
        raise InputError(f"{name}: wheel or rail? add a comment line '# kind: wheel' (or rail), or say kind=")
    factor = UNITS[units] if units else stated
    points = _points(rows, name) * factor
    _check_size(points / factor, factor, kind, name)
    return oriented(points, kind, gauge_side, Path(source).stem, name)


def write_profile(profile: Profile, path: str | os.PathLike[str], comments: list[str]) -> None:
    """Write two columns in mm (six decimals: 1 nm, so that curvatures survive) under comment lines."""
    heads = [f"# {line}" for line in (*comments, f"kind: {profile.kind}")]
    rows = [f"{y:.6f},{z:.6f}" for y, z in np.round(1e3 * np.column_stack((profile.y, profile.z)), 6) + 0.0]
    text = "\n".join([*heads, "y [mm],z [mm]", *rows, ""])
    try:
        Path(path).write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(f"cannot write profile '{path}': {error.strerror}; choose another place") from None


def _text(source: str | os.PathLike[str]) -> tuple[str, str]:
    path = Path(source)
    bare = path.name == str(source) and not path.suffix
    try:
        if bare and str(source) in shipped_profiles():
            shipped = shipped_folder("track_data", "profiles") / f"{source}.csv"
            return str(source), shipped.read_text(encoding="utf-8")
        return path.name, path.read_bytes().decode("latin-1")
    except FileNotFoundError:
        hint = f"; shipped profiles are: {', '.join(shipped_profiles())}" if bare else "; check the path"
        raise InputError(f"no profile '{source}'{hint}") from None
    except OSError as error:
        raise InputError(f"cannot read profile '{source}': {error.strerror}; give a text file") from None


def _simpack(text: str, name: str) -> tuple[list[str], float, Kind | None]:
    """Lines of points, metres per unit, kind."""
    head, begin, rest = text.partition("point.begin")
    if not begin:
        raise InputError(f"{name}: no 'point.begin' as SIMPACK profiles have; rename plain columns to .txt")
    body, end, _ = rest.partition("point.end")
    if not end:
        raise InputError(f"{name}: no 'point.end' (cut short?); copy the file again")
    factor = re.search(r"^\s*units\.len\.f\s*=\s*(\S+)", head + rest, flags=re.MULTILINE)
    types = re.search(r"^\s*type\s*=\s*([01])\s", head, flags=re.MULTILINE)
    scale = float(factor[1]) if factor and _NUMBER.fullmatch(factor[1]) else 1e3
    if scale <= 0.0:
        raise InputError(f"{name}: units.len.f is {scale:g}; it is 1000 for mm, 1 for m")
    return [line.split("!")[0] for line in body.splitlines()], 1.0 / scale, _KINDS[types[1]] if types else None


_KINDS: dict[str, Kind] = {"0": "rail", "1": "wheel"}


def _miniprof(text: str, name: str) -> tuple[list[str], float, Kind | None]:
    lines = text.splitlines()
    data = [number for number, line in enumerate(lines) if _row(line) is not None]
    head = "\n".join(lines[: data[0]] if data else lines)
    if not re.search(r"MINI ?(WHEEL|RAIL)?PROF|^[A-Za-z]\w* *=", head, flags=re.IGNORECASE | re.MULTILINE):
        raise InputError(f"{name}: no MiniProf header before the numbers; rename plain columns to .txt")
    unit = re.search(r"\b(units?|XYUnit) *[=:] *\W*(inch|in|mm)\b", head, flags=re.IGNORECASE)
    inches = unit is not None and unit[2].lower() != "mm"
    return lines, UNITS["inch" if inches else "mm"], None


def _columns(text: str) -> tuple[list[str], float, Kind | None]:
    kind = re.search(r"^[#!%] *kind: *(wheel|rail)\b", text, flags=re.IGNORECASE | re.MULTILINE)
    unit = re.search(r"^[^\d#]*\[(mm|m|inch)\]", text, flags=re.MULTILINE)
    lines = [re.split(r"[#!%]", line)[0] for line in text.splitlines()]
    return lines, UNITS[unit[1] if unit else "mm"], cast(Kind, kind[1].lower()) if kind else None


def _row(line: str) -> list[float] | None:
    """Numbers of a line that holds nothing but two or more numbers."""
    words = line.replace(",", " ").replace(";", " ").split()
    if len(words) < 2 or not all(_NUMBER.fullmatch(word) for word in words):
        return None
    return [float(re.sub("[dD]", "e", word)) for word in words[:2]]


def _points(lines: list[str], name: str) -> np.ndarray:
    rows = [row for line in lines if (row := _row(line)) is not None]
    if not rows:
        raise InputError(f"{name}: no lines with two numbers (y and z); is it a profile?")
    if len(rows) < 20:
        raise InputError(f"{name}: only {len(rows)} points; a profile needs 20 or more")
    return np.array(rows)


def _check_size(values: np.ndarray, factor: float, kind: Kind, name: str) -> None:
    """Width along the first column, in the file's units, must be that of a wheel or a rail head."""
    low, high = (0.09, 0.2) if kind == "wheel" else (0.025, 0.2)
    width = float(np.ptp(values[:, 0]))
    if low <= width * factor <= high:
        return
    fitting = [unit for unit, metres in UNITS.items() if low <= width * metres <= high]
    cure = f"the numbers look like {fitting[0]}: say units='{fitting[0]}'" if fitting else "check columns and units"
    raise InputError(f"{name}: the {kind} would be {1e3 * width * factor:.4g} mm wide; {cure}")
