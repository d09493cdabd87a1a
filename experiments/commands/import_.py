"""`railsim import`: measured data becomes a recording, a track-recording car's file a track."""

import argparse

from experiments.commands.interface import Outcome
from railsim.field.importing import import_file


def execute(given: argparse.Namespace) -> Outcome:
    """Import, and say every assumption and repair."""
    done = import_file(given.file, given.map, given.out)
    result = {done.kind: str(given.out), "assumptions": done.notes.assumptions, "repairs": done.notes.repairs}
    lines = [f"{given.out}: {done.kind} from {given.file}"]
    lines += [f"  assumed: {text}" for text in done.notes.assumptions]
    lines += [f"  repaired: {text}" for text in done.notes.repairs]
    return Outcome(result, "\n".join(lines))
