"""Files of results: the cells, the matrix as a table and as a picture."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from experiments.circumstances import report
from experiments.circumstances.picture import draw
from experiments.circumstances.run import Matrix
from experiments.circumstances.verdicts import Cell
from experiments.reporting.claims import Claim
from railsim.files import new_file

DPI = 130


def write_results(
    matrix: Matrix, cells: Sequence[Cell], claims: Sequence[Claim], beside: pd.DataFrame | None
) -> list[Path]:
    """Write cells.csv, matrix.md and matrix.png, and against.csv where there is another run; each whole or not at all.

    Raises
    ------
    InputError : the folder cannot be written.
    """
    picture = draw(matrix.circumstances, matrix.estimators, report.merged(cells))
    text = report.markdown(matrix.circumstances, matrix.estimators, cells, claims)
    table = report.frame(cells)
    files: dict[str, Callable[[Path], object]] = {
        "cells.csv": lambda path: table.to_csv(path, index=False, float_format="%.6g"),
        "matrix.md": lambda path: path.write_text(text, encoding="utf-8"),
        "matrix.png": lambda path: picture.savefig(path, dpi=DPI, format="png"),
    }
    if beside is not None:
        files["against.csv"] = lambda path: beside.to_csv(path, index=False, float_format="%.6g")
    return [_replace(matrix.folder / name, write) for name, write in files.items()]


def _replace(path: Path, write: Callable[[Path], object]) -> Path:
    with new_file(path) as aside:
        write(aside)
    return path
