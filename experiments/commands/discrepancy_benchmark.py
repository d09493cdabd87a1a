"""`railsim discrepancy-benchmark`: count how often the discrepancy workflow is right on hidden effects.

examples:
  railsim discrepancy-benchmark --out benchmark --cases 40
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from experiments.reporting.logs import tell
from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError


def configure(parser: argparse.ArgumentParser) -> None:
    """Folder, cases, and which of them to ask or to score."""
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of cases and results; goes on where it was")
    parser.add_argument("--cases", type=int, default=10, metavar="N", help="number of cases in all (default: 10)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the cases (default: 1)")
    parser.add_argument("--laws", metavar="FILE", default="", help="railway: YAML list of effects of no library")
    parser.add_argument(
        "--system",
        default="railway",
        choices=("railway", "half_car", "balls", "pendulum", "double_pendulum"),
        help="railway, half_car: hidden effects, simulated (default: railway); the others: laboratory records",
    )
    parser.add_argument(
        "--time-limit", type=float, default=900.0, metavar="S", help="railway: seconds of a verdict (default: 900)"
    )
    parser.add_argument("--data", metavar="FOLDER", default="", help="folder of the laboratory's files")
    parser.add_argument(
        "--study",
        choices=("sensitivity", "lengths", "errors"),
        help="half_car: study of answered cases, or of healthy records",
    )
    parser.add_argument(
        "--policy", metavar="FILE", default="", help="half_car: YAML file of the numbers and scales to use"
    )
    parser.add_argument(
        "--learn", metavar="FILE", default="", help="half_car: file for the scales of healthy levels that are learned"
    )
    parser.add_argument("--part", metavar="I/N", default="0/1", help="every N-th case from the I-th on (default: 0/1)")


def execute(given: argparse.Namespace) -> Outcome:
    """Go on with the cases, then score all that are answered."""
    if given.system == "half_car":
        return _half_car(given)
    return _railway(given) if given.system == "railway" else _laboratory(given)


def _laboratory(given: argparse.Namespace) -> Outcome:
    """A measured set: table, picture, and what the others predict."""
    from experiments.discrepancy.systems.laboratory import SETS, page, predicted_powers
    from experiments.discrepancy.systems.picture import picture
    from experiments.reporting.html import png
    from railsim.files import replace_file
    from railsim.plots.style import styled

    if not given.data:
        raise InputError(f"--system {given.system}: give --data, the folder of the laboratory's files")
    folder, out = Path(given.data), Path(given.out)
    told = list(SETS[given.system](folder, tell))
    text = page(told)
    if given.system == "pendulum":
        powers = predicted_powers(folder)
        rows = [[name, nothing, friction] for name, (nothing, friction) in powers.items()]
        text += "\n\n" + table(
            ["predicted from the four others", "frictionless: power", "with friction: power"], rows, 2
        )
    out.mkdir(parents=True, exist_ok=True)
    replace_file(out / f"{given.system}.md", f"{text}\n".encode())
    with styled():
        replace_file(out / f"{given.system}.png", png(picture(told), 150))
    facts = {"verdicts": {one.name: str(one.verdict.action) for one in told}}
    return Outcome(facts | {"withheld": {one.name: str(one.withheld.action) for one in told}}, text)


def _railway(given: argparse.Namespace) -> Outcome:
    """Simulated vehicles with something hidden, or nothing: a file each, and a table of all."""
    from experiments.discrepancy.railway.benchmark import NAME, run_benchmark, score
    from experiments.discrepancy.railway.specimens import read_laws

    if given.cases < 1 or given.time_limit <= 0.0:
        raise InputError("--cases: give a number from 1; --time-limit: seconds above 0")
    (first, step), laws = _part(given.part), read_laws(given.laws) if given.laws else []
    run_benchmark(Path(given.out), given.seed, range(first, given.cases, step), tell, given.time_limit, laws)
    return _counted(given, NAME, score)


def _counted(given: argparse.Namespace, name: str, score: Callable[..., list[list[Any]]]) -> Outcome:
    """Table and picture of all answered cases."""
    from experiments.discrepancy.core.counting import page, read_rows
    from experiments.discrepancy.core.counting_picture import picture
    from experiments.reporting.html import png
    from railsim.files import replace_file
    from railsim.plots.style import styled

    folder = Path(given.out)
    rows = read_rows(folder, name, given.seed)
    scores = score(rows)
    text = page(name.replace("_", " "), rows, scores)
    replace_file(folder / f"{name}.md", f"{text}\n".encode())
    with styled():
        replace_file(folder / f"{name}.png", png(picture(rows), 150))
    names = ("hits", "cases", "share", "low", "high")
    return Outcome({str(title): dict(zip(names, one, strict=True)) for title, *one in scores}, text)


def _half_car(given: argparse.Namespace) -> Outcome:
    """Simulated half cars : a file each, and a table of all."""
    from experiments.discrepancy.core.counting import score
    from experiments.discrepancy.systems.half_car_benchmark import NAME, run_benchmark
    from experiments.discrepancy.systems.half_car_policy import learned_policy, read_policy
    from experiments.discrepancy.systems.half_car_truth import SETTINGS
    from railsim.files import replace_file

    if given.cases < 1:
        raise InputError("--cases: give a number from 1")
    if given.learn:
        replace_file(Path(given.learn), learned_policy(tell).encode())
        return Outcome({"policy": given.learn}, f"{given.learn}: take it by --policy {given.learn}")
    folder = Path(given.out)
    first, step = _part(given.part)
    if given.study:
        return _study(given, folder, range(first, given.cases, step))
    policy, scales = read_policy(Path(given.policy)) if given.policy else (None, None)
    run_benchmark(folder, given.seed, range(first, given.cases, step), tell, policy, scales)
    return _counted(given, NAME, partial(score, settings=SETTINGS))


def _study(given: argparse.Namespace, folder: Path, indices: range) -> Outcome:
    """A study of the half car, as a table."""
    from experiments.discrepancy.core.counting import read_rows
    from experiments.discrepancy.systems.half_car_benchmark import NAME
    from experiments.discrepancy.systems.half_car_studies import lengths, other_errors, sensitivity
    from railsim.files import replace_file

    if given.study == "lengths":
        titles, rows = ["setting", "length [s]", "best effect", "best unknown"], lengths(given.seed, given.cases, tell)
    elif given.study == "errors":
        titles, rows = ["latent levels", "kind", "verdict", "cases"], other_errors(given.seed, indices, tell)
    else:
        answered = read_rows(folder, NAME, given.seed)
        if not answered:
            raise InputError(f"--study sensitivity: no answered case of seed {given.seed} in {folder}; ask them first")
        titles, rows = ["number", "nulls", "effects", "foreign laws", "pairs"], sensitivity(answered)
    text = table(titles, rows, 1)
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / f"half_car_{given.study}.md", f"{text}\n".encode())
    return Outcome({given.study: rows}, text)


def _part(text: str) -> tuple[int, int]:
    numbers = text.split("/")
    if len(numbers) == 2 and all(number.isdigit() for number in numbers) and int(numbers[0]) < int(numbers[1]):
        return int(numbers[0]), int(numbers[1])
    raise InputError(f"--part {text}: give I/N with I from 0 to N - 1, for example 0/2")


def _text(scores: dict[str, Any]) -> str:
    groups = {"metric": scores["metrics"], "right name by class": scores["classes"], **scores["settings"]}
    parts = [
        table([title, "value", "from", "to", "cases"], [_row(name, counted) for name, counted in group.items()])
        for title, group in groups.items()
    ]
    medians = [[*_row(name, median), median["least"], median["most"]] for name, median in scores["figures"].items()]
    parts.append(table(["median of", "value", "from", "to", "cases", "least", "most"], medians))
    return "\n\n".join(parts)


def _row(name: str, metric: dict[str, Any]) -> list[Any]:
    return [name, metric["value"], metric["low"], metric["high"], metric["cases"]]
