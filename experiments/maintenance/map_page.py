"""A page with the condition on a map: one file, no network, drawn by its own script."""

import json
from html import escape
from importlib.resources import files
from typing import Any


def page(title: str, collection: dict[str, Any], lines: list[str]) -> str:
    """The page.

    Parameters
    ----------
    title : heading, as text.
    collection : GeoJSON as `condition_map.features` makes it.
    lines : what stands below the heading, as text.
    """
    template = (files("experiments.maintenance") / "map.html").read_text(encoding="utf-8")
    data = json.dumps(collection, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    safe = data.replace("<", "\\u003c").replace("&", "\\u0026")
    about = "".join(f"<p>{escape(line)}</p>" for line in lines)
    return template.replace("{{TITLE}}", escape(title)).replace("{{ABOUT}}", about).replace("{{DATA}}", safe)
