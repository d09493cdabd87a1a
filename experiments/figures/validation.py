"""The validation report: our numbers beside references that we did not make, one section per question."""

import io
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim
from experiments.reporting.plots import BLUE, GREY, RED
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section, sections
from experiments.validation.reference import VARIABLE
from experiments.validation.report import document
from experiments.validation.tables import of

SECTION = "section"
PICTURE_DPI = 100


class Validation(Figure):
    """An overview of all limits; beside it validation.html, and a table and a picture of each section."""

    def compute(self, size: Size) -> pd.DataFrame:
        """The tables of all sections, one below the other."""
        tables = [part.compute(size).assign(**{SECTION: part.name}) for part in sections() if not part.lacking()]
        table = pd.concat(tables, ignore_index=True)
        first = table.pop(SECTION)
        table.insert(0, SECTION, first)
        return table

    def draw(self, table: pd.DataFrame) -> Picture:
        """How much of its limit each comparison uses."""
        parts = [(part, [row for row in _rows(part, table) if row.used is not None]) for part in _checked(table)]
        parts = [(part, rows) for part, rows in parts if rows]
        picture = Picture(figsize=(10.0, 1.6 + 0.42 * len(parts)), layout="constrained")
        axes = picture.subplots()
        for line, (_, rows) in enumerate(parts):
            used = np.clip([row.used or 0.0 for row in rows], 1e-4, 100.0)
            spread = np.linspace(-0.25, 0.25, len(used)) if len(used) > 1 else np.zeros(1)
            held = np.array([bool(row.held) for row in rows])
            for chosen, colour, marker in ((held, BLUE, "o"), (~held, RED, "X")):
                axes.scatter(used[chosen], (line + spread)[chosen], s=30, marker=marker, color=colour, zorder=3)
        axes.axvline(1.0, color=RED, lw=1.0, ls=":")
        axes.set_yticks(range(len(parts)), [f"{part.number}  {part.title}" for part, _ in parts])
        axes.invert_yaxis()
        axes.set(xscale="log", xlabel="share of the limit that is used [-] (left end: 0.0001 or less; cross: not held)")
        axes.tick_params(axis="y", length=0, colors=GREY, labelcolor="black")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """One claim for each comparison with a limit."""
        rows = [row for part in _checked(table) for row in _rows(part, table)]
        claims = [row.claim() for row in rows]
        return [claim for claim in claims if claim is not None]

    def further(self, table: pd.DataFrame) -> Mapping[str, Callable[[Path], object]]:
        """The report, and the table of comparisons, the numbers and the picture of each section."""
        checked = _checked(table)
        pictures = {part.name: _picture(part, table) for part in checked}
        rows = {part.name: _rows(part, table) for part in checked}
        listings = {part.name: part.listing(_part(part, table)) for part in checked}
        everything = pd.DataFrame([row.cells() for found in rows.values() for row in found])
        files: dict[str, Callable[[Path], object]] = {
            "validation.html": lambda path: path.write_text(document(sections(), rows, listings, pictures), "utf-8"),
            "validation_comparisons.csv": partial(everything.to_csv, index=False),
        }
        for part in checked:
            stem = f"validation_{part.item:02d}{part.part}_{part.name}"
            files[f"{stem}.csv"] = partial(_part(part, table).to_csv, index=False)
            files[f"{stem}.png"] = partial(_write, data=pictures[part.name])
        return files

    def notes(self) -> list[str]:
        """Sections that cannot be checked."""
        return [f"{part.number} {part.title}: {not_checked(part)}" for part in sections() if part.lacking()]


def not_checked(part: Section) -> str:
    """Why a section has no rows, and how to mend it."""
    return (
        f"not checked: reference data not found ({', '.join(part.lacking())}); "
        f"put the folder at ../shared/reference or set {VARIABLE}"
    )


def _checked(table: pd.DataFrame) -> list[Section]:
    """The sections that are in the table."""
    there = set(table[SECTION])
    return [part for part in sections() if part.name in there]


def _part(part: Section, table: pd.DataFrame) -> pd.DataFrame:
    """A section's own table: its rows, and the columns that have any value there."""
    own = of(table, SECTION, part.name).drop(columns=SECTION)
    return pd.DataFrame(own.dropna(axis="columns", how="all").reset_index(drop=True))


def _rows(part: Section, table: pd.DataFrame) -> list[Row]:
    return part.rows(_part(part, table))


def _picture(part: Section, table: pd.DataFrame) -> bytes:
    """PNG."""
    picture = Picture(figsize=part.size, layout="constrained")
    part.draw(_part(part, table), picture)
    stream = io.BytesIO()
    picture.savefig(stream, dpi=PICTURE_DPI, format="png")
    return stream.getvalue()


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)
