"""A measured track where the recording has none: a track file, or an estimate of the track from another recording."""

from pathlib import Path

import numpy as np

from estimators.interface import Estimate
from experiments.discrepancy.recording.evidence import GivenTrack
from railsim.errors import InputError
from railsim.track.files import DISTANCE, read_track
from railsim.track.survey import TrackErrors
from railsim.track.track import Track

TAKEN = ("vertical", "lateral", "cross_level")
SPACING = 0.25  # m


def given_track(source: str) -> GivenTrack:
    """Track of a file, or of an estimate's folder with its standard deviations (None where it states none).

    An estimate's distances count from the first sample of its own recording, so the scenario's `start` does too; what
    it does not hold (curves, gauge) is taken as nothing, stretches that it leaves open as straight between their ends.

    Raises
    ------
    InputError : neither a track file nor an estimate of one.
    """
    if not Path(source).is_dir():
        return GivenTrack(read_track(source))
    series = Estimate.open(source).series
    names = [name for name in TAKEN if f"{name} [m]" in series]
    if str(series.columns[0]) != DISTANCE or not names:
        raise InputError(
            f"--track {source}: that estimate has none of {', '.join(TAKEN)} over '{DISTANCE}'; "
            "give one of track_smoother, alignment_lateral, alignment_vertical or cross_level"
        )
    s = series[DISTANCE].to_numpy(float)
    grid = np.arange(s[0], s[-1] + 1e-9, SPACING)
    columns, spread = {}, {}
    for name in names:
        values = series[f"{name} [m]"].to_numpy(float)
        good = np.isfinite(values)
        if good.sum() < 2:
            raise InputError(f"--track {source}: its {name} holds no values; estimate from a longer recording")
        columns[name] = np.interp(grid, s[good], values[good])
        if f"{name}_std [m]" in series:
            spread[f"{name}_std"] = float(np.nanmedian(series[f"{name}_std [m]"].to_numpy(float)[good]))
    errors = TrackErrors(**spread) if spread else None
    return GivenTrack(Track(grid, columns, Path(source).name), errors, estimated=True)
