"""Can conicity be known from bogie and body sensors on unknown track? Profile likelihood and Fisher information.

The track is shaped noise, whose level is sought with the parameters. The profiles are of Exudyn runs on tracks on which
nothing was chosen; the information is that of the filter's own model, checked on data that this model made.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture
from scipy.optimize import minimize

from estimators.suspension.base import Problem
from estimators.suspension.discrete_model import Discrete, discrete, layout
from estimators.suspension.fisher_information import fisher
from estimators.suspension.suspension_ml import STEP, SuspensionMl, gradient
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS, WITHOUT_WHEELSETS, half_vehicle
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_most, between
from experiments.reporting.plots import BLUE, RED
from experiments.reporting.size import Size
from experiments.runs.suspension import JUDGED, write_other
from experiments.scoring.suspension import true_parameters
from railsim import load_scenario, measure, simulate
from railsim.measurements import Measurements
from railsim.plots.style import OPAQUE
from railsim.scratch import scratch_folder

EVERY = 4  # samples of 256 Hz
LEVELS, FAST_LEVELS, SMOKE_LEVELS = (0.25, 0.5, 1.0, 2.0, 4.0), (0.5, 1.0, 2.0), (1.0,)
CONICITIES = tuple(np.round(np.arange(0.06, 0.2501, 0.01), 3))
FAST_CONICITIES = (0.1, 0.15, 0.2)
TRACKS = 3
LEVEL_STEP = 0.02  # of the logarithm of the level
MADE = 600.0  # s of data that the model makes
SECONDS = (10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0)
WHAT, LEVEL, CONICITY, VALUE = "what", "level", "conicity", "value"


class SuspensionIdentifiability(Figure):
    """Profiles, information, and the estimates that fit the level too."""

    def compute(self, size: Size) -> pd.DataFrame:
        seconds, engine = (12.0, "compiled") if size.reduced else (65.0, "exudyn")
        estimator = SuspensionMl(wheelset_sensors=False, track="unknown", keep_every=EVERY, starts=16)
        rows: list[dict[str, Any]] = []
        for number in range(1 if size.reduced else TRACKS):
            true, measurements = _run(JUDGED + number, seconds, engine)
            if not size.reduced:
                estimate = estimator.but(fit_level=True).estimate(measurements)
                last = estimate.series.iloc[-1]
                for name, value in zip(PARAMETERS, true, strict=True):
                    rows.append({WHAT: f"estimate of {name}", VALUE: float(last[name]), "true": float(value)})
                rows[-1]["std"] = float(last[std_name(PARAMETERS[2])])
                rows.append({WHAT: "level", VALUE: estimate.about["track_level"]})
            if number == 0:
                rows += _profiles(estimator, measurements, size)
                rows += _information(estimator, measurements, size.of(MADE, 60.0, 6.0))
        return pd.DataFrame(rows)

    def draw(self, table: Any) -> Picture:
        picture = Picture(figsize=(10.0, 4.4), layout="constrained")
        axes = picture.subplots(1, 2)
        profiles = table[table[WHAT] == "profile"]
        top = profiles[VALUE].max()
        for level, profile in profiles.groupby(LEVEL):
            label = f"level {float(str(level)):g} of ERRI B176 low"
            axes[0].plot(profile[CONICITY], profile[VALUE] - top, "-", lw=1.0, label=label)
        best = profiles.groupby(CONICITY)[VALUE].max()
        axes[0].plot(best.index, best - top, "k--", lw=1.6, label="best of these levels")
        axes[0].axvline(0.15, color="black", lw=0.7, label="true")
        axes[0].set(
            xlabel="conicity [-]",
            ylabel="log likelihood below the best [-]",
            title="bogie, body; track unknown",
            ylim=(max(-1300.0, 2.6 * float((profiles[VALUE] - top).min())), 40),
        )
        axes[0].set_xticks([0.05, 0.1, 0.15, 0.2, 0.25])
        axes[0].legend(loc="lower center", **OPAQUE)
        bounds = table[table[WHAT] == "bound"]
        for known, label, colour in ((1.0, "level known", BLUE), (0.0, "level unknown", RED)):
            std = float(bounds.loc[bounds["known"] == known, VALUE].iloc[0])
            axes[1].loglog(SECONDS, [std * np.sqrt(60.0 / one) for one in SECONDS], color=colour, label=label)
        made = table[table[WHAT] == "curvature"]
        for known, label, colour in ((1.0, "known", BLUE), (0.0, "unknown", RED)):
            rows = made[made["known"] == known]
            label = f"by the likelihood's curvature, level {label}"
            axes[1].loglog(rows["seconds"], rows[VALUE], "o", color=colour, ms=5, label=label)
        axes[1].axhline(0.03, color="black", lw=0.7, ls="--", label="error allowed")
        axes[1].set(xlabel="length of the record [s]", ylabel="deviation of the conicity [-]", title="Cramér-Rao bound")
        axes[1].legend(loc="lower left")
        return picture

    def check(self, table: Any) -> list[Claim]:
        claims = []
        tracks = table[table[WHAT] == f"estimate of {PARAMETERS[2]}"]
        if len(tracks):
            error = float((tracks[VALUE] - tracks["true"]).abs().max())
            text = "conicity from bogie and body, track and its level estimated too: "
            text += f"largest error of {len(tracks)} tracks"
            claims.append(Claim.definite(text, error, at_most(0.03), len(tracks)))
            for name, short in zip(PARAMETERS[:2], ("C_sy", "C_spsi"), strict=True):
                rows = table[table[WHAT] == f"estimate of {name}"]
                worst = 100.0 * float((rows[VALUE] / rows["true"] - 1.0).abs().max())
                text = f"{short} in these runs: largest error"
                claims.append(Claim.definite(text, worst, at_most(10.0, "%"), len(rows)))
        bounds = table[table[WHAT] == "bound"]
        bound = float(bounds.loc[bounds["known"] == 0.0, VALUE].iloc[0])
        text = "Cramér-Rao bound of the conicity, 60 s, level unknown: information does not forbid it"
        claims.append(Claim.definite(text, bound, at_most(0.01)))
        for known, text in ((1.0, "known"), (0.0, "unknown")):
            row = table[(table[WHAT] == "curvature") & (table["known"] == known)].iloc[0]
            expected = float(bounds.loc[bounds["known"] == known, VALUE].iloc[0]) * float(
                np.sqrt(60.0 / row["seconds"])
            )
            ratio = float(row[VALUE]) / expected
            name = f"deviation by the curvature of the likelihood over the bound, data of the model, level {text}"
            claims.append(Claim.definite(name, ratio, between(0.85, 1.18)))
        return claims


def _run(seed: int, seconds: float, engine: str) -> tuple[np.ndarray, Measurements]:
    with scratch_folder() as folder:
        track = str(write_other(Path(folder), seed))
        scenario = load_scenario("suspension", {"duration": seconds, "track": track})
        truth = simulate(scenario, engine=engine)
        return true_parameters(truth), measure(truth, scenario, seed=seed).measurements


def _profiles(estimator: SuspensionMl, measurements: Measurements, size: Size) -> list[dict[str, Any]]:
    """Largest likelihood over both dampers, for every conicity and level."""
    rows = []
    for level in size.of(LEVELS, FAST_LEVELS, SMOKE_LEVELS):
        problem = estimator.but(track_level=level).prepare(measurements)
        span = problem.high - problem.low
        start = ((problem.nominal - problem.low) / span)[:2]
        for conicity in size.of(CONICITIES, FAST_CONICITIES):
            place = (conicity - problem.low[2]) / span[2]
            start, value = _best_dampers(problem, start, place)
            rows.append({WHAT: "profile", LEVEL: level, CONICITY: conicity, VALUE: -value})
    return rows


def _best_dampers(problem: Problem, start: np.ndarray, conicity: float) -> tuple[np.ndarray, float]:
    size = problem.high - problem.low

    def cost(two: np.ndarray) -> float:
        one = np.append(two, conicity)
        return -problem.trust * float(problem.likelihood((problem.low + one * size)[None, :])[0])

    solution = minimize(
        cost,
        start,
        method="L-BFGS-B",
        jac=lambda two: gradient(problem, np.append(two, conicity))[:2],
        bounds=[(0.0, 1.0)] * 2,
        options={"maxiter": 8},
    )
    return solution.x, float(solution.fun)


def _information(estimator: SuspensionMl, measurements: Measurements, seconds: float) -> list[dict[str, Any]]:
    """The bound for 60 s, and the deviation by the curvature for data that the model made."""
    problem = estimator.prepare(measurements)
    situation = problem.situation(*problem.stretches[-2])
    assert situation is not None
    _, speed, _, _ = problem.system(situation)
    rate, middle = problem.record.rate, np.append(problem.nominal, 0.0)

    def system(parameters: np.ndarray) -> Discrete:
        settings = estimator.but(track_level=float(np.exp(parameters[3])))
        unknowns = settings.unknowns(problem.vehicle, WITHOUT_WHEELSETS, problem.record.noise, rate)
        plan = layout(2.0 * problem.vehicle["semi_wheelbase"], speed, rate, unknowns)
        vehicle = half_vehicle(problem.vehicle, speed, WITHOUT_WHEELSETS, settings.creep)
        return discrete(vehicle, parameters[:3], speed, rate, unknowns, plan)

    information = fisher(system, middle, rate, 0.01, 60.0)
    observed = _curvature(problem, system(middle), middle, seconds)
    rows = []
    for known, used in ((1.0, 3), (0.0, 4)):
        rows.append({WHAT: "bound", "known": known, VALUE: _deviation(information[:used, :used])})
        rows.append({WHAT: "curvature", "known": known, "seconds": seconds, VALUE: _deviation(observed[:used, :used])})
    return rows


def _deviation(information: np.ndarray) -> float:
    return float(np.sqrt(np.linalg.inv(information)[2, 2]))


def _curvature(problem: Problem, system: Discrete, middle: np.ndarray, seconds: float) -> np.ndarray:
    """Minus the second derivatives of the likelihood of data that the model made, shape (4, 4)."""
    count = round(seconds * problem.record.rate)
    readings = _made(system, count, np.random.default_rng(1))
    steps = np.append(STEP * (problem.high - problem.low), LEVEL_STEP)
    likelihoods = {sign: _of_level(problem, readings, float(np.exp(sign * steps[3]))) for sign in (-1.0, 0.0, 1.0)}

    def value(change: np.ndarray) -> float:
        return float(likelihoods[float(np.sign(change[3]))]((middle + change * steps)[:3]))

    unit = np.eye(4)
    information = np.zeros((4, 4))
    for i in range(4):
        for j in range(i):
            ends = [(a, b, value(a * unit[i] + b * unit[j])) for a in (1, -1) for b in (1, -1)]
            information[i, j] = information[j, i] = -sum(a * b * one for a, b, one in ends) / (
                4.0 * steps[i] * steps[j]
            )
        ends = [value(a * unit[i]) for a in (1, 0, -1)]
        information[i, i] = -(ends[0] - 2.0 * ends[1] + ends[2]) / steps[i] ** 2
    return information


def _of_level(problem: Problem, readings: np.ndarray, level: float) -> Callable[[np.ndarray], float]:
    """Likelihood of parameters for made readings and a level of the track."""
    record, count = problem.record, len(readings)
    speed = float(np.nanmedian(record.speed))
    made = replace(
        record,
        time=np.arange(count) / record.rate,
        readings=readings,
        good=np.ones(readings.shape, dtype=bool),
        speed=np.full(count, speed),
        inputs=np.zeros((count, record.inputs.shape[1])),
        later=np.zeros((count, record.inputs.shape[1])),
    )
    modelled = Problem(
        made, problem.vehicle, problem.settings.but(track_level=level), problem.low, problem.high, problem.nominal
    )
    return lambda parameters: float(modelled.likelihood(parameters[None, :], interpolated=False)[0])


def _made(system: Discrete, count: int, rng: np.random.Generator) -> np.ndarray:
    """Readings of the model, driven by its own noise, shape (count, m)."""
    values, vectors = np.linalg.eigh(system.Q)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    noise = np.sqrt(np.diag(system.R))
    z, warm = np.zeros(len(system.F)), 2000
    readings = np.empty((count, len(noise)))
    for k in range(-warm, count):
        if k >= 0:
            readings[k] = system.C @ z + noise * rng.standard_normal(len(noise))
        z = system.F @ z + root @ rng.standard_normal(len(z))
    return readings
