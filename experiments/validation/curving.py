"""Item 7: steady curving at R 400 m, time-domain runs against the balance of `railsim.analysis.curving`."""

from typing import Any, cast

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from experiments.reporting.claims import Target
from experiments.reporting.plots import BLUE, ORANGE
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from railsim.analysis.curving import Curve, Curving, steady_curving
from railsim.dynamics.channels import channel_names
from railsim.engines.interface import Run, default_substeps
from railsim.model import Model
from railsim.profiles.pair import ProfilePair
from railsim.simulation import load_engine
from railsim.speed import Constant, speed_tables
from railsim.track import Track
from railsim.track.kernel import build_tables
from railsim.track.synthesis import Segment, Transition, design, distances
from railsim.vehicles.class175 import Class175
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.whole_vehicle import WholeVehicle

RADIUS, CANT = 400.0, 0.1568  # m; as in the shipped curve_r400
BEFORE, TRANSITION = 60.0, 60.0  # m of straight and of clothoid
SETTLE = 20.0  # s in the circle before the last second is read
START = 30.0  # m
RATE = 256.0  # rows a second; the last second is averaged
SPEEDS = (8.0, 14.0, 19.8, 24.0)  # m/s: much cant excess, excess, balance, deficiency
LIMIT = 0.01
PROFILES = ProfilePair(kind="profiles")
VEHICLES: dict[str, HalfVehicle] = {
    "Manchester": Manchester(),
    "Class 175": Class175(),
    "Manchester, S1002 on 60E1": Manchester(pair=PROFILES),
    "Class 175, S1002 on 60E1": Class175(pair=PROFILES),
}


class SteadyCurving(Section):
    """Wheelset places, yaw angles and creep forces."""

    item = 7
    title = "Steady curving against a quasi-static solution"
    about = (
        "Left-hand curve of 400 m with 157 mm of cant, without irregularities. Ours: the last second of a run through "
        "straight, clothoid and 20 s of circle. Reference: free-body diagrams of the half vehicle that turns about the "
        "curve's axis as one body, with finite rotations, its own contact search in the profiles that the contact "
        "functions imply, and Polach's published law, solved by scipy.optimize.root; nothing of the engines' equations "
        "is used. Differences of place and yaw are relative to the larger wheelset's, of a creep force to that "
        "wheel's resultant."
    )
    source = "scipy.optimize.root on free-body diagrams (railsim.analysis.curving)"
    size = (8.0, 4.5)

    def compute(self, size: Size) -> pd.DataFrame:
        return curving_table(size)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        rows = []
        for key, group in table.groupby(["vehicle", "engine", "kind"], sort=False):
            name, engine, kind = cast(tuple[str, str, str], key)
            worst = group.loc[group["difference [-]"].idxmax()]
            used = float(worst["difference [-]"]) / LIMIT
            rows.append(
                Row(
                    self.number,
                    f"{name}, {engine}: {kind}, worst: {worst['quantity']} at {worst['V [m/s]']:g} m/s",
                    float(worst["ours"]),
                    float(worst["reference"]),
                    float(worst["ours"] - worst["reference"]),
                    str(worst["unit"]),
                    Target(words=f"{float(worst['reference']):.6g} ± {100.0 * LIMIT:g} %"),
                    self.source,
                    used,
                    kept=used <= 1.0,
                )
            )
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        draw_curving(table, picture.subplots())


def curving_table(size: Size = Size.FULL) -> pd.DataFrame:
    """One row for each vehicle, speed, engine and quantity: the run's value, the balance's and their difference.

    `difference [-]` of a lateral place or yaw angle is relative to the vehicle's larger one of that kind (a trailing
    wheelset that stands near its middle has no size of its own), that of a creep force is the length of the
    difference of both components over the wheel's creep force.
    """
    cases = [(name, speed, "compiled") for name in VEHICLES for speed in SPEEDS]
    cases += [("Manchester", 14.0, "exudyn"), ("Class 175", 24.0, "exudyn")]
    if size.reduced:
        cases = [("Manchester", 14.0, "compiled"), ("Manchester, S1002 on 60E1", 14.0, "compiled")]
        cases = cases[: size.of(None, 2, 1)]
    solved: dict[tuple[str, float], Curving] = {}
    rows: list[dict[str, Any]] = []
    for name, speed, engine in cases:
        if (name, speed) not in solved:
            solved[name, speed] = steady_curving(VEHICLES[name], Curve(1.0 / RADIUS, CANT, speed))
        simulated = settled(VEHICLES[name], speed, engine)
        about = {"vehicle": name, "V [m/s]": speed, "engine": engine}
        rows += [about | row for row in compared(simulated, solved[name, speed])]
    return pd.DataFrame(rows)


def settled(
    vehicle: HalfVehicle | WholeVehicle,
    speed: float,
    engine: str = "compiled",
    radius: float = RADIUS,
    cant: float = CANT,
) -> dict[str, float]:
    """Means over the last second of a run through straight, clothoid and a long circle without irregularities."""
    return settled_model(vehicle.model(), speed, engine, radius, cant)


def settled_model(model: Model, speed: float, engine: str, radius: float, cant: float) -> dict[str, float]:
    """As `settled`, of a model; an infinite radius [m] is straight track with cant [m]."""
    length = BEFORE + TRANSITION + SETTLE * speed + 60.0
    s = distances(length, 0.2)
    circle = Segment(length - BEFORE - TRANSITION, 1.0 / radius, cant)
    track = Track(s, design([Segment(BEFORE), Transition(TRANSITION), circle], s), "circle")
    duration = SETTLE + (BEFORE + TRANSITION - START) / speed
    tables = speed_tables(Constant(speed=speed), (), len(model.wheelsets), duration)
    substeps = default_substeps(model, tables, RATE)
    run = Run(model, build_tables(track), tables, START, duration, RATE, substeps)
    last = np.concatenate(list(load_engine(engine)(run)))[-round(RATE) :]
    return dict(zip(channel_names(model), last.mean(axis=0).tolist(), strict=True))


def compared(simulated: dict[str, float], solved: Curving) -> list[dict[str, Any]]:
    """Rows of the table of one run."""
    rows = []
    for axis, unit in (("y", "m"), ("yaw", "rad")):
        names = [name for name in solved.values if name.startswith("wheelset") and name.endswith(f".{axis}")]
        pairs = [(simulated[f"{name} [{unit}]"], solved.values[name]) for name in names]
        size = max(abs(reference) for _, reference in pairs)
        for i, (ours, reference) in enumerate(pairs, 1):
            difference = abs(ours - reference) / size
            kind = "lateral position" if axis == "y" else "yaw"
            rows.append(_row(kind, f"wheelset {i} {kind}", ours, reference, difference, unit))
    for name, wheel in solved.wheels.items():
        force = np.array([simulated[f"{name}.creep_force_{axis} [N]"] for axis in "xy"])
        reference = np.array([wheel.creep_force_x, wheel.creep_force_y])
        size = float(np.hypot(*reference))
        difference = float(np.hypot(*(force - reference))) / size
        what = f"{name.replace('_', ' ')} creep force"
        rows.append(_row("creep force", what, float(np.hypot(*force)), size, difference, "N"))
    return rows


def _row(kind: str, what: str, ours: float, reference: float, difference: float, unit: str) -> dict[str, Any]:
    return {
        "kind": kind,
        "quantity": what,
        "ours": ours,
        "reference": reference,
        "unit": unit,
        "difference [-]": difference,
    }


def draw_curving(table: pd.DataFrame, axes: Axes) -> None:
    """Largest difference of each quantity, one mark for each case, over the limit."""
    names = list(table["quantity"].unique())
    for vehicles, colour, offset, label in (
        (table["vehicle"].str.contains("S1002"), ORANGE, 0.15, "S1002 on 60E1"),
        (~table["vehicle"].str.contains("S1002"), BLUE, -0.15, "analytic profiles"),
    ):
        part = table[vehicles]
        places = [names.index(name) + offset for name in part["quantity"]]
        axes.plot(100.0 * part["difference [-]"], places, "o", color=colour, markersize=4, alpha=0.7, label=label)
    axes.axvline(100.0 * LIMIT, color="black", linewidth=0.8, linestyle="--", label="1 %")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlim(left=0.0)
    axes.set_xlabel("difference of run and balance [%]")
    axes.set_title("Steady curving, R 400 m, cant 157 mm, 8 to 24 m/s", fontsize="medium")
    axes.legend(fontsize="small")
