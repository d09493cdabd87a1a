"""Slices one after the other, each in a process of its own and kept as it ends."""

import hashlib
import json
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.reproduction.numbers import numbers_in
from experiments.reproduction.slices import Slice
from railsim.distribution import CODE, ROOT
from railsim.errors import InputError
from railsim.files import json_text, replace_file
from railsim.progress import counting
from railsim.recording import software_versions


def words_of(one: Slice, fast: bool, out: Path) -> list[str]:
    """What follows `railsim` for a slice."""
    text = f"{one.command} {one.fast or ''}" if fast else one.command
    return [word.replace("{out}", str(out)).replace("{root}", str(ROOT)) for word in shlex.split(text)]


def perform(chosen: Sequence[Slice], folder: Path, fast: bool) -> dict[str, dict[str, float]]:
    """Numbers of each slice by its name; a slice that is kept from an earlier call is not run again.

    Raises
    ------
    InputError : a command fails; the line says which, and with what words it ended.
    KeyboardInterrupt : what is finished is kept.
    """
    done: dict[str, dict[str, float]] = {}
    program = _program()
    with counting(sum(one.hours for one in chosen), "reproducing", "h", in_files=not fast) as bar:
        for one in chosen:
            done[one.name] = _numbers(one, folder, fast, program)
            bar.update(one.hours)
    return done


def _numbers(one: Slice, folder: Path, fast: bool, program: str) -> dict[str, float]:
    kept = folder / f"{one.name}.{'fast' if fast else 'full'}.json"
    key = {"program": program, "command": words_of(one, fast, Path("out"))}
    found = _kept(kept)
    if found is not None and {name: found.get(name) for name in key} == key:
        return found["numbers"]
    words = [sys.executable, "-m", "railsim", *words_of(one, fast, folder / one.name), "--json"]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    if ended.returncode not in (0, 1):  # 1: a claim that does not hold is a number as well
        last = (ended.stderr.strip().splitlines() or ["no message"])[-1]
        raise InputError(f"slice '{one.name}' ended with {ended.returncode}: {last}; run its command by hand")
    numbers = numbers_in(json.loads(ended.stdout))
    replace_file(kept, json_text({**key, "numbers": numbers}).encode())
    return numbers


def _program() -> str:
    """SHA-256 over all of the program and the versions of its libraries: results of different ones are not mixed."""
    total = hashlib.sha256(json.dumps(software_versions(), sort_keys=True).encode())
    for path in sorted(one for name in CODE for one in (ROOT / name).rglob("*") if one.suffix in (".py", ".yaml")):
        total.update(f"{path.relative_to(ROOT).as_posix()}\0".encode() + path.read_bytes())
    return total.hexdigest()


def _kept(path: Path) -> dict[str, Any] | None:
    """What an earlier call wrote; None where it did not, or where the file is damaged."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and isinstance(found.get("numbers"), dict) else None
