"""Runs for the figures of the suspension: the shipped scenario on other tracks, with many noise seeds, track errors."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from experiments.scoring.suspension import true_parameters
from railsim import load_scenario, measure, simulate
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.track import spectra, synthesis
from railsim.track.files import write_track
from railsim.track.track import Track
from railsim.truth import Truth

BAND = spectra.Band(shortest=1.0, longest=100.0)
LENGTH, SPACING = 2000.0, 0.2  # m
JUDGED = 5107
"""Seed of the track that figures are judged on; nothing was chosen on it."""
CASE, SEED, TIME, VALID = "case", "seed", "time [s]", "valid [-]"


def with_track_errors(measurements: Measurements, share: float, seed: int) -> Measurements:
    """The same with a measured track that is wrong: errors of the shape of ERRI B176 low, `share` of its power."""
    track = measurements.track
    assert track is not None
    track = track.copy()
    s = track["s [m]"].to_numpy(dtype=float)
    rng = np.random.default_rng(seed)
    errors = synthesis.irregularities(spectra.spectra("erri_low"), s.size, float(s[1] - s[0]), rng, BAND)
    for name in ("lateral", "cross_level"):
        track[f"{name} [m]"] = track[f"{name} [m]"].to_numpy(dtype=float) + np.sqrt(share) * errors[name]
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measurements:
        table = tables.setdefault(measurements.rate(name), {TIME: measurements.time(name)})
        table[name] = measurements[name]
    return Measurements(measurements.about, tables, track)


def write_other(folder: Path, seed: int, length: float = LENGTH) -> Path:
    """A straight track with irregularities of ERRI B176 low of its own."""
    s = synthesis.distances(length, SPACING)
    irregularities = synthesis.irregularities(
        spectra.spectra("erri_low"), s.size, SPACING, np.random.default_rng(seed), BAND
    )
    columns = {key: column * synthesis.fade_in(s, 25.0, 20.0) for key, column in irregularities.items()}
    path = folder / f"other_{seed}.csv"
    write_track(Track(s, columns, path.stem, [f"Irregularities of seed {seed}."]), path)
    return path


def over_time(
    cases: Mapping[str, tuple[SuspensionRbpf, float]], track_seed: int, seed: int, duration: float, engine: str
) -> pd.DataFrame:
    """Estimates of every case over time with one noise seed.

    Parameters
    ----------
    cases : by name, the estimator and the share of the track's power that is error of track.csv.
    track_seed : of the true track's irregularities. duration : of the run, s.

    Returns
    -------
    Rows over time: CASE, SEED, TIME, the parameters and their deviations, and the true parameters as "true" and their
    name.
    """
    scenario, truth = _run(track_seed, duration, engine)
    measured = measure(truth, scenario, seed=seed).measurements
    wanted = [TIME, *PARAMETERS, *(std_name(parameter) for parameter in PARAMETERS)]
    tables = []
    for name, (estimator, share) in cases.items():
        seen = with_track_errors(measured, share, 1000 + seed) if share > 0.0 else measured
        series = estimator.but(seed=seed).estimate(seen).series
        tables.append(series[wanted].assign(**{CASE: name, SEED: seed}))
    return pd.concat(tables, ignore_index=True).assign(**_known(truth))


def at_end(
    cases: Mapping[str, tuple[SuspensionRbpf, float]], seed: int, duration: float, engine: str
) -> Iterator[dict[str, Any]]:
    """What every case ends at, by one seed of track, noise and error of the track; see `over_time` for the cases.

    Returns
    -------
    A row a case: CASE, SEED, TIME of the end, the parameters, "true" and their name, and `VALID`: whether the
    filter's own check of its innovations lets the estimate stand.
    """
    scenario, truth = _run(seed, duration, engine)
    measured = measure(truth, scenario, seed=seed).measurements
    for name, (estimator, share) in cases.items():
        wrong = with_track_errors(measured, share, 1000 + seed)
        last = estimator.but(seed=seed).estimate(wrong).series.iloc[-1]
        found = {column: float(last[column]) for column in (TIME, *PARAMETERS, VALID)}
        yield {CASE: name, SEED: seed} | found | _known(truth)


def _run(track_seed: int, duration: float, engine: str) -> tuple[Scenario, Truth]:
    """The shipped scenario on a track of its own; simulated once, then taken from the cache."""
    with scratch_folder() as folder:
        track = str(write_other(Path(folder), track_seed))
        scenario = load_scenario("suspension", {"duration": duration, "track": track})
        return scenario, simulate(scenario, engine=engine)


def _known(truth: Truth) -> dict[str, float]:
    return {f"true {name}": float(value) for name, value in zip(PARAMETERS, true_parameters(truth), strict=True)}
