"""Sound inputs of every kind, made once, of which each case damages a copy."""

import hashlib
import shutil
from collections.abc import Sequence
from pathlib import Path

from railsim.__main__ import main
from railsim.errors import InputError
from railsim.files import write_folder_atomically

SCENARIO = """description: four seconds on straight track
track: straight_erri_low
vehicle: class175
speed: {kind: constant, speed: 25}
start: 25
duration: 4
output_rate: 1024
seed: 3
sensors:
  - {kind: accelerometer, name: bogie, body: bogie, axes: [x, y, z], rate: 256, errors: industrial}
  - {kind: gyro, name: bogie, body: bogie, axes: [roll, pitch, yaw], rate: 256, errors: industrial}
  - {kind: tachometer, name: wheelset1, body: wheelset1, rate: 64}
"""
SWEEP = """description: two speeds
scenario: short.yaml
engine: compiled
set: {duration: 2.0}
design: {kind: grid, keys: {speed.speed: [25.0, 30.0]}}
estimators: [speed_plain]
seeds: [1]
"""
LAWS = "- {kind: conicity_change, factor: 1.5}\n"
WIDE = {"default": 25, "suspension": 20, "whole_coach": 20, "curve_s1002": 20, "wheelset_worn": 20, "corrugated": 12}
"""Scenarios, and seconds of each; one or another suits every estimator."""
FAST = ("--engine", "compiled")
EXPORTS = ("csv", "parquet", "mat", "mf4")


def call(*words: str | Path) -> int:
    """The command with these words."""
    return main([str(word) for word in words])


def make_workshop(folder: Path) -> Path:
    """The sound inputs; made where they are not there yet.

    Raises
    ------
    InputError : a command that makes one of them fails.
    """
    if folder.is_dir():
        return folder
    with write_folder_atomically(folder) as aside:
        for name, text in (("short.yaml", SCENARIO), ("sweep.yaml", SWEEP), ("laws.yaml", LAWS)):
            (aside / name).write_text(text)
        recording = aside / "recording"
        _made("simulate", aside / "short.yaml", *FAST, "--out", recording)
        _made("estimate", "speed_plain", recording, "--out", aside / "estimate")
        for ending in EXPORTS:
            place = aside / ending
            place.mkdir()
            _made("export", recording, "--to", place / f"data.{ending}", "--map", place / "map.yaml")
        shutil.copyfile(recording / "truth" / "track.csv", aside / "track.csv")
    return folder


def make_wide(folder: Path) -> Path:
    """The workshop with recordings of the scenarios `WIDE`, made where they are not there yet."""
    for name, seconds in WIDE.items():
        if not (folder / f"wide_{name}").is_dir():
            _made("simulate", name, *FAST, "--set", f"duration={seconds}", "--out", folder / f"wide_{name}")
    return folder


def contents(folder: Path) -> dict[str, str]:
    """Digest of every file below by its name from there; `.railsim`, which holds digests itself, left out."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != ".railsim")
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def _made(*words: str | Path) -> None:
    if call(*words) not in (0, 1):
        raise InputError(f"'railsim {' '.join(map(str, words))}' failed; see above")


def copy_of(workshop: Path, names: Sequence[str], place: Path) -> None:
    """Copies of some of the inputs, as they are."""
    for name in names:
        source, target = workshop / name, place / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target)
        else:
            shutil.copyfile(source, target)
