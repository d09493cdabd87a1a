"""Scores of an estimate against the truth, by every scorer that knows one of its columns."""

import re
from collections.abc import Mapping
from typing import Any

from estimators.interface import Estimate
from experiments.reporting.failures import PluginError, plugin_code
from experiments.scoring.interface import SCORERS, Scorer
from railsim.errors import InputError
from railsim.progress import counted
from railsim.truth import TIME, Truth

_KEY = re.compile(r"(?P<score>.+) \[(?P<unit>[^\]]*)\]")
_EXPLAINS = (TIME, "s [m]", "valid [-]")
"""Columns that say where and whether an estimate holds, and are none themselves."""


def scorers() -> dict[str, Scorer]:
    """Every scorer by the name of its module."""
    return {name: kind() for name, kind in SCORERS.classes().items()}


def score(estimate: Estimate, truth: Truth, progress: bool = False) -> dict[str, float]:
    """How good an estimate is, by `"score [unit]"`; empty where nothing scores it, and `unscored` says why.

    `progress`: show it on stderr, where that is a terminal.

    Raises
    ------
    InputError : a scorer cannot compare the estimate with this truth, for example as it lies outside it in time.
    PluginError : a scorer fails.
    """
    scores, problems = scores_and_problems(estimate, truth, progress)
    for problem in problems.values():
        raise problem
    return scores


def scores_and_problems(
    estimate: Estimate, truth: Truth, progress: bool = False
) -> tuple[dict[str, float], dict[str, InputError | PluginError]]:
    """Scores of all scorers that can compare the estimate with this truth, and by scorer why others cannot."""
    scores: dict[str, float] = {}
    problems: dict[str, InputError | PluginError] = {}
    for name, scorer in counted(scorers().items(), "scoring", "scorers", wanted=progress):
        try:
            with plugin_code(f"scorer '{name}' of '{estimate.name}'", scorer):
                if scorer.columns_of(estimate) and not scorer.lacking(estimate):
                    scores |= scorer.score(estimate, truth)
        except (InputError, PluginError) as problem:
            problems[name] = problem
    return scores, problems


def unscored(estimate: Estimate) -> str:
    """Why an estimate has no score, and what to do."""
    for name, scorer in scorers().items():
        if scorer.columns_of(estimate):
            lacking = scorer.lacking(estimate)
            why = f"needs {_listed(lacking)} beside it" if lacking else "has nothing to compare it with in this run"
            return f"{_of(scorer.columns_of(estimate), estimate)} has no score: scorer '{name}' {why}"
    columns = [str(name) for name in estimate.series.columns if name not in _EXPLAINS and "_std [" not in str(name)]
    return f"nothing scores {_of(columns, estimate)}; add a Scorer, see CONTRIBUTING.md"


def _of(columns: list[str], estimate: Estimate) -> str:
    return f"column {_listed(columns)} of estimate '{estimate.name}'"


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def score_rows(estimator: str, scores: Mapping[str, float]) -> list[dict[str, Any]]:
    """Scores in the shape of the command's JSON: estimator, score, value, unit."""
    rows = []
    for key, value in scores.items():
        parts = _KEY.fullmatch(key)
        name, unit = (parts["score"], parts["unit"]) if parts else (key, "-")
        rows.append({"estimator": estimator, "score": name, "value": value, "unit": unit})
    return rows
