"""What every figure must do."""

import json
import tempfile
from collections.abc import Iterable
from pathlib import Path

from experiments.conformance.interface import Check, described
from experiments.figures.interface import Figure, publish
from experiments.reporting.size import Size

Kind = type[Figure]


def computed_drawn_and_checked(kind: Kind) -> Iterable[str]:
    """At its smallest size it writes a table and a picture, and its claims can be told."""
    figure = kind()
    with tempfile.TemporaryDirectory() as folder:
        published = publish(figure, folder, Size.SMOKE)
        table, picture = (Path(folder) / f"{figure.name}.{ending}" for ending in ("csv", "png"))
        if len(table.read_text(encoding="utf-8").splitlines()) < 2:
            yield "its table has no row"
        if not picture.read_bytes().startswith(b"\x89PNG"):
            yield "its picture is none"
        json.dumps(published["claims"], allow_nan=False)
        for claim in published["claims"]:
            if not claim["claim"] or not claim["target"]:
                yield f"claim {claim} says nothing"


CHECKS: tuple[Check[Kind], ...] = (described, computed_drawn_and_checked)
