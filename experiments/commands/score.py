"""`railsim score`: an estimate against the truth of its recording."""

import argparse
from collections.abc import Sequence
from typing import Any

from estimators.interface import Estimate
from experiments.commands.interface import Outcome, table
from experiments.score import score, score_rows
from railsim.errors import InputError
from railsim.recording import Recording


def execute(given: argparse.Namespace) -> Outcome:
    """Compute the scores."""
    estimate = Estimate.open(given.estimate)
    truth = Recording.open(given.recording).truth
    if truth is None:
        raise InputError(f"'{given.recording}' has no truth to score against; name the recording of a simulation")
    rows = score_rows(estimate.name, score(estimate, truth))
    return Outcome({"scores": rows}, score_table(rows))


def score_table(rows: Sequence[dict[str, Any]]) -> str:
    """Scores side by side: a row a score, a column an estimator."""
    names = list(dict.fromkeys(row["estimator"] for row in rows))
    keys = list(dict.fromkeys((row["score"], row["unit"]) for row in rows))
    values = {(row["score"], row["unit"], row["estimator"]): row["value"] for row in rows}
    lines = [[score, unit, *(values.get((score, unit, name)) for name in names)] for score, unit in keys]
    return table(["score", "unit", *names], lines)
