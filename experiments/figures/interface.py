"""What a figure is: a table that is computed, a picture drawn from it, and claims that it must bear out."""

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.reporting.claims import Claim
from experiments.reporting.size import Size
from experiments.reporting.style import save_picture
from experiments.reporting.text import first_sentence
from railsim.files import new_file
from railsim.plots.style import styled
from railsim.registry import Kind


class Figure(ABC):
    """One figure; its name is that of the module that defines it."""

    @property
    def name(self) -> str:
        """Name of the figure."""
        return type(self).__module__.rpartition(".")[2]

    @classmethod
    def summary(cls) -> str:
        """What the figure shows, in one sentence: the first of its module's docstring."""
        return first_sentence(sys.modules[cls.__module__].__doc__ or cls.__doc__ or "")

    @abstractmethod
    def compute(self, size: Size) -> pd.DataFrame:
        """The numbers behind the picture; the same columns at every size."""

    @abstractmethod
    def draw(self, table: pd.DataFrame) -> Picture:
        """The picture."""

    @abstractmethod
    def check(self, table: pd.DataFrame) -> list[Claim]:
        """The claims, each held, not held or undecided."""

    def further(self, table: pd.DataFrame) -> Mapping[str, Callable[[Path], object]]:
        """Files beside NAME.csv, NAME.png and NAME.svg: what writes each, by its name. Most figures have none."""
        del table
        return {}

    def notes(self) -> list[str]:
        """What a reader of the claims must know, in lines: for example what could not be checked, and why."""
        return []


FIGURES = Kind("figures", "experiments.figures", Figure)


def publish(figure: Figure, folder: Path | str, size: Size) -> dict[str, Any]:
    """Compute, draw and check a figure; write NAME.csv, NAME.png, NAME.svg and its further files.

    Each file appears whole or not at all.

    Returns
    -------
    The figure's part of the command's JSON: "files" and "claims".

    Raises
    ------
    InputError : the folder cannot be written.
    """
    try_folder(folder)
    return publish_table(figure, figure.compute(size), folder)


def try_folder(folder: Path | str) -> None:
    """Raise `InputError` where the folder cannot be written."""
    _replace(Path(folder), ".probe", lambda path: path.touch(), keep=False)


def publish_table(figure: Figure, table: pd.DataFrame, folder: Path | str) -> dict[str, Any]:
    """Draw and check what a figure has computed; see `publish`."""
    folder = Path(folder)
    with styled():
        picture = figure.draw(table)
        pictures = {f"{figure.name}.{kind}": partial(save_picture, picture, kind=kind) for kind in ("png", "svg")}
        writers = {f"{figure.name}.csv": partial(table.to_csv, index=False), **pictures, **figure.further(table)}
        files = [_replace(folder, name, write) for name, write in writers.items()]
    return {"files": [str(path) for path in files], "claims": [asdict(claim) for claim in figure.check(table)]}


def _replace(folder: Path, name: str, write: Callable[[Path], object], keep: bool = True) -> Path:
    """Let `write` fill a file aside, then rename it to `name`."""
    with new_file(folder / name, keep) as aside:
        write(aside)
    return folder / name
