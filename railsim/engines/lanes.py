"""The engine for many runs at once: that of `compiled`, with each run in a lane of the processor's vectors.

Its numbers are those of `compiled` but for rounding, and do not depend on what runs beside. What lanes cannot run, the
other engine does: `lanes.structure.refused` says what that is.
"""

from collections.abc import Iterator

import numpy as np

from railsim.dynamics.chunks import rows_of
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.engines.interface import CHUNK, Run
from railsim.lanes.fleet import Piece, advance, prepare


def integrate(run: Run) -> Iterator[np.ndarray]:
    """Rows of truth of a run, chunk by chunk; see `interface.Engine`.

    Raises
    ------
    Diverged : a state is not finite or a wheel left its rail; names time, place and body.
    """
    job = prepare(0, run)
    if job.refused:
        yield from rows_of(run, job.plant, RUNGE_KUTTA, run.substeps)
        return
    for piece in advance([job], CHUNK):
        if not isinstance(piece, Piece):
            raise piece[1]
        yield piece.rows
