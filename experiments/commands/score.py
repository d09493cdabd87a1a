"""`railsim score`: compare an estimate with the truth of its recording.

examples:
  railsim score estimate recording
"""

import argparse

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import score_table
from railsim.errors import InputError


def configure(parser: argparse.ArgumentParser) -> None:
    """Estimate and recording."""
    parser.add_argument("estimate", metavar="ESTIMATE_DIR", help="folder of an estimate")
    parser.add_argument("recording", metavar="RECORDING", help="recording that it was made from, with its truth")


def execute(given: argparse.Namespace) -> Outcome:
    """Compute the scores."""
    from estimators.interface import Estimate
    from experiments.scoring.score import score, score_rows, unscored
    from railsim.recording import Recording

    estimate = Estimate.open(given.estimate)
    truth = Recording.open(given.recording).truth
    if truth is None:
        raise InputError(f"'{given.recording}' has no truth to score against; name the recording of a simulation")
    rows = score_rows(estimate.name, score(estimate, truth, progress=True))
    notes = [] if rows else [unscored(estimate)]
    return Outcome({"scores": rows, "notes": notes}, score_table(rows) if rows else f"Note: {notes[0]}")
