"""Fixed-step classical Runge-Kutta loop over the compiled right-hand side."""

import numpy as np

from railsim.compiled import kernel
from railsim.engines._kernel import derivatives, derivatives_and_wheels
from railsim.engines._observe import observe


@kernel
def rk4_step(plant, t, h, x, stages, trial, scratch):
    """Advance x by one step of length h; stages (4, size) with dx/dt at t in its first row, trial (size,) is
    scratch.
    """
    size = x.shape[0]
    for i in range(size):
        trial[i] = x[i] + 0.5 * h * stages[0, i]
    derivatives(plant, t + 0.5 * h, trial, stages[1], scratch)
    for i in range(size):
        trial[i] = x[i] + 0.5 * h * stages[1, i]
    derivatives(plant, t + 0.5 * h, trial, stages[2], scratch)
    for i in range(size):
        trial[i] = x[i] + h * stages[2, i]
    derivatives(plant, t + h, trial, stages[3], scratch)
    for i in range(size):
        x[i] += h / 6.0 * (stages[0, i] + 2.0 * (stages[1, i] + stages[2, i]) + stages[3, i])


@kernel
def run_chunk(plant, x, first, rows, substeps, rate, out, stages, trial, wheels, scratch):
    """Fill `rows` rows of truth at 1/rate, row k at time (first + k)/rate; x is advanced in place; wheels (2 w, 10) is
    scratch. Return the rows that are finite.
    """
    h = 1.0 / (rate * substeps)
    for k in range(rows):
        base = (first + k) / rate
        derivatives_and_wheels(plant, base, x, stages[0], scratch, wheels)
        observe(plant, base, x, stages[0], wheels, scratch, out[k])
        if not np.isfinite(np.sum(x)):
            return k
        for j in range(substeps):
            if j > 0:
                derivatives(plant, base + j * h, x, stages[0], scratch)
            rk4_step(plant, base + j * h, h, x, stages, trial, scratch)
    return rows
