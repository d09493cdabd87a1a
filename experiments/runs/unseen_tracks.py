"""Tracks on which nothing was tuned: other realisations of the shipped spectra, and another curve.

Those of the seeds 961 to 963 (a curve of 700 m among them) have served to understand what was wrong; they are left out.
"""

from pathlib import Path

import numpy as np

from railsim.track import spectra, synthesis
from railsim.track.files import write_track
from railsim.track.synthesis import Segment, Transition
from railsim.track.track import CANT_BASE, Track

SPACING = 0.2  # m
BAND = spectra.Band(shortest=1.0, longest=100.0)
CLEAN, FADE = 25.0, 20.0  # m; as in the shipped tracks
LENGTH = 1300.0  # m
RADIUS, CANT = 550.0, 0.120  # m; to the left, balanced at 21 m/s
SEEDS = {"unseen_erri_low": 1961, "unseen_erri_high": 1962, "unseen_curve_r550": 1963}


def write_unseen(folder: Path) -> dict[str, Path]:
    """Write the tracks into a folder; their files by name.

    Raises
    ------
    InputError : the place cannot be written.
    """
    files = {}
    for name, seed in SEEDS.items():
        s = synthesis.distances(LENGTH, SPACING)
        columns = _irregularities(s, "erri_high" if "high" in name else "erri_low", seed)
        if "curve" in name:
            columns |= _curve(s)
        files[name] = folder / f"{name}.csv"
        write_track(Track(s, columns, name, [f"Irregularities of seed {seed}; nothing was tuned on it."]), files[name])
    return files


def _irregularities(s: np.ndarray, spectrum: str, seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return synthesis.faded_irregularities(spectra.spectra(spectrum), s, SPACING, rng, BAND, (CLEAN, FADE))


def _curve(s: np.ndarray) -> dict[str, np.ndarray]:
    """Left-hand curve between straights: clothoids of 80 m, 340 m of full curvature and cant."""
    arc = Segment(340.0, curvature=1 / RADIUS, cant=CANT_BASE * np.sin(CANT / CANT_BASE))
    pieces = [Segment(200.0), Transition(80.0), arc, Transition(80.0), Segment(600.0)]
    return {key: value for key, value in synthesis.design(pieces, s).items() if key != "gradient"}
