"""Cells of the matrix: estimators run on a recording, their scores judged; one small file an estimator."""

import hashlib
import json
import math
import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from estimators.interface import ESTIMATORS, Estimate
from experiments.circumstances.circumstance import Circumstance
from experiments.circumstances.verdicts import (
    FAILED,
    NOT_APPLICABLE,
    SAYS_SO,
    Cell,
    Judgement,
    excused,
    judge,
    told,
    warnings_of,
)
from experiments.reporting.failures import PluginError, plugin_code
from experiments.runs.estimation import estimated
from experiments.scoring.interface import Check
from experiments.scoring.score import scorers, scores_and_problems, unscored
from railsim.errors import InputError
from railsim.files import replace_file
from railsim.recording import Recording

CELLS = "cells"


def place(folder: Path, circumstance: str, estimator: str) -> Path:
    """File of the cells of one estimator in one circumstance."""
    return folder / CELLS / circumstance / f"{estimator}.json"


def keep(path: Path, key: str, cells: Iterable[Cell]) -> None:
    """Write cells aside, then rename."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"key": key, "cells": [cell.plain() for cell in cells]}, ensure_ascii=False, allow_nan=False)
    replace_file(path, text.encode() + b"\n")


def kept(path: Path, key: str | None) -> list[Cell] | None:
    """Cells that were written for this key, any key where None; None where there are none or the file is damaged."""
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
        if key is not None and stored["key"] != key:
            return None
        return [Cell(**one | {"warnings": tuple(one.get("warnings", ()))}) for one in stored["cells"]]
    except (OSError, ValueError, TypeError, KeyError):
        return None


def all_kept(folder: Path) -> list[Cell]:
    """Every cell of a folder, whatever it was made for.

    Raises
    ------
    InputError : the folder holds none.
    """
    found = [cell for path in sorted((folder / CELLS).glob("*/*.json")) for cell in kept(path, None) or []]
    if not found:
        raise InputError(f"'{folder}' holds no cells; name the folder that 'railsim circumstances --out' wrote")
    return excused(found)


def key_of(circumstance: Circumstance, fast: bool, program: str) -> str:
    """What cells must have been made from to count: the recording and the program."""
    return hashlib.sha256(f"{circumstance.digest(fast)} {program}".encode()).hexdigest()


def run_estimator(name: str, recording: Recording, here: Mapping[str, Any]) -> list[Cell]:
    """Cells of one estimator on one recording; an estimator that fails gives one that tells the line.

    Parameters
    ----------
    here : circumstance, group and base.
    """
    began = time.process_time()

    def alone(verdict: str, says: str) -> list[Cell]:
        spent = round(time.process_time() - began, 2)
        return [Cell(**here, estimator=name, quantity="", subject="", verdict=verdict, says=says, seconds=spent)]

    try:
        estimator = ESTIMATORS.pick(name).build({})
        with plugin_code(name, estimator):
            missing = estimator.missing(recording.measurements)
        if missing:
            return alone(NOT_APPLICABLE, f"{name} needs {missing.text()}")
        estimate = estimated(estimator, recording.measurements)
    except InputError as error:
        return alone(SAYS_SO, str(error))
    except PluginError as failure:
        return alone(FAILED, str(failure))
    spent = time.process_time() - began
    return _judged(estimate, recording, {**here, "estimator": name, "seconds": round(spent, 2)}) or alone(
        NOT_APPLICABLE, unscored(estimate)
    )


def _judged(estimate: Estimate, recording: Recording, common: dict[str, Any]) -> list[Cell]:
    assert recording.truth is not None
    scores, problems = scores_and_problems(estimate, recording.truth)
    common["warnings"] = warnings_of(estimate)
    cells = []
    for name, scorer in scorers().items():
        if not scorer.columns_of(estimate) or scorer.lacking(estimate):
            continue
        if name in problems:
            verdict = FAILED if isinstance(problems[name], PluginError) else NOT_APPLICABLE
            cells.append(Cell(**common, quantity=name, subject="", verdict=verdict, says=str(problems[name])))
            continue
        for check in scorer.checks:
            if check.error in scores or check.answered in scores:
                found = judge(check, scores)
                says = [told(estimate) if check.subject == "health" else "", found.says]
                cells.append(_cell(check, replace(found, says="; ".join(filter(None, says))), common))
    return cells


def _cell(check: Check, found: Judgement, common: dict[str, Any]) -> Cell:
    error = found.error if found.error is None or math.isfinite(found.error) else None
    return Cell(
        **common, quantity=check.quantity, subject=check.subject, verdict=found.verdict, error=error,
        allowance=check.allowance, unit=check.unit, coverage=found.coverage, answered=found.answered, says=found.says,
        excusable=check.excused,
    )  # fmt: skip
