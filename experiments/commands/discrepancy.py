"""`railsim discrepancy`: what is missing in a model, found from a recording, named, added."""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from experiments.commands.interface import Outcome, table
from experiments.discrepancy.candidates import candidates
from experiments.discrepancy.explain import explain
from experiments.discrepancy.report import in_words
from railsim.errors import InputError
from railsim.scenario import load_scenario
from railsim.track.files import read_track


def execute(given: argparse.Namespace) -> Outcome:
    """Run the workflow; progress goes to stderr."""
    found = explain(
        Path(given.recording),
        load_scenario(given.model),
        Path(given.out),
        _progress(),
        track=read_track(given.track) if given.track else None,
        only=_known(given.effects),
        fast=given.fast,
        engine=given.engine,
    )
    return Outcome(found, _text(given.out, found))


def _known(names: list[str] | None) -> list[str] | None:
    """The names, where each is an effect's."""
    known = {one.name for one in candidates()}
    for name in names or []:
        if name not in known:
            raise InputError(f"--effects {name}: no such effect; there are: {', '.join(sorted(known))}")
    return names


def _progress() -> Callable[[str], None]:
    begun = time.monotonic()
    return lambda text: print(f"{time.monotonic() - begun:6.1f} s  {text}", file=sys.stderr)


def _text(folder: str, found: dict[str, Any]) -> str:
    rows = [
        [name, one["before"], one["nuisance_only"], one["after"]]
        for name, one in {"all channels together": found["gap"], **found["channels"]}.items()
    ]
    return "\n".join(
        [
            f"{found['status'].upper()}: {in_words(found)}",
            "",
            table(["gap on held-out sections", "before", "nuisances only", "after"], rows, decimals=2),
            "",
            f"{folder}/report.html, {folder}/model.yaml, {folder}/verdict.json",
        ]
    )
