"""What every figure must do."""

import json
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from experiments.conformance.interface import Check, described
from experiments.figures.interface import Figure, publish_table
from experiments.reporting.size import Size
from railsim.scratch import scratch_folder

Kind = type[Figure]


def computed_drawn_and_checked(kind: Kind) -> Iterable[str]:
    """At its smallest size it writes a table and a picture, and its claims can be told."""
    figure = kind()
    yield from drawn_and_checked(figure, figure.compute(Size.SMOKE))


def drawn_and_checked(figure: Figure, table: pd.DataFrame) -> Iterable[str]:
    """What falls short of the files and the claims that a figure makes of its table."""
    with scratch_folder() as folder:
        published = publish_table(figure, table, folder)
        written, picture = (Path(folder) / f"{figure.name}.{ending}" for ending in ("csv", "png"))
        if len(written.read_text(encoding="utf-8").splitlines()) < 2:
            yield "its table has no row"
        if not picture.read_bytes().startswith(b"\x89PNG"):
            yield "its picture is none"
        json.dumps(published, allow_nan=False)
        if empty := [path for path in published["files"] if not Path(path).stat().st_size]:
            yield f"writes empty files: {', '.join(empty)}"
        if not published["claims"]:
            yield "claims nothing, so it checks nothing"
        for claim in published["claims"]:
            if claim["held"] and claim["value"] is None:
                yield f"claim '{claim['claim']}' is held without a value"
            if claim["low"] is not None and not claim["cases"]:
                yield f"claim '{claim['claim']}' has an interval of no cases"


CHECKS: tuple[Check[Kind], ...] = (described, computed_drawn_and_checked)
