"""Conicity function on constant gauge: all of it from one Kalman filter's likelihood and its smoother."""

import numpy as np
import pandas as pd

from estimators.wheel_rail.conicity_kernel import RAIL, WheelsetRecord, Y
from estimators.wheel_rail.conicity_likelihood import Likelihood
from estimators.wheel_rail.conicity_result import ConicityFit, mean_over


def on_constant_gauge(
    likelihood: Likelihood, starts: int, time: np.ndarray, record: WheelsetRecord, window: float, model_error: float
) -> ConicityFit:
    """Fit the function, then smooth.

    Parameters
    ----------
    starts : of the search. time : (n,), s, of the record. window : of the conicity over time, s. model_error : standard
    deviation (-) besides that of the data.
    """
    posterior = likelihood.fit(starts)
    conicity, spread = likelihood.conicity(posterior)
    states, deviation = likelihood.smooth(posterior)
    shift, count = states[:, Y] - states[:, RAIL], round(window / record.step)
    value = np.interp(np.abs(shift), likelihood.shift, conicity)
    square = mean_over(shift**2, count)
    own = np.interp(np.sqrt(square), likelihood.shift, spread)
    series = pd.DataFrame({
        "time [s]": time,
        "conicity [-]": mean_over(value * shift**2, count) / np.maximum(square, 1e-15),
        "conicity_std [-]": np.hypot(own, model_error),
        "track_lateral [m]": states[:, RAIL],
        "track_lateral_std [m]": deviation[:, 0],
        "wheelset1.lateral_shift [m]": shift,
        "wheelset1.lateral_shift_std [m]": deviation[:, 1],
    })  # fmt: skip
    logs = np.exp(posterior.parameters[likelihood.count :])
    names: list[str] = ["f11 [N]", "rail_level [m]", "slip [m/s]", "line [-]"]
    others = dict(zip(names, logs.tolist(), strict=True))
    basis, covariance = likelihood.basis, posterior.covariance[: likelihood.count, : likelihood.count]
    return ConicityFit(series, likelihood.shift, conicity, basis @ covariance @ basis.T, np.abs(shift), others)
