"""Every estimator that fits a recording, run on it."""

import logging
from dataclasses import dataclass

from estimators.interface import ESTIMATORS, Estimate, Estimator
from experiments.reporting.failures import PluginError, plugin_code
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.progress import LOGGER, counted


@dataclass(frozen=True)
class Estimates:
    """Estimates by estimator; why an estimator that fits the sensors gave none; which ones failed."""

    given: dict[str, Estimate]
    refused: dict[str, str]
    failed: dict[str, PluginError]


def estimate_all(measured: Measurements, only: frozenset[str] | None = None) -> Estimates:
    """Every estimator whose channels the recording has, or those of them that are named."""
    estimates = Estimates({}, {}, {})
    kinds = {name: kind for name, kind in ESTIMATORS.classes().items() if only is None or name in only}
    for name, kind in counted(kinds.items(), "estimating", "estimators"):
        try:
            estimator = kind.build({})
            with plugin_code(name, estimator):
                fits = estimator.fits(measured)
            if fits:
                estimates.given[name] = estimated(estimator, measured)
        except InputError as error:
            estimates.refused[name] = str(error)
        except PluginError as failure:
            estimates.failed[name] = failure
    return estimates


def estimated(estimator: Estimator, measured: Measurements) -> Estimate:
    """What the estimator gives.

    Raises
    ------
    InputError : it refuses the recording.
    PluginError : it fails, or gives what is no estimate.
    """
    logging.getLogger(LOGGER).debug("estimating by '%s'", estimator.name)
    with plugin_code(estimator.name, estimator):
        estimate = estimator.estimate(measured)
        if not isinstance(estimate, Estimate):
            raise TypeError(f"estimate() gave {type(estimate).__name__}, not an Estimate")
    return estimate
