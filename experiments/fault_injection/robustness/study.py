"""The kinds of fault, each a number of cases that depend on nothing but kind and number."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.fault_injection.robustness.attempt import Attempt, Ending, ended
from experiments.fault_injection.robustness.mutations import flipped
from experiments.fault_injection.robustness.surroundings import compared, names
from experiments.fault_injection.robustness.targets import targets
from experiments.fault_injection.robustness.workshop import FAST, call, contents, copy_of, make_wide
from railsim.digests import MARKER, is_whole
from railsim.scratch import PARTIAL

NOBODY = 65534
COMPILED = 200.0  # s of a processor for a command that has to compile every kernel
SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)


@dataclass(frozen=True)
class Result:
    """A case: what met what, how it ended in a word, and what was not as it should be."""

    target: str
    ending: str
    faults: tuple[str, ...]
    seconds: float
    memory: int
    text: str


@dataclass(frozen=True)
class Writer:
    """A command that writes: the inputs that it needs, its call, and what it makes."""

    name: str
    needs: tuple[str, ...]
    work: Callable[[Path], int]
    made: str = "out"


def writers() -> list[Writer]:
    """Commands that write files."""
    return [
        Writer(
            "simulate", ("short.yaml",),
            lambda at: call("simulate", at / "short.yaml", *FAST, "--out", at / "out"),
        ),
        Writer("run", ("short.yaml",), lambda at: call("run", at / "short.yaml", *FAST, "--out", at / "out")),
        Writer(
            "estimate", ("recording",),
            lambda at: call("estimate", "speed_plain", at / "recording", "--out", at / "out"),
        ),
        Writer(
            "import", ("csv",),
            lambda at: call("import", at / "csv" / "data.csv", "--map", at / "csv" / "map.yaml", "--out", at / "out"),
        ),
        Writer(
            "export", ("recording",),
            lambda at: call("export", at / "recording", "--to", at / "out.csv", "--overwrite"), "out.csv",
        ),
        Writer(
            "inspect --repair", ("recording",),
            lambda at: call("inspect", at / "recording", "--repair", at / "out"),
        ),
        Writer(
            "inspect --prune", ("recording",),
            lambda at: call("inspect", at / "recording", "--prune", "--after", "0", "--yes"), "recording",
        ),
        Writer(
            "sweep", ("short.yaml", "sweep.yaml"),
            lambda at: call("sweep", at / "sweep.yaml", "--jobs", "1", "--out", at / "out"),
        ),
    ]  # fmt: skip


def damaged_input(number: int, workshop: Path, place: Path) -> Result:
    """A command that meets a damaged file."""
    rng = np.random.default_rng([1, number])
    every = targets()
    target = every[number % len(every)]
    copy_of(workshop, [*target.needs, *([] if target.file.split("/")[0] in target.needs else [target.file])], place)
    file = place / target.file
    file.write_bytes(target.damage(file.read_bytes(), rng))
    for marker in list(place.rglob(MARKER)):  # digests would stop all damage before it is read
        marker.unlink()
    before = set(place.rglob("*"))
    ending = ended(Attempt(lambda: target.work(place), place / "said"))
    new = {path.relative_to(place).parts[0] for path in set(place.rglob("*")) - before}
    left = ["left behind"] if not new <= {"said", "out", "out.csv", *_LIVE} or _partial(place) else []
    return _result(target.name, ending, left)


def stopped(number: int, workshop: Path, place: Path) -> Result:
    """A command that is stopped at some moment and called again: the same as without the stop, and nothing left."""
    rng = np.random.default_rng([2, number])
    every = writers()
    writer = every[number % len(every)]
    due, seconds = _undisturbed(writer, workshop, place.parent)
    copy_of(workshop, writer.needs, place)
    moment, how = float(rng.uniform(0.0, 1.05 * seconds)), SIGNALS[int(rng.integers(3))]
    older = bool(rng.integers(2)) and writer.name in ("simulate", "run", "estimate", "import", "inspect --repair")
    if older:
        shutil.copytree(workshop / "estimate" if writer.name == "estimate" else workshop / "recording", place / "out")
    first = ended(Attempt(lambda: writer.work(place), place / "said", (moment, how), environment=_own(place)))
    faults = [] if not older or is_whole(place / "out") else ["older result lost"]
    if older and writer.name != "estimate":
        shutil.rmtree(place / "out")
    again = ended(Attempt(lambda: writer.work(place), place / "said", environment=_own(place)))
    found = _of(place / writer.made)
    wrong = [name for name, digest in due.items() if found.get(name) != digest]
    faults += ["other bytes: " + wrong[0]] if wrong else []
    faults += ["left behind"] if _partial(place) else []
    return _result(writer.name, first, [*faults, *(f"again: {one}" for one in again.faults)])


def flipped_bit(number: int, workshop: Path, place: Path) -> Result:
    """A bit that changes in a result: noticed with the file named, or without any consequence."""
    rng = np.random.default_rng([3, number])
    copy_of(workshop, ("recording", "estimate"), place)
    files = [
        path
        for name in ("recording", "estimate")
        for path in sorted((place / name).rglob("*"))
        if path.is_file() and path.name != "estimate.png"
    ]
    file = files[number % len(files)]
    _call_json(place)
    due = (place / "said").read_text()
    file.write_bytes(flipped(file.read_bytes(), rng))
    ending = _call_json(place)
    name = str(file.relative_to(place))
    noticed = ending.code == 2 or "is not as railsim wrote it" in ending.text
    outcome = "noticed" if noticed else "harmless" if ending.text == due else "silent"
    faults = ["silent change"] if outcome == "silent" else []
    return Result(name, outcome, (*ending.faults, *faults), ending.seconds, ending.memory, ending.text[-400:])


def _call_json(place: Path) -> Ending:
    def work() -> int:
        codes = [call("score", place / "estimate", place / "recording", "--json")]
        codes.append(call("inspect", place / "recording", "--json"))
        return max(codes)

    return ended(Attempt(work, place / "said"))


def full_disk(number: int, workshop: Path, place: Path) -> Result:
    """A disk that takes no more at some file: one line, the older result as it was, nothing left."""
    rng = np.random.default_rng([4, number])
    every = [one for one in writers() if one.made == "out" and one.name != "sweep"]
    writer = every[number % len(every)]
    copy_of(workshop, writer.needs, place)
    largest = int(10 ** rng.uniform(1.0, 4.5))
    (place / "cache").mkdir()
    ending = ended(Attempt(lambda: writer.work(place), place / "said", largest=largest, environment=_own(place)))
    faults = ["left behind"] if _partial(place) else []
    faults += ["half a result"] if (place / "out").exists() and not is_whole(place / "out") else []
    faults += ["not said"] if ending.code == 2 and "railsim: " not in ending.text else []
    return _result(writer.name, ending, faults)


def foreign_home(number: int, workshop: Path, place: Path) -> Result:
    """A home that cannot be written, every other time as another user: the commands work all the same."""
    every = [one for one in writers() if one.name != "sweep"]
    writer = every[number % len(every)]
    copy_of(workshop, writer.needs, place)
    user = NOBODY if number // len(every) % 2 and os.geteuid() == 0 else None
    if user is not None and not _public(Path(sys.executable).resolve()):
        text = "the interpreter stands in a folder of its user alone"
        return Result(f"{writer.name}, another user", "not tried", (), 0.0, 0, text)
    for path in (place, *place.rglob("*")):
        path.chmod(0o777)
    for folder in place.parents:  # scratch folders are for their own user alone
        if tempfile.gettempdir() in map(str, folder.parents):
            folder.chmod(0o755)
    home = {"HOME": os.devnull, "XDG_CACHE_HOME": "", "RAILSIM_CACHE": "", "NUMBA_CACHE_DIR": "", "TMPDIR": str(place)}
    program = "import sys; from pathlib import Path\nfrom experiments.fault_injection.robustness.study import writers\n"
    program += "sys.exit(next(w for w in writers() if w.name == sys.argv[1]).work(Path(sys.argv[2])))"

    def work() -> int:
        return subprocess.call([sys.executable, "-c", program, writer.name, str(place)])

    root = str(Path(__file__).parents[3])
    environment = {**home, "PYTHONPATH": root}
    ending = ended(Attempt(work, place / "said", environment=environment, user=user, longest=COMPILED))
    faults = ["does not work"] if ending.code not in (0, 1) else []
    return _result(f"{writer.name}{', another user' if user else ''}", ending, faults)


def _public(path: Path) -> bool:
    """Whether every user may open a file or folder."""
    return all(one.stat().st_mode & 0o001 for one in (path, *path.parents))


def surroundings(number: int, workshop: Path, place: Path) -> Result:
    """An estimator with other orders of sets, other threads and a cold cache: the same bytes."""
    name = names()[number]
    ending, faults, seconds, memory = compared(name, make_wide(workshop), place)
    return Result(name, ending, tuple(faults), seconds, memory, "")


def _undisturbed(writer: Writer, workshop: Path, scratch: Path) -> tuple[dict[str, str], float]:
    """Digests of what a command makes without a stop, without files that differ by the clock; and its time, s."""
    if writer.name not in _known:
        results, seconds = [], 0.0
        for which in ("one", "other"):
            place = scratch / f"undisturbed-{which}"
            place.mkdir()
            copy_of(workshop, writer.needs, place)
            seconds = ended(Attempt(lambda at=place: writer.work(at), place / "said", environment=_own(place))).seconds
            results.append(_of(place / writer.made))
            shutil.rmtree(place)
        same = {name: digest for name, digest in results[0].items() if results[1].get(name) == digest}
        _known[writer.name] = same, seconds
    return _known[writer.name]


def _of(result: Path) -> dict[str, str]:
    """Digests of a result, be it a folder or a file."""
    if result.is_dir():
        return contents(result)
    return {name: digest for name, digest in contents(result.parent).items() if name == result.name}


_known: dict[str, tuple[dict[str, str], float]] = {}
_LIVE = ("cache", "temporary")


def _own(place: Path) -> dict[str, str]:
    """A cache and a temporary folder of the case's own."""
    for name in _LIVE:
        (place / name).mkdir(exist_ok=True)
    return {"RAILSIM_CACHE": str(place / "cache"), "TMPDIR": str(place / "temporary")}


def _partial(place: Path) -> bool:
    return any(PARTIAL in path.name for path in place.rglob("*"))


def _result(target: str, ending: Ending, faults: list[str]) -> Result:
    words = {0: "used", 1: "used", 2: "refused", 130: "stopped"}
    word = words.get(ending.code, "killed" if ending.code < 0 else f"exit code {ending.code}")
    return Result(target, word, (*ending.faults, *faults), ending.seconds, ending.memory, ending.text[-400:])


KINDS: dict[str, tuple[Callable[[int, Path, Path], Result], int]] = {
    "damaged input": (damaged_input, 3000),
    "stop": (stopped, 200),
    "flipped bit": (flipped_bit, 200),
    "full disk": (full_disk, 20),
    "foreign home": (foreign_home, 14),
    "surroundings": (surroundings, len(names())),
}
"""By name: a case by its number, and how many the study has."""
