"""Runs of the figure `track_stiffness`: how well the track's stiffness is found, at home and away from it.

Each run has a line of its own: stiffness that varies at random by a fifth about the usual one, and what the case adds.
Roughness follows ERRI B176 down to waves of 0.1 m, below the limits of ISO 3095 for a reference track.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from estimators.track.track_stiffness import TrackStiffness
from estimators.vehicle.wheel_on_track import contact_stiffness
from experiments.bounds.stiffness import one_pass
from experiments.scoring.track_stiffness import RATIO, RATIO_STD, STIFFNESS, STIFFNESS_STD, true_stiffness
from railsim import measure, simulate
from railsim.analysis.statistics import root_mean_square
from railsim.measurements import TIME, Measurements
from railsim.scenario import Scenario, load_scenario
from railsim.scratch import scratch_folder
from railsim.simulation import about_recording
from railsim.track.featured import zones
from railsim.track.files import format_track
from railsim.track.flexible import FlexibleTrack
from railsim.track.spectra import Band, spectra
from railsim.track.synthesis import distances, faded_irregularities
from railsim.track.track import Track

LENGTH, START, CLEAN, FADE = 520.0, 25.0, 20.0, 20.0  # m
SPACING = 0.025  # m
WAVES = Band(shortest=0.1, longest=100.0)
USUAL, VARIES, APART = 95e6, 0.2, 25.0  # N/m; standard deviation of the logarithm, and metres between its knots
SOFT, STIFF = (200.0, 280.0, 0.5), (200.0, 280.0, 1.7)
STIFFEST = 0.9
"""Most of the stiffness of the pads alone."""
SEED = 7300
NOISE = 0.01 / np.sqrt(2.0)
"""Of the mean of two axleboxes, m/s2/sqrt(Hz): that of the sensors' data sheet."""
NINETY = 1.645
ZHAI = {"pad_stiffness_vertical": 65e6, "pad_damping_vertical": 75e3}


@dataclass(frozen=True)
class Case:
    """What is not as the estimator assumes, or what the track has.

    Attributes
    ----------
    pieces : zones of the line. usual : stiffness of the line, N/m. track : of `flexible_track`; None: rigid rails.
    effects, set : as in a scenario. nominal : factors on what about.json says of the vehicle.
    away : whether vehicle, track or sensors differ from what the estimator is told or assumes.
    """

    pieces: tuple[tuple[float, float, float], ...] = ()
    usual: float = USUAL
    track: Mapping[str, float] | None = field(default_factory=dict)
    effects: tuple[Mapping[str, Any], ...] = ()
    set: Mapping[str, Any] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)
    away: bool = True


def damped(share: float) -> dict[str, float]:
    """Pads and ballast with a share of their usual damping."""
    return {"pad_damping_vertical": share * 30e3, "ballast_damping_vertical": share * 50e3}


ROUND = tuple({"kind": "out_of_round", "amplitude": size, "order": order} for size, order in ((2e-4, 1), (3e-5, 5)))
GAIN = tuple(
    {"kind": "sensor_gain", "channel": f"axlebox1_{side}.acceleration_z", "factor": 1.02} for side in ("left", "right")
)
HANGING = {"kind": "hanging_sleepers", "deflection": 2e-3, "place": 240.0, "length": 4.0}
CASES: Mapping[str, Case] = {
    "home": Case(away=False),
    "soft zone": Case((SOFT,), away=False),
    "bridge": Case((STIFF,), away=False),
    "soft line": Case(usual=55e6, away=False),
    "stiff line": Case(usual=170e6, away=False),
    "hanging sleepers": Case(effects=(HANGING,)),
    "laden": Case((SOFT,), set={"vehicle.payload": {"mass": 6000.0}}),
    "wheelset 5 % lighter than told": Case((SOFT,), nominal={"wheelset_mass": 1.05}),
    "wheelset 5 % heavier than told": Case((SOFT,), nominal={"wheelset_mass": 0.95}),
    "damping 30 % less": Case((SOFT,), track=damped(0.7)),
    "damping 30 % more": Case((SOFT,), track=damped(1.3)),
    "pads of 65 MN/m, 75 kN s/m": Case((SOFT,), usual=75e6, track=ZHAI),
    "sleepers of 200 kg": Case((SOFT,), track={"sleeper_mass": 200.0}),
    "wheels out of round": Case((SOFT,), effects=ROUND),
    "gain 2 % off": Case((SOFT,), effects=GAIN),
    "all at once": Case(
        (SOFT,), usual=75e6, track={**damped(1.3), "sleeper_mass": 200.0}, effects=(*ROUND, *GAIN),
        nominal={"wheelset_mass": 1.05},
    ),
    "rigid rails": Case(track=None),
}  # fmt: skip
MORE = 6
"""Times as many runs on rigid rails: 72 without a false answer show that it is below 5 %."""
SPEEDS = (15.0, 25.0, 40.0, 55.0)


def line(case: Case, seed: int) -> Track:
    """The track of one run."""
    s = distances(LENGTH, SPACING)
    rng = np.random.default_rng([SEED, seed])
    columns = faded_irregularities(spectra("erri_low"), s, SPACING, rng, WAVES, (CLEAN, FADE))
    if case.track is not None:
        knots = np.arange(-APART, LENGTH + 2.0 * APART, APART)
        logarithm = np.interp(s, knots, VARIES * rng.standard_normal(knots.size))
        most = STIFFEST * FlexibleTrack.build(dict(case.track)).corunning().pad_stiffness_z
        columns["stiffness"] = np.minimum(zones(s, case.usual, case.pieces) * np.exp(logarithm), most)
    return Track(s, columns, "line", ["made for a study"])


def scenario(case: Case, speed: float, seed: int, folder: Path) -> Scenario:
    """A half vehicle with axleboxes and a tachometer over a line that is written into a folder."""
    path = folder / "line.csv"
    path.write_text(format_track(line(case, seed)), encoding="utf-8")
    keys = {
        "track": str(path),
        "speed.speed": speed,
        "start": START,
        "duration": np.floor(16.0 * (LENGTH - START - 10.0) / speed) / 16.0,
        "effects": [dict(one) for one in case.effects],
        "seed": SEED + seed,
        "flexible_track": None if case.track is None else dict(case.track),
        **case.set,
    }
    return load_scenario("stiffness_varies", keys)


def run(name: str, speed: float, seed: int) -> pd.DataFrame:
    """One run of a case, a row each window that can be used.

    Returns
    -------
    Columns "case", "away", "speed [m/s]", "seed", "s [m]", "true [N/m]" (infinite on rigid rails), "found [N/m]" (NaN
    where it is withheld), "error [-]", "std [-]", of the ratio over the answered windows "ratio error [-]", "ratio std
    [-]", all relative, and "bound [-]" of the window.
    """
    case = CASES[name]
    with scratch_folder() as folder:
        chosen = scenario(case, speed, seed, Path(folder))
        truth = simulate(chosen, "compiled", Path(folder) / "truth", cache=False)
        measured = measure(truth, chosen).measurements
        told = believed(measured, case)
        estimate = TrackStiffness().estimate(told)
        true = true_stiffness(estimate, truth)
    valid = np.asarray(estimate.series["valid [-]"]) > 0.5
    true = true[valid]
    s, value, std, ratio, ratio_std = (
        np.asarray(estimate.series[one])[valid] for one in ("s [m]", STIFFNESS, STIFFNESS_STD, RATIO, RATIO_STD)
    )
    answered = np.isfinite(value)
    known = true / np.exp(np.mean(np.log(true[answered]))) if answered.any() else true
    rigid = np.isinf(true)
    return pd.DataFrame(
        {
            "case": name,
            "away": case.away,
            "speed [m/s]": speed,
            "seed": seed,
            "s [m]": s,
            "true [N/m]": true,
            "found [N/m]": value,
            "error [-]": np.where(rigid & answered, 1.0, value / true - 1.0),
            "std [-]": std / value,
            "ratio error [-]": np.where(rigid & answered, 1.0, ratio / np.where(rigid, 1.0, known) - 1.0),
            "ratio std [-]": ratio_std / ratio,
            "bound [-]": [bound(case, one, speed, chosen) if np.isfinite(one) else np.nan for one in true],
        }
    )


def believed(measured: Measurements, case: Case) -> Measurements:
    """The recording with what is wrongly believed of the vehicle."""
    vehicle = dict(measured.vehicle)
    for field_name, factor in case.nominal.items():
        vehicle[field_name] = factor * vehicle[field_name]
    tables: dict[float, dict[str, np.ndarray]] = {}
    for channel in measured:
        table = tables.setdefault(measured.rate(channel), {TIME: measured.time(channel)})
        table[channel] = measured[channel]
    return Measurements({**measured.about, "vehicle": vehicle}, tables)


def bound(case: Case, stiffness: float, speed: float, chosen: Scenario) -> float:
    """Least relative deviation of one window's stiffness with all else known but its roughness' level and slope."""
    vehicle = about_recording(chosen)["vehicle"]
    wheel = vehicle["wheelset_mass"] / 2.0, contact_stiffness(vehicle["design_wheel_load"], vehicle["wheel_radius"])
    lumped = FlexibleTrack.build(dict(case.track or {})).corunning()
    roughness = spectra("erri_low")["vertical"], WAVES, 1.0
    return one_pass(stiffness, speed, TrackStiffness().length, lumped, wheel, roughness, NOISE)


def study(name: str, speeds: Sequence[float], seeds: int) -> pd.DataFrame:
    """All runs of a case, `seeds` at each speed; on rigid rails `MORE` times as many."""
    number = 1000 * list(CASES).index(name)
    return pd.concat(
        [
            run(name, speed, number + 10 * i + seed % 10 + 100 * (seed // 10))
            for i, speed in enumerate(speeds)
            for seed in range(seeds if CASES[name].track is not None else MORE * seeds)
        ],
        ignore_index=True,
    )


def summary(table: pd.DataFrame, by: str = "case") -> pd.DataFrame:
    """A row each case: windows, share answered, errors, bound, coverage of the stated 90 % interval."""
    columns = {str(name): np.asarray(table[name]) for name in table.columns}
    rows = []
    for name in dict.fromkeys(columns[by]):
        mine = columns[by] == name
        told = mine & np.isfinite(columns["found [N/m]"])
        row: dict[str, Any] = {by: name, "windows": int(mine.sum()), "answered": told.sum() / mine.sum()}
        for what in ("", "ratio ") if told.any() else ():
            error, std = columns[f"{what}error [-]"][told], columns[f"{what}std [-]"][told]
            row |= {
                f"{what}rms": root_mean_square(error),
                f"{what}stated": root_mean_square(std),
                f"{what}cover 90": float(np.mean(np.abs(error) <= NINETY * std)),
            }
        rows.append(row | {"bound": root_mean_square(columns["bound [-]"][told]) if told.any() else np.nan})
    return pd.DataFrame(rows)
