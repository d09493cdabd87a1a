"""A track beyond its ends: a run that begins a little earlier, or ends later, stays on it."""

import numpy as np

from railsim.errors import InputError
from railsim.track.track import Track

HELD = ("friction", "stiffness", "curvature", "cant", "gradient")
"""Columns that keep their last value beyond the ends; irregularities fade out there."""


def continued(track: Track, reach: float) -> Track:
    """The track, `reach` [m] longer at both ends.

    Raises
    ------
    InputError : the track has less than four rows.
    """
    s = track.s
    if s.size < 4:
        raise InputError("track.csv: too few rows; give the measured track")
    step = float(np.median(np.diff(s)))
    count = round(reach / step)
    before, after = s[0] - step * np.arange(count, 0, -1), s[-1] + step * np.arange(1, count + 1)
    fade = 0.5 * (1.0 + np.cos(np.pi * np.arange(1, count + 1) / count))
    columns = {}
    for name, values in track.columns().items():
        kept = np.ones(count) if name in HELD else fade
        columns[name] = np.concatenate([values[0] * kept[::-1], values, values[-1] * kept])
    return Track(np.concatenate([before, s, after]), columns, track.name)
