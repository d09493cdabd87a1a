"""Runs for the figures of the suspension: the shipped scenario on other tracks, with many noise seeds, track errors."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed

from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from experiments.scoring.suspension import true_parameters
from railsim import load_scenario, measure, simulate
from railsim.measurements import Measurements
from railsim.scratch import scratch_folder
from railsim.track import spectra, synthesis
from railsim.track.files import write_track
from railsim.track.track import Track

BAND = spectra.Band(shortest=1.0, longest=100.0)
LENGTH, SPACING = 2000.0, 0.2  # m
JUDGED = 5107
"""Seed of the track that figures are judged on; nothing was chosen on it."""
WORKERS = 2
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


def over_seeds(
    cases: dict[str, tuple[SuspensionRbpf, float]], track_seed: int, seeds: int, duration: float, engine: str
) -> tuple[pd.DataFrame, np.ndarray]:
    """Estimates of every case and noise seed over time, and the true parameters; one run serves all.

    Parameters
    ----------
    cases : by name, the estimator and the share of the track's power that is error of track.csv.
    track_seed : of the true track's irregularities.
    """
    with scratch_folder() as folder:
        track = str(write_other(Path(folder), track_seed))
        scenario = load_scenario("suspension", {"duration": duration, "track": track})
        truth = simulate(scenario, engine=engine)

    def estimated(name: str, seed: int) -> pd.DataFrame:
        estimator, share = cases[name]
        measurements = measure(truth, scenario, seed=seed).measurements
        if share > 0.0:
            measurements = with_track_errors(measurements, share, 1000 + seed)
        series = estimator.but(seed=seed).estimate(measurements).series
        columns = [TIME, *PARAMETERS, *(std_name(parameter) for parameter in PARAMETERS)]
        return series[columns].assign(**{CASE: name, SEED: seed})

    jobs = [(name, seed) for seed in range(1, seeds + 1) for name in cases]
    tables: Any = Parallel(n_jobs=WORKERS, prefer="threads")(delayed(estimated)(*job) for job in jobs)
    return pd.concat(tables, ignore_index=True), true_parameters(truth)


def over_track_errors(
    cases: Mapping[str, tuple[SuspensionRbpf, float]], seeds: Sequence[int], duration: float, engine: str
) -> pd.DataFrame:
    """What every case ends at, by seeds of track, noise and error of the track; see `over_seeds` for the cases.

    Returns
    -------
    A row a case and seed: CASE, SEED, TIME of the end, the parameters, "true" and their name, and `VALID`: whether the
    filter's own check of its innovations lets the estimate stand.
    """

    def ended(seed: int, measurements: Measurements, true: np.ndarray) -> Iterator[dict[str, Any]]:
        for name, (estimator, share) in cases.items():
            wrong = with_track_errors(measurements, share, 1000 + seed)
            last = estimator.but(seed=seed).estimate(wrong).series.iloc[-1]
            found = {column: float(last[column]) for column in (TIME, *PARAMETERS, VALID)}
            known = {f"true {column}": float(value) for column, value in zip(PARAMETERS, true, strict=True)}
            yield {CASE: name, SEED: seed} | found | known

    def of_seed(seed: int) -> list[dict[str, Any]]:
        with scratch_folder() as folder:
            track = str(write_other(Path(folder), seed))
            scenario = load_scenario("suspension", {"duration": duration, "track": track})
            truth = simulate(scenario, engine=engine)
        return list(ended(seed, measure(truth, scenario, seed=seed).measurements, true_parameters(truth)))

    rows: Any = Parallel(n_jobs=WORKERS, prefer="threads")(delayed(of_seed)(seed) for seed in seeds)
    return pd.DataFrame([row for of in rows for row in of])
