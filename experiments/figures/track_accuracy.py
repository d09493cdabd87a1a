"""Accuracy of every track estimator by band and speed, beside the bound of information (section 3 of the paper).

On vehicles that are not quite as their papers say, the standard deviations of the fused estimate are checked too.
"""

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from experiments.figures.accuracy_claims import (
    JUDGED,
    accuracy_claims,
    cases,
    honesty_claims,
    pick,
    share,
    where,
)
from experiments.figures.parted import PartedFigure, Parts, table_of
from experiments.reporting.claims import HONEST, Claim
from experiments.reporting.plots import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY
from experiments.reporting.size import Size
from experiments.runs.track_accuracy import (
    ACCELEROMETER,
    AXLEBOXES,
    DISPLACEMENT,
    FUSED,
    GYRO,
    LEVEL,
    PLACED,
    PLAIN,
    WITH_AXLEBOXES,
    accuracy_tasks,
    coverage_tasks,
)

STYLES = {
    FUSED: (BLUE, "o-"),
    WITH_AXLEBOXES: (SKY, "o-"),
    "alignment_vertical": (GREEN, "s--"),
    GYRO: (GREEN, "s-"),
    ACCELEROMETER: (RED, "^-"),
    DISPLACEMENT: (PURPLE, "v-"),
    AXLEBOXES: (ORANGE, "D-"),
    PLAIN: (RED, "P--"),
    "alignment_lateral": (ORANGE, "P-"),
    "cross_level": (ORANGE, "X--"),
    LEVEL: (RED, "X-"),
}
"""Colour and line of each estimator."""
SHOWN = (
    (("vertical", "d1"), ("vertical", "d2")),
    (("cross_level", "d1"), ("cross_level", "d2")),
    (("lateral", "d1"), ("left_vertical", "d1")),
)
"""Quantities and bands of the panels, by rows."""


class TrackAccuracy(PartedFigure):
    """Errors by band, estimator, speed and grade of sensors; share of points within two standard deviations."""

    def parts(self, size: Size) -> Parts:
        """Errors by speed; coverage by track, speed and engine."""
        return {name: table_of(task) for name, task in (accuracy_tasks(size) | coverage_tasks(size)).items()}

    def draw(self, table: pd.DataFrame) -> Picture:
        """Rows of two panels, each row with the legend of what it shows."""
        picture = Picture(figsize=(10.0, 16.0), layout="constrained")
        found: Any = picture.subfigures(len(SHOWN) + 1, 1)
        *rows, last = found
        for row, shown in zip(rows, SHOWN, strict=True):
            panels = row.subplots(1, 2)
            entries: dict[str, Any] = {}
            for axes, (quantity, band) in zip(panels, shown, strict=True):
                _errors(axes, pick(table, part="accuracy", quantity=quantity, band=band, grade="mems"))
                axes.set_title(f"{quantity.replace('_', ' ')} {band.upper()}")
                entries |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
            row.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=3)
        place, vehicles = last.subplots(1, 2)
        _over_position(place, pick(table, part="place", band="d1"))
        _honesty(vehicles, pick(table, part="coverage"))
        picture.suptitle(
            "Track geometry on straight_erri_low, Manchester vehicle, consumer MEMS on the bogie: error against truth"
        )
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        return [*accuracy_claims(table), *honesty_claims(table)]


def _errors(axes: Axes, rows: pd.DataFrame) -> None:
    for name, (colour, line) in STYLES.items():
        rows_of_estimator = pick(rows, estimator=name).sort_values("speed [m/s]")
        if not rows_of_estimator.empty:
            width = 2.0 if name == FUSED else 1.0
            axes.loglog(
                rows_of_estimator["speed [m/s]"],
                rows_of_estimator["rms error [mm]"],
                line,
                color=colour,
                ms=4,
                lw=width,
                label=name,
            )
    fused = pick(rows, estimator=FUSED).sort_values("speed [m/s]")
    axes.loglog(fused["speed [m/s]"], fused["bound [mm]"], ":", color=BLACK, label="Cramér–Rao bound of track_smoother")
    if not pick(rows, estimator=AXLEBOXES).empty:
        rows_of_estimator = pick(rows, estimator=AXLEBOXES).sort_values("speed [m/s]")
        axes.loglog(
            rows_of_estimator["speed [m/s]"],
            rows_of_estimator["bound [mm]"],
            ":",
            color=ORANGE,
            label="Cramér–Rao bound of axleboxes",
        )
    axes.loglog(fused["speed [m/s]"], fused["true rms [mm]"], "--", color=GREY, lw=1.0, label="true irregularity")
    _ticks(axes, rows)
    axes.set_ylabel("rms [mm]")


def _ticks(axes: Axes, rows: pd.DataFrame) -> None:
    """Speeds along the axis, plain millimetres up it."""
    speeds = sorted(set(rows["speed [m/s]"]))
    axes.set_xticks(speeds, [f"{speed:g}" for speed in speeds])
    low, high = axes.get_ylim()
    ticks = [tick for tick in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel("speed [m/s]")


def _over_position(axes: Axes, rows: pd.DataFrame) -> None:
    """Error over the place of the sensor on the bogie."""
    for name in (ACCELEROMETER, GYRO):
        one = pick(rows, estimator=name).groupby("place [m]")["rms error [mm]"]
        mean = one.apply(lambda values: float((values**2).mean() ** 0.5))
        colour, line = STYLES[name]
        axes.plot(mean.index, mean, line, color=colour, ms=4, label=name)
    axes.set(ylim=(0.0, None), xlabel="place before the bogie's centre [m]", ylabel="rms error [mm]")
    axes.set_title(f"vertical D1 at {PLACED:g} m/s by place")
    axes.legend()


def _honesty(axes: Axes, rows: pd.DataFrame) -> None:
    rows = where(rows, rows["band"].isin(["d1", "d2"]) & rows["quantity"].isin(JUDGED) & rows["engine"].ne("exudyn"))
    labels, named = [], set()
    for column, (track, speed, case) in enumerate(cases(rows)):
        for number, (quantity, colour) in enumerate(zip(JUDGED, (BLUE, ORANGE, GREEN), strict=True)):
            for band, marker in (("d1", "o"), ("d2", "s")):
                selected = pick(case, quantity=quantity, band=band)
                if not selected.empty:
                    label = f"{quantity.replace('_', ' ')} {band.upper()}"
                    at = column + 0.2 * (number - 1)
                    axes.plot(
                        at,
                        share(selected),
                        marker,
                        color=colour,
                        ms=4,
                        alpha=0.8,
                        label=None if label in named else label,
                    )
                    named.add(label)
        labels.append(f"{str(track).removeprefix('unseen_')}, {speed:g}")
    axes.axhspan(HONEST.low, HONEST.high, color=GREY, alpha=0.25, lw=0)
    axes.set_xticks(range(len(labels)), labels, rotation=50, ha="right", rotation_mode="anchor", fontsize=8.5)
    axes.set_ylim(0.5, 1.01)
    axes.set_ylabel("within two standard deviations [-]")
    axes.set_title("vehicles off nominal, by track and speed in m/s")
    axes.legend(loc="lower left", ncols=2, fontsize=8.5)
