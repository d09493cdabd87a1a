"""Scores of crossovers that an estimator found: their features against the labelled ones of the true track."""

from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from experiments.scoring.interface import Check, Scorer
from railsim.truth import Truth


class SwitchScorer(Scorer):
    """Switches and crossings of a crossover."""

    columns: ClassVar[tuple[str, ...]] = ("yaw [rad]",)
    checks: ClassVar[tuple[Check, ...]] = (
        Check("features of crossovers", "missed or false features [-]", 0.17, "illustrative: one of six"),
        Check("places of features", "largest error of distance from middle [m]", 1.0, "illustrative: two sleepers"),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Recall of the labelled features, their places by time, and their distances from the crossover's middle."""
        labelled = [feature for feature in truth.about.get("features", []) if feature.get("label")]
        real = {str(feature["label"]): float(feature["s [m]"]) for feature in labelled}
        events = {event["label"]: event for event in estimate.about.get("events", [])}
        scores = {
            "true features [-]": float(len(real)),
            "crossovers [-]": float(len(estimate.about.get("crossovers", []))),
        }
        hits = sorted(set(real) & set(events))
        every = set(real) | set(events)
        scores["missed or false features [-]"] = 1.0 - len(hits) / len(every) if every else 0.0
        if real:
            scores["features found [-]"] = len(hits) / len(real)
        if hits:
            middle = (min(real.values()) + max(real.values())) / 2
            at = [np.interp(events[label]["time [s]"], truth.time, truth["s [m]"]) - real[label] for label in hits]
            away = [events[label]["from_middle [m]"] - (real[label] - middle) for label in hits]
            scores["largest error of place [m]"] = float(np.abs(at).max())
            scores["largest error of distance from middle [m]"] = float(np.abs(away).max())
        return scores
