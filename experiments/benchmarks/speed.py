"""Speed of engines and estimators: simulated (or recorded) seconds per second of processor time, side by side in one
run.
"""

import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from estimators.interface import ESTIMATORS, Estimator, OnlineEstimator
from estimators.track.dipped_joints import DippedJoints
from experiments.benchmarks.lanes import lane_sections
from experiments.benchmarks.suspension import suspension_rows
from railsim.engines.compiled import right_hand_side
from railsim.engines.interface import Run
from railsim.errors import InputError
from railsim.progress import counted
from railsim.scenario import Scenario, load_scenario
from railsim.scratch import scratch_folder
from railsim.simulation import build_run, load_engine, measure, simulate

UNIT = "s/s"
SCENARIO = "straight_erri_low"
WHEELSET, RECURSIVE = "wheelset_new", "rolling_radii_rls"
"""Scenario of the online conicity filters, and the estimator whose recursion alone is online."""
REPEATS = 3  # the median is reported
FAST_DURATION = 8.0  # s
ANALYTIC = "engine compiled"
VARIANTS: dict[str, dict[str, Any]] = {
    "engine compiled, profiles": {"vehicle.pair": {"kind": "profiles", "wheel": "s1002", "rail": "uic60_40"}},
    "engine compiled, FASTSIM": {"vehicle.adhesion.law": "fastsim"},
    "engine compiled, flexible track": {"flexible_track": {}},
}
"""The compiled engine with other contacts than the analytic pair and Polach's law, or with a track that gives, as
overrides of the scenario.
"""

CURVE, IN_CURVE = "curve_s1002", {"start": 370.0, "duration": 19.0}
"""Scenario with profiles, and the part of it in the curve, where the leading outer wheel touches tread and flange."""

ONE, TWO = "engine compiled, profiles in a curve", "engine compiled, two contacts in a curve"

JOINTED = {
    "estimator dipped_joints, dense joints at 15 m/s": 15.0,
    "estimator dipped_joints, dense joints at 45 m/s": 45.0,
}
"""Names and speeds of runs over the track with a joint every 18 m."""

ADHESION, ADHESION_ESTIMATORS = "low_adhesion", "adhesion"
"""Scenario with the sensors of the adhesion estimators, and how their names begin."""

BASELINE = "solve_ivp RK45, rtol 1e-6"


def bench_rows(fast: bool = False) -> list[dict[str, Any]]:
    """Rows of the benchmark: name, value, unit, what it is compared against and the ratio to that.

    `fast`: a short run, once: to see that it works, not to be quoted.
    """
    scenario = load_scenario(SCENARIO, {"duration": FAST_DURATION} if fast else {})
    repeats = 1 if fast else REPEATS
    shorter = {"duration": FAST_DURATION} if fast else {}
    duration = FAST_DURATION if fast else None
    variants = {name: load_scenario(SCENARIO, {**shorter, **changes}) for name, changes in VARIANTS.items()}
    wheelset = load_scenario(WHEELSET, shorter)
    plain = load_scenario(ADHESION, {"duration": 2.0 * FAST_DURATION} if fast else {})
    sections: list[Callable[[], list[dict[str, Any]]]] = [
        lambda: engine_rows(scenario, repeats, variants),
        lambda: contact_rows(repeats, duration),
        lambda: estimator_rows(scenario, repeats),
        lambda: joint_rows(repeats, duration),
        lambda: estimator_rows(wheelset, repeats, kind=OnlineEstimator),
        lambda: estimator_rows(wheelset, repeats, RECURSIVE),
        lambda: estimator_rows(plain, repeats, ADHESION_ESTIMATORS),
        lambda: suspension_rows(fast),
        *lane_sections(fast),
    ]
    return [row for section in counted(sections, "measuring", "sections") for row in section()]


def engine_rows(
    scenario: Scenario, repeats: int = REPEATS, variants: Mapping[str, Scenario] = MappingProxyType({})
) -> list[dict[str, Any]]:
    """All engines, and `scipy.integrate.solve_ivp` on the compiled engine's own right-hand side (Dormand-Prince and
    LSODA). `variants` are runs of the compiled engine that are compared with its run of the scenario itself.
    """
    run = build_run(scenario)
    tasks: dict[str, tuple[Callable[[], object], float]] = {
        BASELINE: (lambda: _adaptive(run, "RK45", scenario.duration / 10.0), scenario.duration / 10.0),
        "solve_ivp LSODA, rtol 1e-6": (
            lambda: _adaptive(run, "LSODA", scenario.duration / 10.0),
            scenario.duration / 10.0,
        ),
        "engine exudyn": (lambda: deque(load_engine("exudyn")(run), maxlen=0), run.duration),
        ANALYTIC: (lambda: deque(load_engine("compiled")(run), maxlen=0), run.duration),
        "engine verlet": (lambda: deque(load_engine("verlet")(run), maxlen=0), run.duration),
    }
    for name, variant in variants.items():
        varied = build_run(variant)
        tasks[name] = (lambda varied=varied: deque(load_engine("compiled")(varied), maxlen=0), varied.duration)
    speeds = rates(tasks, repeats)
    against = {name: ANALYTIC if name in variants else BASELINE for name in speeds if name != BASELINE}
    return [
        _row(name, rate, against.get(name), rate / speeds[against.get(name, name)]) for name, rate in speeds.items()
    ]


def contact_rows(repeats: int = REPEATS, duration: float | None = None) -> list[dict[str, Any]]:
    """The compiled engine in a curve with one contact a wheel and with two; `duration` in s."""
    tasks: dict[str, tuple[Callable[[], object], float]] = {}
    for name, contacts in ((ONE, 1), (TWO, 2)):
        changes = {**IN_CURVE, "vehicle.pair.contacts": contacts}
        run = build_run(load_scenario(CURVE, changes if duration is None else {**changes, "duration": duration}))
        tasks[name] = (lambda run=run: deque(load_engine("compiled")(run), maxlen=0), run.duration)
    speeds = rates(tasks, repeats)
    return [_row(ONE, speeds[ONE], None, 1.0), _row(TWO, speeds[TWO], ONE, speeds[TWO] / speeds[ONE])]


def estimator_rows(
    scenario: Scenario, repeats: int = REPEATS, only: str = "", kind: type = Estimator
) -> list[dict[str, Any]]:
    """Every estimator that fits the scenario's sensors: recorded seconds per second; 1 = real time.

    `only` : what its name must begin with. `kind` : what it must be, for example one that runs online.
    """
    with scratch_folder() as folder:
        truth = simulate(scenario, "compiled", f"{folder}/truth")
        measured = measure(truth, scenario).measurements
        built = {name: estimator.build({}) for name, estimator in ESTIMATORS.classes().items()}
        tasks: dict[str, tuple[Callable[[], object], float]] = {
            f"estimator {name}": (lambda estimator=estimator: estimator.estimate(measured), scenario.duration)
            for name, estimator in built.items()
            if name.startswith(only) and isinstance(estimator, kind) and estimator.fits(measured)
        }
        return [_row(name, rate, "real time", rate) for name, rate in rates(tasks, repeats).items()]


def joint_rows(repeats: int = REPEATS, duration: float | None = None) -> list[dict[str, Any]]:
    """The detector of joints where there are most of them in a second; 2 km each unless `duration` (s) is given."""
    tasks: dict[str, tuple[Callable[[], object], float]] = {}
    with scratch_folder() as folder:
        for name, speed in JOINTED.items():
            changes = {"speed": {"kind": "constant", "speed": speed}, "duration": duration or round(2000.0 / speed, 1)}
            scenario = load_scenario("jointed", changes)
            measured = measure(simulate(scenario, "compiled", f"{folder}/{speed:g}"), scenario).measurements
            tasks[name] = (lambda measured=measured: DippedJoints().estimate(measured), scenario.duration)
        return [_row(name, rate, "real time", rate) for name, rate in rates(tasks, repeats).items()]


def rates(tasks: dict[str, tuple[Callable[[], object], float]], repeats: int) -> dict[str, float]:
    """Seconds of each task per second of processor time: medians of runs in turn, after one that compiles what there
    is to. An estimator that refuses the record, as too short for it, is left out.
    """
    tasks = {name: task for name, task in tasks.items() if _goes(task[0])}
    spent: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(repeats):
        for name, (call, _) in tasks.items():
            before = time.process_time()
            call()
            spent[name].append(time.process_time() - before)
    return {name: tasks[name][1] / float(np.median(times)) for name, times in spent.items()}


def _goes(call: Callable[[], object]) -> bool:
    try:
        call()
    except InputError:
        return False
    return True


def _adaptive(run: Run, method: str, duration: float) -> Iterable[float]:
    """SciPy's integrator over the first `duration` seconds; output at the run's rate, as the engines give it."""
    system, start = right_hand_side(run)
    times = np.arange(int(duration * run.rate) + 1) / run.rate
    solution = solve_ivp(system, (0.0, times[-1]), start, method, t_eval=times, rtol=1e-6, atol=1e-9)
    return solution.t


def _row(name: str, value: float, against: str | None, ratio: float) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": UNIT, "against": against, "ratio": ratio if against else None}
