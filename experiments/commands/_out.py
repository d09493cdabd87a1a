"""What stands where a command is to write."""

import argparse
from pathlib import Path

from railsim.errors import InputError
from railsim.files import read_json

_KINDS = (("recording", "origin"), ("estimate", "about"))


def add_overwrite(parser: argparse.ArgumentParser) -> None:
    """The option by which a folder of another kind may be replaced."""
    parser.add_argument("--overwrite", action="store_true", help="replace what --out names, whatever it is")


def replaces(out: str, kind: str, overwrite: bool) -> str | None:
    """A line that says what will be replaced; None where there is nothing.

    Raises
    ------
    InputError : it is of another kind than what will be written, as a recording where an estimate is to be.
    """
    path = Path(out)
    if path.is_file():
        return f"replaced: an earlier track in '{out}'"
    if not (path / "about.json").is_file():
        return None
    about = read_json(path / "about.json", "a folder")
    found = next((name for name, key in _KINDS if key in about), "folder")
    if found != kind and not overwrite:
        raise InputError(f"'{out}' holds a {found}, which would be lost; name another folder, or add --overwrite")
    return f"replaced: an earlier {found} in '{out}'"
