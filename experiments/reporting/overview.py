"""One page of a folder of results that has none of its own: its summary, tables and pictures."""

import json
from html import escape
from pathlib import Path

import pandas as pd

from experiments.reporting.html import image, page, table
from railsim.errors import InputError

MOST_ROWS = 200
_FACTS = ("scenario", "engine", "seed", "duration [s]", "distance [m]", "name", "recording", "origin")


def overview(folder: Path) -> str:
    """HTML that stands alone.

    Raises
    ------
    InputError : the folder holds neither a summary nor a table nor a picture.
    """
    facts = [_facts(folder / name) for name in ("summary.json", "about.json")]
    tables = [_table(path) for path in sorted(folder.glob("*.csv"))]
    shown = [path for path in sorted(folder.rglob("*.png")) if path.is_file()]
    pictures = [
        f"<h2>{escape(str(path.relative_to(folder)))}</h2>{image(path.stem, path.read_bytes())}" for path in shown
    ]
    parts = [part for part in (*facts, *tables, *pictures) if part]
    if not parts:
        raise InputError(f"'{folder}' holds no page, summary, table or picture; name the folder that --out named")
    return page(folder.resolve().name, [f"<h1>{escape(folder.resolve().name)}</h1>", *parts])


def _facts(path: Path) -> str:
    """The simple values of a JSON file that say what the result is of."""
    if not path.is_file():
        return ""
    values = json.loads(path.read_text(encoding="utf-8"))
    rows = [(key, str(values[key])) for key in _FACTS if isinstance(values.get(key), str | int | float)]
    notes = [f'<p class="note">{escape(str(note))}</p>' for note in values.get("notes", [])]
    cells = [(escape(key), escape(value)) for key, value in rows]
    return table(("what", "value"), cells, (False, False)) + "".join(notes) if rows else ""


def _table(path: Path) -> str:
    """A CSV file; of a long one the first rows."""
    frame = pd.read_csv(path, comment="#")
    part = frame.head(MOST_ROWS)
    numeric = [kind.kind in "if" for kind in frame.dtypes]
    rows = [[_cell(value) for value in row] for row in part.itertuples(index=False)]
    more = "" if len(frame) == len(part) else f'<p class="note">{len(frame)} rows; the first {len(part)} are shown</p>'
    return f"<h2>{escape(path.name)}</h2>" + table([escape(str(name)) for name in frame.columns], rows, numeric) + more


def _cell(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else escape(str(value))
