"""Renewing: what screening found by the bank's signatures, looked at once more by signatures made at the fit itself.

A sensor's error is a copy of its signal, and the nominal vehicle's signal is not that of the one that was built: on a
healthy vehicle such a signature may take some of what the other's would leave.
"""

from collections.abc import Sequence

import numpy as np

from experiments.discrepancy.baseline.parallel import in_parallel
from experiments.discrepancy.fit.fitting import Fit, Problem
from experiments.discrepancy.screen.filters import forms
from experiments.discrepancy.screen.projection import Projection
from experiments.discrepancy.screen.screening import Screened, judged_signature, shortlist
from railsim.errors import InputError

PROMISING = 4.0  # nats that a signature must gain to be fitted
ROUNDS = 4  # times that others come on the shortlist in place of those that gain less than it seemed


def renewed(problem: Problem, fit: Fit, screened: Sequence[Screened]) -> tuple[Screened, ...]:
    """Signatures, those on the shortlist made at the fit by a run each, or by what its own run gives a sensor.

    Raises
    ------
    InputError : the model does not run at the fit.
    """
    forward = problem.forward
    projection = Projection(problem.differentiated(fit), problem.train, problem.forward.bounds)
    truth = forward.run(fit.z, fit.effects)[1]

    def change_by(one: Screened, values: dict[str, float]) -> np.ndarray | None:
        effects = (*fit.effects, one.candidate.build(values))
        try:
            if one.candidate.of_sensor:
                prediction = forward.observe(forward.setup(fit.z, effects), truth, fit.z)
            else:
                prediction = forward.predict(fit.z, effects)
        except InputError:
            return None
        change = problem.stacked(prediction) - fit.stacked
        return change if np.isfinite(change).all() and change.any() else None

    def again(one: Screened) -> Screened | None:
        reference = one.candidate.reference
        turned = forms(one.candidate, problem.frames.frequencies, finely=True) if reference else None
        for values in (
            (reference,) if reference else (one.values, one.tried)
        ):  # a gap made so much smaller may stay open
            change = change_by(one, values)
            if change is not None:
                return judged_signature(problem, fit, projection, one.candidate, change, turned or [(values, None)])
        return None

    done: set[str] = set()
    for _ in range(ROUNDS):
        new = [one for one in shortlist(screened) if one.gain > PROMISING and one.candidate.label not in done]
        if not new:
            break
        labels = {one.candidate.label for one in new}
        done |= labels
        others = [one for one in screened if one.candidate.label not in labels]
        screened = [*others, *(one for one in in_parallel(again, new) if one is not None)]
    return tuple(screened)
