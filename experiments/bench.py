"""Speed of engines and estimators: simulated (or recorded) seconds per second of processor time."""

import tempfile
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import estimators
from estimators.interface import Estimator
from railsim.registry import discover
from railsim.scenario import load_scenario
from railsim.simulation import build_run, load_engine, measure, simulate

UNIT = "s/s"
SCENARIO = "straight_erri_low"


def bench_rows() -> list[dict[str, Any]]:
    """Rows of the benchmark: name, value, unit, what it is compared against and the ratio to that."""
    scenario = load_scenario(SCENARIO)
    run = build_run(scenario)
    integrate = load_engine("compiled")
    rows = [_row("engine compiled", run.duration / processor_time(lambda: deque(integrate(run), maxlen=0)))]
    with tempfile.TemporaryDirectory() as folder:
        truth = simulate(scenario, "compiled", f"{folder}/truth")
        measured = measure(truth, scenario).measurements
        for name, kind in discover(estimators, Estimator).items():
            estimator = kind.build({})
            if estimator.fits(measured):
                spent = processor_time(lambda estimator=estimator: estimator.estimate(measured))
                rows.append(_row(f"estimator {name}", run.duration / spent))
    return rows


def processor_time(task: Callable[[], object]) -> float:
    """Processor time of `task` in s, after a first call that compiles what there is to compile."""
    task()
    before = time.process_time()
    task()
    return time.process_time() - before


def _row(name: str, value: float) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": UNIT, "against": None, "ratio": None}
