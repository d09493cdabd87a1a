"""The tracks that come with the program.

`python -m railsim.track.shipped [FOLDER]` makes their files again, byte for byte, and prints their checksums.
"""

import hashlib
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from railsim.track import featured, spectra, synthesis
from railsim.track.files import write_track
from railsim.track.synthesis import Segment, Transition
from railsim.track.track import CANT_BASE, Track

SPACING = 0.2
"""Distance of the rows, m."""

BAND = spectra.Band(shortest=1.0, longest=100.0)
"""Wavelengths of the irregularities: 1 m rather than the 3 m of EN 13848, so that slow vehicles are shaken too."""

CLEAN, FADE = 25.0, 20.0
"""Length without irregularities at the start, and length over which they come in after it, m."""

_DIGITS = {"curvature": 11, "cant": 9}
_IRREGULARITY_DIGITS = 8


def tracks() -> dict[str, Callable[[], Track]]:
    """What makes each shipped track, by its name."""
    return {
        "straight_erri_low": lambda: _straight("straight_erri_low", "erri_low", seed=176_001),
        "straight_erri_high": lambda: _straight("straight_erri_high", "erri_high", seed=176_002),
        "curve_r400": lambda: _curve("curve_r400", "erri_low", seed=176_003),
        "smooth": _smooth,
        "jointed_60ft": lambda: featured.jointed("jointed_60ft", seed=176_004),
        "crossover_1in13": lambda: featured.crossover("crossover_1in13", seed=176_005),
        "corrugated": lambda: featured.corrugated("corrugated", seed=176_006),
        "voids": lambda: featured.voids("voids", seed=176_007),
        "stiffness_varies": lambda: featured.stiffness_varies("stiffness_varies", seed=176_009),
        "paddington_bristol_like": lambda: featured.main_line("paddington_bristol_like", seed=176_008),
    }


def main(arguments: list[str]) -> None:
    """Write every shipped track into the folder `arguments[0]` (default track_data) and print its SHA-256."""
    folder = Path(arguments[0] if arguments else "track_data")
    for name, make in tracks().items():
        path = folder / f"{name}.csv"
        write_track(make(), path)
        print(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}")


def _straight(name: str, spectrum: str, seed: int) -> Track:
    s = synthesis.distances(2000.0, SPACING)
    comments = [f"Straight level track, 2 km, with irregularities of the spectrum {spectrum}.", *_notes(spectrum, seed)]
    return Track(s, _irregularities(s, spectrum, seed), name, comments)


def _curve(name: str, spectrum: str, seed: int) -> Track:
    s = synthesis.distances(1000.0, SPACING)
    arc = Segment(300.0, curvature=1 / 400, cant=CANT_BASE * np.sin(np.radians(6.0)))
    pieces = [Segment(300.0), Transition(60.0), arc, Transition(60.0), Segment(280.0)]
    columns = {key: value for key, value in synthesis.design(pieces, s).items() if key != "gradient"}
    rounded = {key: np.round(value, _DIGITS[key]) for key, value in columns.items()}
    comments = [
        "Left-hand curve: straight 300 m, clothoid 60 m, radius 400 m with cant 6 degrees (156.8 mm over 1.5 m)",
        f"for 300 m, clothoid 60 m, straight 280 m; with irregularities of the spectrum {spectrum}.",
        f"Corners of the curvature and cant ramps are rounded over {synthesis.ROUNDING:g} m (raised-cosine average);",
        "the total change of heading is that of the sharp ramps.",
        *_notes(spectrum, seed),
    ]
    return Track(s, rounded | _irregularities(s, spectrum, seed), name, comments)


def _smooth() -> Track:
    s = np.linspace(0.0, 3000.0, 7)
    return Track(s, {"vertical": np.zeros(s.size)}, "smooth", ["Straight level track, 3 km, without irregularities."])


def _irregularities(s: np.ndarray, spectrum: str, seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    columns = synthesis.faded_irregularities(spectra.spectra(spectrum), s, SPACING, rng, BAND, (CLEAN, FADE))
    return {key: np.round(column, _IRREGULARITY_DIGITS) for key, column in columns.items()}


def _notes(spectrum: str, seed: int) -> list[str]:
    return [
        f"Random phases (numpy default_rng, seed {seed}) with the one-sided densities over rad/m of {spectrum} in",
        f"railsim/track/spectra.py, wavelengths {BAND.shortest:g} to {BAND.longest:g} m"
        f" (skirts: factor {BAND.skirt:g}),",
        "the quantities independent.",
        f"No irregularities up to s = {CLEAN:g} m, full ones from {CLEAN + FADE:g} m on.",
        "Made by python -m railsim.track.shipped; licence MIT, as the program.",
    ]


if __name__ == "__main__":
    main(sys.argv[1:])
