"""Changes of the true track, that the measured file does not hold."""

import numpy as np

from railsim.constants import GRAVITY
from railsim.effects.interface import Setup
from railsim.errors import InputError
from railsim.track.flexible import Void
from railsim.track.joints import dip
from railsim.track.synthesis import fade_in
from railsim.track.track import Track

RIGID = 1e-12  # m/N; compliance of rails that hardly give way
ROWS_A_WAVE = 8
STEPS_A_WAVE = 12  # integration steps
JOINT_ROWS, JOINT_HALF_LENGTH = 0.1, 1.2  # m
MOST_ROWS = 450_000


def resampled(track: Track, widest: float) -> Track:
    """The track at equal distances of at most `widest` [m], through its own splines; as it is where that holds.

    Raises
    ------
    InputError : that would be too many rows.
    """
    steps = np.diff(track.s)
    if steps.max() <= widest * (1.0 + 1e-9):
        return track
    uniform = bool(np.ptp(steps) <= 1e-6 * steps.mean())
    count = steps.size * int(np.ceil(steps.mean() / widest)) if uniform else int(np.ceil(track.length / widest))
    if count > MOST_ROWS:
        raise InputError(f"track {track.name}: {track.length:g} m at {widest:g} m is too much; cut the track")
    s = np.linspace(track.s[0], track.s[-1], count + 1)
    geometry = track.at(s)
    names = [key for key in ("friction", "stiffness") if key in track.given]
    totals = ("curvature", "cant", "gradient", "left_vertical", "right_vertical", "left_lateral", "right_lateral")
    columns = {key: getattr(geometry, key) for key in (*totals, *names)}
    return Track(s, columns, track.name, track.comments)


def window(s: np.ndarray, begin: float, length: float, ends: float) -> np.ndarray:
    """1 from `begin` over `length` [m], 0 elsewhere, with smooth ends inside."""
    ends = min(ends, 0.5 * length)
    return fade_in(s, begin, ends) * (1.0 - fade_in(s, begin + length - ends, ends))


def _added(setup: Setup, track: Track, **shapes: np.ndarray) -> Setup:
    """The setup over `track` with shapes added to its columns."""
    columns = {key: getattr(track, key) + shape for key, shape in shapes.items()}
    return setup.but(track=Track(track.s, track.columns() | columns, track.name, track.comments))


def _fine(setup: Setup, wavelength: float) -> Setup:
    fastest = float(setup.speed_tables.speed.max())
    return setup.but(longest_step=min(setup.longest_step, wavelength / (STEPS_A_WAVE * fastest)))


def wider(setup: Setup, widening: float, amplitude: float, wavelength: float, place: float) -> Setup:
    """Gauge wider [m] everywhere, and by a wave from `place` [m] on."""
    if widening == 0.0 and amplitude == 0.0:
        return setup
    track = setup.track if amplitude == 0.0 else resampled(setup.track, wavelength / ROWS_A_WAVE)
    wave = amplitude * fade_in(track.s, place, wavelength) * np.sin(2.0 * np.pi * (track.s - place) / wavelength)
    return _added(setup, track, gauge_deviation=widening + wave)


def joints(setup: Setup, depth: float, spacing: float, first: float) -> Setup:
    """Dipped joints of both rails from `first` [m] on."""
    if depth == 0.0:
        return setup
    track = resampled(setup.track, JOINT_ROWS)
    distance = track.s - first
    nearest_joint = np.maximum(np.round(distance / spacing), 0.0) * spacing
    return _added(setup, track, vertical=dip(distance - nearest_joint, depth, JOINT_HALF_LENGTH))


def corrugated(setup: Setup, amplitude: float, wavelength: float, stretch: tuple[float, float]) -> Setup:
    """A wave of both rail heads over a stretch (begin, length) [m]."""
    if amplitude == 0.0:
        return setup
    track = resampled(setup.track, wavelength / ROWS_A_WAVE)
    wave = amplitude * np.sin(2.0 * np.pi * (track.s - stretch[0]) / wavelength)
    return _added(_fine(setup, wavelength), track, vertical=window(track.s, *stretch, 5.0) * wave)


def canted(setup: Setup, error: float) -> Setup:
    """Cant larger by `error` [m]."""
    if error == 0.0:
        return setup
    return _added(setup, setup.track, cant=np.full(setup.track.s.size, error))


def hanging(setup: Setup, deflection: float, place: float, length: float) -> Setup:
    """Rails that sink by `deflection` [m] under the static wheel load at `place`, raised cosine over `length` [m]: into
    a gap below the sleepers of a flexible track, else because they are softer there.
    """
    if deflection == 0.0:
        return setup
    if setup.flexible_track is not None:
        return setup.but(voids=(*setup.voids, Void(place, length, deflection)))
    track = resampled(setup.track, length / (2 * ROWS_A_WAVE))
    x = (track.s - place) / length
    shape = np.where(np.abs(x) < 0.5, 0.5 + 0.5 * np.cos(2.0 * np.pi * x), 0.0)
    return _softer(setup, track, deflection / _wheel_load(setup) * shape)


def soft(setup: Setup, softness: float, variation: float, wavelength: float) -> Setup:
    """Compliance [m/N] of both rails with a wave."""
    if softness == 0.0:
        return setup
    track = setup.track if variation == 0.0 else resampled(setup.track, wavelength / ROWS_A_WAVE)
    wave = 1.0 + variation * np.cos(2.0 * np.pi * track.s / wavelength)
    return _softer(_fine(setup, wavelength) if variation else setup, track, softness * wave)


def _softer(setup: Setup, track: Track, compliance: np.ndarray) -> Setup:
    usual = RIGID if setup.flexible_track is None else 1.0 / setup.flexible_track.stiffness
    base = usual if track.stiffness is None else 1.0 / track.stiffness
    columns = track.columns() | {"stiffness": 1.0 / (base + compliance)}
    return setup.but(track=Track(track.s, columns, track.name, track.comments))


def _wheel_load(setup: Setup) -> float:
    model = setup.model
    carried = sum(body.mass for body in model.bodies if "z" in body.free)
    return (carried * GRAVITY + sum(model.vertical_load.values())) / (2.0 * len(model.wheelsets))
