"""Defects of several kinds and sizes that grow between passes: which are found, and what else is reported."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from estimators.speed.odometry import SPACING
from estimators.track.passes import Match, changes, laid_on, match
from estimators.track.track_smoother import TrackSmoother
from railsim import measure, simulate
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.track.files import read_track, write_track
from railsim.track.joints import void
from railsim.track.track import Track
from railsim.truth import Truth

TRACK = "straight_erri_low"
SPEEDS = (10.0, 20.0, 40.0)  # m/s; of the passes before
LATER = 20.0  # m/s; of the pass after
LENGTH, START = 1000.0, 20.0  # m
POSITIONS = (220.0, 400.0, 580.0, 760.0)  # m
JITTER = 40.0  # m; each place anywhere within so much
KINDS = ("dip", "void", "one rail", "cross level")
SIZES = (0.0, 0.5, 0.75, 1.0, 1.5)  # mm
SEEDS = 10
HALF_LENGTH = 2.5  # m; where a dip has 1/e of its depth
RADIUS = 0.01  # largest error of a wheel's radius
NEAR = 1.0  # m
VERTICAL, LEVEL = "vertical_d1 [m]", "cross_level_d1 [m]"
SERIES = {
    VERTICAL: (1.0, 0.0),
    LEVEL: (0.0, 1.0),
    "left_vertical_d1 [m]": (1.0, -0.5),
    "right_vertical_d1 [m]": (1.0, 0.5),
}
"""What changes are looked for in, as shares of alignment and cross level."""


def growing_defects(fast: bool) -> pd.DataFrame:
    """Four defects grow between passes, each kind somewhere; every seed has other places, sensors and odometers.

    Returns
    -------
    Columns "seed [-]", "size [mm]", "defect" (one of `KINDS`, "" for what was reported elsewhere), "at [m]" (true),
    "away [m]" (of the nearest report; NaN: none within `NEAR`), "change [mm]" (what the report says), "quantity".
    """
    before = {speed: _truth(speed, TRACK) for speed in SPEEDS}
    tables = []
    for seed in range(1, 3 if fast else SEEDS + 1):
        rng = np.random.default_rng([seed, 713])
        earlier = [_ride(before[speed], speed, seed, rng) for speed in SPEEDS]
        positions = dict(
            zip(rng.permutation(KINDS), np.asarray(POSITIONS) + rng.uniform(-JITTER, JITTER, 4), strict=True)
        )
        for size in (1.0,) if fast else SIZES:
            with scratch_folder() as folder:
                truth = _truth(LATER, str(_grown(Path(folder), positions, size * 1e-3)))
                later = _ride(truth, LATER, seed, rng)
                tables.append(
                    _reported(earlier, later, positions, before).assign(**{"seed [-]": seed, "size [mm]": size})
                )
    return pd.concat(tables, ignore_index=True)


def _reported(
    earlier: list[pd.DataFrame], later: pd.DataFrame, positions: dict[str, float], before: dict[float, Truth]
) -> pd.DataFrame:
    """Rows of one later pass: each defect, then each report that belongs to none.

    Alignment is compared with the mean of all passes; cross level, into which the body's sway comes according to speed,
    with the pass of the same speed; so is its half in each rail, where a defect of that rail alone has its whole size.
    """
    reference = earlier[0]
    true = np.interp(reference["time [s]"], before[SPEEDS[0]].time, before[SPEEDS[0]]["s [m]"])
    reports: list[dict[str, Any]] = []
    on = SPACING * np.arange(len(reference))
    laid = {
        name: [laid_on(one[name].to_numpy(), SPACING, _pairing(reference, one), on) for one in (*earlier, later)]
        for name in (VERTICAL, LEVEL)
    }
    height, level = np.mean(laid[VERTICAL][:-1], axis=0), laid[LEVEL][SPEEDS.index(LATER)]
    for name, (share_of_height, share_of_level) in SERIES.items():
        base = share_of_height * height + share_of_level * level
        now = share_of_height * laid[VERTICAL][-1] + share_of_level * laid[LEVEL][-1]
        for event in changes(base, now, SPACING):
            position = float(np.interp(event["s [m]"], on, true))
            reports.append({"quantity": name, "place": position, "change [mm]": 1e3 * event["change [m]"]})
    rows = []
    for kind, at in positions.items():
        near = [one for one in reports if abs(one["place"] - at) <= NEAR]
        best = min(near, key=lambda one: abs(one["place"] - at)) if near else {}
        rows.append({"defect": str(kind), "at [m]": at, "away [m]": abs(best["place"] - at) if near else np.nan} | best)
    for report in reports:
        if min(abs(report["place"] - at) for at in positions.values()) > NEAR:
            rows.append({"defect": "", "at [m]": report["place"]} | report)
    return pd.DataFrame(rows).drop(columns="place", errors="ignore")


def _pairing(reference: pd.DataFrame, later: pd.DataFrame) -> Match:
    return match(reference[VERTICAL].to_numpy(), later[VERTICAL].to_numpy(), SPACING)


def _truth(speed: float, track: str) -> Truth:
    """The run, by the compiled engine: what is compared is made by sensors and odometers."""
    return simulate(Scenario.build(_values(speed, track, 0.0)), engine="compiled")


def _ride(truth: Truth, speed: float, seed: int, rng: np.random.Generator) -> pd.DataFrame:
    """Vertical alignment and cross level of one pass; other sensors and another wheel each time."""
    scenario = Scenario.build(_values(speed, TRACK, float(rng.uniform(-RADIUS, RADIUS))))
    measured = measure(truth, scenario, seed=int(rng.integers(1 << 30)) + seed).measurements
    return TrackSmoother().estimate(measured).series


def _values(speed: float, track: str, radius_error: float) -> dict[str, Any]:
    wheel = {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": radius_error}
    bogie = {"name": "bogie", "body": "bogie", "rate": 256, "errors": "mems"}
    return {
        "track": track,
        "vehicle": "manchester",
        "speed": {"kind": "constant", "speed": speed},
        "start": START,
        "duration": round((LENGTH - START) / speed, 1),
        "sensors": [{"kind": "gyro", **bogie}, {"kind": "accelerometer", **bogie}, wheel],
    }


def _grown(folder: Path, positions: dict[str, float], size: float) -> Path:
    """The track with each defect deeper by `size`, m."""
    track = read_track(TRACK)
    columns = dict(track.columns())
    left, right = np.zeros(track.s.size), np.zeros(track.s.size)
    for kind, at in positions.items():
        x = track.s - at
        shape = void(x, size) if kind == "void" else -size * np.exp(-((x / HALF_LENGTH) ** 2))
        left += shape * (0.5 if kind == "cross level" else 1.0)
        right += shape * {"cross level": -0.5, "one rail": 0.0}.get(kind, 1.0)
    columns["vertical"] = track.vertical + (left + right) / 2
    columns["cross_level"] = track.cross_level + right - left
    path = folder / "grown.csv"
    write_track(Track(track.s, columns, "grown", track.comments), path)
    return path
