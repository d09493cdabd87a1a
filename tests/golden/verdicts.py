"""Twelve blind cases, made and answered: the whole verdicts, to hold against those after a change of the code.

`python -m tests.golden.verdicts --out FILE.json` makes and answers them and writes their verdicts; with `--compare
FILE.json` they are held against those of that file. Both may be given. `--work DIR` keeps the recordings, so that the
same are answered again; without it they are made in a folder that is removed. `--cases N ...` takes only some of them.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.discrepancy.baseline.evidence import gather
from experiments.discrepancy.blind.benchmark import Cases
from experiments.discrepancy.result.answer import answer
from tests.golden.record import apart
from tests.golden.summary import TOLERANCE

LAWS = Path(__file__).parents[1] / "experiments" / "discrepancy" / "foreign_laws.yaml"
MAKER = "experiments.discrepancy.blind.blind_cases"  # makes one case in a process of its own
SHOWN = 20  # differences that are told of each case
CASES = Cases("yaw_dampers", seed=30, duration=24.0, laws=str(LAWS))
NUMBERS = {
    2: "effect: a sensor's delay, named",
    34: "null",
    69: "effect: a stretch exposed to wind, named a gust, of the same class",
    94: "withheld: stiffness of the air spring; unknown",
    111: "decoy: unknown, at one sensor",
    138: "foreign: unknown, with a law found from the recording",
    153: "decoy: none",
    188: "withheld: blow-off of the yaw damper, named otherwise",
    277: "effect: asymmetry of the secondary suspension under FASTSIM, named",
    356: "effect: low adhesion at a place, named, with its place",
    368: "pair: low adhesion and a sensor's gain, both named",
    386: "effect: rail joints, named",
}
"""Of the rows of seed 30: all kinds, four settings, both creep laws, and little time of each."""

Verdicts = dict[str, dict[str, Any]]


def made(number: int, folder: Path) -> Path:
    """The recording of a case, which is made unless it is there."""
    recording = folder / "recordings" / f"{number:04d}"
    if not recording.is_dir():
        words = [CASES.model, str(folder), str(CASES.seed), str(number), str(CASES.duration), CASES.laws]
        subprocess.run([sys.executable, "-m", MAKER, *words], check=True)
    return recording


def answered(number: int, folder: Path) -> dict[str, Any]:
    """Label of a case and the verdict on it, as plain JSON; of the label only a withheld effect is used."""
    recording = made(number, folder)
    label = json.loads((folder / "sealed" / f"{number:04d}.json").read_text(encoding="utf-8"))
    withheld = label["classes"][:1] if label["kind"] == "withheld" else []
    verdict, _ = answer(gather(recording, CASES.nominal(number)), withheld=withheld)
    kept = {key: label[key] for key in ("kind", "setting", "effects", "classes", "law")}
    return json.loads(json.dumps({"label": kept, "verdict": verdict}))


def verdicts(numbers: list[int], folder: Path) -> Verdicts:
    """Label and verdict of every case, by its number as text."""
    found: Verdicts = {}
    for number in numbers:
        begun = time.monotonic()
        with apart():
            found[str(number)] = answered(number, folder)
        one = found[str(number)]["verdict"]
        told = f"{one['status']} {one['effect'] or ''}".strip()
        print(f"case {number}: {told} in {time.monotonic() - begun:.1f} s ({NUMBERS[number]})", flush=True)
    return found


def apart_by(old: Any, new: Any, place: str = "") -> dict[str, float]:
    """Relative difference of every number of two JSON values; infinite where anything else differs."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        pairs = {str(key): (old.get(key, ...), new.get(key, ...)) for key in dict.fromkeys([*old, *new])}
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = {str(key): pair for key, pair in enumerate(zip(old, new, strict=True))}
    elif isinstance(old, float) and isinstance(new, int | float) or isinstance(new, float) and isinstance(old, int):
        return {place: 0.0 if old == new else abs(old - new) / max(abs(old), abs(new))}
    else:
        return {place: 0.0 if old == new else float("inf")}
    return {key: one for name, pair in pairs.items() for key, one in apart_by(*pair, f"{place}.{name}").items()}


def compared(old: Verdicts, new: Verdicts) -> bool:
    """Whether all verdicts are the same to the tolerance; prints what is not."""
    same = True
    for number, verdict in new.items():
        found = apart_by(old.get(number), verdict)
        worst = sorted(found.items(), key=lambda item: -item[1])
        far = [f"\n  {one:.1e} {place}" for place, one in worst if one > TOLERANCE]
        same &= not far
        print(f"case {number}: {len(found)} values, largest difference {worst[0][1]:.1e}" + "".join(far[:SHOWN]))
    return same


def main(words: list[str]) -> int:
    """The command; 1 if a verdict differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.golden.verdicts", description=__doc__)
    parser.add_argument("--out", type=Path, metavar="FILE", help="where the verdicts are written")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="earlier verdicts")
    parser.add_argument("--work", type=Path, metavar="DIR", help="folder of the recordings, kept")
    parser.add_argument("--cases", type=int, nargs="+", choices=list(NUMBERS), default=list(NUMBERS), metavar="N")
    given = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as aside:
        found = verdicts(given.cases, given.work or Path(aside))
    if given.out:
        given.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    if given.compare:
        return 0 if compared(json.loads(given.compare.read_text(encoding="utf-8")), found) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
