"""simulate: a scenario becomes truth (slow, cached). measure: truth becomes a recording (cheap, random)."""

import hashlib
import importlib
import json
import logging
import pkgutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from railsim import engines
from railsim.cache import cached
from railsim.dynamics.channels import channel_names
from railsim.engines.interface import Engine, Run
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.progress import LOGGER, counting
from railsim.recording import Recording, software_versions, write_recording
from railsim.registry import pick, source_digest
from railsim.room import BYTES, Forecast, check_disk, check_memory
from railsim.scenario import Scenario, digest_of
from railsim.scratch import scratch_folder
from railsim.sensors.suite import data_sheets, measure_all
from railsim.track.features import features
from railsim.track.files import write_track
from railsim.track.kernel import build_tables
from railsim.track.survey import survey
from railsim.truth import TIME, HeldTruth, Truth, TruthWriter

REFERENCE = "exudyn"
LESS = "shorten duration, or lower output_rate and the sensors' rates"
_COPIES = 2  # of the measured samples: as they are made, and in the recording
_COLUMNS = 8  # of the truth that a sensor reads at a time
_TRACK_STREAM = 0x747261636B  # "track": keeps the survey's random numbers apart from the sensors'
_SHAPING = (
    *("dynamics", "engines", "lanes", "contact", "track", "vehicles", "effects"),
    *("branches.py", "force_laws.py", "model.py", "speed.py", "simulation.py"),
)
_NUMERICS = ("exudyn", "numba", "numpy", "scipy", "python")


def simulate(
    scenario: Scenario,
    engine: str = REFERENCE,
    folder: Path | str | None = None,
    *,
    cache: bool = True,
    progress: bool = False,
) -> Truth:
    """Run a scenario and keep every channel of it on disk.

    Parameters
    ----------
    scenario : what to run; sensors and seed do not matter here.
    engine : "exudyn" (the reference), "compiled" (the fast one) or "verlet" (faster still, second order).
    folder : where the truth shall be; None puts it into the cache (`RAILSIM_CACHE`, else ~/.cache/railsim/truth).
    cache : False simulates even where the cache has the run.
    progress : show a bar on stderr if the run takes more than two seconds and stderr is a terminal.

    Raises
    ------
    InputError : the scenario does not fit together, the folder cannot be written.
    Diverged : the run left the finite numbers or the rails; names time, place and body.
    """
    scenario.check()
    load_engine(engine)
    key = run_digest(scenario, engine)

    log = logging.getLogger(LOGGER)
    log.debug("run %s: %g s of '%s' by engine '%s'", key[:12], scenario.duration, scenario.name, engine)

    def write(target: Path) -> None:
        log.debug("integrating %d rows at %g Hz into '%s'", build_run(scenario).rows, scenario.output_rate, target)
        _integrate(scenario, engine, key, target, progress)

    if folder is not None:
        write(Path(folder))
        return Truth.open(folder)
    return cached(key, write, again=not cache)


def engine_names() -> list[str]:
    """Names of the engines: the public modules of `railsim.engines`; none of them is imported."""
    modules = (module.name for module in pkgutil.iter_modules(engines.__path__))
    return sorted(name for name in modules if not name.startswith("_") and name != "interface")


def load_engine(name: str) -> Engine:
    """The engine's `integrate`.

    Raises
    ------
    InputError : no such engine, or a library that it needs is missing.
    """
    pick(dict.fromkeys(engine_names()), name, "engine")
    try:
        return importlib.import_module(f"{engines.__name__}.{name}").integrate
    except (ImportError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"engine '{name}' cannot be loaded: {reason}; install that, or use another engine") from None


def build_run(scenario: Scenario) -> Run:
    """What an engine is given."""
    return Run(
        model=scenario.model,
        track=build_tables(scenario.setup.track),
        speed=scenario.speed_tables,
        start=scenario.start,
        duration=scenario.duration,
        rate=scenario.output_rate,
        substeps=scenario.steps_a_row,
    )


def run_digest(scenario: Scenario, engine: str) -> str:
    """SHA-256 over all that shapes the truth: run, track's contents, engine, its code, numerical libraries."""
    apart = ("name", "description", "sensors", "seed", "track_measured", "track_errors")
    run = {key: value for key, value in scenario.values().items() if key not in apart}
    run["effects"] = [effect.settings() for effect in scenario.effects if effect.acts_on != "sensor"]
    run |= {"track": scenario.geometry.digest(), "features": _features(scenario), "substeps": scenario.steps_a_row}
    versions = {name: version for name, version in software_versions().items() if name in _NUMERICS}
    return digest_of([engine, run, versions, code_digest(scenario)])


def measure(truth: Truth, scenario: Scenario, seed: int | None = None, folder: Path | str | None = None) -> Recording:
    """What the scenario's sensors give of a run.

    Parameters
    ----------
    truth : the run.
    scenario : its sensors are used, and its track and vehicle described.
    seed : of all random numbers; None takes the scenario's.
    folder : where the recording shall be, with its truth; None keeps it in memory (its folder is then the truth's).

    Raises
    ------
    InputError : a sensor does not fit the run, the folder cannot be written.
    """
    seed = scenario.seed if seed is None else seed
    logging.getLogger(LOGGER).debug("measuring by %d sensors, seed %d", len(scenario.sensors), seed)
    frames = _measured(scenario, truth, seed)
    track = _measured_track(scenario, seed)
    about = about_recording(scenario)
    if folder is None:
        return Recording(truth.folder, Measurements(about, frames, track), truth)
    with scratch_folder() as aside:
        true_track, tracks = Path(aside) / "track.csv", {}
        write_track(scenario.setup.track, true_track)
        if scenario.setup.track is not scenario.geometry:  # effects act on the track of the file, so that is kept too
            tracks["track_nominal.csv"] = Path(aside) / "track_nominal.csv"
            write_track(scenario.geometry, tracks["track_nominal.csv"])
        text = scenario.to_yaml(track=next(iter(tracks), "track.csv"), seed=seed)
        write_recording(folder, frames, about, truth, track=track, true_track=true_track, scenario=text, further=tracks)
    del frames
    return Recording.open(folder)


def about_recording(scenario: Scenario) -> dict[str, Any]:
    """What a field engineer would know of the scenario, for about.json."""
    about: dict[str, Any] = {
        "origin": "railsim simulation",
        "vehicle": {"name": scenario.vehicle_name, **scenario.vehicle.nominal()},
        "sensors": data_sheets(scenario.sensors),
    }
    if assumptions := scenario.vehicle.assumptions():
        about["assumptions"] = assumptions
    if scenario.track_measured:
        about["track"] = {"errors": scenario.track_errors.model_dump(mode="json")}
    return about


def simulate_held(scenario: Scenario, engine: str = REFERENCE) -> HeldTruth:
    """Run a scenario and keep every channel of it in memory: the same numbers as `simulate`, nothing on the disk.

    Raises
    ------
    InputError, Diverged : as `simulate`; or the run does not fit into memory.
    """
    scenario.check()
    load_engine(engine)
    run = build_run(scenario)
    check_memory(2.0 * _bytes(run), _described(run), LESS)
    values = np.empty((len(channel_names(run.model)), run.rows))
    filled = 0
    for rows in _on_track(load_engine(engine)(run), scenario):
        values[:, filled : filled + len(rows)] = rows.T
        filled += len(rows)
    about = about_run(scenario, run, engine)
    return HeldTruth(values, run.rate, channel_names(run.model), about)


def truth_bytes(scenario: Scenario) -> float:
    """Memory that `simulate_held` of the scenario takes."""
    return _bytes(build_run(scenario))


def _bytes(run: Run) -> float:
    return float(BYTES) * run.rows * len(channel_names(run.model))


def _described(run: Run) -> str:
    return f"the run ({run.duration:g} s at {run.rate:g} Hz, {len(channel_names(run.model))} channels)"


def about_run(scenario: Scenario, run: Run, engine: str, key: str | None = None) -> dict[str, Any]:
    """What stands beside the channels of a run; `key` is its digest, where that is known."""
    return {
        "vehicle": _vehicle_data(scenario),
        "digest": key or run_digest(scenario, engine),
        "engine": engine,
        "effects": [effect.settings() for effect in scenario.effects],
        "features": _features(scenario),
        "step [s]": run.step,
        "software": software_versions(),
    }


def _integrate(scenario: Scenario, engine: str, key: str, target: Path, progress: bool) -> None:
    run = build_run(scenario)
    names = channel_names(run.model)
    about = about_run(scenario, run, engine, key)
    check_disk(_bytes(run), target, _described(run), LESS)
    forecast = Forecast(run.rows)
    with (
        TruthWriter(target, names, run.rate, about) as writer,
        counting(run.rows, engine, "rows", wanted=progress) as bar,
    ):
        for rows in _on_track(load_engine(engine)(run), scenario):
            writer.append(rows)
            bar.update(len(rows))
            forecast.update(len(rows))


def check_measured(scenario: Scenario) -> None:
    """Raise `InputError` where what the sensors give does not fit into memory, before anything is simulated."""
    by_rate: dict[float, int] = {}
    for sensor in scenario.sensors:
        by_rate[sensor.rate] = by_rate.get(sensor.rate, 1) + len(sensor.channels())
    numbers = sum(rate * scenario.duration * columns for rate, columns in by_rate.items())
    reading = (
        (_COLUMNS if by_rate else 0) * scenario.output_rate * scenario.duration
    )  # of the truth, one sensor after the other
    check_memory(BYTES * (_COPIES * numbers + reading), "what the sensors give", LESS)


def _on_track(chunks: Iterator[np.ndarray], scenario: Scenario) -> Iterator[np.ndarray]:
    """The chunks as they come; ends a run whose forces carry it off the track."""
    for rows in chunks:
        check_on_track(rows, scenario)
        yield rows


def check_on_track(rows: np.ndarray, scenario: Scenario) -> None:
    """Raise `InputError` where rows of truth lie beyond the ends of the track."""
    behind, ahead = scenario.overhang
    track = scenario.setup.track
    first, last = float(track.s[0]) - behind, float(track.s[-1]) - ahead
    outside = (rows[:, 1] < first - 1e-6) | (rows[:, 1] > last + 1e-6)
    if outside.any():
        raise InputError(
            f"track: the run leaves '{track.name}' at t = {rows[int(outside.argmax()), 0]:.2f} s; "
            "shorten duration, change traction or use a longer track"
        )


def _features(scenario: Scenario) -> list[dict[str, Any]]:
    """Discrete features of the true track, for scorers."""
    return [feature.stated() for feature in features(scenario.setup.track)]


def _vehicle_data(scenario: Scenario) -> dict[str, Any]:
    """Nominal parameters with their units in the keys."""
    vehicle = scenario.vehicle
    return {"name": scenario.vehicle_name} | {f"{k} [{vehicle.about(k)[0]}]": v for k, v in vehicle.nominal().items()}


def _measured(scenario: Scenario, truth: Truth, seed: int) -> dict[float, pd.DataFrame]:
    """What the real sensors measure, in the order of the sensors of the data sheets."""
    frames = measure_all(scenario.setup.sensors, truth, seed)
    order = [channel for sensor in scenario.sensors for channel in sensor.channels()]
    return {rate: frame.loc[:, [TIME, *(n for n in order if n in frame)]] for rate, frame in frames.items()}


def _measured_track(scenario: Scenario, seed: int) -> pd.DataFrame | None:
    if not scenario.track_measured:
        return None
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_TRACK_STREAM,)))
    return survey(scenario.geometry, scenario.track_errors, rng)


def code_digest(scenario: Scenario) -> str:
    """SHA-256 over the source of everything that shapes a run, with the scenario's own plug-ins from outside."""
    total = _shipped_code().copy()
    total.update(json.dumps(source_digest([type(scenario.vehicle), *map(type, scenario.effects)])).encode() + b"]")
    return total.hexdigest()


@cache
def _shipped_code() -> Any:
    """Hash of a list of all shipped files that shape a run, as `digest_of` writes it, open for one entry more.

    Read once a process: what has been imported does not change any more.
    """
    root = Path(str(engines.__file__)).parents[1]
    wanted = [
        path for name in _SHAPING for path in ([root / name] if name.endswith(".py") else (root / name).rglob("*.py"))
    ]
    ours = [[path.relative_to(root).as_posix(), path.read_text(encoding="utf-8")] for path in sorted(wanted)]
    return hashlib.sha256(json.dumps(ours, sort_keys=True).removesuffix("]").encode() + b", ")
