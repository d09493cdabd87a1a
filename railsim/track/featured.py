"""Shipped tracks with discrete features on top of irregularities, and one like a measured main line."""

from collections.abc import Mapping, Sequence

import numpy as np

from railsim.track import spectra, synthesis
from railsim.track.corrugation import corrugation
from railsim.track.features import Feature, with_features
from railsim.track.joints import RAIL_LENGTH, rail_joints, vertical_shapes
from railsim.track.spectra import Band
from railsim.track.switches import Crossover
from railsim.track.track import Track

BAND = Band(shortest=1.0, longest=100.0)
CLEAN, FADE = 25.0, 20.0  # m at the start without irregularities; over which they come in
SPACING = 0.1  # m
_DIGITS = {"curvature": 11, "stiffness": -4}
_OTHERS = 7
_MADE = "Made by python -m railsim.track.shipped; licence MIT, as the program."


def jointed(name: str, seed: int) -> Track:
    """2.4 km of rails 60 ft long with dipped joints: abreast, then staggered by half a rail, then abreast again."""
    s = synthesis.distances(2400.0, SPACING)
    noise, sizes = (np.random.default_rng([seed, stream]) for stream in (0, 1))
    columns = _irregularities(s, "erri_low", noise)
    distances = np.arange(60.0, s[-1] - 20.0, RAIL_LENGTH)
    staggered = (distances >= 1000.0) & (distances < 1600.0)
    joints = rail_joints(distances[~staggered], ("left", "right"), sizes)
    joints += rail_joints(distances[staggered], ("left",), sizes)
    joints += rail_joints(distances[staggered] + RAIL_LENGTH / 2, ("right",), sizes)
    comments = [
        f"Jointed straight track: rails of 60 ft, dipped joints every {RAIL_LENGTH} m from 60 m on,",
        "both rails abreast; from 1000 to 1600 m the right rail's joints lie half a rail beyond the left one's. Sizes",
        f"at random (railsim/track/joints.py), seed {seed}; irregularities of the spectrum erri_low.",
        _MADE,
    ]
    return _assembled(s, name, columns, joints, comments)


def crossover(name: str, seed: int) -> Track:
    """Crossover of two 1 in 13 turnouts, 75 m from toe to toe, and more than 100 m of plain track after it."""
    s = synthesis.distances(260.0, SPACING)
    shape = Crossover()
    columns = _irregularities(s, "erri_low", np.random.default_rng(seed))
    around = synthesis.fade_in(s, shape.start - 15, 10) * (1 - synthesis.fade_in(s, shape.start + shape.length + 5, 10))
    rough = 1 + 0.5 * around
    columns = {"curvature": shape.curvature(s)} | {key: column * rough for key, column in columns.items()}
    comments = [
        "Crossover to the left without cant: two turnouts 1 in 13 back to back, toe A at 60 m, heel B, crossing C,",
        "crossing D, heel E, toe F at 135 m (railsim/track/switches.py), then plain track. Irregularities of the",
        f"spectrum erri_low, seed {seed}, half as large again around the crossover.",
        _MADE,
    ]
    return _assembled(s, name, columns, shape.features(), comments)


def corrugated(name: str, seed: int) -> Track:
    """400 m with long-pitch corrugation on both rails and, further on, on the right one."""
    s = synthesis.distances(400.0, 0.05)
    columns = _irregularities(s, "erri_low", np.random.default_rng(seed))
    both = Feature("corrugation", 100.0, "both", 5e-5, length=80.0, wavelength=0.4)
    right = Feature("corrugation", 240.0, "right", 8e-5, length=80.0, wavelength=0.6)
    wave = {"left_vertical": np.zeros(s.size), "right_vertical": np.zeros(s.size)}
    for feature in (both, right):
        shape = corrugation(s, feature.s, feature.length or 0.0, feature.wavelength or 1.0, feature.depth or 0.0)
        for side in ("left", "right") if feature.side == "both" else (feature.side,):
            wave[f"{side}_vertical"] += shape
    comments = [
        "Straight track with long-pitch corrugation (rows 0.05 m apart): wavelength 0.4 m, amplitude 0.05 mm on both",
        "rails from 100 to 180 m, 0.6 m, 0.08 mm on the right rail from 240 to 320 m; irregularities of the spectrum",
        f"erri_low, seed {seed}. Short-pitch corrugation (30 to 80 mm) is too short for rows like these.",
        _MADE,
    ]
    return _assembled(s, name, columns | wave, [both, right], comments)


def voids(name: str, seed: int) -> Track:
    """600 m with single hanging sleepers."""
    s = synthesis.distances(600.0, SPACING)
    noise, sizes = (np.random.default_rng([seed, stream]) for stream in (0, 1))
    distances = np.round(np.cumsum(sizes.uniform(20.0, 55.0, 14)) + 60.0, 2)
    depths = np.round(sizes.uniform(1e-3, 4e-3, distances.size), 6)
    sides = np.array(["both", "left", "right"])[np.arange(distances.size) % 3]
    rows = zip(distances, sides, depths, strict=True)
    hanging = [Feature("void", float(at), str(side), float(depth)) for at, side, depth in rows if at < s[-1] - 30]
    comments = [
        "Straight track with hanging sleepers: the rail sinks by the depth stated, as a beam on Winkler's foundation",
        f"does under a point load (railsim/track/joints.py); irregularities of the spectrum erri_low, seed {seed}.",
        _MADE,
    ]
    return _assembled(s, name, _irregularities(s, "erri_low", noise), hanging, comments)


def stiffness_varies(name: str, seed: int) -> Track:
    """400 m whose stiffness under the rails varies: soft formation, then a bridge; roughness down to waves of 0.2 m."""
    s = synthesis.distances(400.0, 0.05)
    laws = spectra.spectra("erri_low")
    waves = Band(shortest=0.2, longest=100.0)
    columns = synthesis.faded_irregularities(laws, s, 0.05, np.random.default_rng(seed), waves, (CLEAN, FADE))
    columns["stiffness"] = zones(s, 100e6, [(130.0, 190.0, 0.5), (260.0, 320.0, 1.7)])
    comments = [
        "Straight track whose rails stand on 100 MN/m each; on half of that from 130 to 190 m (soft formation), on 1.7",
        "times as much from 260 to 320 m (bridge), with ramps of 6 m. Irregularities of the spectrum erri_low, carried",
        f"on to wavelengths of 0.2 m (rows 0.05 m apart), seed {seed}.",
        _MADE,
    ]
    return _assembled(s, name, columns, [], comments)


def zones(s: np.ndarray, usual: float, pieces: Sequence[tuple[float, float, float]], ramp: float = 6.0) -> np.ndarray:
    """Stiffness at distances `s`: the usual one, times a factor between two places of each piece, with ramps."""
    factor = np.ones(s.size)
    for begin, end, times in pieces:
        inside = synthesis.fade_in(s, begin - ramp / 2, ramp) * (1 - synthesis.fade_in(s, end - ramp / 2, ramp))
        factor *= times**inside
    return usual * factor


def main_line(name: str, seed: int) -> Track:
    """4 km with lateral and gauge irregularity of 2 mm standard deviation each, rows 0.2 m apart.

    What is known of the Paddington to Bristol track data used in section 4 of Ward et al. (2011): both quantities, the
    sampling and both standard deviations; the shape of the spectrum is ERRI B176's.
    """
    s = synthesis.distances(4000.0, 0.2)
    rng = np.random.default_rng(seed)
    laws = spectra.spectra("erri_low")
    columns = {}
    for key in ("lateral", "gauge_deviation"):
        column = synthesis.irregularity(laws[key], s.size, 0.2, rng, BAND) * synthesis.fade_in(s, CLEAN, FADE)
        columns[key] = column * 2e-3 / column[s > CLEAN + FADE].std()
    comments = [
        "Straight track with lateral and gauge irregularity of 2 mm standard deviation each at 0.2 m, as stated for",
        "the track data from Paddington to Bristol; no measured data, with the shape of the spectrum erri_low,",
        f"seed {seed}; wavelengths {BAND.shortest:g} to {BAND.longest:g} m.",
        _MADE,
    ]
    return _assembled(s, name, columns, [], comments)


def _irregularities(s: np.ndarray, spectrum: str, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Vertical, lateral, cross level, gauge; the first metres clean."""
    spacing = float(s[1] - s[0])
    return synthesis.faded_irregularities(spectra.spectra(spectrum), s, spacing, rng, BAND, (CLEAN, FADE))


def _assembled(
    s: np.ndarray, name: str, columns: Mapping[str, np.ndarray], features: Sequence[Feature], comments: Sequence[str]
) -> Track:
    """Track with the features' vertical shapes put in as mean and difference of the rails, and stated in comments."""
    total = dict(columns)
    left, right = vertical_shapes(s, features)
    if left.any() or right.any():
        total["vertical"] = total["vertical"] + (left + right) / 2
        total["cross_level"] = total["cross_level"] + (right - left)
    rounded = {key: np.round(value, _DIGITS.get(key, _OTHERS)) for key, value in total.items()}
    return with_features(Track(s, rounded, name, comments), features)
