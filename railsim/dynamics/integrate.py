"""Fixed-step loops over the compiled right-hand side: classical Runge-Kutta, and velocity Verlet."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from railsim.compiled import kernel
from railsim.dynamics.corunning import COORDINATES, moving_track, track_place
from railsim.dynamics.kernel import derivatives
from railsim.dynamics.observe import observe


@kernel
def rk4_step(plant, t, h, x, stages, trial, scratch, unseen):
    """Advance x by one step of length h; stages (4, size) with dx/dt at t in its first row, trial (size,) is
    scratch; `unseen` of `workspace.NO_WHEELS`.
    """
    size = x.shape[0]
    for i in range(size):
        trial[i] = x[i] + 0.5 * h * stages[0, i]
    derivatives(plant, t + 0.5 * h, trial, stages[1], scratch, unseen)
    for i in range(size):
        trial[i] = x[i] + 0.5 * h * stages[1, i]
    derivatives(plant, t + 0.5 * h, trial, stages[2], scratch, unseen)
    for i in range(size):
        trial[i] = x[i] + h * stages[2, i]
    derivatives(plant, t + h, trial, stages[3], scratch, unseen)
    for i in range(size):
        x[i] += h / 6.0 * (stages[0, i] + 2.0 * (stages[1, i] + stages[2, i]) + stages[3, i])


@kernel
def run_chunk(plant, x, first, rows, substeps, rate, out, stages, trial, wheels, scratch):
    """Fill `rows` rows of truth at 1/rate, row k at time (first + k)/rate; x is advanced in place; wheels (2 w, 10) is
    scratch. Return the rows that are finite.
    """
    h, unseen = 1.0 / (rate * substeps), wheels[:0]
    for k in range(rows):
        base = (first + k) / rate
        derivatives(plant, base, x, stages[0], scratch, wheels)
        observe(plant, base, x, stages[0], wheels, scratch, out[k])
        if not np.isfinite(np.sum(x)):
            return k
        for j in range(substeps):
            if j > 0:
                derivatives(plant, base + j * h, x, stages[0], scratch, unseen)
            rk4_step(plant, base + j * h, h, x, stages, trial, scratch, unseen)
    return rows


@kernel
def verlet_step(plant, t, h, x, rates, trial, scratch, wheels):
    """Advance x from t by one step of length h, with one evaluation of the right-hand side.

    Velocity Verlet with the velocities of the new forces predicted (Groot and Warren 1997, J. Chem. Phys. 107, 4423,
    eq. 16 with lambda = 1); an element's own state is predicted and corrected alike. rates (2, size): dx/dt at t in
    its first row, replaced by that at t + h; trial (size,) is scratch; wheels as in `derivatives`, at t + h.
    """
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    size, s, half = x.shape[0], 2 * n + 2 * w, 0.5 * h
    for i in range(n, size):
        trial[i] = x[i] + h * rates[0, i]
    for i in range(n):
        trial[i] = x[i] + h * (x[n + i] + half * rates[0, n + i])
    for i in range(2 * n, 2 * n + w):
        trial[i] = x[i] + h * (x[w + i] + half * rates[0, w + i])
    speed = x[s + 1] if plant.core.driven else rates[0, s]
    trial[s] = x[s] + h * (speed + half * rates[0, s + 1])
    track = size
    if moving_track(plant):
        track, count = track_place(plant), COORDINATES * w
        for i in range(track, track + count):
            trial[i] = x[i] + h * (x[count + i] + half * rates[0, count + i])
    derivatives(plant, t + h, trial, rates[1], scratch, wheels)
    for i in range(size):
        if i < n or 2 * n <= i < 2 * n + w or i == s or track <= i < track + COORDINATES * w:
            x[i] = trial[i]
        else:
            x[i] += half * (rates[0, i] + rates[1, i])
        rates[0, i] = rates[1, i]


@kernel
def verlet_chunk(plant, x, first, rows, substeps, rate, out, rates, trial, wheels, scratch):
    """Fill `rows` rows of truth at 1/rate, row k at time (first + k)/rate, where x and rates (2, size) are those of the
    row before `first`; both are advanced in place. wheels (2 w, 10) is scratch. Return the rows that are finite.
    """
    h = 1.0 / (rate * substeps)
    for k in range(rows):
        now = (first + k) / rate
        if first + k == 0:
            derivatives(plant, now, x, rates[0], scratch, wheels)
        else:
            before = (first + k - 1) / rate
            for j in range(substeps):
                kept = wheels if j == substeps - 1 else wheels[:0]
                verlet_step(plant, before + j * h, h, x, rates, trial, scratch, kept)
        observe(plant, now, x, rates[0], wheels, scratch, out[k])
        if not np.isfinite(np.sum(x)):
            return k
    return rows


class Scheme(NamedTuple):
    """A loop, how many derivatives it keeps, and the largest products of its step with frequency and decay rate that
    contacts with a moving track shall have.
    """

    loop: Callable[..., int]
    stages: int
    oscillation: float
    decay: float

    @property
    def settling(self) -> float:
        """Largest product of the step with the decay rate of a linear state."""
        return 2.0 * self.decay

    def implicit(self, step: float) -> tuple[float, float]:
        """Inertia per stiffness [s2] and per damping [s] that the contacts get at a step [s]."""
        return (step / self.oscillation) ** 2, step / self.decay


RUNGE_KUTTA = Scheme(run_chunk, 4, 1.4, 1.4)  # stable up to 2.83 and 2.78
VERLET = Scheme(verlet_chunk, 2, 0.9, 0.5)  # stable up to 2 and 1
