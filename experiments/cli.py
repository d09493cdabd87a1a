"""The `railsim` command: reads arguments, calls one of `experiments.commands`, turns errors into one line."""

import _thread
import argparse
import ast
import importlib
import json
import logging
import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, NoReturn

import pydantic
from threadpoolctl import threadpool_limits

from experiments import commands
from experiments.reporting.logs import LEVELS, LOGGER, logged
from experiments.reporting.outcome import Outcome
from railsim.distribution import check_packages
from railsim.errors import InputError, Noticed, printable
from railsim.plugins import more_plugins

BAD_INPUT = 2
UNFORESEEN = 3
INTERRUPTED = 130
LATER = 0.05  # s
SHELLS = ("bash", "zsh", "tcsh")
EXAMPLES = """examples:
  railsim run default                      simulate, measure, estimate and score
  railsim list estimators                  all estimators, with what they give
  railsim new estimator my_filter          begin an estimator of your own
  eval "$(railsim --completion bash)"      complete commands and names in this shell"""
REPORT = "call it again with --debug and report what is printed, with the input if you can share it"


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f"railsim: {message}; see '{self.prog} --help'\n")


class _CommandParser(_Parser):
    """Parser of one command, whose module is imported only when the command is called."""

    module: str | None = None

    def parse_known_args(self, *arguments: Any, **named: Any) -> Any:
        """Let the command add its arguments, then read them."""
        self.complete_itself()
        return super().parse_known_args(*arguments, **named)

    def complete_itself(self) -> None:
        """Let the command add its arguments."""
        if self.module:
            with redirect_stdout(sys.stderr):
                command = importlib.import_module(self.module)
            command.configure(self)
            self.set_defaults(execute=command.execute)
            self.module = None


class _Version(argparse.Action):
    """Says the version, which is looked up only then."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        """Print and end."""
        from railsim.distribution import version

        print(f"railsim {version()}")
        parser.exit()


class _Completion(argparse.Action):
    """Writes what a shell needs to complete commands, options and names."""

    def __call__(self, parser: argparse.ArgumentParser, given: Any, shell: Any, option: Any = None) -> NoReturn:
        """Print and end."""
        from experiments.reporting.completion import script

        for command in _commands(parser):
            command.complete_itself()
        print(script(parser, shell))
        parser.exit()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns 0 on success, 1 where a check or claim did not hold, 2 on bad input, 130 on Ctrl-C
    or where it is told to end, 3 on an error that nobody foresaw.
    """
    usual, sys.unraisablehook = sys.unraisablehook, _hear_again
    given = argparse.Namespace(debug=False)
    try:
        with _ended_like_interrupted(), _noticed_in_a_line(), threadpool_limits(1):
            check_packages()
            given = build_parser().parse_args(arguments)
            outcome = _execute(given)
        print(json.dumps(outcome.result, allow_nan=False, ensure_ascii=False) if given.json else outcome.text)
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader has gone, which is its right
        return 0
    except KeyboardInterrupt as stop:
        sys.unraisablehook = _say_nothing
        if arguments is None:  # the process ends with this
            usual = _say_nothing
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
    except Exception as error:
        if given.debug:
            raise
        return _complain(f"{unforeseen(error)}; this is a fault of railsim: {REPORT}", UNFORESEEN)
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


def _say_nothing(lost: Any) -> None:
    """What was half made when a Ctrl-C came may complain as it is deleted: of no use to who pressed it."""


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands: one for each public module of `experiments.commands`, none of which is imported."""
    parser = _Parser(
        prog="railsim",
        description="Simulate a railway vehicle, measure, estimate, score.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    parser.add_argument(
        "--completion", action=_Completion, choices=SHELLS, help="print what completes the command in that shell"
    )
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_CommandParser)
    for path in sorted(Path(commands.__path__[0]).glob("[!_]*.py")):
        text, examples = _summary(path)
        command = subparsers.add_parser(
            path.stem.rstrip("_").replace("_", "-"),  # the module of a Python keyword ends with "_"
            help=text,
            description=text,
            epilog=examples,
            formatter_class=argparse.RawTextHelpFormatter,
        )
        command.module = f"{commands.__name__}.{path.stem}"
        command.add_argument("--json", action="store_true", help="one JSON object on stdout")
        told = command.add_mutually_exclusive_group()
        told.add_argument(
            "--quiet", dest="told", action="store_const", const="quiet", default="usual", help="only errors on stderr"
        )
        told.add_argument(
            "--verbose", dest="told", action="store_const", const="verbose", help="each step with its time on stderr"
        )
        command.add_argument("--debug", action="store_true", help="show the traceback of an unforeseen error")
        command.add_argument(
            "--plugins", metavar="DIR", action="append", default=[], help="look for plug-ins in this folder too"
        )
    return parser


def _summary(path: Path) -> tuple[str, str | None]:
    """First line of a command's docstring, without its name and the full stop; and its examples."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    _, title, examples = text.partition("\nexamples:\n")
    return text.partition("\n")[0].partition(": ")[2].rstrip("."), f"examples:\n{examples}" if title else None


def _commands(parser: argparse.ArgumentParser) -> list[_CommandParser]:
    """The parsers of all commands."""
    found = [one for action in parser._actions if isinstance(action.choices, dict) for one in action.choices.values()]
    return [one for one in found if isinstance(one, _CommandParser)]


def _execute(given: argparse.Namespace) -> Outcome:
    """Execute the command; what it prints goes to stderr."""
    with logged(LEVELS[given.told]), redirect_stdout(sys.stderr), more_plugins(given.plugins):
        return given.execute(given)


@contextmanager
def _noticed_in_a_line() -> Iterator[None]:
    """What is noticed about the input stands in a line of its own, once, without the place in the code."""
    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *place: Any, **named: Any) -> None:
        if issubclass(category, Noticed):
            logging.getLogger(LOGGER).warning("railsim: %s", printable(str(message)))
        else:
            usual(message, category, *place, **named)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def unforeseen(error: Exception) -> str:
    """An error that nobody foresaw: its kind, what it says and where it came from."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {printable(str(error))[:200]} (in {Path(frame.filename).name}:{frame.lineno})"


def _complain(text: str, code: int = BAD_INPUT) -> int:
    print(f"railsim: {printable(text)}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
