"""Pieces of HTML pages that stand alone: style and pictures are inside."""

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape

from matplotlib.figure import Figure

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1150px; margin: 2em auto; padding: 0 1em; color: #222; }
h1 { font-size: 1.5em; }
h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #ccc; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 0.6em 0; font-size: 13px; }
td, th { padding: 0.15em 0.7em; border-bottom: 1px solid #e4e4e4; text-align: left; vertical-align: top; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
.note { color: #666; font-size: 13px; }
.failed { color: #d55e00; font-weight: bold; }
.plain { background: #f4f6f5; padding: 0.8em 1em; border-left: 4px solid #2a7f62; }
"""


def page(title: str, parts: Iterable[str]) -> str:
    """A whole page of these parts, which are HTML; the title is text."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    body = "\n".join(parts)
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def table(titles: Sequence[str], rows: Iterable[Sequence[str]], numeric: Sequence[bool]) -> str:
    """A table; titles and cells are HTML, and those of numeric columns are set to the right."""

    def line(cells: Sequence[str], tag: str) -> str:
        marks = [' class="number"' if right else "" for right in numeric]
        return "<tr>" + "".join(f"<{tag}{m}>{cell}</{tag}>" for m, cell in zip(marks, cells, strict=True)) + "</tr>"

    return "<table>\n" + "\n".join([line(titles, "th"), *(line(cells, "td") for cells in rows)]) + "\n</table>"


def image(name: str, data: bytes) -> str:
    """A picture (PNG) inside the page."""
    return f'<img alt="{escape(name)}" src="data:image/png;base64,{base64.b64encode(data).decode()}">'


def png(figure: Figure, dpi: int) -> bytes:
    """A figure as PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi)
    return stream.getvalue()
