"""Item 10: simulated seconds per second of processor time with tables from profiles, beside the analytic pair."""

from collections import deque
from collections.abc import Callable

import pandas as pd
from matplotlib.figure import FigureBase

from experiments.benchmarks.speed import SCENARIO, UNIT, rates
from experiments.reporting.plots import BLUE, GREY
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from experiments.validation.tables import of, values
from railsim.engines.interface import Run
from railsim.scenario import load_scenario
from railsim.simulation import build_run, load_engine

PAIRS: dict[str, dict[str, object]] = {
    "analytic pair": {},
    "tables from profiles": {"vehicle.pair": {"kind": "profiles"}},
}
ENGINES = ("compiled", "exudyn")
DURATION, FAST_DURATION = 20.0, 2.0  # s
REPEATS, FAST_REPEATS = 5, 3
SPEED = f"speed [{UNIT}]"
LEAST = 0.8
"""Least ratio of speeds: no more than 20 % slower."""


class Speed(Section):
    """`railsim bench` twice in one process."""

    item = 10
    title = "Speed with tables included"
    about = (
        "Both engines, measured as in `railsim bench` (its scenario; processor time, median of repeated runs in "
        "turn, compiled before), with S1002 on 60E1 in tables over the shift, and with the analytic pair that the "
        "engines were first built for."
    )
    source = "railsim bench, the same machine in the same minute"
    size = (8.0, 3.2)

    def compute(self, size: Size) -> pd.DataFrame:
        duration = FAST_DURATION if size.reduced else DURATION
        tasks: dict[str, tuple[Callable[[], object], float]] = {}
        for pair, settings in PAIRS.items():
            run = build_run(load_scenario(SCENARIO, {"duration": duration} | settings))
            for engine in ENGINES:
                tasks[f"{pair}; {engine}"] = (_task(run, engine), duration)
        measured = rates(tasks, FAST_REPEATS if size.reduced else REPEATS)
        split = [name.split("; ") for name in measured]
        return pd.DataFrame(
            {"pair": [one[0] for one in split], "engine": [one[1] for one in split], SPEED: measured.values()}
        )

    def rows(self, table: pd.DataFrame) -> list[Row]:
        analytic, tables = PAIRS
        rows = []
        for engine in ENGINES:
            with_tables, without = (
                values(of(of(table, "pair", pair), "engine", engine), SPEED)[0] for pair in (tables, analytic)
            )
            rows.append(self.noted(f"engine {engine}: tables; analytic pair as reference", with_tables, without, UNIT))
            rows.append(self.bounded(f"engine {engine}: ratio of both", with_tables / without, low=LEAST))
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        axes = picture.subplots()
        names = list(ENGINES)
        for offset, (pair, colour) in enumerate(zip(PAIRS, (GREY, BLUE), strict=True)):
            speed = values(of(table, "pair", pair), SPEED)
            positions = [index + 0.38 * (offset - 0.5) for index in range(len(names))]
            axes.barh(positions, speed, height=0.36, color=colour, label=pair)
            for place, value in zip(positions, speed, strict=True):
                axes.annotate(f" {value:.3g}", (value, place), va="center", fontsize=8)
        axes.set_yticks(range(len(names)), [f"engine {name}" for name in names])
        axes.invert_yaxis()
        axes.set(xlabel="simulated seconds per second of processor time")
        axes.legend(frameon=False)


def _task(run: Run, engine: str) -> Callable[[], object]:
    return lambda: deque(load_engine(engine)(run), maxlen=0)
