"""Claims of figures 13 to 16 and of the conicity without a track: held by good numbers, not held by bad ones."""

import numpy as np
import pandas as pd
import pytest

from experiments.figures.conicity_blind import BOUNDED_CASE, BOUNDS, CASES, WEAR, ConicityBlind, order
from experiments.figures.fig13 import CASES as KNOWN_CASES
from experiments.figures.fig13 import Fig13, true_conicity
from experiments.figures.fig14 import spread_at_shift
from experiments.figures.fig15 import DURATION, LINEAR, NAMES, Fig15, sections, worst
from experiments.figures.fig16 import typical
from experiments.runs.rolling_radii import RATE, contact, parameters, run, true_geometry


def test_conicity_of_new_profiles_is_even_and_falls_with_the_shift():
    shift = np.array([-3e-3, 0.0, 3e-3])
    found = true_conicity(0.0, shift)
    assert found[0] == pytest.approx(found[2], rel=1e-6)
    assert 0.1 < found[0] < found[1] < 0.25


def test_spread_at_shift_knows_a_line_from_a_cloud():
    rng = np.random.default_rng(2)
    shift = 1e-3 * rng.standard_normal(4000)
    assert spread_at_shift(shift, 0.3 * shift) == pytest.approx(0.0, abs=1e-9)
    assert spread_at_shift(shift, 0.3 * shift + 2e-5 * rng.standard_normal(4000)) == pytest.approx(2e-5, rel=0.1)


def test_sum_of_radii_is_even_in_the_shift_and_moves_with_the_gauge():
    wheels = contact()
    shift, none, wide = np.array([-2e-3, 2e-3]), np.zeros(2), np.full(2, -2e-3)
    level = true_geometry(wheels, shift, none)
    assert level.sum_of_radii[0] == pytest.approx(level.sum_of_radii[1], rel=1e-9)
    assert level.difference_of_radii[0] == pytest.approx(-level.difference_of_radii[1], rel=1e-6)
    assert np.all(
        true_geometry(wheels, shift, wide).sum_of_radii > level.sum_of_radii
    )  # tight gauge: nearer the flange


def test_sections_find_the_difference_of_radii_on_profiles():
    wheels = contact()
    signals, known = run(wheels, 15, False, 25.0)
    table = sections(signals, known, wheels, 2)
    assert worst(table, "difference_of_radii") < 0.01
    assert worst(table, "difference_of_angles") < 0.01
    assert known.f11 == parameters().longitudinal_creep


MANY = 200  # seeds: enough to decide a share


def _known(error: float) -> pd.DataFrame:
    shift = np.linspace(-3e-3, 3e-3, 31)
    names = [*KNOWN_CASES, *(f"seeds {seed}" for seed in range(MANY))]
    rows = {"shift [m]": shift, "true [-]": 0.2, "estimate [-]": 0.2 + error, "std [-]": 0.01, "samples": 10}
    return pd.concat([pd.DataFrame(rows).assign(case=name) for name in names])


@pytest.mark.parametrize(("error", "held"), [(0.005, True), (0.03, False)])
def test_claims_of_figure_13(error: float, held: bool):
    claims = Fig13().check(_known(error))
    assert [claim.held for claim in claims[:-1]] == [held] * (len(claims) - 1)


@pytest.mark.parametrize(("share", "held"), [(0.01, True), (0.2, False)])
def test_claims_of_figure_15(share: float, held: bool):
    shift = np.linspace(-2e-3, 2e-3, 9)
    tables = []
    for case in (
        "as printed (constant)",
        "local linear",
        "local parabola",
        "local cubic",
        LINEAR,
        "as printed, narrow",
        "creep 3 % wrong",
    ):
        table = pd.DataFrame({"shift [m]": shift, "case": case, "samples": DURATION * RATE / len(shift)})
        for name in NAMES:
            table[f"true {name}"], table[name] = shift, shift + share * np.ptp(shift)
        tables.append(table)
    whole = pd.concat(tables)
    assert {claim.held for claim in Fig15().check(whole)} == {held}
    short = whole.assign(samples=whole["samples"] / 3)
    assert {claim.held for claim in Fig15().check(short)} == {held or None}, "a shorter run decides nothing against it"


@pytest.mark.parametrize(("error", "held"), [(0.004, True), (0.08, False)])
def test_claims_without_a_track(error: float, held: bool):
    common = {"true [-]": 0.2, "at nominal gauge [-]": 0.2, "std [-]": 0.02, "wear [-]": 0.0}
    sign = 1.0 if held else -1.0
    rows = [
        common
        | {"part": "seed", "case": name, "estimate [-]": 0.2 + one, "function rms [-]": one, "best cone [-]": 0.2 + one}
        | {"gauge apart [-]": 0.2 - sign * one, "gauge together [-]": 0.2 - 3.0 * sign * one, "own std [-]": one}
        for name in CASES
        for one in np.linspace(0.9 * error, 1.1 * error, MANY)
    ]
    rows += [row | dict.fromkeys(BOUNDS, 0.01) for row in rows if row["case"] == BOUNDED_CASE]
    rows += [
        {"part": "wear", "case": "wear", "wear [-]": w, "true [-]": w, "std [-]": 0.02}
        | {"at 2 mm [-]": w if held else -w, "least squares at 2 mm [-]": w if held else -w}
        | {"true [-]": w, "least squares [-]": w if held else -w, "true at 2 mm [-]": w}
        | {"estimate [-]": w, "at nominal gauge [-]": w}
        for w in np.linspace(0.1, 0.3, len(WEAR))
    ]
    claims = [claim for claim in ConicityBlind().check(pd.DataFrame(rows)) if "bound" not in claim.claim]
    assert {claim.held for claim in claims if "corner" not in claim.claim and "2 std" not in claim.claim} == {held}


def test_order_counts_runs_in_their_place():
    assert order(np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.3, 0.2])) == (pytest.approx(1 / 3), pytest.approx(0.5))


def test_sections_of_shift_and_gauge_find_what_the_gauge_does_to_the_radii():
    wheels = contact()
    signals, known = run(wheels, 15, True, 25.0)
    table = sections(signals, known, wheels, 1, True, 4e-4, 4e-4)
    error = (table["sum_of_radii"] - table["true sum_of_radii"]).abs()
    assert np.median(error) < 0.05 * np.ptp(table["true sum_of_radii"])
    assert typical(table, "difference_of_radii") < 0.01
    assert np.ptp(table["gauge [m]"]) > 2e-3
