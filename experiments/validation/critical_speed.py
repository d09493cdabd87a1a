"""Critical speeds over conicity: eigenvalues, smallest motions and limit cycles of wheelset and half vehicle."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from experiments.plots import BLACK, BLUE, ORANGE
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
COMPLIANCE = 0.5e-3  # m; the flange's smooth step begins this much before it, and yields no more beyond
NONE = np.nan


def critical_speed_table(fast: bool = False) -> pd.DataFrame:
    """Rows of (vehicle, conicity, kind of row, V, amplitude): critical speeds of three kinds, and the coarse ramps.

    `kind` "matrices": eigenvalues of the linearised equations; "small_motion": growth of runs of 0.01 mm; "nonlinear":
    end of the limit cycle; "ramp": amplitude [m] of the leading wheelset over the falling speed. A critical speed is
    NaN where there is none below 120 m/s.
    """
    rows: list[dict[str, Any]] = []
    for name, vehicle in VEHICLES.items():
        for conicity in FEW if fast else CONICITIES:
            made: Vehicle = vehicle(pair=WheelRailPair(conicity=conicity))
            rows += [{"vehicle": name, "conicity [-]": conicity} | row for row in _rows(hunting(made.model()))]
    return pd.DataFrame(rows)


def _rows(found: Hunting) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for kind in KINDS:
        speed = getattr(found, kind)
        rows.append({"kind": kind, "V [m/s]": NONE if speed is None else speed, "amplitude [m]": NONE})
    if found.ramp is not None:
        for speed, amplitude in zip(found.ramp.speed, found.ramp.amplitude, strict=True):
            rows.append({"kind": "ramp", "V [m/s]": float(speed), "amplitude [m]": float(amplitude)})
    return rows


def critical_speed_rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    """For each vehicle and conicity: the cycle ends at or below the linear critical speed; its amplitude fits."""
    rows = []
    for (name, conicity), group in table.groupby(["vehicle", "conicity [-]"], sort=False):
        speeds = group.set_index("kind")["V [m/s]"]
        small, nonlinear = float(speeds["small_motion"]), float(speeds["nonlinear"])
        if np.isnan(small) or np.isnan(nonlinear):
            continue
        case = f"{name}, conicity {conicity:g}"
        excess = nonlinear / small - 1.0
        rows.append(
            _row(
                f"{case}: end of the limit cycle, not above the growth of the smallest motions",
                nonlinear,
                small,
                excess,
                TOLERANCE,
                "m/s",
                excess <= TOLERANCE,
                "growth rates of runs of 0.01 mm",
            )  # fmt: skip
        )
        largest = float(group["amplitude [m]"].max())
        off = abs(largest - CLEARANCE)
        rows.append(
            _row(
                f"{case}: amplitude of the limit cycle at the highest speed, by the flange clearance",
                largest,
                CLEARANCE,
                off,
                2.0 * COMPLIANCE + 0.5e-3,
                "m",
                largest <= CLEARANCE + COMPLIANCE and largest > 0.7 * CLEARANCE,
                "flange clearance of the pair",
            )  # fmt: skip
        )
    return rows


def _row(
    what: str, ours: float, reference: float, difference: float, limit: float, unit: str, held: bool, source: str
) -> dict[str, Any]:
    return {
        "item": "8",
        "what": what,
        "ours": ours,
        "reference": reference,
        "difference": difference,
        "limit": limit,
        "unit": unit,
        "held": bool(held),
        "source": source,
    }


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
    values = sorted(last["conicity [-]"].unique())
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
