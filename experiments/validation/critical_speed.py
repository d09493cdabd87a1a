"""Item 8: critical speeds over conicity: eigenvalues, smallest motions, limit cycles of wheelset and half vehicle."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from experiments.reporting.plots import BLACK, BLUE, ORANGE
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from railsim.analysis.hunting import Hunting, hunting
from railsim.contact.pairs import WheelRailPair
from railsim.speed import FASTEST
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.wheelset import WheelsetVehicle

CONICITIES = (0.05, 0.075, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)
FEW = (0.1, 0.4)
VEHICLES: dict[str, type[WheelsetVehicle] | type[Manchester]] = {
    "wheelset": WheelsetVehicle,
    "Manchester half vehicle": Manchester,
}
KINDS = ("matrices", "small_motion", "nonlinear")
TOLERANCE = 0.01  # relative, of a limit cycle's end over the growth of the smallest motions
CLEARANCE = WheelRailPair().flange_clearance  # m
COMPLIANCE = WheelRailPair().flange_width  # m; half width of the step to the flange
LEAST_SHARE = 0.7  # of the clearance: the cycle goes from flange to flange
NONE = np.nan


class CriticalSpeed(Section):
    """Linear and nonlinear, wheelset and half vehicle."""

    item = 8
    title = "Critical speed over conicity"
    about = (
        "Linear twice: where an eigenvalue of the linearised equations crosses the axis, and where runs of 0.01 mm "
        "begin to grow (Polach's slope at vanishing creepage lies between C11 and C22, by direction, so that the two "
        "differ). Nonlinear: a limit cycle is started above, and the speed falls at 0.5 and near the end at 0.1 m/s2 "
        "until less than 0.5 mm is left. The cycle may outlive the smallest motions' critical speed downwards "
        "(subcritical) but not end above it. No value: none below 120 m/s."
    )
    source = "theory of Hopf bifurcations (Knothe and Stichel 2017, chapter 11); flange clearance of the pair"
    size = (11.0, 4.8)

    def compute(self, size: Size) -> pd.DataFrame:
        return critical_speed_table(size)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        rows = []
        for key, group in table.groupby(["vehicle", "conicity [-]"], sort=False):
            name, conicity = cast(tuple[str, float], key)
            speeds = dict(zip(group["kind"].tolist(), group["V [m/s]"].tolist(), strict=True))
            matrices, small, nonlinear = (float(speeds[kind]) for kind in KINDS)
            if np.isnan(small) or np.isnan(nonlinear):
                continue
            case = f"{name}, conicity {conicity:g}"
            rows.append(self.noted(f"{case}: smallest motions, beside the eigenvalues", small, matrices, "m/s"))
            rows.append(
                self.bounded(f"{case}: end of the limit cycle over that", nonlinear / small, high=1.0 + TOLERANCE)
            )
            largest = 1e3 * float(np.nanmax(group["amplitude [m]"].to_numpy()))
            low, high = 1e3 * LEAST_SHARE * CLEARANCE, 1e3 * (CLEARANCE + COMPLIANCE)
            rows.append(self.bounded(f"{case}: amplitude of the limit cycle", largest, low, high, "mm"))
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        draw_critical_speed(table, picture.subplots(1, 2))


def critical_speed_table(size: Size = Size.FULL) -> pd.DataFrame:
    """Rows of (vehicle, conicity, kind of row, V, amplitude): critical speeds of three kinds, and the coarse ramps.

    `kind` "matrices": eigenvalues of the linearised equations; "small_motion": growth of runs of 0.01 mm; "nonlinear":
    end of the limit cycle; "ramp": amplitude [m] of the leading wheelset over the falling speed. A critical speed is
    NaN where there is none below 120 m/s.
    """
    rows: list[dict[str, Any]] = []
    for name, vehicle in VEHICLES.items():
        for conicity in size.of(CONICITIES, FEW, FEW[:1]):
            made: Vehicle = vehicle(pair=WheelRailPair(conicity=conicity))
            rows += [{"vehicle": name, "conicity [-]": conicity} | row for row in _rows(hunting(made.model()))]
    return pd.DataFrame(rows)


def _rows(solved: Hunting) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for kind in KINDS:
        speed = getattr(solved, kind)
        rows.append({"kind": kind, "V [m/s]": NONE if speed is None else speed, "amplitude [m]": NONE})
    if solved.ramp is not None:
        for speed, amplitude in zip(solved.ramp.speed, solved.ramp.amplitude, strict=True):
            rows.append({"kind": "ramp", "V [m/s]": float(speed), "amplitude [m]": float(amplitude)})
    return rows


def draw_critical_speed(table: pd.DataFrame, axes_list: Sequence[Axes]) -> None:
    """Two panels: critical speeds over conicity, and amplitude over speed of the half vehicle's ramps."""
    over, cycle = axes_list[0], axes_list[1]
    labels = {
        "matrices": ("eigenvalues (slopes of the pure directions)", "--", "none"),
        "small_motion": ("growth of the smallest motions", "-", "o"),
        "nonlinear": ("end of the limit cycle, falling speed", ":", "s"),
    }
    for (name, group), colour in zip(table.groupby("vehicle", sort=False), (ORANGE, BLUE), strict=True):
        for kind, (label, line, marker) in labels.items():
            part = group[group["kind"] == kind]
            over.plot(
                part["conicity [-]"], part["V [m/s]"], line, marker=marker, markersize=4, color=colour,
                label=f"{name}: {label}",
            )  # fmt: skip
    over.set_xlim(left=0.0)
    over.set_ylim(0.0, FASTEST)
    over.set_xlabel("conicity [-]")
    over.set_ylabel("critical speed [m/s]")
    over.legend(fontsize="x-small", loc="lower left")
    last = table[(table["vehicle"] == table["vehicle"].iloc[-1]) & (table["kind"] == "ramp")]
    values = sorted(set(last["conicity [-]"].tolist()))
    for number, conicity in enumerate(values):
        part = last[last["conicity [-]"] == conicity]
        shade = 0.75 * (1.0 - number / max(len(values) - 1, 1))
        cycle.plot(part["V [m/s]"], 1e3 * part["amplitude [m]"], color=str(shade), label=f"conicity {conicity:g}")
    cycle.axhline(1e3 * CLEARANCE, color=BLACK, linewidth=0.8, linestyle="--")
    cycle.annotate("flange clearance", (0.01, 1e3 * CLEARANCE + 0.1), xycoords=("axes fraction", "data"), fontsize=8)
    cycle.set_ylim(0.0, 1.2e3 * CLEARANCE)
    cycle.set_xlabel("speed, falling at 0.5 m/s² [m/s]")
    cycle.set_ylabel("amplitude of wheelset 1 [mm]")
    cycle.set_title(str(table["vehicle"].iloc[-1]), fontsize="medium")
    cycle.legend(fontsize="x-small")
