"""The report as one HTML file: headings, words, tables, pictures inside."""

import base64
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
import pandas as pd

from experiments.validation.interface import Row, Section
from experiments.validation.reference import VARIABLE

_STYLE = """
body { font: 15px/1.45 sans-serif; max-width: 1200px; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 0.8em 0; font-size: 13px; }
th, td { border-bottom: 1px solid #ddd; padding: 0.2em 0.7em; text-align: right; vertical-align: top; }
th { border-bottom: 2px solid #888; } .words { text-align: left; } img { max-width: 100%; }
.failed { color: #d55e00; font-weight: bold; } .source { color: #666; font-size: 13px; }
"""


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
        body.append(f'<p class="source">Source: {escape(part.source)}</p>')
    head = f'<meta charset="utf-8"><title>railsim: validation report</title><style>{_STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{chr(10).join(body)}\n</body></html>\n'


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
    image = base64.b64encode(picture).decode()
    found = [_table(titles, cells, words=1), f'<img alt="plots" src="data:image/png;base64,{image}">']
    if listing is not None:
        found.append("<p>Every deviation (ours minus reference):</p>")
        lines = [[f"{value:.3g}" for value in line] for line in listing.to_numpy(float)]
        found.append(_table([escape(str(column)) for column in listing], lines, words=0))
    return found


def _verdict(held: bool | None) -> str:
    if held is None:
        return ""
    return "held" if held else '<span class="failed">NOT HELD</span>'


def _table(titles: Sequence[str], lines: Sequence[Sequence[str]], words: int) -> str:
    """`words`: so many first columns are text, set to the left; cells are HTML already."""

    def line(cells: Sequence[str], tag: str) -> str:
        marks = [' class="words"' if place < words else "" for place in range(len(cells))]
        return "<tr>" + "".join(f"<{tag}{m}>{cell}</{tag}>" for m, cell in zip(marks, cells, strict=True)) + "</tr>"

    return "<table>\n" + "\n".join([line(titles, "th"), *(line(cells, "td") for cells in lines)]) + "\n</table>"
