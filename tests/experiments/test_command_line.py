"""The command around the commands: version, examples, completion, what is told on stderr, starts, pages."""

import logging
import os
import re
import resource
import shlex
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from tqdm import tqdm

import railsim
from experiments.cli import build_parser, main
from experiments.commands import new
from experiments.conformance.plugins import subjects
from experiments.reporting.logs import logged
from railsim.errors import InputError
from railsim.plugins import more_plugins
from railsim.progress import counted, counting
from tests.experiments.conftest import ROOT, Command
from tests.experiments.test_cli import COMMANDS

PROBE = """
source "$1"; shift
specification=$(complete -p railsim)
function=${specification#*-F }
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_LINE="$*"; COMP_POINT=${#COMP_LINE}
"${function%% *}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


def test_version_is_that_of_the_project(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as done:
        main(["--version"])
    assert done.value.code == 0
    stated = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert stated is not None
    assert capsys.readouterr().out == f"railsim {stated[1]}\n"
    assert railsim.__version__ == stated[1]


def test_help_is_quick():
    """Processor time of the quickest of three starts, which counts less of what else the machine does."""
    spent = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "railsim", "--help"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert min(spent) < 0.4


@pytest.mark.parametrize("command", COMMANDS)
def test_every_help_has_examples_that_are_understood(command: str, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit):
        build_parser().parse_args([command, "--help"])
    examples = re.findall(r"^  railsim (.+)$", capsys.readouterr().out.partition("\nexamples:\n")[2], re.MULTILINE)
    assert examples
    for example in examples:
        words = shlex.split(example)
        assert words[0] == command
        assert build_parser().parse_args(words).execute


@pytest.fixture(scope="module")
def completion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What bash is given."""
    words = [sys.executable, "-m", "railsim", "--completion", "bash"]
    done = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True)
    path = tmp_path_factory.mktemp("completion") / "railsim.bash"
    path.write_text(done.stdout)
    return path


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("railsim sim", {"simulate"}),
        ("railsim run defau", {"default"}),
        ("railsim run default --eng", {"--engine"}),
        ("railsim list estim", {"estimators"}),
        ("railsim estimate speed_ref", {"speed_refined"}),
        ("railsim new estim", {"estimator"}),
        ("railsim figure fig0", {f"fig0{number}" for number in (2, 3, 4, 5, 7, 8, 9)}),
        ("railsim inspect my_rec", {"my_recording"}),
    ],
)
def test_bash_completes_commands_options_names_and_paths(
    line: str, expected: set[str], completion: Path, tmp_path: Path
):
    (tmp_path / "my_recording").mkdir()
    words = ["bash", "-c", PROBE, "bash", str(completion), *line.split()]
    done = subprocess.run(words, cwd=tmp_path, check=True, capture_output=True, text=True)
    assert set(done.stdout.split()) == expected, done.stderr


@pytest.mark.parametrize("kind", new.KINDS)
def test_what_new_writes_passes_its_checks(kind: str, railsim_here: Command, tmp_path: Path):
    done = railsim_here("new", kind, f"my_{kind}", "--in", "mine")
    assert done.returncode == 0, done.stderr
    path = tmp_path / "mine" / f"{kind}s" / f"my_{kind}{new.KINDS[kind]}"
    with more_plugins([tmp_path / "mine"]):
        results = [result for subject in subjects(str(path)) for result in subject.results()]
    assert results
    assert [f"{result.check}: {result.message}" for result in results if not result.ok] == []
    assert "#" in path.read_text()
    again = railsim_here("new", kind, f"my_{kind}", "--in", "mine")
    assert again.returncode == 2 and "is there already" in again.stderr


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("estimator", "speed_plain"), "ships with railsim"),
        (("scenario", "default"), "ships with railsim"),
        (("effect", "two-words"), "letters, digits and '_'"),
        (("vehicle", "class"), "letters, digits and '_'"),
    ],
)
def test_new_refuses_names_that_cannot_be(words: tuple[str, str], reason: str, railsim_here: Command, tmp_path: Path):
    done = railsim_here("new", *words)
    assert done.returncode == 2 and reason in done.stderr
    assert not list(tmp_path.iterdir())


def test_open_shows_the_page_of_a_result(railsim_here: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    shown: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: shown.append(address) or True)
    (tmp_path / "sweep").mkdir()
    for name in ("report.html", "another.html"):
        (tmp_path / "sweep" / name).write_text("<html></html>")
    assert railsim_here("open", "sweep").returncode == 0
    assert shown == [(tmp_path / "sweep" / "report.html").as_uri()]


def test_open_makes_a_page_of_tables_where_there_is_none(railsim_here: Command, tmp_path: Path):
    folder = tmp_path / "result"
    folder.mkdir()
    assert railsim_here("open", "result", "--no-browser").returncode == 2
    (folder / "scores.csv").write_text("estimator,value\n<b>,1.25\n")
    (folder / "summary.json").write_text('{"scenario": "mine", "notes": ["a note"]}')
    assert railsim_here("open", "result", "--no-browser").stdout == "result/overview.html\n"
    page = (folder / "overview.html").read_text()
    assert all(text in page for text in ("&lt;b&gt;", "1.25", "mine", "a note"))


@pytest.fixture
def telling(monkeypatch: pytest.MonkeyPatch) -> None:
    """A command that tells something on each level."""

    def execute(given: object) -> object:
        logger = logging.getLogger("railsim")
        logger.debug("a step")
        logger.info("a line")
        raise InputError("what is wrong")

    monkeypatch.setattr("experiments.commands.list.execute", execute)


@pytest.mark.parametrize(
    ("option", "lines"), [("--quiet", 1), ("--json", 2), ("--verbose", 3)], ids=["quiet", "usual", "verbose"]
)
def test_levels_of_what_is_told(option: str, lines: int, telling: None, capsys: pytest.CaptureFixture[str]):
    logger = logging.getLogger("railsim")
    before = (logger.level, logger.propagate, list(logger.handlers))
    assert main(["list", option]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    told = written.err.splitlines()
    assert len(told) == lines
    assert told[-1] == "railsim: what is wrong"
    assert (logger.level, logger.propagate, list(logger.handlers)) == before


class _Terminal:
    """A stderr that says that it is a terminal."""

    def __init__(self) -> None:
        self.written = ""

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> None:
        self.written += text

    def flush(self) -> None:
        pass


def test_progress_says_the_remaining_time(monkeypatch: pytest.MonkeyPatch):
    terminal = _Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr("railsim.progress.SHOWN_AFTER", 0.1)
    for _ in counted(range(8), "waiting", "turns"):
        time.sleep(0.05)
    assert re.search(r"waiting: +\d+%.*\d/8 \[00:\d\d<00:\d\d", terminal.written), terminal.written


def test_progress_shows_on_a_terminal_that_does_not_say_its_width(monkeypatch: pytest.MonkeyPatch):
    ours, theirs = os.openpty()  # of no columns and no rows until someone sets them
    os.set_blocking(ours, False)
    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr("sys.stderr", terminal)
        monkeypatch.setattr("railsim.progress.SHOWN_AFTER", 0.1)
        for _ in counted(range(8), "waiting", "turns"):
            time.sleep(0.05)
        written = os.read(ours, 65536).decode()
        monkeypatch.undo()
    os.close(ours)
    assert re.search(r"waiting: +\d+%.*\d/8 \[00:\d\d<00:\d\d", written), written


def test_progress_goes_on_while_nothing_is_counted(monkeypatch: pytest.MonkeyPatch):
    terminal = _Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr("railsim.progress.SHOWN_AFTER", 0.05)
    for total, shown in (
        (None, r"0\.[1-9] s \[00:00"),
        (10.0, r"1%.*0\.[1-9]/10\.0 \[00:00<00:\d\d"),
        (0.2, r" 50%.*0\.1/0\.2"),
    ):
        terminal.written = ""
        with counting(total, "waiting", "s", by_clock=True):
            time.sleep(0.3)
        assert re.search(shown, terminal.written), terminal.written
        assert terminal.written.rpartition("waiting")[2].endswith("\r"), "the bar has gone"
    terminal.written = ""
    with counting(4, "waiting", "turns") as bar:
        time.sleep(0.2)
        assert re.search(r"0/4", terminal.written), "shown before the first turn ends"
        bar.update()


def test_progress_is_silent_when_quick_or_asked_to_be(monkeypatch: pytest.MonkeyPatch):
    terminal = _Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    list(counted(range(3), "quick", "turns"))
    with logged(logging.ERROR), counting(3, "silent", "turns", in_files=True) as bar:
        bar.update(3)
    assert terminal.written == ""


def test_a_bar_takes_no_semaphore_of_the_system():
    """A worker that is killed would leave it behind, and Python warns of it."""
    with counting(1, "waiting", "turns"):
        assert isinstance(tqdm.get_lock(), type(threading.RLock()))


def test_a_quiet_command_gives_results_alone():
    words = [sys.executable, "-m", "railsim", "list", "tracks", "--quiet"]
    done = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stderr == "" and "smooth" in done.stdout
