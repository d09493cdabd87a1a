"""Add the recording of a new format version to this folder: `python -m tests.formats.write`, once for each version.

What stands here already is never written again: it shows that recordings of that version can still be read.
"""

import sys
from pathlib import Path

import pandas as pd

from railsim import Recording, load_scenario, measure, simulate
from railsim.measurements import Measurements
from railsim.recording import FORMAT_VERSION

HERE = Path(__file__).parent
ROWS = (0, 1, 37)
"""Rows of each channel that are kept as numbers beside the recording."""


def samples(recording: Recording) -> pd.DataFrame:
    """A few samples of every channel, measured and true: columns channel, row, value."""
    assert recording.truth is not None
    found = []
    for source in (recording.measurements, recording.truth):
        for name in source.channels if isinstance(source, Measurements) else source.columns:
            values = source[name]
            found += [(name, row, float(values[row])) for row in ROWS if row < len(values)]
    return pd.DataFrame(found, columns=["channel", "row", "value"])


def main() -> int:
    """Write the recording of the present version, if it is not there."""
    folder = HERE / f"recording_{FORMAT_VERSION}"
    if folder.exists():
        print(f"{folder.name} stands already", file=sys.stderr)
        return 1
    scenario = load_scenario("wheelset_new").but(duration=0.5, track="smooth", output_rate=256.0)
    recording = measure(simulate(scenario, engine="compiled"), scenario, folder=folder)
    samples(recording).to_csv(HERE / f"recording_{FORMAT_VERSION}.csv", index=False, float_format="%.17g")
    return 0


if __name__ == "__main__":
    sys.exit(main())
