"""Number of particles against accuracy: spread of the estimates over the filter's own random numbers, and speed."""

import time
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, at_least, at_most
from experiments.reporting.plots import RED
from experiments.reporting.size import Size
from railsim import load_scenario, measure, simulate

COUNTS, FAST_COUNTS = (30, 100, 300, 1000, 3000), (30, 300)
SEEDS, FAST_SEEDS = 5, 2
USED = 1000
REAL_TIME = 5.0
LABELS = ("$C_{sy}$", "$C_{s\\psi}$", "conicity")


class SuspensionParticles(Figure):
    """Spread over seeds in units of the stated standard deviation of the largest filter."""

    def compute(self, size: Size) -> pd.DataFrame:
        scenario = load_scenario("suspension", {"duration": 12.0 if size.reduced else 40.0})
        measurements = measure(simulate(scenario, engine="compiled"), scenario).measurements
        SuspensionRbpf(particles=10, track="exact").estimate(measurements)  # machine code
        rows = []
        for count in FAST_COUNTS if size.reduced else COUNTS:
            for seed in range(1, 1 + (FAST_SEEDS if size.reduced else SEEDS)):
                began = time.process_time()
                series = SuspensionRbpf(particles=count, seed=seed, track="exact").estimate(measurements).series
                speed = scenario.duration / (time.process_time() - began)
                values = {name: series[name].to_numpy()[-1] for name in PARAMETERS}
                spreads = {std_name(name): series[std_name(name)].to_numpy()[-1] for name in PARAMETERS}
                flagged = int(series["degenerate [-]"].to_numpy().sum())
                rows.append(
                    {"particles": count, "seed": seed, "speed [s/s]": speed, "flagged": flagged, **values, **spreads}
                )
        return pd.DataFrame(rows)

    def draw(self, table: Any) -> Picture:
        picture = Picture(figsize=(9.0, 4.0), layout="constrained")
        axes = picture.subplots(1, 2)
        for name, label in zip(PARAMETERS, LABELS, strict=True):
            spread = _spread(table, name)
            axes[0].loglog(spread.index, spread, "o-", lw=1.2, ms=4, label=label)
        counts = np.array(sorted(set(table["particles"])), dtype=float)
        axes[0].loglog(counts, np.sqrt(30.0 / counts), "k--", lw=0.7, label="1 / square root")
        axes[0].set(xlabel="particles", ylabel="spread over seeds / standard deviation [-]", title="accuracy")
        axes[0].legend()
        speed = table.groupby("particles")["speed [s/s]"].median()
        axes[1].loglog(speed.index, speed, "o-", color=RED, ms=4)
        axes[1].axhline(REAL_TIME, color="black", lw=1.0, ls="--", label="target")
        axes[1].legend()
        axes[1].set(xlabel="particles", ylabel="times real time, one core [-]", title="speed at 256 Hz, seven channels")
        for panel in axes:
            panel.minorticks_off()  # their labels stand in each other
            panel.set_xticks(counts, [f"{count:.0f}" for count in counts])
        _ticks(axes[0], (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0))
        _ticks(axes[1], (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0))
        return picture

    def check(self, table: Any) -> list[Claim]:
        used = USED if USED in set(table["particles"]) else int(table["particles"].max())
        speeds = table[table["particles"] == used]["speed [s/s]"].to_numpy()
        spreads = [float(_spread(table, name).loc[used]) for name in PARAMETERS]
        each = intervals.largest([_spread_interval(table, name, used) for name in PARAMETERS])
        text = f"speed of {used} particles at 256 Hz on one core, times real time"
        spread = f"spread of {used} particles over their random numbers, in standard deviations"
        return [
            Claim.definite(text, float(np.median(speeds)), at_least(REAL_TIME), len(speeds)),
            Claim.sampled(spread, max(spreads), at_most(1.0), each),
        ]

    def notes(self) -> list[str]:
        return ["The speed is of processor time and falls while other work runs on the same cores."]


def _ticks(panel: Axes, values: tuple[float, ...]) -> None:
    low, high = panel.get_ylim()
    inside = [value for value in values if low <= value <= high]
    panel.set_yticks(inside, [f"{value:g}" for value in inside])


def _spread(table: Any, name: str) -> Any:
    """Standard deviation over seeds, over the stated one of the most particles."""
    return table.groupby("particles")[name].std() / _stated(table, name)


def _spread_interval(table: Any, name: str, particles: int) -> intervals.Interval:
    values = table.loc[table["particles"] == particles, name].to_numpy() / _stated(table, name)
    return intervals.of_deviation(values)


def _stated(table: Any, name: str) -> float:
    largest = table[table["particles"] == table["particles"].max()]
    return float(largest[std_name(name)].mean())
