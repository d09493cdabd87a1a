"""`railsim sweep`: vary keys of a scenario over many runs, and make a table and a report; resumes by itself.

examples:
  railsim sweep default_sweep.yaml --out sweep --jobs 2
"""

import argparse
import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError

if TYPE_CHECKING:
    from experiments.sweep.executors import Executor
    from experiments.sweep.run import Done


def configure(parser: argparse.ArgumentParser) -> None:
    """Sweep, folder and processes."""
    parser.add_argument("sweep", metavar="SWEEP", nargs="?", help="name of a shipped study, or path of a YAML file")
    parser.add_argument("--out", metavar="DIR", help="folder of the results; a sweep that was stopped goes on there")
    where = parser.add_mutually_exclusive_group()
    cores = len(os.sched_getaffinity(0))
    where.add_argument(
        "--jobs", type=int, default=cores, metavar="N", help=f"processes on this machine (default: {cores})"
    )
    where.add_argument("--cluster", metavar="ADDRESS", help="scheduler of a Dask cluster, host:port")
    parser.add_argument("--keep-truth", action="store_true", help="leave the simulated runs in the cache")
    parser.add_argument("--report", metavar="DIR", help="only write the report of a finished sweep again")


def execute(given: argparse.Namespace) -> Outcome:
    """Run what is not finished, write the table and the report.

    Exit code 1 where a plug-in failed, or repeated tasks did not agree.
    """
    from experiments.sweep.report import numbers, write_report
    from experiments.sweep.run import run_sweep
    from experiments.sweep.settings import read_sweep
    from experiments.sweep.store import FAILURES, TABLE

    if given.report:
        if given.sweep or given.out:
            raise InputError("--report takes the folder of a finished sweep and nothing else; leave the rest out")
        path = write_report(Path(given.report))
        return Outcome({"report": str(path)}, f"{path}: written")
    if not given.sweep or not given.out:
        raise InputError("give a sweep and --out DIR, or --report DIR")
    if given.jobs < 1:
        raise InputError(f"--jobs {given.jobs}: give a number from 1")
    done = run_sweep(read_sweep(given.sweep), Path(given.out), partial(_executor, given))
    report = write_report(Path(given.out))
    result = {"table": f"{given.out}/{TABLE}", "report": str(report), **_facts(done)}
    result["metrics"] = numbers(Path(given.out))
    result["failed"] = sorted(done.tracebacks)
    result["tracebacks"] = f"{given.out}/{FAILURES}" if done.tracebacks else None
    return Outcome(result, _text(result, done), held=done.repeatable and not done.tracebacks)


def _executor(given: argparse.Namespace, scratch: Path) -> "Executor":
    from experiments.sweep.executors import Cluster, Local

    if given.cluster is not None:
        return Cluster(given.cluster, given.keep_truth)
    return Local(given.jobs, scratch, given.keep_truth)


def _facts(done: "Done") -> dict[str, Any]:
    return {
        "points": done.plan.points,
        "runs": len(done.plan.tasks),
        "performed": done.performed,
        "rows": sum(done.status.values()),
        "status": done.status,
        "throughput": done.throughput,
    }


def _text(result: dict[str, Any], done: "Done") -> str:
    lines = [
        f"{result['table']}: {result['rows']} rows of {result['points']} points, {result['runs']} simulated runs "
        f"({result['performed']} of them now)",
        f"{result['report']}: response plots, best and worst, failures, speed",
        "",
        table(["status", "rows"], [[name, count] for name, count in result["status"].items()]),
    ]
    if done.throughput:
        speed = done.throughput
        lines += [
            "",
            f"{speed['rate [s/s]']:.1f} simulated seconds per second on {speed['workers']} workers; efficiency "
            f"{speed['efficiency [-]']:.2f} against one worker alone ({speed['one worker alone [s/s]']:.1f})",
        ]
    lines += [f"FAILED: {message}" for message in result["failed"]]
    if result["failed"]:
        lines.append(f"Tracebacks: {result['tracebacks']}")
    if not done.repeatable:
        lines.append("NOT HELD: tasks that were repeated did not give the same rows")
    return "\n".join(lines)
