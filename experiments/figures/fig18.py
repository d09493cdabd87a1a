"""Figure 18: detected speed at 50 and 100 km/h on a curve of 400 m radius; and while a wheel slides."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from experiments.figures._speed_runs import error, rows_where, speed_table, truncation
from experiments.figures.interface import Claim, Figure
from experiments.plots import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE
from experiments.score import KMH

CURVE = (300.0, 720.0)  # m; from the first transition's beginning to the second one's end on curve_r400
SLIDE = 0.2
PAPER = {50: 0.22, 100: 0.65}  # km/h; largest errors, Ward et al. (2011), section 5.2
REFINED = {50: 0.05, 100: 0.15}  # km/h; what the refined variant has to reach
WINDOW = {50: 6.0, 100: 4.0}  # s of the plain variant; "longer time windows" at low speed (section 5.2)
SLIDING = "100 km/h, wheelset 1 sliding"
CASES = {50: "50 km/h", 100: "100 km/h"}


class Fig18(Figure):
    """Speed on a low-speed curve, plain (the paper's) and refined, with ideal and MEMS sensors."""

    def compute(self, fast: bool) -> pd.DataFrame:
        tables, values = [], {}
        for speed, case in CASES.items():
            values: dict[str, Any] = {"track": "curve_r400", "speed": {"kind": "constant", "speed": speed / KMH}}
            values["duration"] = np.floor(930.0 * KMH / speed)
            tables.append(speed_table(case, values, fast, window=WINDOW[speed]))
        values["traction"] = [
            {"wheelset": 1, "time": [0.0, 13.0, 14.0, 24.0, 25.0], "slip": [0.0, 0.0, SLIDE, SLIDE, 0.0]}
        ]
        tables.append(speed_table(SLIDING, values, fast, tachometer=True))
        return pd.concat(tables, ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 10.5), layout="constrained")
        for axes, (case, rows) in zip(picture.subplots(3, 1), table.groupby("case", sort=False), strict=True):
            _panel(axes, str(case), rows)
        picture.suptitle(
            "Speed from bogie sensors on curve_r400 (radius 400 m, cant 6°), 1 ms sampling, wheelbase 2.6 m"
        )
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for speed, case in CASES.items():
            rows = _on_curve(table, case)
            plain, low, high = error(rows, "plain"), *truncation(speed)
            largest = _largest(plain)
            refined, noisy = _largest(error(rows, "refined")), _largest(error(rows, "refined noisy"))
            inside = float(np.mean((plain >= low - 0.01) & (plain <= high + 0.01)))
            claims += [
                Claim(
                    f"plain, {case}: largest error as in the paper or less",
                    largest,
                    f"<= {PAPER[speed]} km/h",
                    largest <= PAPER[speed] + 0.005,
                ),
                Claim(
                    f"plain, {case}: share of errors within the truncation bounds",
                    inside,
                    f"1 in [{low:.2f}, {high:.2f}] km/h",
                    inside == 1.0,
                ),
                Claim(
                    f"refined, {case}: largest error", refined, f"<= {REFINED[speed]} km/h", refined <= REFINED[speed]
                ),
                Claim(
                    f"refined, {case}, MEMS sensors: largest error",
                    noisy,
                    f"<= {REFINED[speed]} km/h",
                    noisy <= REFINED[speed],
                ),
                Claim(
                    f"refined beats plain, {case}: ratio of largest errors",
                    largest / refined,
                    ">= 2",
                    largest >= 2.0 * refined,
                ),
            ]
        return claims + _sliding_claims(table)


def _sliding_claims(table: pd.DataFrame) -> list[Claim]:
    rows = _on_curve(table, SLIDING)
    slide = rows_where(rows, rows["time [s]"].between(14.5, 23.5))
    tachometer = float(np.median(error(slide, "tachometer") / slide["true [km/h]"]))
    noisy = _largest(error(rows, "refined noisy"))
    return [
        Claim(
            "tachometer of the sliding wheelset: relative error",
            tachometer,
            f"-{SLIDE:g} within 0.02",
            abs(tachometer + SLIDE) < 0.02,
        ),
        Claim(
            f"refined, {SLIDING}, MEMS sensors: largest error", noisy, f"<= {REFINED[100]} km/h", noisy <= REFINED[100]
        ),
    ]


def _on_curve(table: pd.DataFrame, case: str) -> pd.DataFrame:
    return rows_where(table, (table["case"].eq(case)) & table["s [m]"].between(*CURVE))


def _largest(errors: np.ndarray) -> float:
    """Largest size; infinite where a value is missing."""
    return float(np.abs(errors).max()) if np.isfinite(errors).all() else float("inf")


def _panel(axes: Axes, case: str, rows: pd.DataFrame) -> None:
    sliding = case == SLIDING
    time = rows["time [s]"].to_numpy()
    limit = 1.2 if sliding else 1.6 * PAPER[int(case.split()[0])]
    for name, colour, width in (("plain", ORANGE, 0.9), ("refined noisy", GREEN, 1.3), ("refined", BLUE, 1.3)):
        label = {"plain": "plain, ideal sensors", "refined": "refined, ideal sensors"}.get(
            name, "refined, MEMS sensors"
        )
        axes.plot(time, error(rows, name), color=colour, lw=width, label=label)
    axes.axhline(0.0, color=BLACK, lw=0.8)
    on = time[rows["s [m]"].between(*CURVE)]
    axes.axvspan(on[0], on[-1], color=GREY, alpha=0.12, lw=0, label="transitions and curve")
    if sliding:
        axes.axvspan(14.0, 24.0, color=PURPLE, alpha=0.2, lw=0, label="tachometer 20 % (20 km/h) too low")
    else:
        for bound in truncation(float(case.split()[0])):
            axes.axhline(bound, color=ORANGE, lw=0.8, ls=":")
    axes.set_ylim(-limit, limit)
    axes.set_xlim(0.0, time[-1])
    axes.set_title(case, loc="left")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("speed error [km/h]")
    axes.legend(loc="upper left", ncols=5, fontsize=8, framealpha=0.9)
