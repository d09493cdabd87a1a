"""Scores of the running speed."""

from collections.abc import Mapping
from contextlib import suppress
from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from experiments.reporting.failures import PluginError, plugin_code
from experiments.reporting.units import KMH
from experiments.scoring.interface import Check, Scorer
from railsim.analysis.statistics import root_mean_square
from railsim.errors import InputError
from railsim.truth import SPEED, TIME, Truth


class SpeedScorer(Scorer):
    """Errors of the running speed, in km/h as in Ward et al. (2011), section 5, and in m/s."""

    columns: ClassVar[tuple[str, ...]] = (SPEED,)
    needs: ClassVar[tuple[str, ...]] = (TIME,)
    checks: ClassVar[tuple[Check, ...]] = (
        Check(
            "speed",
            "relative rms [-]",
            0.01,
            "illustrative: as good as a tachometer on a wheel worn by 5 mm",
            "within 2 std [-]",
            "valid share [-]",
        ),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Root mean square, 99.9 % quantile, largest size and mean of the error; share within two deviations."""
        time, error = speed_errors(estimate, truth)
        valid = np.isfinite(error)
        if not valid.any():
            return {"valid share [-]": 0.0}
        size = np.abs(error[valid])
        rms = root_mean_square(size)
        speed = root_mean_square(np.interp(time[valid], truth.time, truth[SPEED]))
        scores = {
            "rms error [km/h]": KMH * rms,
            "99.9 % error [km/h]": KMH * float(np.quantile(size, 0.999)),
            "largest error [km/h]": KMH * float(size.max()),
            "bias [km/h]": KMH * float(np.mean(error[valid])),
            "rms error [m/s]": rms,
            "largest error [m/s]": float(size.max()),
            "relative rms [-]": rms / max(speed, 1e-9),
        }
        if "speed_std [m/s]" in estimate.series.columns:
            spread = estimate.series["speed_std [m/s]"].to_numpy()[valid]
            scores["within 2 std [-]"] = float(np.mean(size <= 2.0 * spread))
        return scores | {"valid share [-]": float(np.mean(valid))}


def all_speed_errors(estimates: Mapping[str, Estimate], truth: Truth) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """`speed_errors` of every estimate that has a speed over time that can be compared with the truth."""
    errors = {}
    for name, estimate in estimates.items():
        if {SPEED, TIME} <= set(estimate.series.columns):
            with suppress(InputError, PluginError), plugin_code(name, estimate):
                errors[name] = speed_errors(estimate, truth)
    return errors


def speed_errors(estimate: Estimate, truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] of every sample and its speed error [m/s], NaN where the estimate is not valid.

    Raises
    ------
    InputError : the estimate reaches beyond the truth in time.
    """
    series = estimate.series
    time = series[TIME].to_numpy()
    true = truth.time
    if len(time) and (time[0] < true[0] - 0.5 / truth.rate or time[-1] > true[-1] + 0.5 / truth.rate):
        raise InputError(
            f"estimate '{estimate.name}' covers {time[0]:g} to {time[-1]:g} s, the truth {true[0]:g} to "
            f"{true[-1]:g} s; score it on the recording that it was made from"
        )
    error = series[SPEED].to_numpy() - np.interp(time, true, truth[SPEED])
    if "valid [-]" in series.columns:
        error = np.where(series["valid [-]"].to_numpy() > 0.5, error, np.nan)
    return time, error
