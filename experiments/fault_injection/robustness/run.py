"""Cases one after the other, each kept as it ends, and the table of all that are there."""

import json
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.fault_injection.robustness.study import KINDS, Result
from experiments.fault_injection.robustness.workshop import make_workshop
from experiments.reporting.slices import sliced
from railsim.errors import InputError
from railsim.files import json_text, replace_file
from railsim.progress import counted
from railsim.scratch import scratch_folder

CASES = "cases"
PAGE = "robustness.md"


def perform(folder: Path, kinds: Sequence[str], share: float, part: str | None) -> list[tuple[str, Result]]:
    """Make the cases that are missing; what a call that was stopped has made is kept.

    Parameters
    ----------
    folder : of the results. kinds : of `KINDS`. share : of each kind's cases, 0 to 1.
    part : "I/N", every N-th case from the I-th on; None: all.

    Returns
    -------
    All cases of the folder, of other calls too, each with its kind.
    """
    workshop = make_workshop(folder / "workshop")
    wanted = [(kind, number) for kind in kinds for number in range(max(1, round(share * KINDS[kind][1])))]
    wanted = [one for one in sliced(wanted, part) if not _file(folder, *one).is_file()]
    with scratch_folder("railsim-robustness") as scratch:
        for kind, number in counted(wanted, "cases", "cases"):
            with scratch_folder("case", scratch) as aside:
                place = aside / "place"
                place.mkdir()
                result = KINDS[kind][0](number, workshop, place)
            replace_file(_file(folder, kind, number), json_text({"kind": kind, **asdict(result)}).encode())
    return list(kept(folder))


def kept(folder: Path) -> Iterator[tuple[str, Result]]:
    """The cases that a folder holds, each with its kind."""
    for path in sorted((folder / CASES).glob("*.json")):
        try:
            values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            kind = values.pop("kind")
            values["faults"] = tuple(values["faults"])
            yield kind, Result(**values)
        except (ValueError, TypeError, KeyError):
            raise InputError(f"'{path}' is not a case of this study; remove it, and it is made again") from None


def page(results: Sequence[tuple[str, Result]]) -> str:
    """Tables in Markdown: how many of each kind, how they ended, and what was not as it should be."""
    groups: dict[tuple[str, str], list[Result]] = defaultdict(list)
    for kind, result in results:
        groups[kind, result.target].append(result)
    lines = [
        "| fault | meets | cases | how they ended | longest, s | memory, MiB | not as it should be |",
        "|" + "---|" * 7,
    ]
    for (kind, target), cases in sorted(groups.items()):
        endings = ", ".join(f"{count} {word}" for word, count in Counter(one.ending for one in cases).most_common())
        faults = Counter(fault for one in cases for fault in one.faults)
        wrong = ", ".join(f"{count} {fault}" for fault, count in faults.most_common()) or "0"
        longest, memory = max(one.seconds for one in cases), max(one.memory for one in cases) / 2**20
        lines.append(f"| {kind} | {target} | {len(cases)} | {endings} | {longest:.1f} | {memory:.0f} | {wrong} |")
    total = Counter(kind for kind, _ in results)
    bad = Counter(kind for kind, result in results if result.faults)
    summary = [f"- {kind}: {count} cases, {bad[kind]} not as they should be" for kind, count in total.items()]
    return "\n".join([*summary, "", *lines, ""])


def _file(folder: Path, kind: str, number: int) -> Path:
    return folder / CASES / f"{kind.replace(' ', '_')}-{number:04d}.json"
