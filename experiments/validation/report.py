"""The report as one HTML file: headings, words, tables, pictures inside."""

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
import pandas as pd

from experiments.reporting import html
from experiments.validation.interface import Row, Section
from experiments.validation.reference import VARIABLE


def document(
    parts: Sequence[Section],
    rows: Mapping[str, Sequence[Row]],
    listings: Mapping[str, pd.DataFrame | None],
    pictures: Mapping[str, bytes],
) -> str:
    """The whole report.

    Parameters
    ----------
    parts : every section in order. rows, listings, pictures (PNG) : by the name of the section; one without
    rows was not checked because its reference data are absent.
    """
    body = [
        "<h1>railsim: validation report</h1>",
        "<p>Each section compares numbers of this program with a reference that it did not make, or with an identity. "
        "Difference: ours minus reference, in the same unit. A row without a limit is told for information only.</p>",
        _summary(parts, rows),
    ]
    for part in parts:
        body.append(f'<h2 id="{part.name}">{part.number}. {escape(part.title)}</h2>')
        body.append(f"<p>{escape(part.about)}</p>")
        if part.name in rows:
            body += _results(rows[part.name], listings[part.name], pictures[part.name])
        else:
            body.append(f'<p class="failed">{escape(_absent(part))}</p>')
        body.append(f'<p class="note">Source: {escape(part.source)}</p>')
    return html.page("railsim: validation report", body)


def number(value: float | None) -> str:
    """Five significant digits; nothing for None."""
    return "" if value is None else (f"{value:.5g}" if np.isfinite(value) else "none")


def _absent(part: Section) -> str:
    files = ", ".join(part.lacking())
    return f"Not checked: reference data not found ({files}). Put the folder at ../shared/reference or set {VARIABLE}."


def _summary(parts: Sequence[Section], rows: Mapping[str, Sequence[Row]]) -> str:
    cells = []
    for part in parts:
        claimed = [row for row in rows.get(part.name, ()) if row.held is not None]
        failed = sum(not row.held for row in claimed)
        result = f"{len(claimed) - failed} of {len(claimed)}" if part.name in rows else "not checked"
        link = f'<a href="#{part.name}">{escape(part.title)}</a>'
        cells.append([part.number, link, result, _verdict(not failed) if part.name in rows else ""])
    return _table(["", "section", "limits held", ""], cells, words=2)


def _results(rows: Sequence[Row], listing: pd.DataFrame | None, picture: bytes) -> list[str]:
    cells = []
    for row in rows:
        words = [escape(row.what)]
        values = [number(row.ours), number(row.reference), number(row.difference)]
        cells.append([*words, *values, escape(row.unit), escape(row.limit), _verdict(row.held), escape(row.source)])
    titles = ["quantity", "ours", "reference", "difference", "unit", "limit", "", "source"]
    parts = [_table(titles, cells, words=1), html.image("plots", picture)]
    if listing is not None:
        parts.append("<p>Every deviation (ours minus reference):</p>")
        cells_of_listing = [[f"{value:.3g}" for value in line] for line in listing.to_numpy(float)]
        parts.append(_table([escape(str(column)) for column in listing], cells_of_listing, words=0))
    return parts


def _verdict(held: bool | None) -> str:
    if held is None:
        return ""
    return "held" if held else '<span class="failed">NOT HELD</span>'


def _table(titles: Sequence[str], lines: Sequence[Sequence[str]], words: int) -> str:
    """`words`: so many first columns are text; cells are HTML already."""
    return html.table(titles, lines, [place >= words for place in range(len(titles))])
