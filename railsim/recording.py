"""Recording: the folder with measured channels, what is known about them and, for simulations only, the truth."""

import platform
import re
import shutil
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np
import pandas as pd

from railsim.digests import as_written, check_as_written
from railsim.errors import InputError, Noticed
from railsim.files import read_json, write_folder_atomically, write_json
from railsim.measurements import Measurements
from railsim.parquet import read_columns, read_names, write_frame
from railsim.truth import HeldTruth, Truth

__all__ = ["Measurements", "Recording", "software_versions", "write_recording"]

FORMAT = "railsim recording"
FORMAT_VERSION = 1
_ABOUT = "about.json"
_WHAT = "a recording"
_RATE = re.compile(r"(\d+(?:\.\d+)?)hz")
_SOFTWARE = ("railsim", "exudyn", "numba", "numpy", "pandas", "pyarrow", "scipy")


@dataclass(frozen=True)
class Recording:
    """A recording folder.

    Attributes
    ----------
    folder : where it is.
    measurements : all that an estimator may see.
    truth : the simulated run behind it; None in the field or in a blind challenge.
    """

    folder: Path
    measurements: Measurements
    truth: Truth | None

    @classmethod
    def open(cls, folder: Path | str) -> Self:
        """Read the measured channels into memory and open the truth where there is one.

        Raises
        ------
        InputError : missing, cut short, of another format version or inconsistent; one line that names the part.
        """
        folder = Path(folder)
        measurements = read_measurements(folder)
        return cls(folder, measurements, Truth.open(folder / "truth") if (folder / "truth").is_dir() else None)

    @property
    def true_track(self) -> Path | None:
        """The track file of the simulation; None without truth; `InputError` where it is not as it was written."""
        return self._true("track.csv")

    @property
    def scenario(self) -> str | None:
        """The full scenario as YAML text, with its effects and seeds; None without truth."""
        path = self._true("scenario.yaml")
        return path.read_text(encoding="utf-8") if path else None

    def _true(self, name: str) -> Path | None:
        path = self.folder / "truth" / name
        check_as_written(self.folder, f"truth/{name}")
        return path if path.is_file() else None


def read_measurements(folder: Path | str) -> Measurements:
    """The measured part of a recording; a truth beside it is not opened.

    Raises
    ------
    InputError : as `Recording.open`.
    """
    folder = Path(folder)
    about = read_json(folder / _ABOUT, _WHAT)
    if about.get("format") != FORMAT:
        raise InputError(
            f"'{folder}' is not {_WHAT}: its about.json does not state the format '{FORMAT}'; name another"
        )
    if about.get("format_version") != FORMAT_VERSION:
        found = about.get("format_version")
        raise InputError(f"'{folder}' has format version {found!r}; this railsim reads {FORMAT_VERSION}")
    for name in (_ABOUT, "track.csv"):
        if not as_written(folder, name):
            warnings.warn(f"'{folder / name}' is not as railsim wrote it: edited, or damaged", Noticed, stacklevel=2)
    try:
        return Measurements(about, _read_tables(folder, about), _read_track(folder / "track.csv"))
    except InputError as error:
        text = str(error)
        raise InputError(text if str(folder) in text else f"'{folder}': {text}") from None


def write_recording(
    folder: Path | str,
    frames: Mapping[float, pd.DataFrame],
    about: dict[str, Any],
    truth: Truth | None = None,
    *,
    track: pd.DataFrame | None = None,
    true_track: Path | None = None,
    scenario: str | None = None,
    further: Mapping[str, Path] = MappingProxyType({}),
) -> Path:
    """Write a recording; it appears whole or not at all, and an older one stays until then.

    Parameters
    ----------
    folder : a new or empty folder, or one that railsim wrote.
    frames : by sample rate in Hz, "time [s]" and the channels.
    about : "origin" (text), "vehicle" (nominal parameters in SI units by field name, and "name"), "sensors" (data
        sheets); further keys as a field engineer knows them. Format, number of rows and software versions are added.
    truth : the simulated run, copied into `truth/`.
    track : the track as it was measured, first column "s [m]".
    true_track : the track file of the simulation, copied into `truth/`.
    scenario : YAML text of the full scenario, for `truth/`.
    further : files that the scenario names, copied into `truth/` under these names.

    Returns
    -------
    The folder.

    Raises
    ------
    InputError : the folder cannot be written, or the contents could not be read back as a recording.
    """
    if truth is None and (true_track is not None or scenario is not None):
        raise ValueError("a true track and a scenario belong to a truth")
    files = {f"{rate:.10g}hz.parquet": frame for rate, frame in sorted(frames.items())}
    head = {"format": FORMAT, "format_version": FORMAT_VERSION}
    rows = {name: {"rows": len(frame)} for name, frame in files.items()}
    stated = {**head, **about, **head, "measured": rows, "software": software_versions()}
    Measurements(stated, frames, track)
    with write_folder_atomically(folder) as aside:
        (aside / "measured").mkdir()
        for name, frame in files.items():
            write_frame(aside / "measured" / name, frame)
        if track is not None:
            track.to_csv(aside / "track.csv", index=False)
        if truth is not None:
            _copy_truth(truth, aside / "truth", true_track, scenario)
            for name, path in further.items():
                shutil.copyfile(path, aside / "truth" / name)
        write_json(aside / _ABOUT, stated)
    return Path(folder)


def software_versions() -> dict[str, str]:
    """Versions of Python and of the packages that shape the numbers; "not installed" where one is missing."""
    return dict(_versions())


@cache
def _versions() -> Mapping[str, str]:
    """Read once a process: what has been imported does not change any more."""
    versions = {"python": platform.python_version()}
    for name in _SOFTWARE:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def _copy_truth(truth: Truth, target: Path, true_track: Path | None, scenario: str | None) -> None:
    try:
        if isinstance(truth, HeldTruth):
            truth.write(target)
        else:
            shutil.copytree(truth.folder, target)
        if true_track is not None:
            shutil.copyfile(true_track, target / "track.csv")
    except FileNotFoundError as error:
        raise InputError(f"'{error.filename}' has gone; simulate again") from None
    if scenario is not None:
        (target / "scenario.yaml").write_text(scenario, encoding="utf-8")


def _read_tables(folder: Path, about: dict[str, Any]) -> dict[float, dict[str, np.ndarray]]:
    paths = sorted((folder / "measured").glob("*.parquet"))
    check_as_written(folder, *(f"measured/{path.name}" for path in paths))
    stated = about.get("measured", {path.name: {} for path in paths})
    names = sorted(path.name for path in paths)
    if not names and (folder / "features").is_dir():
        raise InputError(
            f"'{folder}' holds no raw data any more: they were reduced to '{folder / 'features'}'; read those, or "
            "import the data again"
        )
    if not isinstance(stated, dict) or not names or sorted(stated) != names:
        listed = ", ".join(sorted(stated)) if isinstance(stated, dict) else ""
        raise InputError(f"measured/ must hold the tables {listed or '<rate>hz.parquet'}; make or copy it again")
    return dict(_read_table(path, stated[path.name]) for path in paths)


def _read_table(path: Path, stated: Any) -> tuple[float, dict[str, np.ndarray]]:
    rate = _RATE.fullmatch(path.stem)
    if not rate:
        raise InputError(f"'{path}': name the file by its sample rate, for example 256hz.parquet")
    names, rows = read_names(path)
    due = stated.get("rows", rows) if isinstance(stated, dict) else rows
    if rows != due:
        raise InputError(f"'{path}' has {rows} rows where about.json states {due}; make or copy it again")
    if len(set(names)) != len(names):
        raise InputError(f"'{path}': a column appears twice; rename one")
    return float(rate[1]), read_columns(path, names)


def _read_track(path: Path) -> pd.DataFrame | None:
    if not path.exists():
        return None
    try:
        return pd.read_csv(path, comment="#")
    except (OSError, ValueError):
        raise InputError(f"'{path}' is not a table of comma-separated values; mend or remove it") from None
