"""Figure 9 over wheel-rail pairs: claims of made-up peaks, held and not."""

import numpy as np
import pandas as pd
import pytest

from estimators.adhesion.classifier import LEVELS
from experiments.figures.fig09 import NAMES
from experiments.figures.force_peaks import EXPECTED, PAIRS, claims


def peaks(leading: float, trailing: float, cases: int = 40) -> pd.DataFrame:
    """Peaks that fall by so many decades from dry to very low, a little differently in every case."""
    rng = np.random.default_rng(9)
    rows = []
    for pair in PAIRS:
        for case in range(cases):
            track = rng.normal()
            for place, level in enumerate(LEVELS):
                for number, decades in ((1, leading), (2, trailing)):
                    peak = 10.0 ** (6.0 + track - decades * place / 3.0 + 0.01 * rng.normal())
                    row = {"pair": pair, "track": str(case), "speed [m/s]": 30.0, "condition": level}
                    rows.append(row | {"wheelset": float(number)} | dict.fromkeys(NAMES, peak))
    return pd.DataFrame(rows)


@pytest.mark.parametrize(("leading", "trailing", "outcome"), [(1.0, 1.5, "held"), (1.5, 1.0, "NOT HELD")])
def test_trailing_over_leading_is_by_the_pair_and_its_runs(leading: float, trailing: float, outcome: str):
    found = [claim for claim in claims(peaks(leading, trailing), NAMES, NAMES[-1]) if "geometric mean" in claim.claim]
    assert len(found) == len(PAIRS) * len(NAMES)
    assert {claim.outcome for claim in found} == {outcome}
    assert [claim.value for claim in found] == pytest.approx([10.0 ** (trailing - leading)] * len(found), rel=0.05)


def test_order_of_the_levels_is_by_the_wheelset():
    found = {claim.claim: claim.outcome for claim in claims(peaks(-1.0, 3.0, 80), NAMES, NAMES[-1])}
    assert {found[name] for name in found if "in order" in name and "leading" in name} == {"NOT HELD"}
    assert {found[name] for name in found if "in order" in name and "trailing" in name} == {"held"}


def test_what_was_seen_before_is_held_only_by_the_pair_that_shows_it():
    ratio = EXPECTED["arcs"][0] * 1.1
    found = list(claims(peaks(1.0, 1.0 + np.log10(ratio)), NAMES, NAMES[-1]))[-len(EXPECTED) :]
    assert [claim.outcome for claim in found] == ["held", "NOT HELD", "NOT HELD"]
