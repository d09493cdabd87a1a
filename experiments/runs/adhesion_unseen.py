"""Runs on tracks that the adhesion classifier's calibration never saw, judged window by window; changes of level."""

from collections.abc import Iterator, Sequence
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from estimators.adhesion.adhesion_level import COLUMNS, AdhesionLevel, judge
from estimators.adhesion.classifier import LEVELS, classifier
from estimators.adhesion.features import SETS
from experiments.reporting.size import Size
from experiments.runs.adhesion import CLEAR, START, between, run, scenario, sensors, spliced
from experiments.runs.unseen_tracks import write_unseen
from railsim.contact.adhesion import CONDITIONS
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.track.files import read_track, write_track
from railsim.track.track import Track

VEHICLE = "class175"
TRACKS = ("unseen_erri_low", "unseen_erri_high", "paddington_bristol_like")
SPEEDS = (15.0, 22.5, 30.0, 37.5, 45.0)  # m/s
DURATION = 28.0  # s: 1300 m of track at the highest speed
SPLICE = 15.0  # s
HOP = {10.0: 1.0, 4.0: 2.0}  # s between windows
MIDDLES = (("dry", "wet"), ("wet", "low"), ("low", "very low"))


OTHERS: dict[str, dict[str, Any]] = {
    "worn wheels, conicity 0.2": {"pair": {"kind": "smooth", "conicity": 0.2}},
    "new wheels, conicity 0.07": {"pair": {"kind": "smooth", "conicity": 0.07}},
    "yaw dampers at 60 %": {"yaw_damper_damping": 90e3},
    "body 15 % heavier, lateral dampers at 60 %": {"body_mass": 19800.0, "secondary_lateral_damping": 12e3},
}
"""Vehicles that are not what their recordings state."""
NOMINAL = "nominal"
FRICTIONS = (0.06, 0.03)  # after a change of friction alone


class Case(NamedTuple):
    """One run: where, how fast, on what, by which vehicle."""

    track: str
    speed: float
    condition: str
    settings: Any
    vehicle: str = NOMINAL

    def scenarios(self, path: str, suite: list[dict[str, Any]]) -> tuple[Scenario, Scenario]:
        """As it is, and as the recording states it."""
        known = {"name": VEHICLE, "adhesion": self.settings}
        real = {**known, **OTHERS.get(self.vehicle, {})}
        shared = {"track": path, "start": START if self.vehicle == NOMINAL else CLEAR}
        true, stated = (
            scenario({**shared, "vehicle": vehicle}, self.speed, DURATION, suite) for vehicle in (real, known)
        )
        return true, stated


def cases(fast: bool) -> Iterator[Case]:
    """Every level on every track at every speed; on one track also by other vehicles, and in between two levels."""
    tracks, speeds = (TRACKS[:1], SPEEDS[2:3]) if fast else (TRACKS, SPEEDS)
    for track in tracks:
        for speed in speeds:
            for name in LEVELS:
                yield Case(track, speed, name, name)
    for vehicle in list(OTHERS)[: 1 if fast else None]:
        for speed in speeds[1::2] or speeds:
            for name in LEVELS:
                yield Case(TRACKS[1], speed, name, name, vehicle)
    for speed in speeds[::2]:
        for pair in MIDDLES:
            yield Case(tracks[0], speed, " to ".join(pair), between(*pair))


def initial_share(condition: str) -> float:
    """Initial slope over Kalker's of a level or of what lies between two."""
    shares = [CONDITIONS[name].initial_share for name in condition.split(" to ")]
    return float(np.exp(np.mean(np.log(shares))))


def judged(size: Size) -> pd.DataFrame:
    """One row a window or a change; "kind" says which.

    Returns
    -------
    Columns "kind", "track", "speed [m/s]", "condition", "vehicle", "sensors", "window [s]", "time [s]", probabilities,
    "creep_slope [-]", "true slope [-]"; for changes "after", "true time [s]", "changes named".
    """
    fast, engine = size.reduced, "compiled" if size.reduced else "exudyn"
    pairs = list(permutations(LEVELS, 2))[: size.of(None, None, 1)]
    rows: list[pd.DataFrame] = []
    with scratch_folder() as folder:
        files = write_unseen(Path(folder))
        recordings: dict[tuple[str, float], dict[tuple[str, str], Measurements]] = {}
        rows.append(_friction_changes(files[TRACKS[1]], (22.5,) if fast else (22.5, 37.5), engine, size))
        for number, case in enumerate(cases(fast)):
            path = str(files.get(case.track, case.track))
            for kind in SETS:
                true, stated = case.scenarios(path, sensors("mems", kind == "wheelsets"))
                measured = run(true, 1000 + number, engine, stated)[1]
                rows += _windows(case, kind, measured)
                if case.condition in LEVELS and case.vehicle == NOMINAL:
                    recordings.setdefault((case.track, case.speed), {})[case.condition, kind] = measured
    rows += [_changes(track, speed, given, pairs) for (track, speed), given in recordings.items()]
    return pd.concat(rows, ignore_index=True)


def _friction_changes(file: Path, speeds: Sequence[float], engine: str, size: Size) -> pd.DataFrame:
    """Changes of friction alone, by the track's own column: the creep slope at rest stays that of dry rails."""
    rows = []
    track = read_track(str(file))
    for speed in speeds:
        for friction in FRICTIONS[: size.of(None, None, 1)]:
            change = START + SPLICE * speed
            column = np.where(track.s < change, CONDITIONS["dry"].friction, friction)
            path = file.with_name(f"friction_{speed:g}_{friction:g}.csv")
            write_track(Track(track.s, {**track.columns(), "friction": column}, path.stem, track.comments), path)
            settings = {"track": str(path), "vehicle": {"name": VEHICLE, "adhesion": "dry"}}
            for kind in SETS:
                slippery = scenario(settings, speed, DURATION, sensors("mems", kind == "wheelsets"))
                named = AdhesionLevel().estimate(run(slippery, 7, engine)[1]).about["changes"]
                row: dict[str, Any] = {"kind": "friction", "track": file.stem, "speed [m/s]": speed, "sensors": kind}
                row |= {"condition": "dry", "after": f"friction {friction:g}", "changes named": len(named)}
                nearest = min(
                    (float(change["time"]) for change in named), key=lambda t: abs(t - SPLICE), default=np.nan
                )
                rows.append(row | {"true time [s]": SPLICE, "time [s]": nearest})
    return pd.DataFrame(rows)


def _windows(case: Case, kind: str, measured: Measurements) -> list[pd.DataFrame]:
    estimator = AdhesionLevel()
    forces = estimator.forces(measured, estimator.health(measured), SETS[kind])
    tables = []
    for window, hop in HOP.items():
        table = judge(forces, kind, window, hop, classifier(VEHICLE, kind, window))
        about = {"kind": "window", "track": case.track, "speed [m/s]": case.speed, "condition": case.condition}
        about["vehicle"] = case.vehicle
        about |= {"sensors": kind, "window [s]": window, "true slope [-]": initial_share(case.condition)}
        tables.append(table[["time [s]", *COLUMNS, "creep_slope [-]"]].assign(**about))
    return tables


def _changes(
    track: str, speed: float, recordings: dict[tuple[str, str], Measurements], pairs: Sequence[tuple[str, str]]
) -> pd.DataFrame:
    """Changes from one level to another at one place and speed."""
    rows = []
    for kind in SETS:
        for before, after in pairs:
            joined = spliced(recordings[before, kind], recordings[after, kind], SPLICE)
            named = AdhesionLevel().estimate(joined).about["changes"]
            right = [one for one in named if (one["before"], one["after"]) == (before, after)]
            nearest = min((one["time"] for one in right), key=lambda time: abs(time - SPLICE), default=np.nan)
            row: dict[str, Any] = {
                "kind": "change",
                "track": track,
                "speed [m/s]": speed,
                "condition": before,
                "after": after,
            }
            rows.append(
                row | {"sensors": kind, "true time [s]": SPLICE, "time [s]": nearest, "changes named": len(named)}
            )
    return pd.DataFrame(rows)
