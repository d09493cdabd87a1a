"""The `railsim` command: reads arguments, calls one of `experiments.commands`, turns errors into one line."""

import _thread
import argparse
import importlib
import json
import keyword
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from typing import Any, NoReturn

import pydantic

from experiments.commands.interface import Outcome
from railsim.distribution import check_packages
from railsim.errors import InputError

BAD_INPUT = 2
INTERRUPTED = 130
LATER = 0.05  # s
KINDS = ("scenarios", "estimators", "effects", "sensors", "vehicles", "tracks", "figures", "studies")


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f"railsim: {message}; see '{self.prog} --help'\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns 0 on success, 1 where a check or claim did not hold, 2 on bad input, 130 on Ctrl-C
    or where it is told to end.
    """
    given = build_parser().parse_args(arguments)
    usual, sys.unraisablehook = sys.unraisablehook, _hear_again
    try:
        with _ended_like_interrupted():
            outcome = _execute(given)
        print(json.dumps(outcome.result, allow_nan=False, ensure_ascii=False) if given.json else outcome.text)
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader has gone, which is its right
        return 0
    except KeyboardInterrupt as stop:
        return _complain(str(stop) or "interrupted; nothing was written", INTERRUPTED)
    except InputError as error:
        return _complain(str(error))
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        return _complain(f"{'.'.join(map(str, first['loc'])) or error.title}: {first['msg']}")
    except OSError as error:
        where = f"'{error.filename}': " if error.filename else ""
        return _complain(f"{where}{error.strerror or error}; check the path, its permissions and the disk")
    except MemoryError:
        return _complain("not enough memory; shorten duration or lower output_rate")
    finally:
        sys.unraisablehook = usual
    return 0 if outcome.held else 1


@contextmanager
def _ended_like_interrupted() -> Iterator[None]:
    """A SIGTERM, by which schedulers of clusters end what takes too long, leaves as little behind as a Ctrl-C."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _hear_again(lost: Any) -> None:
    """A Ctrl-C that falls into a callback of the compiler comes again; Python would print and forget it."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        threading.Timer(LATER, _thread.interrupt_main).start()  # at once it would be raised in here
    else:
        sys.__unraisablehook__(lost)


def build_parser() -> argparse.ArgumentParser:
    """The parser of all subcommands."""
    parser = _Parser(prog="railsim", description="Simulate a railway vehicle, measure, estimate, score.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (text, configure) in _COMMANDS.items():
        sub = commands.add_parser(name, help=text, description=text, formatter_class=argparse.RawTextHelpFormatter)
        sub.add_argument("--json", action="store_true", help="one JSON object on stdout")
        configure(sub)
    return parser


def _execute(given: argparse.Namespace) -> Outcome:
    """Import the command's module only now, so that the others cost no time; what it prints goes to stderr."""
    check_packages()
    with redirect_stdout(sys.stderr):
        name = given.command.replace("-", "_")
        module = f"{name}_" if keyword.iskeyword(name) else name
        return importlib.import_module(f"experiments.commands.{module}").execute(given)


def _complain(text: str, code: int = BAD_INPUT) -> int:
    print(f"railsim: {' '.join(text.split())}", file=sys.stderr)
    return code


def _scenario(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a shipped scenario, or path of a YAML file")
    parser.add_argument(
        "--engine", default="exudyn", metavar="NAME", help="exudyn (the reference, default), compiled or verlet"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="of the sensors' random errors (default: the scenario's)")
    parser.add_argument(
        "--set", action="extend", nargs="+", default=[], metavar="KEY=VALUE", help="e.g. vehicle.body_mass=18000"
    )


def _run(parser: argparse.ArgumentParser) -> None:
    _scenario(parser)
    parser.add_argument("--out", metavar="DIR", help="folder of results (default: results/SCENARIO)")


def _simulate(parser: argparse.ArgumentParser) -> None:
    _scenario(parser)
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the recording")


def _estimate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="see 'railsim list estimators'")
    parser.add_argument("recording", metavar="RECORDING", help="folder of a recording")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the estimate")


def _score(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("estimate", metavar="ESTIMATE_DIR", help="folder of an estimate")
    parser.add_argument("recording", metavar="RECORDING", help="recording that it was made from, with its truth")


def _figure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME|all", help="see 'railsim list figures'")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the pictures and tables")
    parser.add_argument("--fast", action="store_true", help="shorter runs, the compiled engine")


def _import(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="CSV, Parquet, MDF4 or TDMS")
    parser.add_argument("--map", metavar="MAP.yaml", required=True, help="what its columns mean: docs/field_data.md")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the recording; track.csv for a track")


def _inspect(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", metavar="RECORDING|SCENARIO|TRACK", help="a name or a path")
    parser.add_argument("--repair", metavar="DIR", help="folder of a cleaned copy of the recording, with a log")
    parser.add_argument(
        "--prune", action="store_true", help="say what a recording would be reduced to: events and features"
    )
    parser.add_argument("--after", type=float, default=90.0, metavar="DAYS", help="age from which raw data go (90)")
    parser.add_argument("--yes", action="store_true", help="with --prune: do it")


def _list(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("kind", choices=KINDS, nargs="?", help="all kinds where none is named")


def _sweep(parser: argparse.ArgumentParser) -> None:
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


def _discrepancy(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", metavar="RECORDING", nargs="?", help="folder; its truth is never read")
    parser.add_argument("--plan", action="store_true", help="without a recording: what one could show and tell apart")
    parser.add_argument("--model", metavar="SCENARIO", required=True, help="nominal scenario: a name or a YAML file")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of verdict.json, model.yaml, report.html")
    parser.add_argument(
        "--track",
        metavar="FILE",
        help="measured track in place of the recording's: a CSV\nfile, or the folder of an estimate of it",
    )
    parser.add_argument(
        "--held-out", nargs="+", default=[], metavar="REC", help="recordings that take no part: the gap there too"
    )
    parser.add_argument("--effects", nargs="+", metavar="NAME", help="consider only these (default: the whole library)")
    parser.add_argument("--engine", default="exudyn", metavar="NAME", help="of the last run (default: exudyn)")


def _discrepancy_benchmark(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of cases and results; goes on where it was")
    parser.add_argument("--cases", type=int, default=10, metavar="N", help="how many in all (default: 10)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the cases (default: 1)")
    parser.add_argument("--model", default="yaw_dampers", metavar="SCENARIO", help="nominal (default: yaw_dampers)")
    parser.add_argument("--duration", type=float, default=40.0, metavar="S", help="of each recording (default: 40)")
    parser.add_argument("--laws", metavar="FILE", default="", help="YAML list of effects from outside the library")
    parser.add_argument(
        "--score", metavar="RULE", default="", help="no new cases: score the rows of that rule, its effects valued anew"
    )
    parser.add_argument(
        "--rows", metavar="FOLDER", default="", help="answered cases, a file per seed: none is asked again"
    )
    parser.add_argument("--part", metavar="I/N", default="0/1", help="every N-th case from the I-th on (default: 0/1)")


def _bench(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--fast", action="store_true", help="a short run, once: to see that it works, not to be quoted")


_COMMANDS: dict[str, tuple[str, Callable[[argparse.ArgumentParser], None]]] = {
    "run": ("simulate, measure, estimate, score and draw a scenario", _run),
    "simulate": ("make a recording with its truth from a scenario", _simulate),
    "estimate": ("run one estimator on a recording", _estimate),
    "score": ("compare an estimate with the truth of its recording", _score),
    "figure": ("draw figures of the paper and check its claims", _figure),
    "sweep": ("run a design over a scenario's keys on many processes: a table and a report; resumes by itself", _sweep),
    "list": ("what there is", _list),
    "import": ("turn measured data into a recording, or a track-recording car's file into a track", _import),
    "inspect": ("check a recording, scenario or track and say what is wrong with it", _inspect),
    "discrepancy": ("find what is missing in a model, name it, add it and show the gap shrink", _discrepancy),
    "discrepancy-benchmark": ("hidden effects, blind: how often the workflow is right", _discrepancy_benchmark),
    "bench": ("speed of the engines and estimators", _bench),
}

if __name__ == "__main__":
    sys.exit(main())
