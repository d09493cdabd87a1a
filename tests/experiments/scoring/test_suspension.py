"""Scores and figures of the suspension estimators."""

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from experiments.figures.fig07 import FULL, OTHER, REDUCED, UNCERTAIN, Fig07
from experiments.figures.fig07 import NOMINAL as TRUE
from experiments.figures.suspension_identifiability import SuspensionIdentifiability
from experiments.scoring.score import score
from experiments.scoring.suspension import true_parameters
from railsim import load_scenario, simulate
from railsim.truth import Truth

VALUES = (40e3, 507e3, 0.15)


@pytest.fixture(scope="module")
def truth() -> Truth:
    """A short run of the shipped scenario, whose profiles have the conicity 0.15 by their closed form."""
    return simulate(load_scenario("suspension", {"duration": 6.0}), engine="compiled")


def test_true_parameters_are_those_of_the_vehicle(truth: Truth):
    assert true_parameters(truth) == pytest.approx(VALUES, rel=0.01)


def test_a_damper_that_is_ten_per_cent_too_large_scores_so(truth: Truth):
    time = np.arange(0.0, 6.0)
    columns = {name: np.full(6, value) for name, value in zip(PARAMETERS, (44e3, 507e3, 0.15), strict=True)}
    columns |= {std_name(name): np.full(6, 1e-3) for name in PARAMETERS}
    scores = score(Estimate("test", pd.DataFrame({"time [s]": time, **columns})), truth)
    assert scores["secondary lateral damping error [%]"] == pytest.approx(10.0, abs=1e-6)
    assert scores["secondary yaw damping error [%]"] == pytest.approx(0.0, abs=1e-6)


def table(conicity: float) -> pd.DataFrame:
    """What figure 7 would hold if every case gave the true dampers."""
    rows = []
    for case, found in ((FULL, 0.15), (REDUCED, 0.15), (UNCERTAIN, conicity), (OTHER, conicity + 0.01)):
        for time in (1.0, 60.0):
            values = dict(zip(PARAMETERS, (40e3, 507e3, found), strict=True))
            spreads = {std_name(name): 0.01 * value for name, value in zip(PARAMETERS, VALUES, strict=True)}
            true = {TRUE.format(name): value for name, value in zip(PARAMETERS, VALUES, strict=True)}
            for seed in range(10):
                values["conicity [-]"] = found + 1e-4 * seed
                rows.append({"case": case, "seed": seed, "time [s]": time, **values, **spreads, **true})
    return pd.DataFrame(rows)


def test_figure_7_says_when_conicity_does_converge():
    offset = [claim for claim in Fig07().check(table(0.15)) if "does not converge" in claim.claim]
    assert [claim.held for claim in offset] == [True]  # 0.01 off under the other assumption
    converged = table(0.15)
    converged["conicity [-]"] = 0.15 + 1e-4 * converged["seed"]
    assert [claim.held for claim in Fig07().check(converged) if "does not converge" in claim.claim] == [False]


def test_figure_7_has_four_panels():
    assert len(Fig07().draw(table(0.18)).axes) == 4


def information(curvature: float, estimates: tuple[float, ...]) -> pd.DataFrame:
    """What `suspension_identifiability` would hold for some estimates of the conicity, of true 0.15."""
    rows: list[dict[str, object]] = []
    for found in estimates:
        for name, true, value in zip(PARAMETERS, VALUES, (*VALUES[:2], found), strict=True):
            rows.append({"what": f"estimate of {name}", "value": value, "true": true})
    for level in (0.5, 1.0):
        rows += [{"what": "profile", "level": level, "conicity": one, "value": -level} for one in (0.1, 0.15, 0.2)]
    for known in (0.0, 1.0):
        rows.append({"what": "bound", "known": known, "value": 0.004})
        rows.append({"what": "curvature", "known": known, "seconds": 240.0, "value": curvature})
    return pd.DataFrame(rows)


def test_identifiability_says_when_curvature_and_bound_disagree():
    """Four times as long a record has half the deviation."""
    held = [claim.held for claim in SuspensionIdentifiability().check(information(0.002, (0.14, 0.17)))]
    assert held == [True] * len(held)
    assert {type(one) for one in held} == {bool}  # what JSON takes
    wrong = SuspensionIdentifiability().check(information(0.004, (0.14, 0.19)))
    assert [claim.held for claim in wrong] == [False, True, True, True, False, False]
    assert len(SuspensionIdentifiability().draw(information(0.002, (0.14,))).axes) == 2
