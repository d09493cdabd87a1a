"""Runs of an engine in memory, tracks to run over, and the mirror of a row of truth."""

from collections.abc import Sequence

import numpy as np

from railsim.dynamics.channels import channel_names
from railsim.engines import compiled, exudyn, verlet
from railsim.engines.interface import Engine, Run, default_substeps
from railsim.model import Model
from railsim.speed import Constant, Driven, Profile, Traction, speed_tables
from railsim.track import Track
from railsim.track.kernel import build_tables
from railsim.track.spectra import Band, spectra
from railsim.track.synthesis import Segment, Transition, design, distances, fade_in, irregularity

ENGINES: dict[str, Engine] = {
    "compiled": compiled.integrate,
    "exudyn": exudyn.integrate,
    "verlet": verlet.integrate,
}
RATE = 1024.0
BAND = Band(shortest=1.0, longest=100.0)


class Rows:
    """Rows of truth by channel name."""

    def __init__(self, model: Model, rows: np.ndarray) -> None:
        self.names, self.rows = channel_names(model), rows

    def __getitem__(self, name: str) -> np.ndarray:
        return self.rows[:, self.names.index(name)]


def make_run(
    model: Model,
    track: Track,
    speed: float | Constant | Profile | Driven,
    duration: float,
    *,
    start: float = 20.0,
    finer: int = 1,
    traction: Sequence[Traction] = (),
    initial: np.ndarray | None = None,
) -> Run:
    """A run at 1024 rows a second with the default step divided by `finer`."""
    wanted = Constant(speed=speed) if isinstance(speed, int | float) else speed
    tables = speed_tables(wanted, tuple(traction), len(model.wheelsets), duration)
    substeps = default_substeps(model, tables, RATE) * finer
    return Run(model, build_tables(track), tables, start, duration, RATE, substeps, initial)


def go(engine: str, run: Run) -> Rows:
    """All rows of a run."""
    return Rows(run.model, np.concatenate(list(ENGINES[engine](run))))


def flat(length: float = 400.0) -> Track:
    """Straight, level, smooth."""
    s = np.linspace(-50.0, length, 10)
    return Track(s, {"vertical": np.zeros(s.size)}, "flat")


def curve(radius: float, cant: float, length: float = 400.0, before: float = 40.0) -> Track:
    """Straight, 60 m of transition and a long left-hand circle, smooth."""
    s = distances(length, 0.2)
    pieces = [Segment(before), Transition(60.0), Segment(length - before - 60.0, 1.0 / radius, cant)]
    return Track(s, design(pieces, s), "curve")


def rough(track: Track, scale: float = 1.0, seed: int = 1) -> Track:
    """The track with every kind of irregularity of ERRI B176 low, times `scale`, from 25 m on."""
    rng = np.random.default_rng(seed)
    densities = spectra("erri_low")
    kinds = {
        "vertical": "vertical", "lateral": "lateral",
        "cross_level": "cross_level", "gauge_deviation": "gauge_deviation",
        "left_vertical": "cross_level", "right_vertical": "cross_level",
        "left_lateral": "gauge_deviation", "right_lateral": "gauge_deviation",
    }  # fmt: skip
    fade = scale * fade_in(track.s, 25.0, 20.0)
    added = {
        column: fade * irregularity(densities[kind], track.s.size, track.spacing, rng, BAND)
        for column, kind in kinds.items()
    }
    return Track(track.s, track.columns() | added, "rough")


FLIPPED = (
    "y [m]", "roll [rad]", "yaw [rad]", "y_rate [m/s]", "roll_rate [rad/s]", "yaw_rate [rad/s]",
    "specific_force_y [m/s2]", "angular_velocity_x [rad/s]", "angular_velocity_z [rad/s]",
    "angular_acceleration_x [rad/s2]", "angular_acceleration_z [rad/s2]",
    "creep_force_y [N]", "creepage_y [-]", "spin_creepage [1/m]", "contact_angle [rad]", "lateral_shift [m]",
    "curvature [1/m]", "cant [m]", "left_lateral [m]", "right_lateral [m]", "north [m]",
)  # fmt: skip
"""Quantities that change sign in the mirror; all others keep it, and left and right change places."""


def mirrored(result: Rows) -> Rows:
    """What the same run looks like in a mirror."""
    seen = np.empty_like(result.rows)
    for i, name in enumerate(result.names):
        quantity = name.rpartition(".")[2]
        other = name.replace("left", "@").replace("right", "left").replace("@", "right")
        seen[:, i] = result[other] * (-1.0 if quantity in FLIPPED else 1.0)
    mirror = Rows.__new__(Rows)
    mirror.names, mirror.rows = result.names, seen
    return mirror


def ratio(a: np.ndarray, b: np.ndarray) -> float:
    """Root-mean-square difference over the standard deviation of `b`."""
    return float(np.sqrt(np.mean((a - b) ** 2)) / b.std())
