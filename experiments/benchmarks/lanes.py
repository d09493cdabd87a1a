"""Speed of runs in lanes against the same runs one by one, side by side: simulated seconds per second."""

import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from experiments.reporting.plots import BLACK, BLUE, GREEN, ORANGE
from railsim.lanes.buffers import Buffers
from railsim.lanes.fleet import Job, advance, prepare
from railsim.many import simulate_many
from railsim.progress import counted
from railsim.scenario import Scenario, load_scenario
from railsim.simulation import build_run, load_engine, simulate_held

RUNS = 64
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "half vehicle": ("straight_erri_low", {"start": 60.0}),
    "profiles in a curve": ("curve_s1002", {"start": 370.0}),
    "whole vehicle": ("whole_coach", {}),
}
"""Scenario and overrides of each case; body mass and start differ between its runs."""

DURATION, FAST_DURATION = 15.0, 1.0  # s
NUISANCES, LONG = 60, 60.0  # parameters; s of each run
FELT = [f"{body}.specific_force_{axis} [m/s2]" for body in ("body", "bogie", "wheelset1", "wheelset2") for axis in "yz"]
"""Channels that derivatives are taken of."""
ONE_BY_ONE = 4  # runs of a case by the compiled engine: their mean stands for all


def lane_sections(fast: bool = False, repeats: int = 3) -> list[Callable[[], list[dict[str, Any]]]]:
    """What measures rows of the benchmark, see `speed.bench_rows`; `fast`: half vehicle only, short runs."""
    duration, repeats = (FAST_DURATION, 1) if fast else (DURATION, repeats)
    first = next(iter(CASES))
    cases = [partial(_measured, case, duration, repeats) for case in (list(CASES)[:1] if fast else CASES)]
    return [
        *cases,
        lambda: _threads(_scenarios(first, 2 * RUNS, duration), repeats),
        lambda: _derivatives(_scenarios(first, 1 + NUISANCES, 4.0 * duration if fast else LONG), repeats),
    ]


def _measured(case: str, duration: float, repeats: int) -> list[dict[str, Any]]:
    return _case(case, _scenarios(case, RUNS, duration), repeats)


def _scenarios(case: str, count: int, duration: float) -> list[Scenario]:
    name, changes = CASES[case]
    mass = load_scenario(name).vehicle.nominal()["body_mass"]
    return [
        load_scenario(
            name,
            {
                **changes,
                "vehicle.body_mass": mass * (1.0 + 0.1 * i / count),
                "start": changes.get("start", 25.0) + 0.2 * i,
                "duration": duration,
            },
        )
        for i in range(count)
    ]


def _case(case: str, scenarios: list[Scenario], repeats: int) -> list[dict[str, Any]]:
    """Engine alone, without set-up: lanes against one by one."""
    jobs, buffers = [prepare(i, build_run(one)) for i, one in enumerate(scenarios)], Buffers()
    compiled, simulated = load_engine("compiled"), sum(job.run.duration for job in jobs)

    def one_by_one() -> None:
        for job in jobs[:ONE_BY_ONE]:
            deque(compiled(job.run), maxlen=0)

    def side_by_side() -> None:
        deque((None for _ in advance(jobs, buffers=buffers)), maxlen=0)

    alone = f"{case}, compiled, one by one"
    spent = _medians({alone: one_by_one, "lanes": side_by_side}, repeats, time.process_time)
    single = simulated * ONE_BY_ONE / len(jobs) / spent[alone]
    lanes = simulated / spent["lanes"]
    return [_row(alone, single, None, None), _row(f"{case}, {len(jobs)} runs in lanes", lanes, alone, lanes / single)]


WIDTHS, FAST_WIDTHS = (4, 8, 16, 32, 64), (4, 8)


def width_rows(fast: bool = False) -> list[dict[str, Any]]:
    """Simulated seconds per second of processor time by number of lanes, without and with set-up, beside one by one;
    `fast`: half vehicle, narrow lanes, short runs.
    """
    rows = []
    for case in counted(list(CASES)[:1] if fast else CASES, "measuring", "cases"):
        scenarios = _scenarios(case, RUNS, FAST_DURATION if fast else DURATION)
        prepare(0, build_run(scenarios[0]))  # loads the kernels
        before = time.process_time()
        jobs = [prepare(i, build_run(one)) for i, one in enumerate(scenarios)]
        ready, buffers = time.process_time() - before, Buffers()
        simulated = sum(job.run.duration for job in jobs)
        for width in FAST_WIDTHS if fast else WIDTHS:

            def through(jobs: list[Job] = jobs, buffers: Buffers = buffers, width: int = width) -> None:
                deque((None for _ in advance(jobs, buffers=buffers, width=width)), maxlen=0)

            spent = _medians({"lanes": through}, 1 if fast else 3, time.process_time)["lanes"]
            rates = {"without set-up [s/s]": simulated / spent, "with set-up [s/s]": simulated / (spent + ready)}
            rows.append({"case": case, "lanes": width, **rates})
        deque(load_engine("compiled")(jobs[0].run), maxlen=0)
        before = time.process_time()
        deque(load_engine("compiled")(jobs[0].run), maxlen=0)
        alone = jobs[0].run.duration / (time.process_time() - before)
        rows.append({"case": case, "lanes": 1, "without set-up [s/s]": alone, "with set-up [s/s]": float("nan")})
    return rows


def draw_widths(rows: list[dict[str, Any]]) -> Figure:
    """The picture of `width_rows`."""
    table, picture = pd.DataFrame(rows), Figure(figsize=(8.0, 4.2), layout="constrained")
    axes = picture.subplots()
    for (case, part), colour in zip(table.groupby("case", sort=False), (BLUE, ORANGE, GREEN), strict=False):
        wide = part[part["lanes"] > 1]
        axes.plot(wide["lanes"], wide["without set-up [s/s]"], "o-", color=colour, label=str(case))
        axes.plot(wide["lanes"], wide["with set-up [s/s]"], "o--", color=colour, mfc="white")
        axes.axhline(float(part.loc[part["lanes"] == 1, "without set-up [s/s]"].iloc[0]), color=colour, lw=0.9, ls=":")
    axes.plot([], [], "o--", color=BLACK, mfc="white", label="with set-up")
    axes.plot([], [], color=BLACK, lw=0.9, ls=":", label="one by one")
    axes.set_xscale("log", base=2)
    axes.set_xticks(sorted(set(table["lanes"]) - {1}), [str(n) for n in sorted(set(table["lanes"]) - {1})])
    axes.set(xlabel="lanes", ylabel="simulated s per s of one core", ylim=(0.0, None), title="Runs side by side")
    axes.spines[["top", "right"]].set_visible(False)
    picture.legend(loc="outside right upper", frameon=False, fontsize=9)
    return picture


def _threads(scenarios: list[Scenario], repeats: int) -> list[dict[str, Any]]:
    """Two cores against one, by the clock on the wall."""
    jobs, buffers = [prepare(i, build_run(one)) for i, one in enumerate(scenarios)], Buffers()
    simulated = sum(job.run.duration for job in jobs)
    names = {"lanes, one thread, wall clock": 1, "lanes, two threads, wall clock": 2}

    def through(threads: int) -> None:
        deque((None for _ in advance(jobs, buffers=buffers, threads=threads)), maxlen=0)

    tasks: dict[str, Callable[[], object]] = {name: partial(through, count) for name, count in names.items()}
    spent = _medians(tasks, repeats, time.perf_counter)
    one, two = names
    rate = {name: simulated / seconds for name, seconds in spent.items()}
    return [_row(one, rate[one], None, None), _row(two, rate[two], one, rate[two] / rate[one])]


def _derivatives(scenarios: list[Scenario], repeats: int) -> list[dict[str, Any]]:
    """A run and one for each nuisance, set-up and truth included."""

    def one_by_one() -> None:
        for one in scenarios[:ONE_BY_ONE]:
            simulate_held(one, "compiled")

    def side_by_side() -> None:
        deque((None for _ in simulate_many(scenarios, channels=FELT)), maxlen=0)

    simulated = sum(one.duration for one in scenarios)
    alone = "derivatives, compiled, one by one"
    spent = _medians({alone: one_by_one, "lanes": side_by_side}, repeats, time.process_time)
    single = simulated * ONE_BY_ONE / len(scenarios) / spent[alone]
    lanes = simulated / spent["lanes"]
    name = f"derivatives by {len(scenarios) - 1} nuisances in lanes, set-up included"
    return [_row(alone, single, None, None), _row(name, lanes, alone, lanes / single)]


def _medians(tasks: dict[str, Callable[[], object]], repeats: int, clock: Callable[[], float]) -> dict[str, float]:
    """Median seconds of each task, in turns, after one that compiles and touches memory for the first time."""
    for call in tasks.values():
        call()
    spent: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(repeats):
        for name, call in tasks.items():
            before = clock()
            call()
            spent[name].append(clock() - before)
    return {name: float(np.median(times)) for name, times in spent.items()}


def _row(name: str, value: float, against: str | None, ratio: float | None) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": "s/s", "against": against, "ratio": ratio}
