"""Figure 18: detected speed at 50 and 100 km/h on a curve of 400 m radius; and while a wheel slides."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_least, at_most, exactly, near
from experiments.reporting.plots import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY
from experiments.reporting.size import Size
from experiments.reporting.style import dots
from experiments.reporting.units import KMH
from experiments.runs.speed import GRADES, error, rows_where, speed_table, truncation

CURVE = (300.0, 720.0)  # m; from the first transition's beginning to the second one's end on curve_r400
SLIDE = 0.2
PAPER = {50: 0.22, 100: 0.65}  # km/h; largest errors, Ward et al. (2011), section 5.2
ROUNDED = 0.005  # km/h; the paper gives two decimals
REFINED = {50: 0.05, 100: 0.15}  # km/h; what the refined variant has to reach
WINDOW = {50: 6.0, 100: 4.0}  # s of the plain variant; "longer time windows" at low speed (section 5.2)
LABELS = {
    "plain": "plain, ideal sensors",
    "refined": "refined, ideal",
    "refined industrial": "refined, industrial MEMS",
    "refined consumer": "refined, consumer MEMS",
}
SLIDING = {
    "100 km/h, wheelset 1 sliding on dry rails": "dry",
    "100 km/h, wheelset 1 sliding on low adhesion": "low",
}
"""By case the adhesion: on dry rails the slide's friction follows the wheel load and pitches the bogie."""
CASES = {50: "50 km/h", 100: "100 km/h"}


class Fig18(Figure):
    """Speed on a low-speed curve, plain (the paper's) and refined, with sensors of three grades."""

    def compute(self, size: Size) -> pd.DataFrame:
        tables, values = [], {}
        for speed, case in CASES.items():
            values: dict[str, Any] = {"track": "curve_r400", "speed": {"kind": "constant", "speed": speed / KMH}}
            values["duration"] = np.floor(930.0 * KMH / speed)
            tables.append(speed_table(case, values, size.reduced, window=WINDOW[speed]))
        values["traction"] = [
            {"wheelset": 1, "time": [0.0, 13.0, 14.0, 24.0, 25.0], "slip": [0.0, 0.0, SLIDE, SLIDE, 0.0]}
        ]
        for case, adhesion in SLIDING.items():
            vehicle = {"name": "class175", "adhesion": adhesion}
            tables.append(speed_table(case, values | {"vehicle": vehicle}, size.reduced, tachometer=True))
        return pd.concat(tables, ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 12.0), layout="constrained")
        panels = picture.subplots(4, 1)
        for axes, (case, rows) in zip(panels, table.groupby("case", sort=False), strict=True):
            _panel(axes, str(case), rows)
        picture.legend(*panels[-1].get_legend_handles_labels(), loc="outside lower center", ncols=3, markerscale=4.0)
        picture.suptitle(
            "Speed from bogie sensors on curve_r400 (radius 400 m, cant 6°), 1 ms sampling, wheelbase 2.6 m"
        )
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for speed, case in CASES.items():
            rows = _on_curve(table, case)
            plain, low, high = error(rows, "plain"), *truncation(speed)
            refined = {grade: _largest(error(rows, f"refined{grade}")) for grade in GRADES}
            inside = float(np.mean((plain >= low - 0.01) & (plain <= high + 0.01)))
            claims += [
                Claim.definite(
                    f"plain, {case}: largest error as in the paper or less",
                    _largest(plain),
                    at_most(PAPER[speed] + ROUNDED, "km/h"),
                ),
                Claim.definite(
                    f"plain, {case}: share of errors within the truncation bounds, {low:.2f} to {high:.2f} km/h",
                    inside,
                    exactly(1.0),
                ),
                *(
                    _refined_claim(f"{case},{grade or ' ideal'} sensors", value, speed)
                    for grade, value in refined.items()
                ),
                Claim.definite(
                    f"refined beats the paper's largest error, {case}: ratio", PAPER[speed] / refined[""], at_least(4.0)
                ),
            ]
        return claims + [claim for case in SLIDING for claim in _sliding_claims(table, case)]


def _sliding_claims(table: pd.DataFrame, case: str) -> list[Claim]:
    rows = _on_curve(table, case)
    slide = rows_where(rows, rows["time [s]"].between(14.5, 23.5))
    tachometer = float(np.median(error(slide, "tachometer") / slide["true [km/h]"]))
    noisy = _largest(error(rows, "refined industrial"))
    return [
        Claim.definite(f"{case}: relative error of its tachometer", tachometer, near(-SLIDE, 0.02)),
        _refined_claim(f"{case}, industrial sensors", noisy, 100),
    ]


def _refined_claim(what: str, largest: float, speed: int) -> Claim:
    return Claim.definite(f"refined, {what}: largest error", largest, at_most(REFINED[speed], "km/h"))


def _on_curve(table: pd.DataFrame, case: str) -> pd.DataFrame:
    return rows_where(table, (table["case"].eq(case)) & table["s [m]"].between(*CURVE))


def _largest(errors: np.ndarray) -> float:
    """Largest size; infinite where a value is missing."""
    return float(np.abs(errors).max()) if np.isfinite(errors).all() else float("inf")


def _panel(axes: Axes, case: str, rows: pd.DataFrame) -> None:
    sliding = case in SLIDING
    time = rows["time [s]"].to_numpy()
    limit = 5.0 if sliding else 1.6 * PAPER[int(case.split()[0])]
    for name, colour, width in (
        ("plain", ORANGE, 0.9),
        ("refined consumer", SKY, 1.0),
        ("refined industrial", GREEN, 1.3),
        ("refined", BLUE, 1.3),
    ):
        shown = error(rows, name)
        if name == "plain":
            dots(axes, time, shown, colour, LABELS[name])
        else:
            axes.plot(time, np.where(np.abs(shown) <= limit, shown, np.nan), color=colour, lw=width, label=LABELS[name])
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
