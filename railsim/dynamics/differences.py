"""Derivatives of the right-hand side by differences, all in one call (compiled)."""

from railsim.compiled import kernel
from railsim.dynamics.kernel import derivatives


@kernel
def central_differences(plant, x, places, steps, out, changes, scratch, unseen):
    """Fill out (places, size) with central differences of dx/dt at time 0 by the numbers of x (size,) at `places`, in
    these steps; changes (2, size) is scratch, `unseen` of `workspace.NO_WHEELS`. x is as it was afterwards.
    """
    for i in range(places.shape[0]):
        at, here = places[i], x[places[i]]
        x[at] = here + steps[i]
        derivatives(plant, 0.0, x, changes[0], scratch, unseen)
        x[at] = here - steps[i]
        derivatives(plant, 0.0, x, changes[1], scratch, unseen)
        x[at] = here
        for j in range(x.shape[0]):
            out[i, j] = (changes[0, j] - changes[1, j]) / (2.0 * steps[i])
