"""Plan: before anyone records, which effects this vehicle, track, speed and sensor set can show and tell apart."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.discrepancy.baseline.evidence import KINDS, Evidence
from experiments.discrepancy.baseline.forward import Registration, forward_over
from experiments.discrepancy.baseline.frames import frames_of, held_out
from experiments.discrepancy.baseline.noise import SEED
from experiments.discrepancy.baseline.parallel import one_thread_each
from experiments.discrepancy.baseline.surveyed import as_surveyed
from experiments.discrepancy.fit.bank import open_bank
from experiments.discrepancy.fit.candidates import Candidate, Context, candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.progress import Progress, silent
from experiments.discrepancy.result.verdict import detectable
from experiments.discrepancy.screen.projection import Projection
from experiments.discrepancy.screen.screening import screen
from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.track.survey import TrackErrors

ALIKE = 0.9  # cosine from which two effects are hard to tell apart


@dataclass(frozen=True)
class Plan:
    """What could be seen.

    Attributes
    ----------
    labels : effects. sizes : smallest size of each that would be detected (first number, "name value unit").
    alike : (n, n) cosine of the signatures, nuisances taken out; 1 = cannot be told apart.
    """

    labels: list[str]
    sizes: dict[str, dict[str, Any]]
    alike: np.ndarray

    def confusable(self) -> list[tuple[str, str, float]]:
        """Pairs that look alike, the worst first."""
        pairs = [
            (a, b, float(self.alike[i, j]))
            for i, a in enumerate(self.labels)
            for j, b in enumerate(self.labels)
            if i < j and self.alike[i, j] > ALIKE
        ]
        return sorted(pairs, key=lambda one: -one[2])


@one_thread_each
def make_plan(scenario: Scenario, progress: Progress, only: Sequence[str] | None = None) -> Plan:
    """Signatures of all effects on the nominal scenario, with its sensors, its track and its survey's errors.

    Raises
    ------
    InputError : no sensor that is compared.
    """
    problem = nominal_problem(scenario, progress)
    fit = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    middle = 0.5 * problem.evidence.duration
    speed = float(np.median(problem.evidence.speed[1]))
    spot = (problem.forward.registration.start + speed * middle, middle)
    names = tuple(name.split(" [")[0] for name in problem.evidence.channels)
    reach = (problem.forward.registration.start, problem.forward.registration.start + speed * problem.evidence.duration)
    context = Context(names, reach, (0.0, problem.evidence.duration), (spot,))
    chosen = _one_variant([one for one in candidates(context) if only is None or one.name in only])
    progress(f"signatures of {len({one.name for one in chosen})} effects")
    screened = screen(problem, fit, chosen, progress)
    sizes = detectable(tuple(screened))
    projection = Projection(problem.differentiated(fit), problem.train, problem.forward.bounds)
    found: dict[str, np.ndarray] = {}
    for one in sorted(screened, key=lambda one: abs(one.size)):  # the smallest size worth naming comes first
        if one.candidate.name in sizes and one.candidate.name not in found:
            change = problem.stacked(problem.forward.predict(fit.z, (one.candidate.build(one.tried),))) - fit.stacked
            cleaned = projection.cleaned((WEIGHT * problem.whitened(change)[problem.train]).ravel())
            found[one.candidate.name] = cleaned / max(float(np.linalg.norm(cleaned)), 1e-12)
    table = np.stack(list(found.values())).astype(np.float32)
    return Plan(list(found), {name: _described(chosen, name, sizes[name]) for name in found}, np.abs(table @ table.T))


def _described(chosen: Sequence[Candidate], name: str, size: dict[str, Any]) -> dict[str, Any]:
    """Number, value and unit, and whether the bound is not enough."""
    parameter = next(one for one in chosen if one.name == name).parameters[size["name"]]
    beyond = size["size"] <= parameter.low or size["size"] >= parameter.high
    return {"name": size["name"], "value": size["size"], "unit": parameter.unit, "beyond": bool(beyond)}


def _one_variant(chosen: Sequence[Candidate]) -> list[Candidate]:
    """The first variant of each effect; sides and wheelsets differ little in what can be seen."""
    first: dict[str, Candidate] = {}
    for one in chosen:
        first.setdefault(one.name, one)
    return list(first.values())


def nominal_problem(scenario: Scenario, progress: Progress = silent) -> Problem:
    """A problem whose measurement is the nominal model itself, as its sensors give it without errors.

    Raises
    ------
    InputError : no sensor that is compared.
    """
    sensors = tuple(sensor for sensor in scenario.sensors if sensor.kind in KINDS)
    channels = tuple(name for sensor in sensors for name in sensor.channels())
    if not channels:
        raise InputError(f"scenario '{scenario.name}' has no {', '.join(KINDS)}; add sensors")
    time = np.arange(0.0, scenario.duration + 0.5, 0.5)
    speed = np.interp(time, *scenario.speed.knots(scenario.duration))
    rates = {name: sensor.rate for sensor in sensors for name in sensor.channels()}
    empty = {name: np.zeros(int(scenario.duration * rates[name]) + 1) for name in channels}
    errors: TrackErrors = scenario.track_errors
    track = as_surveyed(scenario.geometry, errors, SEED)
    evidence = Evidence(scenario, channels, empty, rates, sensors, track, errors, True, (time, speed, 0.01), ())
    forward = forward_over(evidence, Registration(scenario.start))
    frames = frames_of(evidence.duration, min(rates.values()))
    train, test = held_out(frames)
    z = np.zeros(len(forward.nuisances))
    prediction = forward.predict(z)
    bank = open_bank(evidence, forward.registration, frames, progress)
    blank = Problem(forward, frames, np.zeros((*frames.shape, len(channels)), complex), train, test, bank)
    measured = blank.stacked(prediction)
    return replace(blank, measured=measured).with_covariance(measured, bank.propagated)


def draw_plan(plan: Plan, path: Path) -> None:
    """Confusability matrix as a picture."""
    count = len(plan.labels)
    figure = Figure(figsize=(3.2 + 0.24 * count, 2.6 + 0.24 * count), layout="constrained")
    panel = figure.subplots()
    image = panel.imshow(plan.alike, vmin=0.0, vmax=1.0, cmap="magma_r")
    panel.set_xticks(range(count), plan.labels, rotation=90, fontsize=7)
    panel.set_yticks(range(count), plan.labels, fontsize=7)
    bar = figure.colorbar(image, ax=panel, shrink=0.7)
    bar.set_label("likeness of signatures (1 = the same)", fontsize=7)
    bar.ax.tick_params(labelsize=7)
    figure.savefig(path, dpi=110)
