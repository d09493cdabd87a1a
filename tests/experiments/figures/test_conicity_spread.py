"""What the spread of figure 12 comes from: claims of made-up errors, held and not."""

import numpy as np
import pandas as pd
import pytest

from experiments.figures.conicity_spread import (
    CONE,
    CONSTANT,
    FIELD,
    IDEAL,
    KNOWN,
    NEW,
    PAPER,
    ROLL,
    SHORT,
    SMALL,
    claims,
)

NAMES = (FIELD, CONSTANT, IDEAL, PAPER, KNOWN, NEW, ROLL, CONE, SMALL, SHORT)


def spread(of: dict[str, float], level: float = 0.0) -> pd.DataFrame:
    """Twenty runs of eight bins, errors of the stated size by step and a common one of all bins and runs."""
    rng = np.random.default_rng(12)
    rows = []
    for name in NAMES:
        for seed in range(20):
            for place in range(8):
                error = level + of.get(name, 0.1) * rng.choice([-1.0, 1.0]) * (1.0 + 0.05 * rng.random())
                rows.append({"step": name, "seed": seed, "shift [m]": 1e-3 * place, "share [-]": 0.1 + 0.01 * place}
                            | {"true [-]": 0.2, "estimate [-]": 0.2 * (1.0 + error)})  # fmt: skip
    return pd.DataFrame(rows)


def outcomes(table: pd.DataFrame) -> dict[str, bool | None]:
    return {claim.claim.partition(" (")[0]: claim.held for claim in claims(table)}


def test_each_cause_is_by_its_own_step():
    sizes = {FIELD: 0.3, CONSTANT: 0.6, IDEAL: 0.2, PAPER: 0.2, KNOWN: 0.05, NEW: 0.05, CONE: 0.01, SMALL: 0.05}
    found = outcomes(spread(sizes | {SHORT: 0.4, ROLL: 0.05}))
    held = {name.partition(":")[0]: outcome for name, outcome in found.items()}
    assert held["the gauge makes the spread"] is False
    assert held["the sensors make it"] is True
    assert held["gauge and sensors make it"] is True
    assert held["most of it is parameters of the vehicle"] is True
    assert held["most of it is what about.json does not know, parameters, wear and gauge"] is True
    assert held["most of the rest is wear and nominal gauge"] is False
    assert held["most of the rest is nonlinearity of the profiles"] is True
    assert held["the rest goes with the size of the shift"] is False
    assert held["the rest is lack of data"] is True
    assert held["most of the rest is the wheelset's roll"] is False


@pytest.mark.parametrize(("level", "held"), [(0.5, True), (0.0, False)])
def test_a_common_error_is_told_from_scatter(level: float, held: bool):
    found = outcomes(spread({}, level))
    assert [outcome for name, outcome in found.items() if "the same in all runs" in name] == [held]


def test_a_table_without_a_number_counts_as_run_away():
    """Five of twenty are missing from one step, one has run away."""
    table = spread({})
    gone = ((table["step"] == PAPER) & (table["seed"] < 5)).to_numpy()
    wild = ((table["step"] == PAPER) & (table["seed"] == 7)).to_numpy()
    table.loc[wild, "estimate [-]"] = 2.0
    found = [claim for claim in claims(table.loc[~gone]) if claim.claim.startswith(f"'{PAPER}': share of runs")]
    assert [claim.value for claim in found] == [pytest.approx(6.0 / 20.0)]
