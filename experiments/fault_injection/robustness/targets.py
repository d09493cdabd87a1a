"""Which file is damaged, and the command that then meets it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.fault_injection.robustness.mutations import damaged_bytes, damaged_json
from experiments.fault_injection.robustness.workshop import EXPORTS, call

Damage = Callable[[bytes, np.random.Generator], bytes]


@dataclass(frozen=True)
class Target:
    """A file of the workshop, how it is damaged, what else the command needs, and the command in a place."""

    name: str
    file: str
    damage: Damage
    needs: tuple[str, ...]
    work: Callable[[Path], int]


def _sweep(place: Path) -> int:
    from experiments.sweep.settings import read_sweep

    return len(read_sweep(place / "sweep.yaml").design.rows()) * 0


def _laws(place: Path) -> int:
    from experiments.discrepancy.railway.specimens import read_laws

    return len(read_laws(str(place / "laws.yaml"))) * 0


def _said(work: Callable[[Path], int]) -> Callable[[Path], int]:
    """A library call that ends as a command does: one line and 2 for a mistake."""
    import sys

    from railsim.errors import InputError, printable

    def run(place: Path) -> int:
        try:
            return work(place)
        except InputError as error:
            print(f"railsim: {printable(str(error))}", file=sys.stderr)
            return 2

    return run


def _import(ending: str) -> Callable[[Path], int]:
    def run(place: Path) -> int:
        here = place / ending
        return call("import", here / f"data.{ending}", "--map", here / "map.yaml", "--out", place / "out")

    return run


def _score(place: Path) -> int:
    return call("score", place / "estimate", place / "recording")


def targets() -> list[Target]:
    """All of them."""
    json, raw = damaged_json, damaged_bytes
    both = ("recording", "estimate")
    return [
        Target("scenario", "short.yaml", raw, (), lambda at: call("inspect", at / "short.yaml")),
        Target("sweep", "sweep.yaml", raw, ("short.yaml",), _said(_sweep)),
        Target("laws of a benchmark", "laws.yaml", raw, (), _said(_laws)),
        Target("track", "track.csv", raw, (), lambda at: call("inspect", at / "track.csv")),
        *(Target(f"data, {one}", f"{one}/data.{one}", raw, (one,), _import(one)) for one in EXPORTS),
        Target("map", "csv/map.yaml", raw, ("csv",), _import("csv")),
        Target(
            "recording, description", "recording/about.json", json, both, lambda at: call("inspect", at / "recording")
        ),
        Target(
            "recording, description, estimated", "recording/about.json", json, both,
            lambda at: call("estimate", "speed_plain", at / "recording", "--out", at / "out"),
        ),
        Target(
            "recording, table", "recording/measured/256hz.parquet", raw, both,
            lambda at: call("inspect", at / "recording"),
        ),
        Target("truth, description", "recording/truth/about.json", json, both, _score),
        Target("truth, table", "recording/truth/channels.parquet", raw, both, _score),
        Target("estimate, description", "estimate/about.json", json, both, _score),
        Target(
            "estimate, table", "estimate/estimate.parquet", raw, both,
            lambda at: call("export", at / "estimate", "--to", at / "out.csv"),
        ),
    ]  # fmt: skip
