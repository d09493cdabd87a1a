"""What every scorer must do."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.conformance.interface import UNIT, Check, described
from experiments.conformance.recordings import channels_by_scenario, recording
from experiments.scoring.interface import Scorer
from railsim.truth import TIME

Kind = type[Scorer]
ZERO = 1e-9


def names_its_columns(kind: Kind) -> Iterable[str]:
    """It says which columns it scores and needs, with their units."""
    scorer = kind()
    if not scorer.columns:
        yield "columns: name those of an estimate that it scores"
    for name in (*scorer.columns, *scorer.needs):
        if not UNIT.fullmatch(name):
            yield f"column '{name}' has no unit; name it 'quantity [unit]'"


def perfect_estimate_has_no_error(kind: Kind) -> Iterable[str]:
    """What the truth itself holds, given as an estimate, has errors of zero."""
    truth = recording(next(iter(channels_by_scenario())), 10.0).truth
    assert truth is not None
    scorer = kind()
    known = [name for name in (*scorer.columns, *scorer.needs) if name != TIME and name in truth]
    estimate = Estimate("truth", pd.DataFrame({TIME: truth.time} | {name: truth[name] for name in known}))
    if not scorer.columns_of(estimate) or scorer.lacking(estimate):
        return
    scores = scorer.score(estimate, truth)
    for name, value in scores.items():
        if not UNIT.fullmatch(name):
            yield f"score '{name}' has no unit; name it 'score [unit]'"
        elif "error" in name and not abs(value) < ZERO:
            yield f"score '{name}' of a perfect estimate is {value:.3g}"
    if any(not np.isfinite(value) for value in scores.values()):
        yield f"a perfect estimate has scores {scores}"


CHECKS: tuple[Check[Kind], ...] = (described, names_its_columns, perfect_estimate_has_no_error)
