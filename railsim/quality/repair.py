"""What findings change in a recording: a cleaned copy, with a log; the original is only read."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from railsim.measurements import Measurements
from railsim.quality.draft import Draft, tables_of
from railsim.quality.interface import Finding
from railsim.recording import Recording, write_recording


def repaired(measured: Measurements, findings: Sequence[Finding]) -> Measurements:
    """A copy in which each finding's repair is made; notes change nothing."""
    repairs = [(one.repair, one) for one in findings if one.severity == "fault" and one.repair is not None]
    if not repairs:
        return measured
    draft = Draft(measured, tables_of(measured))
    for repair, finding in sorted(repairs, key=lambda pair: pair[0].stage):
        repair.apply(draft, finding)
    return draft.result()


def write_repaired(
    recording: Recording, measured: Measurements, findings: Sequence[Finding], folder: Path | str
) -> Path:
    """Write the cleaned copy; its about.json holds the log under "inspection".

    Parameters
    ----------
    recording : the original, from which truth (if any) is copied.
    measured : the cleaned measurements.
    findings : what was found and done.

    Raises
    ------
    InputError : the folder cannot be written, or is the original's.
    """
    log = [finding.stated() | {"done": finding.done()} for finding in findings]
    about: dict[str, Any] = {**measured.about, "inspection": {"of": recording.folder.name, "findings": log}}
    frames = {rate: pd.DataFrame(columns) for rate, columns in tables_of(measured).items()}
    written = write_recording(
        folder,
        frames,
        about,
        recording.truth,
        track=measured.track,
        true_track=recording.true_track,
        scenario=recording.scenario,
    )
    return Path(written)
