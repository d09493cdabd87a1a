"""Golden record: what every estimator and every figure gave, to hold against what they give after a change of the code.

`python -m tests.golden.record` compares all that is quick with what is in `data` and prints the largest relative
difference of each; `--all` takes the slow figures too, NAME ... only those, `--write` records anew, slow ones too.
`--loosen` raises the tolerances to ten times the differences found: for runs under the settings of other processors.

The figures see no reference data and no earlier run, and linear algebra has one thread: with two, sums are taken in
another order and some estimators' last digits change. Two runs of the estimators on one machine agree in every bit,
with another hash seed too. Between processors `conicity_smoother`, and figures that use it, do not agree in their
leading digits, for recordings of 20 or 30 s of any of the three wheelset scenarios. Tolerances are by quantity.
"""

import argparse
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pandas as pd
from joblib import parallel_config
from threadpoolctl import threadpool_limits

from experiments.reporting.size import Size
from railsim import InputError, load_scenario, measure, simulate
from tests.golden.plugins import Figure, estimator_kinds, figure_kinds
from tests.golden.summary import SCALAR, TOLERANCE, Key, Record, Row, differences, leaf_rows, table_rows

DATA = Path(__file__).with_name("data")
MEASURED_TIMES = ("[s/s]", "times real time")
"""Speeds of the machine, which are no results."""
SLOW = 17.0  # s of a processor; what took longer when it was recorded is replayed by `--all` only
SPARE = 10.0  # tolerance over the difference that was seen between settings of the processor
SEED = 20
NUMBERS = re.compile(r" \([^()]*\d[^()]*\)")
"""What a claim tells in brackets beside its value: numbers that are other ones on another processor."""
SHOWN = 12  # largest differences that are told of each
RECORDINGS = {
    "crossover": 45.0,
    "curve_r400": 30.0,
    "default": 20.0,
    "jointed": 30.0,
    "lateral_2mm": 10.0,
    "low_adhesion": 20.0,
    "stop_and_go": 30.0,
    "suspension": 15.0,
    "wheelset_varying": 20.0,
}
"""Shipped scenarios and seconds of each: every estimator fits at least one, answers one, and some refuse one."""


@contextmanager
def apart() -> Iterator[None]:
    """No earlier runs, no reference data, one thread and process; the environment is as before afterwards."""
    before = dict(os.environ)
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1), parallel_config(backend="sequential"):
        os.environ["OPENBLAS_NUM_THREADS"] = "1"  # of processes that are started
        os.environ["RAILSIM_CACHE"] = f"{folder}/cache"
        os.environ["RAILSIM_REFERENCE"] = f"{folder}/nothing"
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)


@cache
def _recording(name: str):
    """What the sensors of a scenario give of its first seconds."""
    scenario = load_scenario(name, {"duration": RECORDINGS[name], "seed": SEED})
    return measure(simulate(scenario, "compiled"), scenario).measurements


def estimator_rows(name: str) -> dict[Key, Row]:
    """What an estimator gives of each recording that it fits, or that it refuses it."""
    estimator, found = estimator_kinds()[name].build({}), {}
    for part in RECORDINGS:
        measured = _recording(part)
        if not estimator.fits(measured):
            continue
        try:
            estimate = estimator.estimate(measured)
        except InputError:
            found[part, "refused"] = Row(SCALAR, (1.0,))
            continue
        found |= table_rows(part, estimate.series) | leaf_rows(part, "about", estimate.about)
    return found


@cache
def figure_and_table(name: str) -> tuple[Figure, pd.DataFrame]:
    """A figure and its fast table."""
    figure = figure_kinds()[name]()
    return figure, figure.compute(Size.FAST)


def figure_rows(name: str) -> dict[Key, Row]:
    """The fast table of a figure and the values of its claims."""
    figure, table = figure_and_table(name)
    found = table_rows("table", table)
    for place, claim in enumerate(figure.check(table)):
        found |= leaf_rows("claims", f"{place} {NUMBERS.sub('', claim.claim)}", {"value": claim.value})
    return found


def computed(path: str) -> Record:
    """What KIND/NAME gives now."""
    kind, name = path.split("/")
    kinds: dict[str, Callable[[str], dict[Key, Row]]] = {"estimators": estimator_rows, "figures": figure_rows}
    begun = time.process_time()
    rows = {key: row for key, row in kinds[kind](name).items() if not any(text in key[1] for text in MEASURED_TIMES)}
    return Record(rows, time.process_time() - begun)


def names() -> list[str]:
    """KIND/NAME of everything that can be recorded."""
    return [f"estimators/{name}" for name in estimator_kinds()] + [f"figures/{name}" for name in figure_kinds()]


def file_of(path: str, data: Path = DATA) -> Path:
    """Where the record of KIND/NAME is."""
    return data / f"{path}.csv"


def quick(path: str) -> bool:
    """Whether it is recorded and took little time then."""
    return file_of(path).is_file() and Record.open(file_of(path)).seconds <= SLOW


def write(path: str, data: Path) -> str:
    """Record anew; tolerances that were found by `--loosen` stay."""
    file, found = file_of(path, data), computed(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    old = Record.open(file).rows if file.is_file() else {}
    found.loosened({key: row.tolerance for key, row in old.items()}).save(file)
    return f"{len(found.rows)} quantities, {found.seconds:.1f} s of a processor"


def compare(path: str, data: Path, loosen: bool) -> tuple[bool, str]:
    """Whether all is the same to the strict tolerance, and the largest differences in words."""
    old = Record.open(file_of(path, data))
    found = differences(old, computed(path))
    if loosen:
        old.loosened({key: SPARE * one for key, one in found.items() if SPARE * one > TOLERANCE}).save(
            file_of(path, data)
        )
    worst = sorted(found.items(), key=lambda item: -item[1])
    far = [f"\n  {one:.1e} {' / '.join(key)}" for key, one in worst if one > TOLERANCE]
    also = [f"\n  and {len(far) - SHOWN} more"] if len(far) > SHOWN else []
    return not far, f"largest difference {worst[0][1]:.1e}" + "".join([*far[:SHOWN], *also])


def main(words: list[str]) -> int:
    """The command; 1 if something differs by more than the strict tolerance."""
    parser = argparse.ArgumentParser(prog="python -m tests.golden.record", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="estimators/NAME, figures/NAME, estimators or figures")
    parser.add_argument("--all", action="store_true", help="slow figures too")
    parser.add_argument("--write", action="store_true", help="record anew")
    parser.add_argument("--compare", action="store_true", help="compare, which is done anyway without --write")
    parser.add_argument("--loosen", action="store_true", help="compare and raise the tolerances")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the record")
    given = parser.parse_args(words)
    chosen = [one for one in names() if not given.names or one in given.names or one.split("/")[0] in given.names]
    same = True
    for path in chosen:
        if not (given.all or given.write or path in given.names or quick(path)):
            continue
        begun = time.monotonic()
        with apart():
            held, text = (True, write(path, given.data)) if given.write else compare(path, given.data, given.loosen)
        same &= held
        print(f"{path}: {text} ({time.monotonic() - begun:.1f} s)", flush=True)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
