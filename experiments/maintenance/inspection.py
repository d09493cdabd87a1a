"""What there is to say of a recording, a scenario or a track: facts, a table of its channels, what is suspicious."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from experiments.maintenance.readiness import Readiness, readiness, what_each_brings
from railsim.errors import InputError
from railsim.quality.inspection import Inspection, inspect
from railsim.quality.interface import texts
from railsim.quality.repair import write_repaired
from railsim.recording import Recording
from railsim.scenario import SCENARIOS, load_scenario
from railsim.track.files import TRACKS, read_track
from railsim.track.inspection import problems
from railsim.track.track import UNITS


@dataclass(frozen=True)
class Report:
    """Facts by name, a table of columns or channels, and what is suspicious.

    Attributes
    ----------
    problems : what is suspicious, in words.
    header, rows : the table.
    findings : faults and notes of a recording, with their numbers. notes : the latter in words.
    estimators : of a recording, what each estimator lacks.
    """

    kind: str
    name: str
    facts: dict[str, Any]
    problems: list[str]
    header: list[str] = field(default_factory=list)
    rows: list[list[Any]] = field(default_factory=list)
    findings: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    estimators: list[Readiness] = field(default_factory=list)

    def stated(self) -> dict[str, Any]:
        """In the shape of the command's JSON."""
        stated = {"kind": self.kind, "name": self.name, "facts": self.facts, "problems": self.problems}
        stated |= {"findings": self.findings}
        if self.estimators:
            stated |= {"estimators": [one.stated() for one in self.estimators]}
            stated |= {"would bring": what_each_brings(self.estimators)}
        return stated | {"table": [dict(zip(self.header, row, strict=True)) for row in self.rows]}


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
    named = [kind for kind, names in (("scenario", SCENARIOS.paths()), ("track", TRACKS.paths())) if what in names]
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
    inspection = inspect(measured, clean=False, progress=True)
    stated = [finding.stated() for finding in inspection.findings]
    notes = texts(finding for finding in inspection.findings if finding.severity == "note")
    suspicious = texts(inspection.faults)
    return Report("recording", what, facts, suspicious, header, rows, stated, notes, readiness(measured))


def repair(what: str, folder: str) -> Inspection:
    """Write a cleaned copy of a recording into `folder`; returns what was found.

    Raises
    ------
    InputError : no recording, or the folder is its own or cannot be written.
    """
    recording = Recording.open(what)
    if Path(folder).resolve() == recording.folder.resolve():
        raise InputError(f"'{folder}' is the recording itself; name another folder for the cleaned copy")
    inspection = inspect(recording.measurements, progress=True)
    write_repaired(recording, inspection.cleaned, inspection.findings, folder)
    return inspection


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
    return Report("scenario", scenario.name, facts, [], header, rows, notes=scenario.vehicle.assumptions())


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


INSPECTORS: dict[str, Callable[[str], Report]] = {"recording": _recording, "scenario": _scenario, "track": _track}
"""By kind: what inspects it."""
