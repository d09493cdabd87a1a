"""Scores of ride comfort: against the true acceleration at the sensor's place."""

from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.ride.ride_comfort import BLOCK, block_rms, weightings
from estimators.ride.weighting import sperling_index
from experiments.scoring.interface import Check, Scorer
from experiments.scoring.true_acceleration import true_acceleration
from railsim.analysis.statistics import root_mean_square
from railsim.truth import Truth

ALLOWED = 0.05
SOURCE = "illustrative: comfort classes of EN 12299 lie 30 to 50 % apart"


class RideComfortScorer(Scorer):
    """Weighted rms accelerations of the body, Sperling's index and the mean comfort."""

    columns: ClassVar[tuple[str, ...]] = ("comfort_y [m/s2]", "comfort_z [m/s2]")
    needs: ClassVar[tuple[str, ...]] = ("valid [-]",)
    checks: ClassVar[tuple[Check, ...]] = tuple(
        Check(
            f"comfort {axis}", f"comfort {axis} relative error [-]", ALLOWED, SOURCE, f"comfort {axis} within 2 std [-]"
        )
        for axis in "yz"
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Relative rms error of each weighted rms and index, and the share within two stated deviations."""
        series = estimate.series
        ends = series["time [s]"].to_numpy()
        starts = np.round((ends - BLOCK - truth.time[0]) * truth.rate).astype(int)
        scores = {"valid share [-]": float(np.mean(series["valid [-]"].to_numpy() > 0.5)) if len(series) else 0.0}
        if not len(series) or scores["valid share [-]"] == 0.0:
            return scores
        for axis in [one for one in "xyz" if f"comfort_{one} [m/s2]" in series]:
            true = true_acceleration(estimate, truth, axis)[max(0, int(starts[0])) :]
            for name, gain in weightings(axis).items():
                rms = block_rms(true, truth.rate, gain)
                known = rms if name == "comfort" else sperling_index(rms)
                column, unit = ("comfort", "m/s2") if name == "comfort" else ("wz", "-")
                found = series[f"{column}_{axis} [{unit}]"].to_numpy()[: len(known)]
                std = series[f"{column}_{axis}_std [{unit}]"].to_numpy()[: len(known)]
                wrong = found - known[: len(found)]
                good = np.isfinite(wrong)
                size = root_mean_square(known[: len(found)][good])
                scores[f"{column} {axis} relative error [-]"] = root_mean_square(wrong[good]) / size
                scores[f"{column} {axis} within 2 std [-]"] = float(np.mean(np.abs(wrong[good]) <= 2.0 * std[good]))
        return scores
