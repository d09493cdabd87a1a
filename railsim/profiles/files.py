"""Profile files: SIMPACK .prw/.prr, MiniProf .whl/.ban, VAMPIRE, and text with columns."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from railsim.distribution import shipped_folder
from railsim.errors import InputError
from railsim.profiles.formats import UNITS, parse
from railsim.profiles.orientation import GaugeSide, oriented
from railsim.profiles.profile import Kind, Profile

Units = Literal["m", "mm", "inch"]


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
    be mirrored, z may point up or down, points may run either way. Columns are those that a MiniProf header or the
    format names, else the first two. What was taken for granted stands in the profile's `assumptions`.

    Parameters
    ----------
    source : path of a file (.prw, .prr, .whl, .ban, VAMPIRE by its first word, anything else: columns
        of text), or the name of a shipped one.
    kind : "wheel" or "rail"; needed for text that does not say "kind: wheel" in a comment.
    units : of the file's lengths; default: what its header states, else mm.
    gauge_side : sign of y on a rail's gauge side in the file; default: the side that is there, and negative where
    both are. A measured wheel counts y from its flange back (taping line at 70 mm) or from the taping line.

    Raises
    ------
    InputError : one line that says what is wrong with the file and how to mend it.
    """
    name, text = _text(source)
    rows = parse(text, Path(source).suffix.lower(), name)
    kind = kind or rows.kind
    if kind not in ("wheel", "rail"):
        raise InputError(f"{name}: wheel or rail? add a comment line '# kind: wheel' (or rail), or say kind=")
    if str(source) in shipped_profiles():
        gauge_side = gauge_side or "negative"
    factor = UNITS[units] if units else rows.metres
    _check_size(rows.points, factor, kind, name)
    profile = oriented(rows.points * factor, kind, gauge_side or rows.gauge_side, Path(source).stem, name)
    return replace(profile, assumptions=(*rows.notes, *profile.assumptions))


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


def _check_size(values: np.ndarray, factor: float, kind: Kind, name: str) -> None:
    """Width along the first column, in the file's units, must be that of a wheel or a rail head."""
    low, high = (0.09, 0.2) if kind == "wheel" else (0.025, 0.2)
    width = float(np.ptp(values[:, 0]))
    if low <= width * factor <= high:
        return
    fitting = [unit for unit, metres in UNITS.items() if low <= width * metres <= high]
    cure = f"the numbers look like {fitting[0]}: state units={fitting[0]}" if fitting else "check columns and units"
    raise InputError(f"{name}: the {kind} would be {1e3 * width * factor:.4g} mm wide; {cure}")
