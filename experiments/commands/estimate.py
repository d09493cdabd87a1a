"""`railsim estimate`: one estimator on one recording."""

import argparse

import estimators
from estimators.interface import Estimator
from experiments.commands.interface import Outcome
from experiments.maintenance.condition import tables
from railsim.recording import Recording
from railsim.registry import discover, pick


def execute(given: argparse.Namespace) -> Outcome:
    """Write the estimate; of track geometry also standard deviations a section and isolated defects."""
    estimator = pick(discover(estimators, Estimator), given.name, "estimator").build({})
    measurements = Recording.open(given.recording).measurements
    estimate = estimator.estimate(measurements)
    more = tables(estimate)
    estimate.save(given.out, more)
    columns = [str(name) for name in estimate.series.columns]
    result = {"estimator": estimator.name, "estimate": str(given.out), "rows": len(estimate.series), "columns": columns}
    result["tables"] = list(more)
    return Outcome(result, f"{given.out}: {len(estimate.series)} rows of {', '.join([*columns, *more])}")
