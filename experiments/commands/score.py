"""`railsim score`: an estimate against the truth of its recording."""

import argparse
from collections.abc import Sequence
from typing import Any

from estimators.interface import Estimate
from experiments.commands.interface import Outcome, table
from experiments.scoring.score import score, score_rows, unscored
from railsim.errors import InputError
from railsim.recording import Recording


def execute(given: argparse.Namespace) -> Outcome:
    """Compute the scores."""
    estimate = Estimate.open(given.estimate)
    truth = Recording.open(given.recording).truth
    if truth is None:
        raise InputError(f"'{given.recording}' has no truth to score against; name the recording of a simulation")
    rows = score_rows(estimate.name, score(estimate, truth))
    notes = [] if rows else [unscored(estimate)]
    return Outcome({"scores": rows, "notes": notes}, score_table(rows) if rows else f"Note: {notes[0]}")


def score_table(rows: Sequence[dict[str, Any]]) -> str:
    """Scores side by side: a row a score, a column an estimator; a table for each group of estimators that have the
    same scores.
    """
    values: dict[tuple[str, str], dict[str, float]] = {}
    for row in rows:
        values.setdefault((row["score"], row["unit"]), {})[row["estimator"]] = row["value"]
    groups: dict[tuple[str, ...], list[list[Any]]] = {}
    for (name, unit), found in values.items():
        groups.setdefault(tuple(found), []).append([name, unit, *found.values()])
    return "\n\n".join(table(["score", "unit", *names], lines) for names, lines in groups.items())
