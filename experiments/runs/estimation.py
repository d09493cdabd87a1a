"""Every estimator that fits a recording, run on it."""

from dataclasses import dataclass

from estimators.interface import ESTIMATORS, Estimate
from railsim.errors import InputError
from railsim.measurements import Measurements


@dataclass(frozen=True)
class Estimates:
    """Estimates by estimator, and why an estimator that fits the sensors gave none."""

    given: dict[str, Estimate]
    refused: dict[str, str]


def estimate_all(measured: Measurements) -> Estimates:
    """Every estimator whose channels the recording has."""
    given, refused = {}, {}
    for name, kind in ESTIMATORS.classes().items():
        estimator = kind.build({})
        if estimator.fits(measured):
            try:
                given[name] = estimator.estimate(measured)
            except InputError as error:
                refused[name] = str(error)
    return Estimates(given, refused)
