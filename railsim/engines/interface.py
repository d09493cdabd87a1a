"""What an engine is given and what it gives."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from railsim.constants import GRAVITY
from railsim.contact.functions import AXIS_A, AXIS_B, C11, C22
from railsim.contact.hertz import STEEL_SHEAR
from railsim.contact.wheel import SLOWEST
from railsim.errors import InputError
from railsim.model import Model
from railsim.speed import SpeedTables
from railsim.track.flexible import longest_step
from railsim.track.kernel import TrackTables

LONGEST_STEP = 1.0 / 2048.0  # s; 0.65 rad a step of the wheelset's bounce on its contacts: 0.3 % of its acceleration
SHORTEST_STEP = 1e-8  # s; 24 s of such steps take the fastest engine about an hour
STABLE = 2.4  # largest product of step and creep rate; the RK4 limit on the negative axis is 2.78
CHUNK = 8192  # rows of truth that are held in memory at a time


class Diverged(InputError):  # noqa: N818
    """The run left the finite numbers or the rails."""


@dataclass(frozen=True)
class Run:
    """One simulation: `rate` rows of truth a second from `start` [m] for `duration` [s], `substeps` integration
    steps a row.

    `initial`: state of the compiled engine to start from ([q, dq/dt, spin angles, spins, s, V] with the free
    coordinates in the model's order); None starts from the steady state at `start`.

    Raises
    ------
    InputError : the steps are so short that the run would not end.
    """

    model: Model
    track: TrackTables
    speed: SpeedTables
    start: float
    duration: float
    rate: float
    substeps: int
    initial: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.step < SHORTEST_STEP:
            raise InputError(
                f"integration steps of {self.step:.1g} s are asked for, and with less than {SHORTEST_STEP:g} s no run "
                "ends; make 'substeps' smaller, or a spring that is in series with a damper softer (or leave it out)"
            )

    @property
    def rows(self) -> int:
        """Rows of truth, time 0 included."""
        return round(self.duration * self.rate) + 1

    @property
    def step(self) -> float:
        """Integration step [s]."""
        return 1.0 / (self.rate * self.substeps)


class Engine(Protocol):
    """Integrates a run; yields rows of truth in the order of `channel_names`, at most `CHUNK` at a time."""

    def __call__(self, run: Run) -> Iterator[np.ndarray]: ...


def default_substeps(model: Model, speed: SpeedTables, rate: float, longest: float = LONGEST_STEP) -> int:
    """Smallest power of two of steps a row, of `longest` [s] at most, for which the creep forces' damping of the
    wheelsets, and the track that runs with them, stay well inside stability.
    """
    limit = min(longest, STABLE / slowest_creep(model, speed))
    if model.corunning is not None:
        limit = min(limit, longest_step(model.corunning))
    return 2 ** max(0, math.ceil(math.log2(1.0 / (rate * limit)) - 1e-9))


def slowest_creep(model: Model, speed: SpeedTables) -> float:
    """`creep_rate` where a run is slowest, and it is greatest [1/s]."""
    return creep_rate(model, max(float(speed.speed.min()), SLOWEST))


def creep_rate(model: Model, speed: float) -> float:
    """Fastest decay rate that linear creep forces give a wheelset's lateral, yaw or rolling motion at `speed` [1/s];
    Polach's slope is (kA + kS) / 2 of Kalker's.
    """
    middle = model.contact.coefficients.shape[1] // 2
    row = model.contact.coefficients[0, middle, :, 0]
    carried = sum(body.mass for body in model.bodies if "z" in body.free)
    load = carried * GRAVITY + sum(model.vertical_load.values())
    normal = load / (2.0 * len(model.wheelsets))
    area = STEEL_SHEAR * row[AXIS_A] * row[AXIS_B] * normal ** (2.0 / 3.0)
    rates = []
    for wheelset in model.wheelsets:
        body = model.bodies[model.index(wheelset.body)]
        half = row[2]
        rates += [
            2.0 * area * row[C22] / (body.mass * speed),
            2.0 * area * row[C11] * half**2 / (body.inertia[2] * speed),
            2.0 * area * row[C11] * (wheelset.radius**2 / wheelset.spin_inertia + 1.0 / body.mass) / speed,
        ]
    return max(rates) * 0.5 * (model.law.k_adhesion + model.law.k_slip)
