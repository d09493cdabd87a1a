"""`railsim estimate`: one estimator on one recording."""

import argparse

import estimators
from estimators.interface import Estimator
from experiments.commands.interface import Outcome
from railsim.recording import Recording
from railsim.registry import discover, pick


def execute(given: argparse.Namespace) -> Outcome:
    """Write the estimate."""
    estimator = pick(discover(estimators, Estimator), given.name, "estimator").build({})
    measurements = Recording.open(given.recording).measurements
    estimate = estimator.estimate(measurements)
    estimate.save(given.out)
    columns = [str(name) for name in estimate.series.columns]
    result = {"estimator": estimator.name, "estimate": str(given.out), "rows": len(estimate.series), "columns": columns}
    return Outcome(result, f"{given.out}: {len(estimate.series)} rows of {', '.join(columns)}")
