"""`railsim estimate`: run one estimator on a recording."""

import argparse

from experiments.reporting.outcome import Outcome


def configure(parser: argparse.ArgumentParser) -> None:
    """Estimator, recording and folder."""
    parser.add_argument("name", metavar="NAME", help="see 'railsim list estimators'; or the path of a file with one")
    parser.add_argument("recording", metavar="RECORDING", help="folder of a recording")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the estimate")


def execute(given: argparse.Namespace) -> Outcome:
    """Write the estimate; of track geometry also standard deviations a section and isolated defects."""
    from estimators.interface import ESTIMATORS
    from experiments.maintenance.condition import tables
    from railsim.recording import Recording

    estimator = ESTIMATORS.resolve(given.name).build({})
    measurements = Recording.open(given.recording).measurements
    estimate = estimator.estimate(measurements)
    more = tables(estimate)
    estimate.save(given.out, more)
    columns = [str(name) for name in estimate.series.columns]
    result = {"estimator": estimator.name, "estimate": str(given.out), "rows": len(estimate.series), "columns": columns}
    result["tables"] = list(more)
    return Outcome(result, f"{given.out}: {len(estimate.series)} rows of {', '.join([*columns, *more])}")
