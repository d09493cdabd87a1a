"""How often verdicts on cases of known truth are right: what a statement is worth, and the table of all of them."""

import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discrepancy.core.verdict import Action
from experiments.reporting.intervals import of_share
from experiments.reporting.text import table

NINETY = 1.645  # standard deviations of a 90 % interval
DETECTABLE = 10.0  # nats of the true hypothesis over none
STATED = ((0.0, 0.5), (0.5, 0.8), (0.8, 0.9), (0.9, 1.0))  # probabilities of the state that leads
TITLES = {
    "null": "nulls", "effect": "effects", "foreign": "foreign laws", "withheld": "withheld effects", "pair": "pairs",
}  # fmt: skip
"""Of the kinds of cases: `foreign`: a law that is in nobody's library; `withheld`: an effect that the library is
denied.
"""

Rows = Sequence[Mapping[str, Any]]


def dealt(index: int, kinds: Sequence[str], settings: Sequence[str]) -> tuple[str, str]:
    """Kind and setting of a case: kinds one by one, and after each round the settings go on by one."""
    return kinds[index % len(kinds)], settings[(index // len(kinds) + index) % len(settings)]


def judged(kind: str, families: Collection[str], place: str | None, action: Action) -> str:
    """right, in a set, half, missed, refused (unknown), refused elsewhere, wrong; outside the library a name is wrong.

    families, place : what is true; `place` None where an unknown may be said at any.
    """
    said, true = set(action.families), set(families)
    if action.kind == "none":
        return "right" if kind == "null" else "missed"
    outside = kind in ("foreign", "withheld")
    if outside and action.kind == "unknown":
        return "right" if place in (None, action.place) else "refused elsewhere"
    if action.kind == "unknown":
        return "wrong" if kind == "null" else "refused"
    if outside or not said & true:
        return "wrong"
    if kind == "effect":
        return "right" if said == true and action.place is None else "in a set" if action.kind == "set" else "half"
    return "right" if said == true and action.kind == "pair" else "half"


def read_rows(folder: Path, name: str, seed: int) -> list[dict[str, Any]]:
    """All answered cases of a seed."""
    return [json.loads(path.read_text()) for path in sorted(folder.glob(f"{name}_{seed}_*.json"))]


def score(rows: Rows, settings: Sequence[str]) -> list[list[Any]]:
    """Rows of the table: what, hits, cases, share and its interval of 95 % (Clopper and Pearson)."""
    kinds = {kind: [row["judged"] for row in rows if row["kind"] == kind] for kind in TITLES}
    found = [share("nulls right", [one == "right" for one in kinds["null"]])]
    for setting in settings:
        here = [row["judged"] == "right" for row in rows if row["kind"] == "null" and row["setting"] == setting]
        found.append(share(f"nulls right: {setting}", here))
    for kind, title in TITLES.items():
        if kind != "null" and kinds[kind]:
            for outcome in dict.fromkeys(("right", *sorted(kinds[kind]))):
                found.append(share(f"{title}: {outcome}", [one == outcome for one in kinds[kind]]))
    clear = [row for row in rows if row["kind"] == "effect" and (row["own"] is None or row["own"] > DETECTABLE)]
    found.append(share("effects worth 10 nats: right", [row["judged"] == "right" for row in clear]))
    wrong = [row["judged"] == "wrong" for row in rows if row["kind"] in ("effect", "pair")]
    found.append(share("effects and pairs: a wrong name", wrong))
    for low, high in STATED:
        here = [row["leads"] for row in rows if low < row["stated"] <= high]
        found.append(share(f"true where {low:.1f} to {high:.1f} is stated", here))
    errors = [error for row in rows if row["kind"] == "effect" for error in row["covered"].values()]
    found.append(share("sizes of single effects within 90 % intervals", [abs(error) < NINETY for error in errors]))
    return found


def share(title: str, hits: Sequence[bool]) -> list[Any]:
    """A row of the table."""
    interval = of_share(np.array(hits, bool))
    return [title, sum(hits), len(hits), sum(hits) / len(hits) if hits else None, interval.low, interval.high]


def page(title: str, rows: Rows, scores: Sequence[Sequence[Any]]) -> str:
    """As text, with the seconds of a verdict."""
    seconds = np.median([row["seconds"] for row in rows]) if rows else 0.0
    titles = [title, "hits", "cases", "share", "from", "to"]
    return f"{table(titles, scores, 2)}\n\n{seconds:.1f} s a verdict (median)"
