"""Run the matrix: a circumstance is simulated and measured once, then every estimator works on it."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import joblib
from threadpoolctl import threadpool_limits

from experiments.circumstances import cells, verdicts
from experiments.circumstances.circumstance import Circumstance
from experiments.circumstances.recordings import check, recorded
from experiments.circumstances.verdicts import Cell
from experiments.sweep.plan import program_digest
from experiments.sweep.run import Interrupted
from railsim.errors import InputError
from railsim.files import json_text, read_json, replace_file
from railsim.progress import counting
from railsim.scenario import digest_of

FORMAT, FORMAT_VERSION = "railsim circumstances", 1
ABOUT, RECORDINGS = "circumstances.json", "recordings"


@dataclass(frozen=True)
class Matrix:
    """What is to be run.

    Attributes
    ----------
    circumstances : by name. estimators : names.
    folder : of cells. recordings : of recordings, which other runs may share.
    fast : shorter runs.
    """

    circumstances: dict[str, Circumstance]
    estimators: tuple[str, ...]
    folder: Path
    recordings: Path
    fast: bool = False
    program: str = field(default_factory=lambda: _program())

    def left(self, name: str) -> list[str]:
        """Estimators that have no cells in a circumstance yet."""
        key = cells.key_of(self.circumstances[name], self.fast, self.program)
        places = {one: cells.place(self.folder, name, one) for one in self.estimators}
        return [one for one, path in places.items() if cells.kept(path, key) is None]

    def cells(self) -> list[Cell]:
        """All that is there of what is asked for, in the order of circumstances and estimators."""
        found = []
        for name, circumstance in self.circumstances.items():
            key = cells.key_of(circumstance, self.fast, self.program)
            for estimator in self.estimators:
                found += cells.kept(cells.place(self.folder, name, estimator), key) or []
        return verdicts.excused(found)


@dataclass(frozen=True)
class Done:
    """How many estimates were made now, and by name why a circumstance could not be run."""

    estimates: int
    problems: dict[str, str]


def run_matrix(matrix: Matrix, names: list[str], jobs: int) -> Done:
    """Make what is missing of the circumstances `names`; one that cannot be simulated leaves the others as they are.

    Raises
    ------
    InputError : a circumstance has a wrong key or value; the folder is of another version of the program, or cannot be
        written.
    Interrupted : Ctrl-C.
    """
    _open(matrix)
    problems: dict[str, str] = {}
    with _written(matrix.folder), _written(matrix.recordings):
        left = {name: missing for name in names if (missing := matrix.left(name))}
        for name in left:
            check(name, matrix.circumstances[name], matrix.fast, matrix.recordings)
        total = sum(map(len, left.values()))
        with counting(total, "circumstances", "estimates", in_files=True) as bar:
            try:
                for name, problem in _performed(matrix, left, jobs):
                    bar.update(len(left[name]))
                    if problem:
                        problems[name] = problem
            except KeyboardInterrupt:
                raise Interrupted("interrupted; what is finished is kept: the same command goes on") from None
    return Done(total - sum(len(left[name]) for name in problems), problems)


def perform(matrix: Matrix, name: str, estimators: list[str]) -> tuple[str, str]:
    """Make the cells of one circumstance; runs in a process of its own where there are several jobs.

    Returns
    -------
    The name, and why the circumstance could not be simulated, empty where it could.
    """
    circumstance = matrix.circumstances[name]
    key = cells.key_of(circumstance, matrix.fast, matrix.program)
    here = {"circumstance": name, "group": circumstance.group, "base": circumstance.base}
    with threadpool_limits(1):
        try:
            recording = recorded(name, circumstance, matrix.fast, matrix.recordings)
        except InputError as error:
            return name, str(error)
        for estimator in estimators:
            made = cells.run_estimator(estimator, recording, here)
            cells.keep(cells.place(matrix.folder, name, estimator), key, made)
    return name, ""


def _performed(matrix: Matrix, left: dict[str, list[str]], jobs: int) -> Iterator[tuple[str, str]]:
    if jobs == 1 or len(left) < 2:
        for name, missing in left.items():
            yield perform(matrix, name, missing)
        return
    parallel: Any = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")
    yield from parallel(joblib.delayed(perform)(matrix, name, missing) for name, missing in left.items())


def _program() -> str:
    """Digest of all that shapes a cell."""
    own = [Path(str(module.__file__)).read_text(encoding="utf-8") for module in (cells, verdicts)]
    return digest_of([program_digest(), own])


def _open(matrix: Matrix) -> None:
    """Note in the folder what its cells were made with; refuse one of another version."""
    path = matrix.folder / ABOUT
    if path.exists():
        about = read_json(path, "the folder of a matrix")
        if (about.get("format"), about.get("format_version")) != (FORMAT, FORMAT_VERSION):
            raise InputError(f"'{matrix.folder}' holds no matrix of version {FORMAT_VERSION}; name another folder")
        if (about.get("program"), about.get("fast")) != (matrix.program, matrix.fast):
            raise InputError(
                f"'{matrix.folder}' was begun by another version of railsim, or with other --fast; name another folder "
                f"(its recordings can be used again: --recordings {matrix.folder / RECORDINGS})"
            )
        return
    if matrix.folder.is_file() or (matrix.folder.is_dir() and any(_others(matrix))):
        raise InputError(f"'{matrix.folder}' holds something else; name a new or empty folder")
    about = {"format": FORMAT, "format_version": FORMAT_VERSION, "program": matrix.program, "fast": matrix.fast}
    about["begun"] = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    with _written(matrix.folder):
        replace_file(path, json_text(about).encode())


def _others(matrix: Matrix) -> Iterator[Path]:
    return (entry for entry in matrix.folder.iterdir() if entry.resolve() != matrix.recordings.resolve())


@contextmanager
def _written(folder: Path) -> Iterator[None]:
    """The folder, made where it is missing; a disk that cannot be written is told in one line."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(13, os.strerror(13))
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"cannot write '{folder}': {reason}; name a folder that can be written") from None
