"""Run a sweep to its end: what is finished already is not run again, what fails becomes rows."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.sweep.executors import Executor
from experiments.sweep.plan import Plan, make_plan
from experiments.sweep.settings import Sweep
from experiments.sweep.store import TABLE, Store, open_store, write_throughput, write_tracebacks
from experiments.sweep.table import write_table
from experiments.sweep.task import Task
from railsim.progress import counting

ENOUGH = 20  # tasks in a session from which on its speed is worth a number
ALONE = 0.02  # share of the tasks that are timed again on one worker alone
MOST_ALONE = 10


class Interrupted(KeyboardInterrupt):
    """Ctrl-C; says what is kept."""


@dataclass(frozen=True)
class Done:
    """A finished sweep: its table, what was done in this session, and whether repeated tasks gave the same rows.

    status : how many rows of each. tracebacks : of plug-ins that failed, by the message of their rows.
    """

    table: Path
    plan: Plan
    status: dict[str, int]
    performed: int
    throughput: dict[str, Any] | None
    repeatable: bool
    tracebacks: dict[str, str]


def run_sweep(sweep: Sweep, folder: Path, executor: Callable[[Path], Executor]) -> Done:
    """Perform what is not finished and write the table.

    Parameters
    ----------
    sweep : what to do.
    folder : of the results; one of this very sweep goes on where it stopped.
    executor : makes the executor, given a folder for truth that is in use.

    Raises
    ------
    InputError : the sweep cannot be planned, the folder is of another one or cannot be written, workers are lost.
    Interrupted : Ctrl-C.
    """
    plan = _planned(sweep)
    with open_store(folder, plan) as store:
        facts = {task.number: store.facts(task) for task in plan.tasks}
        left = [task for task in plan.tasks if facts[task.number] is None]
        throughput, repeatable = None, True
        if left:
            workers = executor(store.running)
            try:
                session = _perform(left, len(plan.tasks), store, workers, facts)
                if len(left) >= ENOUGH:
                    throughput, repeatable = _speed(left, facts, workers, session, store)
                    write_throughput(folder, throughput)
            except KeyboardInterrupt:
                kept = sum(one is not None for one in facts.values())
                text = f"interrupted; {kept} of {len(plan.tasks)} tasks are kept: the same command goes on"
                raise Interrupted(text) from None
            finally:
                workers.close()
        status = write_table(plan, store.rows, folder / TABLE)
        tracebacks = write_tracebacks(folder, [one for one in facts.values() if one is not None])
    return Done(folder / TABLE, plan, status, len(left), throughput, repeatable, tracebacks)


def _planned(sweep: Sweep) -> Plan:
    """The plan, with a bar where building the scenarios takes long."""
    with counting(None, "checking", "points") as bar:

        def tick(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        return make_plan(sweep, tick)


def _perform(
    left: list[Task], total: int, store: Store, workers: Executor, facts: dict[int, dict[str, Any] | None]
) -> dict[str, float]:
    """Fill `facts`, the rows go to the store; returns when the session began and ended."""
    began = time.time()
    with counting(total, "sweep", "tasks", initial=total - len(left), in_files=True) as bar:
        for task, result in workers.run(left):
            store.keep(task, result)
            facts[task.number] = {name: value for name, value in result.items() if name != "rows"}
            bar.update()
    return {"began": began, "ended": time.time()}


def _speed(
    left: list[Task],
    facts: dict[int, dict[str, Any] | None],
    workers: Executor,
    session: dict[str, float],
    store: Store,
) -> tuple[dict[str, Any], bool]:
    """Throughput of a session, against one worker that has the machine for itself; and whether repeats agree.

    The first tasks, while workers start and load machine code, count in the whole session but not in the steady part.
    Where other programs use the machine too, efficiency says how much they leave; the workers' own share in it is then
    the part of the time that they are busy, and the processor time that a simulated second takes with one worker over
    that with all.
    """
    mine = sorted((one for task in left if (one := facts[task.number])), key=lambda one: one["ended"])
    steady = mine[2 * workers.workers :]
    since = mine[2 * workers.workers - 1]["ended"]
    wall = steady[-1]["ended"] - since
    count = min(MOST_ALONE, max(3, round(ALONE * len(left))))
    chosen = [left[round(place * (len(left) - 1) / count)] for place in range(1, count + 1)]
    alone, same = [], True
    for task in [chosen[0], *chosen]:  # the first once more: it warms up
        _, again = next(iter(workers.run([task])))
        same = same and again["rows"] == store.rows(task)
        alone.append(again)
    alone, simulated = alone[1:], sum(one["simulated"] for one in steady)
    rate, busy, used = simulated / wall, sum(map(_duration, steady)), sum(one["cpu"] for one in steady)
    one_worker = sum(one["simulated"] for one in alone) / sum(map(_duration, alone))
    cost = sum(one["cpu"] for one in alone) / max(sum(one["simulated"] for one in alone), 1e-9)
    speed = {
        "workers": workers.workers,
        "tasks": len(mine),
        "simulated [s]": sum(one["simulated"] for one in mine),
        "wall [s]": session["ended"] - session["began"],
        "rate [s/s]": rate,
        "one worker alone [s/s]": one_worker,
        "tasks timed alone": count,
        "efficiency [-]": rate / (workers.workers * one_worker) if one_worker > 0 else 0.0,
        "workers busy [-]": busy / (workers.workers * wall),
        "processor time, one worker alone over all [-]": cost * simulated / used,
        "processor time per busy time [-]": used / busy,
        "load average": os.getloadavg()[1],
        "repeated tasks agree": same,
    }
    return speed, same


def _duration(result: dict[str, Any]) -> float:
    return result["ended"] - result["began"]
