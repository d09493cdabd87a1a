"""`railsim reproduce`: repeat the numbers of the documentation and compare them with the stored ones; resumes.

examples:
  railsim reproduce --list
  railsim reproduce --fast --out reproduced
  railsim reproduce --slice 1/4 --out reproduced
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError

if TYPE_CHECKING:
    from experiments.reproduction.slices import Slice


def configure(parser: argparse.ArgumentParser) -> None:
    """What to make, how large, and where it is kept."""
    parser.add_argument("--out", metavar="DIR", help="folder of the results; what is finished there is not made again")
    parser.add_argument("--fast", action="store_true", help="the slices that take seconds, in their small form")
    parser.add_argument("--only", metavar="NAME", action="append", default=[], help="this slice; may be repeated")
    parser.add_argument("--slice", metavar="I/N", help="every N-th slice from the I-th one on")
    parser.add_argument("--list", action="store_true", help="only say which slices there are, with pages and hours")
    parser.add_argument("--store", metavar="FILE", help="also write all stored numbers, these renewed, into a table")


def execute(given: argparse.Namespace) -> Outcome:
    """Compare; exit code 1 where a number differs, or is missing on either side.

    Raises
    ------
    InputError : no such slice, no folder, or a slice's command fails.
    """
    from experiments.reproduction.numbers import differences, read_stored, write_stored
    from experiments.reproduction.run import perform

    chosen = _chosen(given)
    if given.list:
        return _list(chosen)
    if not given.out:
        raise InputError("--out is missing; name the folder of the results")
    size = "fast" if given.fast else "full"
    made = perform(chosen, Path(given.out), given.fast)
    stored = read_stored()
    rows = [
        {"slice": one.name, "page": one.page, "number": d.name, "stored": d.stored, "made": d.made, "agrees": d.agrees}
        for one in chosen
        for d in differences(one, stored.get((one.name, size), {}), made[one.name])
    ]
    if given.store:
        write_stored(stored | {(name, size): numbers for name, numbers in made.items()}, Path(given.store))
    apart = [row for row in rows if not row["agrees"]]
    lines = [[row["slice"], row["number"], row["stored"], row["made"]] for row in apart]
    said = f"{len(rows) - len(apart)} of {len(rows)} numbers of {len(chosen)} slices agree ({size})."
    told = [table(["slice", "number", "stored", "made"], lines, decimals=6), ""] if apart else []
    return Outcome({"size": size, "numbers": [_plain(row) for row in rows]}, "\n".join([*told, said]), not apart)


def _chosen(given: argparse.Namespace) -> "list[Slice]":
    from experiments.reporting.slices import sliced
    from experiments.reproduction.slices import slices
    from railsim.registry import pick

    known = slices()
    named = [pick(known, name, "slice") for name in given.only] or list(known.values())
    return list(sliced([one for one in named if not given.fast or one.fast is not None], given.slice))


def _list(chosen: "list[Slice]") -> Outcome:
    rows = [[one.name, one.page, f"railsim {one.command}", one.hours, "yes" if one.fast else ""] for one in chosen]
    total = f"{sum(one.hours for one in chosen):.2f} h of one core together"
    text = table(["slice", "page", "command", "h", "fast"], rows, decimals=2)
    return Outcome({"slices": [one.model_dump() for one in chosen]}, f"{text}\n\n{total}")


def _plain(row: dict[str, object]) -> dict[str, object]:
    """None in place of NaN, which JSON has not."""
    return {name: None if value != value else value for name, value in row.items()}
