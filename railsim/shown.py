"""How values show themselves in a notebook: a title and a table."""

from collections.abc import Iterable, Sequence
from html import escape


def html(title: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """HTML of a table below a title; all of it is text."""
    lines = ["".join(f"<td>{escape(str(cell))}</td>" for cell in row) for row in rows]
    head = "".join(f"<th>{escape(name)}</th>" for name in heads)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<p><b>{escape(title)}</b></p><table><tr>{head}</tr>{body}</table>"
