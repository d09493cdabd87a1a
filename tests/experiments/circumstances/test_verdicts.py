"""Verdicts: what makes an estimate right, honest or silently wrong."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.circumstances.report import claims, compared, counts, merged
from experiments.circumstances.verdicts import (
    FAILED,
    NOT_APPLICABLE,
    RIGHT,
    SAYS_SO,
    SILENT,
    Cell,
    excused,
    judge,
    warnings_of,
)
from experiments.scoring.interface import Check
from experiments.scoring.score import scorers

VALUE = Check("height", "rms error [mm]", 0.5, "test", "within 2 std [-]", "valid share [-]")
HEALTH = Check("dampers", "wrong [-]", 0.0, "test", answered="given [-]", enough=1.0, subject="health", excused=False)


def cell(verdict: str, **changes: Any) -> Cell:
    """A cell of the whole vehicle at home."""
    known: dict[str, Any] = {"circumstance": "home", "group": "home", "base": "whole", "estimator": "one"}
    known |= {"quantity": "height", "subject": "value", "verdict": verdict}
    return Cell(**known | changes)


@pytest.mark.parametrize(
    ("error", "coverage", "valid", "verdict"),
    [
        (0.4, 0.95, 1.0, RIGHT),
        (0.4, None, None, RIGHT),
        (0.4, 0.84, 1.0, SILENT),
        (0.6, 0.84, 1.0, SILENT),
        (0.6, None, 1.0, SILENT),
        (0.6, 0.85, 1.0, SAYS_SO),
        (None, None, 0.0, SAYS_SO),
        (None, None, None, SAYS_SO),
        (float("nan"), None, None, SAYS_SO),
    ],
)
def test_values(error: float | None, coverage: float | None, valid: float | None, verdict: str) -> None:
    given = {"rms error [mm]": error, "within 2 std [-]": coverage, "valid share [-]": valid}
    found = judge(VALUE, {name: one for name, one in given.items() if one is not None})
    assert (found.verdict, found.coverage) == (verdict, coverage)
    assert found.says or verdict != SAYS_SO


@pytest.mark.parametrize(
    ("wrong", "given", "verdict"), [(0.0, 1.0, RIGHT), (0.0, 0.5, SAYS_SO), (1.0, 1.0, SILENT), (1.0, 0.5, SILENT)]
)
def test_verdicts_on_components(wrong: float, given: float, verdict: str) -> None:
    assert judge(HEALTH, {"wrong [-]": wrong, "given [-]": given}).verdict == verdict


def test_a_warning_excuses_unless_it_stands_at_home_too() -> None:
    away = {"circumstance": "curve", "group": "curve"}
    usual, other = ("3.0 s left out, from 0.0 to 3.0 s",), ("4.5 s left out, from 0.0 to 4.5 s",)
    cells = [
        cell(SILENT, warnings=usual),
        cell(SILENT, **away, warnings=other),
        cell(SILENT, **away, warnings=(*other, "a curve: do not trust this")),
        cell(RIGHT, **away, warnings=("a curve: do not trust this",)),
        cell(SILENT, **away, warnings=("a curve: do not trust this",), excusable=False),
        cell(SILENT, **away, estimator="two", warnings=usual),
        cell(SILENT, **away),
    ]
    found = excused(cells)
    assert [one.verdict for one in found] == [SILENT, SILENT, SAYS_SO, RIGHT, SILENT, SAYS_SO, SILENT]
    assert found[2].says == "a curve: do not trust this"


def test_warnings_are_the_words() -> None:
    series = pd.DataFrame({"time [s]": [0.0]})
    assert warnings_of(Estimate("one", series, {"warnings": ["a", "b", "a"]})) == ("a", "b")
    assert warnings_of(Estimate("one", series, {"settings": {"a": 1}})) == ()


def test_the_worst_quantity_speaks_for_an_estimator() -> None:
    cells = [
        cell(RIGHT, quantity="a", error=0.4, allowance=0.5),
        cell(SILENT, quantity="b", error=0.6, allowance=0.5),
        cell(SILENT, quantity="c", error=0.8, allowance=0.5),
        cell(SAYS_SO, quantity="d", error=9.0, allowance=0.5),
        cell(NOT_APPLICABLE, estimator="two", quantity=""),
    ]
    found = merged(cells)
    assert found["home", "one"].quantity == "c"
    assert found["home", "two"].verdict == NOT_APPLICABLE


def test_counts_and_claims() -> None:
    cells = [
        *(cell(RIGHT, circumstance=f"c{i}", group="load") for i in range(398)),
        cell(RIGHT, subject="health"),
        cell(SILENT),
        cell(SILENT, base="half", subject="health"),
        cell(FAILED, quantity=""),
        cell(NOT_APPLICABLE, quantity=""),
    ]
    number = counts(cells)
    assert number["health"] == {RIGHT: 1, SAYS_SO: 0, SILENT: 1, FAILED: 0}
    assert number["value"] == {RIGHT: 398, SAYS_SO: 0, SILENT: 1, FAILED: 1}
    found = {claim.claim: claim for claim in claims(cells, whole=True)}
    assert found["cells on the whole vehicle"].value == 401
    assert found["verdicts of health and adhesion silently wrong"].value == 0  # the half vehicle's does not count here
    assert found["share of the other cells silently wrong"].value == pytest.approx(1 / 400)
    assert found["share of cells right"].value == pytest.approx(399 / 401)
    assert all(claim.held for claim in found.values())
    accused = [*cells, cell(SILENT, subject="health")]
    assert [claim.held for claim in claims(accused, whole=True)] == [True, False, True, True, True]
    assert [claim.held for claim in claims(accused, whole=False)] == [True, False, None, None, None]
    assert [claim.held for claim in claims(cells, whole=False)] == [True, None, None, None, None]
    assert [claim.held for claim in claims(cells, True, [cell(RIGHT)])][
        -1
    ] is False  # one of three, and it was one of one
    last = claims(cells, True, [cell(SILENT)])[-1]
    assert last.held is True
    assert json.loads(json.dumps(asdict(last)))["cases"] == 3


def test_another_run_is_compared_where_both_have_cells() -> None:
    now = [cell(RIGHT), cell(RIGHT, circumstance="wet"), cell(SILENT, estimator="two")]
    before = [cell(SILENT), cell(RIGHT, circumstance="low"), cell(SILENT, estimator="two")]
    table = compared(now, before).set_index("estimator")
    assert table["right"].to_dict() == {"one": 1.0, "two": 0.0, "all": 0.5}
    assert table["right before"].to_dict() == {"one": 0.0, "two": 0.0, "all": 0.0}
    assert table["cells"].to_dict() == {"one": 1, "two": 1, "all": 2}


def test_every_scorer_states_what_its_quantities_are_good_for() -> None:
    for name, scorer in scorers().items():
        assert scorer.checks, name
        for check in scorer.checks:
            assert check.source, check
            assert check.allowance >= 0.0
            assert check.unit, check


def test_the_page_tells_every_allowance() -> None:
    text = (Path(__file__).parents[3] / "docs" / "circumstances.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("|")]
    for scorer in scorers().values():
        for check in scorer.checks:
            name, _, band = check.quantity.partition(" D")
            for part in ("left ", "right ", *(f"wheelset{number} " for number in range(1, 5))):
                name = name.removeprefix(part)
            row = next((line for line in rows if name in line), "")
            number = f"{check.allowance:.2g}" if check.allowance else "none"
            assert number in row, check
            assert not band or f"D{band}" in row, check
