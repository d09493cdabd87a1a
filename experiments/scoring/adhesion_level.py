"""Scores of the adhesion level: its probability against the friction under the wheels, and where it changes."""

from typing import ClassVar

import numpy as np

from estimators.adhesion.adhesion_level import COLUMNS, WINDOW
from estimators.adhesion.classifier import LEVELS
from estimators.interface import Estimate
from experiments.scoring.interface import Check, Scorer
from railsim.truth import TIME, Truth

BOUNDS = (0.35, 0.134, 0.042)
"""Friction coefficients between the levels: 0.35, so that 0.4 of ordinary dry rails is dry; then geometric means."""
SIDES = ("left", "right")
EXCLUDED = 0.05
"""A level of less probability is excluded."""


class AdhesionLevelScorer(Scorer):
    """Share of windows whose level is right, whether its probability is honest, and where changes are seen."""

    columns: ClassVar[tuple[str, ...]] = COLUMNS[:1]
    needs: ClassVar[tuple[str, ...]] = (*COLUMNS, TIME, "valid [-]")
    checks: ClassVar[tuple[Check, ...]] = (
        Check(
            "adhesion level",
            "level wrong [-]",
            0.1,
            "illustrative: nine windows in ten",
            "true level not excluded [-]",
            "windows that count [-]",
            subject="health",
        ),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Share of windows whose level is right, probability that is honest, places of changes.

        Windows in which the true level changes count for the places of changes only.
        """
        series = estimate.series
        time, valid = series[TIME].to_numpy(float), series["valid [-]"].to_numpy(float) > 0.5
        scores = {"windows that count [-]": float(np.mean(valid)) if len(valid) else 0.0}
        level = true_level(truth)
        first = np.searchsorted(truth.time, time - WINDOW / 2.0).clip(0, len(level) - 1)
        last = np.searchsorted(truth.time, time + WINDOW / 2.0).clip(0, len(level) - 1)
        changes = np.concatenate([[0], np.cumsum(np.diff(level) != 0)])
        counts = valid & (changes[first] == changes[last])
        if counts.any():
            given = series[list(COLUMNS)].to_numpy(float)[counts]
            real = level[first][counts]
            right = given.argmax(axis=1) == real
            scores["level right [-]"] = float(np.mean(right))
            scores["level wrong [-]"] = float(np.mean(~right))
            scores["true level not excluded [-]"] = float(np.mean(given[np.arange(len(real)), real] >= EXCLUDED))
            scores["mean probability of the level named [-]"] = float(np.mean(given.max(axis=1)))
            scores["Brier score [-]"] = float(np.mean(np.sum((given - np.eye(len(LEVELS))[real]) ** 2, axis=1)))
        return scores | _change_scores(estimate, truth, level)


def true_level(truth: Truth) -> np.ndarray:
    """Place in `LEVELS` of the mean friction coefficient under the four wheels, by the rows of truth."""
    mean = np.mean([truth[f"wheel{i}_{side}.friction [-]"] for i in (1, 2) for side in SIDES], axis=0)
    return np.asarray(np.sum(mean[:, None] < np.array(BOUNDS), axis=1))


def _change_scores(estimate: Estimate, truth: Truth, level: np.ndarray) -> dict[str, float]:
    real = truth.time[np.flatnonzero(np.diff(level)) + 1]
    named = np.array([change["time"] for change in estimate.about.get("changes", [])])
    if not len(real):
        return {"changes that are none [-]": float(len(named))}
    scores = {"true changes [-]": float(len(real)), "changes named [-]": float(len(named))}
    if len(named):
        errors = np.abs(named[:, None] - real[None, :]).min(axis=0)
        scores["largest error of a change's place [s]"] = float(errors.max())
    return scores
