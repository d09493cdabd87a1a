"""A page with the condition: map, traces and tables in one file, no network, drawn by its own scripts."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
import pandas as pd

from experiments.maintenance.kilometre import Kilometre


def page(
    title: str,
    collection: dict[str, Any],
    lines: list[str],
    traces: Sequence[dict[str, Any]] = (),
    tables: Mapping[str, pd.DataFrame] | None = None,
    along: Kilometre | None = None,
) -> str:
    """The page.

    Parameters
    ----------
    title : heading, as text.
    collection : GeoJSON as `condition_map.features` makes it.
    lines : what stands below the heading, as text.
    traces : as `traces.traces` makes them; none: no chart is drawn.
    tables : by heading; a row that has "s [m]" leads to its place.
    along : kilometrage of the line, by which traces are labelled; None: by distance.
    """
    folder = files("experiments.maintenance")
    drawn = {
        "TITLE": escape(title),
        "ABOUT": "".join(f"<p>{escape(line)}</p>" for line in lines),
        "DATA": _json(collection),
        "TRACES": _json(list(traces)),
        "ALONG": _json({"zero": (along or Kilometre()).zero or 0.0, "slope": (along or Kilometre()).slope}),
        "TABLES": _json([_plain(heading, table) for heading, table in (tables or {}).items()]),
        "CHART": "" if traces else "hidden",
        "SCRIPT": (folder / "traces.js").read_text(encoding="utf-8") if traces else "",
    }
    text = (folder / "map.html").read_text(encoding="utf-8")
    parts = text.split("{{")
    return parts[0] + "".join(drawn[name] + rest for name, _, rest in (part.partition("}}") for part in parts[1:]))


def _json(values: Any) -> str:
    """JSON that cannot end the script element in which it stands."""
    text = json.dumps(values, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("&", "\\u0026")


def _plain(heading: str, table: pd.DataFrame) -> dict[str, Any]:
    rows = [[_cell(value) for value in row] for row in table.itertuples(index=False, name=None)]
    return {"heading": heading, "columns": [str(name) for name in table.columns], "rows": rows}


def _cell(value: Any) -> Any:
    if isinstance(value, float | np.floating):
        return float(f"{value:.6g}") if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
