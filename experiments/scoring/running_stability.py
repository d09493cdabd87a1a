"""Scores of running stability: against the true acceleration at the sensor's place."""

from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.ride.running_stability import RunningStability
from experiments.scoring.interface import Check, Scorer
from experiments.scoring.true_acceleration import true_acceleration
from railsim.analysis.statistics import root_mean_square
from railsim.truth import Truth


class StabilityScorer(Scorer):
    """Rms of the bogie's lateral acceleration about its dominant frequency."""

    columns: ClassVar[tuple[str, ...]] = ("instability [m/s2]",)
    needs: ClassVar[tuple[str, ...]] = ("time [s]", "instability_std [m/s2]", "valid [-]")
    checks: ClassVar[tuple[Check, ...]] = (
        Check(
            "instability",
            "instability relative error [-]",
            0.05,
            "illustrative: 5 % of the value",
            "instability within 2 std [-]",
            "valid share [-]",
        ),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Relative rms error, and the share within two stated deviations."""
        series = estimate.series
        valid = series["valid [-]"].to_numpy() > 0.5
        scores = {"valid share [-]": float(np.mean(valid)) if len(series) else 0.0}
        if not valid.any():
            return scores
        estimator = RunningStability.build(estimate.about["settings"])
        time = series["time [s]"].to_numpy()[valid]
        windows = estimator.windows(truth["s [m]"], np.interp(time, truth.time, truth["s [m]"]))
        true = true_acceleration(estimate, truth, "y")
        square = estimator.mean_square(true, truth.rate, windows, estimate.about["dominant frequency [Hz]"])
        known = np.sqrt(square)
        wrong = series["instability [m/s2]"].to_numpy()[valid] - known
        scores["instability relative error [-]"] = root_mean_square(wrong) / root_mean_square(known)
        within = np.abs(wrong) <= 2.0 * series["instability_std [m/s2]"].to_numpy()[valid]
        scores["instability within 2 std [-]"] = float(np.mean(within))
        return scores
