"""Item 7b: steady curving of whole vehicles at R 300, 400 and 800 m, runs against the balance of their forces."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from experiments.reporting.claims import Target
from experiments.reporting.plots import BLUE, ORANGE, RED, SKY
from experiments.reporting.size import Size
from experiments.validation.curving import LIMIT, compared, settled
from experiments.validation.interface import Row, Section
from railsim.analysis.curving import Curve, Curving, steady_curving
from railsim.contact.pairs import WheelRailPair
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.whole_vehicle import WholeVehicle

VEHICLES: dict[str, WholeVehicle] = {
    "Manchester, whole": ManchesterWhole(),
    "Class 175, whole": Class175Whole(),
    "Manchester, whole, wheels turn on rails": ManchesterWhole(pair=WheelRailPair(upright_rails=1.0)),
    "Class 175, whole, wheels turn on rails": Class175Whole(pair=WheelRailPair(upright_rails=1.0)),
}

COLOURS, OFFSETS = (BLUE, ORANGE, SKY, RED), (-0.3, -0.1, 0.1, 0.3)


@dataclass(frozen=True)
class Circle:
    """Radius [m], cant [m] and speed [m/s]."""

    radius: float
    cant: float
    speed: float


CIRCLES = (
    Circle(300.0, 0.15, 14.0),
    Circle(300.0, 0.15, 19.0),
    Circle(400.0, 0.15, 16.0),
    Circle(400.0, 0.15, 22.0),
    Circle(800.0, 0.1, 20.0),
    Circle(800.0, 0.1, 27.0),
)  # each radius with cant excess and with cant deficiency
CASES = [(name, circle, "compiled") for name in VEHICLES for circle in CIRCLES]
CASES += [(name, CIRCLES[0], "exudyn") for name in list(VEHICLES)[:2]]


class WholeCurving(Section):
    """Places and angles of four wheelsets, creep forces of eight wheels, roll and yaw of the body."""

    item = 7
    part = "b"
    title = "Steady curving of whole vehicles"
    about = (
        "As section 7, for whole vehicles: bogies and wheelsets are free along the track, and the body turns in yaw. "
        "Differences of place and yaw are relative to the largest wheelset's, of a creep force to that wheel's "
        "resultant, of the body's roll to itself, and of its yaw to the larger of it and the largest wheelset's yaw. "
        "Creep forces are listed once more over the largest wheel's, because a trailing wheel that nearly rolls "
        "freely has a small resultant: what is left over from the leading wheelset stands beside it as a large share. "
        "The balance tilts each wheel on its rail; ours does so with `upright_rails`."
    )
    source = "scipy.optimize.root on free-body diagrams (railsim.analysis.curving)"
    size = (9.0, 6.5)

    def compute(self, size: Size) -> pd.DataFrame:
        cases = CASES if size is Size.FULL else CASES[:1]
        solved: dict[tuple[str, Circle], Curving] = {}
        rows: list[dict[str, Any]] = []
        for name, circle, engine in cases:
            if (name, circle) not in solved:
                curve = Curve(1.0 / circle.radius, circle.cant, circle.speed)
                solved[name, circle] = steady_curving(VEHICLES[name], curve)
            simulated = settled(VEHICLES[name], circle.speed, engine, circle.radius, circle.cant)
            about = {"vehicle": name, "R [m]": circle.radius, "V [m/s]": circle.speed, "engine": engine}
            rows += [about | row for row in whole_compared(simulated, solved[name, circle])]
        return pd.DataFrame(rows)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        rows = []
        for key, group in table.groupby(["vehicle", "engine", "R [m]", "kind"], sort=False):
            name, engine, radius, kind = cast(tuple[str, str, float, str], key)
            worst = group.loc[group["difference [-]"].idxmax()]
            ours, reference = float(worst["ours"]), float(worst["reference"])
            used = float(worst["difference [-]"]) / LIMIT
            what = f"{name}, {engine}, R {radius:g} m: {kind}, worst: {worst['quantity']} at {worst['V [m/s]']:g} m/s"
            target = Target(words=f"{reference:.6g} ± {100.0 * LIMIT:g} % of {worst['over']}")
            rows.append(
                Row(
                    self.number, what, ours, reference, ours - reference, str(worst["unit"]), target, self.source, used,
                    kept=used <= 1.0,
                )
            )  # fmt: skip
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        axes = picture.subplots()
        names = list(table["quantity"].unique())
        for vehicle, colour, offset in zip(VEHICLES, COLOURS, OFFSETS, strict=True):
            part = table[table["vehicle"] == vehicle]
            if part.empty:
                continue
            places = [names.index(name) + offset for name in part["quantity"]]
            axes.plot(100.0 * part["difference [-]"], places, "o", color=colour, markersize=4, alpha=0.7, label=vehicle)
        axes.axvline(100.0 * LIMIT, color="black", linewidth=0.8, linestyle="--", label="1 %")
        axes.set_yticks(range(len(names)), names)
        axes.tick_params(axis="y", labelsize="small")
        axes.invert_yaxis()
        axes.set_xscale("symlog", linthresh=0.1, linscale=0.5)
        axes.set_xlim(left=0.0)
        axes.set_xticks([0.0, 0.1, 0.3, 1.0, 3.0, 10.0], ["0", "0.1", "0.3", "1", "3", "10"])
        axes.set_xlabel("difference of run and balance [%]")
        radii = ", ".join(f"{radius:g}" for radius in sorted(table["R [m]"].unique()))
        axes.set_title(f"Steady curving of whole vehicles, R {radii} m", fontsize="medium")
        axes.legend(fontsize="small")


def whole_compared(simulated: dict[str, float], solved: Curving) -> list[dict[str, Any]]:
    """Rows of the table of one run: those of `compared`, creep forces over the largest one, and the body's angles."""
    rows: list[dict[str, Any]] = [
        row | {"over": "its resultant" if row["unit"] == "N" else "the largest"} for row in compared(simulated, solved)
    ]
    largest = max(float(np.hypot(wheel.creep_force_x, wheel.creep_force_y)) for wheel in solved.wheels.values())
    for row in [row for row in rows if row["unit"] == "N"]:
        difference = row["difference [-]"] * row["reference"] / largest
        names = {"kind": "creep force over the largest", "quantity": f"{row['quantity']} / largest"}
        rows.append(row | names | {"difference [-]": difference, "over": "the largest"})
    yaw = max(abs(value) for name, value in solved.values.items() if name.endswith(".yaw"))
    for axis, size, over in (("roll", abs(solved.values["body.roll"]), "itself"), ("yaw", yaw, "the largest yaw")):
        ours, reference = simulated[f"body.{axis} [rad]"], solved.values[f"body.{axis}"]
        rows.append(
            {
                "kind": f"body's {axis}",
                "quantity": f"body {axis}",
                "ours": ours,
                "reference": reference,
                "unit": "rad",
                "difference [-]": abs(ours - reference) / size,
                "over": over,
            }
        )
    return rows
