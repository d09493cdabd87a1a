"""`railsim import`: turn measured data into a recording, or a track-recording car's file into a track.

examples:
  railsim import measured.csv --map map.yaml --out recording
"""

import argparse

from experiments.commands._out import add_overwrite, replaces
from experiments.reporting.outcome import Outcome


def configure(parser: argparse.ArgumentParser) -> None:
    """File, map and folder."""
    parser.add_argument(
        "file", metavar="FILE", nargs="+", help="CSV, Parquet, MDF, TDMS, MATLAB, HDF5, NMEA, GPX; or several"
    )
    parser.add_argument("--map", metavar="MAP.yaml", required=True, help="what its columns mean: docs/field_data.md")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the recording; track.csv for a track")
    add_overwrite(parser)


def execute(given: argparse.Namespace) -> Outcome:
    """Import, and say every assumption and repair."""
    from railsim.field.importing import import_file

    said = replaces(given.out, "recording", given.overwrite)
    done = import_file(given.file, given.map, given.out)
    result = {done.kind: str(given.out), "assumptions": done.notes.assumptions, "repairs": done.notes.repairs}
    lines = [f"{given.out}: {done.kind} from {', '.join(given.file)}"]
    lines = lines if said is None else [said, *lines]
    lines += [f"  assumed: {text}" for text in done.notes.assumptions]
    lines += [f"  repaired: {text}" for text in done.notes.repairs]
    return Outcome(result, "\n".join(lines))
