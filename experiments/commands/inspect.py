"""`railsim inspect`: check a recording, a scenario or a track, and say what is wrong with it."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from experiments.commands.interface import Outcome, table
from experiments.maintenance import retention
from railsim.errors import InputError
from railsim.quality.inspection import inspect as quality
from railsim.quality.repair import write_repaired
from railsim.recording import Recording
from railsim.scenario import load_scenario, shipped_scenarios
from railsim.track.files import read_track, shipped_tracks
from railsim.track.inspection import problems
from railsim.track.track import UNITS


@dataclass(frozen=True)
class Report:
    """What was found: facts by name, a table of columns or channels, and what is suspicious."""

    kind: str
    name: str
    facts: dict[str, Any]
    problems: list[str]
    header: list[str] = field(default_factory=list)
    rows: list[list[Any]] = field(default_factory=list)
    findings: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def execute(given: argparse.Namespace) -> Outcome:
    """Inspect whatever the name or path stands for; exit code 1 where something is suspicious."""
    kinds = kinds_of(given.what)
    if (given.repair or given.prune) and kinds != ["recording"]:
        raise InputError(f"'{given.what}' is a {kinds[0]}; --repair and --prune are for recordings")
    if given.prune:
        return retention.prune(Path(given.what), given.after, given.yes)
    if given.repair:
        return _repair(given.what, given.repair)
    reports = [INSPECTORS[kind](given.what) for kind in kinds]
    found = [
        {"kind": r.kind, "name": r.name, "facts": r.facts, "problems": r.problems, "findings": r.findings}
        | {"table": [dict(zip(r.header, row, strict=True)) for row in r.rows]}
        for r in reports
    ]
    held = not any(report.problems for report in reports)
    return Outcome({"inspected": found}, "\n\n".join(map(_text, reports)), held)


def kinds_of(what: str) -> list[str]:
    """What a name or path stands for; a shipped name may be that of a scenario and of a track.

    Raises
    ------
    InputError : nothing of that name.
    """
    path = Path(what)
    if path.is_dir():
        return ["recording"]
    if path.suffix.lower() in (".yaml", ".yml"):
        return ["scenario"]
    if path.suffix.lower() == ".csv":
        return ["track"]
    named = [kind for kind, names in (("scenario", shipped_scenarios()), ("track", shipped_tracks())) if what in names]
    if not named:
        reason = "is neither a folder nor a .yaml nor a .csv file" if path.exists() else "does not exist"
        raise InputError(f"'{what}' {reason}; give the folder of a recording, a scenario or a track")
    return named


def _recording(what: str) -> Report:
    recording = Recording.open(what)
    measured = recording.measurements
    facts = {
        "origin": measured.about["origin"],
        "vehicle": measured.vehicle.get("name", ""),
        "truth": recording.truth is not None,
        "track measured": measured.track is not None,
    }
    header = ["channel", "rate [Hz]", "samples", "lost", "lowest", "mean", "highest", "std"]
    rows = [[name, measured.rate(name), *_statistics(measured[name])] for name in measured.channels]
    found = quality(measured)
    stated = [one.stated() for one in found.findings]
    notes = [one.text() for one in found.findings if one.severity == "note"]
    return Report("recording", what, facts, [one.text() for one in found.faults], header, rows, stated, notes)


def _repair(what: str, folder: str) -> Outcome:
    """Write a cleaned copy; exit code 0, because what was wrong is mended."""
    recording = Recording.open(what)
    if Path(folder).resolve() == recording.folder.resolve():
        raise InputError(f"'{folder}' is the recording itself; name another folder for the cleaned copy")
    found = quality(recording.measurements)
    write_repaired(recording, found.cleaned, found.findings, folder)
    lines = [f"{folder}: cleaned copy of {what}", *(f"  {one.text()}" for one in found.faults)]
    result = {"repaired": str(folder), "findings": [one.stated() for one in found.findings]}
    return Outcome(result, "\n".join(lines if found.faults else [*lines, "  nothing had to be changed"]))


def _statistics(values: np.ndarray) -> list[Any]:
    good = values[np.isfinite(values)]
    if not good.size:
        return [values.size, values.size, None, None, None, None]
    numbers = (good.min(), good.mean(), good.max(), good.std())
    return [values.size, values.size - good.size, *(float(number) for number in numbers)]


def _scenario(what: str) -> Report:
    scenario = load_scenario(what)
    distance = scenario.distance
    facts = {
        "description": scenario.description,
        "vehicle": scenario.vehicle_name,
        "track": scenario.track,
        "from [m]": scenario.start,
        "to [m]": "decided by the forces" if distance is None else round(scenario.start + distance, 3),
        "duration [s]": scenario.duration,
        "truth [Hz]": scenario.output_rate,
        "step [ms]": 1e3 * scenario.step,
        "seed": scenario.seed,
    }
    header = ["sensor", "kind", "body", "rate [Hz]", "channels"]
    rows = [[s.name, s.kind, s.body, s.rate, ", ".join(s.channels())] for s in scenario.sensors]
    return Report("scenario", scenario.name, facts, [], header, rows)


def _track(what: str) -> Report:
    track = read_track(what)
    facts = {
        "comment": " ".join(track.comments),
        "from [m]": float(track.s[0]),
        "to [m]": float(track.s[-1]),
        "rows": track.s.size,
        "spacing [m]": track.spacing,
    }
    header = ["column", "unit", "lowest", "mean", "highest", "std"]
    rows = [
        [key, UNITS[key], float(c.min()), float(c.mean()), float(c.max()), float(c.std())]
        for key, c in track.columns().items()
    ]
    return Report("track", track.name, facts, problems(track), header, rows)


def _text(report: Report) -> str:
    width = max(len(name) for name in report.facts)
    lines = [
        f"{report.kind} {report.name}",
        *(f"  {name.ljust(width)}  {_fact(value)}" for name, value in report.facts.items()),
    ]
    if report.rows:
        lines += ["", table(report.header, report.rows, decimals=5)]
    lines += ["", *(f"note: {text}" for text in report.notes), *(f"suspicious: {text}" for text in report.problems)]
    return "\n".join(lines if report.problems else [*lines, "nothing suspicious"])


def _fact(value: Any) -> str:
    """A fact for people."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


INSPECTORS: dict[str, Callable[[str], Report]] = {"recording": _recording, "scenario": _scenario, "track": _track}
"""By kind: what inspects it."""
