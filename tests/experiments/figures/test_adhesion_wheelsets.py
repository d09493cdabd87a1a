"""Which wheelset tells adhesion best: claims of made-up peaks, held and not."""

import numpy as np
import pandas as pd
import pytest

from estimators.adhesion.classifier import LEVELS
from experiments.figures.adhesion_wheelsets import (
    COLOURS,
    FORCE_ERROR,
    FORCE_WITHIN,
    MOMENT,
    MOMENT_ERROR,
    MOMENT_WITHIN,
    RIGHT,
    TOLD,
    WHEELSETS,
    AdhesionWheelsets,
)


def table(decades: dict[int, float], cases: int = 30, right: float = 1.0) -> pd.DataFrame:
    """Peaks that fall by so many decades from level to level, by wheelset; a little differently in every case."""
    rng = np.random.default_rng(3)
    rows = []
    for case in range(cases):
        louder = rng.normal()  # the track
        for place, level in enumerate(LEVELS):
            for number in WHEELSETS:
                peak = 10.0 ** (6.0 + louder - decades[number] * place + 0.01 * rng.normal())
                row = {"track": str(case), "speed [m/s]": 30.0, "condition": level, "wheelset": float(number)}
                row |= {f"{what} {'[N2 m2/Hz]' if what == MOMENT else '[N2/Hz]'}": peak for what in COLOURS}
                row |= {FORCE_ERROR: 0.005 + 1e-5 * case, MOMENT_ERROR: 0.02 + 1e-5 * case}
                row |= {FORCE_WITHIN: 0.9 + 1e-4 * case, MOMENT_WITHIN: 0.6 + 1e-4 * case, RIGHT: right, TOLD: 1.0}
                rows.append(row)
    return pd.DataFrame(rows)


def outcomes(decades: dict[int, float], **more: float) -> dict[str, str]:
    claims = AdhesionWheelsets().check(table(decades, **more))  # type: ignore[arg-type]
    return {claim.claim: claim.outcome for claim in claims}


def test_levels_in_order_are_held_whatever_the_track():
    found = outcomes({1: 0.3, 2: 0.5, 3: 0.3, 4: -0.3}, cases=80)
    in_order = {name: outcome for name, outcome in found.items() if name.startswith("net") and "in order" in name}
    assert list(in_order.values()) == ["held", "held", "held", "NOT HELD"]
    assert found["yaw moment: decades between dry and very low, trailing less leading wheelset in front"] == "held"
    assert found["yaw moment: decades between dry and very low, trailing less leading wheelset behind"] == "NOT HELD"


def test_errors_and_coverage_are_those_of_each_wheelset():
    found = outcomes(dict.fromkeys(WHEELSETS, 0.3))
    for number in WHEELSETS:
        own = [outcome for name, outcome in found.items() if name.startswith(f"wheelset {number}")]
        assert own == ["held", "NOT HELD", "held", "NOT HELD"]
    assert found["level right, of the windows that are told"] == "held"
    few = outcomes(dict.fromkeys(WHEELSETS, 0.3), cases=3)
    assert few["level right, of the windows that are told"] == "undecided"


def test_levels_that_are_wrong_are_told():
    values = {
        claim.claim: claim.value for claim in AdhesionWheelsets().check(table(dict.fromkeys(WHEELSETS, 0.3), right=0.5))
    }
    assert values["level right, of the windows that are told"] == pytest.approx(0.5)


def test_picture_has_four_panels():
    assert len(AdhesionWheelsets().draw(table(dict.fromkeys(WHEELSETS, 0.3), 3)).axes) == 4
