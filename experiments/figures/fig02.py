"""Figure 2: 35 m vertical alignment and vertical curvature over 100 m of jointed track."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture
from scipy import ndimage, signal

from estimators.track.alignment_vertical import AlignmentVertical
from estimators.track.dipped_joints import DippedJoints
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_least, at_most, exactly, near
from experiments.reporting.plots import BLACK, BLUE, GREY, RED, legend
from experiments.reporting.size import Size
from experiments.scoring.joints import TrueDip, matched, true_dips
from railsim import measure, simulate
from railsim.scenario import Scenario

SPEED = 15.0  # m/s
SHOWN = (230.0, 330.0)  # m
WHEELBASE = 2.6  # m, class175
PROMINENCE = 5e-4  # m; of a dip in the alignment
CLOSE = 1.0  # m; a dip in the alignment belongs to a joint this near
ENDS = 35.0  # m at the ends of the run that the alignment's filter needs
OFFSET = 0.025  # 1/m; "offset by 25 units" of 1/km (Ward et al. 2011, figure 2)
S = "s [m]"


class Fig02(Figure):
    """Pitch gyro and tachometer alone: joints in the alignment and, a wheelbase long, in the curvature."""

    def compute(self, size: Size) -> pd.DataFrame:
        scenario = Scenario.build(_values(500.0 if size.reduced else 1000.0))
        truth = simulate(scenario, engine="compiled" if size.reduced else "exudyn")
        measured = measure(truth, scenario).measurements
        joints = DippedJoints().estimate(measured)
        plain, sharp = (AlignmentVertical(compensate=x, cut=35.0).estimate(measured).series for x in (False, True))
        distance = np.interp(np.asarray(joints.series["time [s]"]), truth.time, truth[S])
        table: dict[str, Any] = {S: distance}
        for name, series in (("plain", plain), ("sharp", sharp)):
            at = np.interp(np.asarray(series["time [s]"]), truth.time, truth[S])
            table[f"alignment {name} [m]"] = np.interp(distance, at, np.asarray(series["vertical [m]"]))
        table["vertical_curvature [1/m]"] = np.nan_to_num(np.asarray(joints.series["vertical_curvature [1/m]"]))
        rows = pd.DataFrame(table)
        matches = matched(joints, truth)
        fitted = {name: np.asarray(matches[name], dtype=float) for name in ("true s [m]", "angle [rad]")}
        dips = [dip for dip in true_dips(truth) if distance[0] + ENDS < dip.s < distance[-1] - ENDS]
        steps = pd.DataFrame([_steps(rows, dip) for dip in dips])
        steps["angle [rad]"] = [_angle(fitted, dip) for dip in dips]
        return pd.concat([rows, steps], ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 6.4), layout="constrained")
        above, below = picture.subplots(2, sharex=True, height_ratios=(1.3, 1.0))
        rows, steps = _parts(table)
        at = rows[S]
        shown = (at > SHOWN[0]) & (at < SHOWN[1])
        above.plot(at, 1e3 * rows["alignment sharp [m]"], color=BLUE, lw=1.6, label="wheelbase undone")
        above.plot(at, 1e3 * rows["alignment plain [m]"], color=GREY, lw=1.1, label="as in the paper")
        curvature = 1e3 * rows["vertical_curvature [1/m]"]
        below.plot(at, curvature, color=RED, lw=1.1)
        low, high = float(curvature[shown].min()) - 1.2, float(curvature[shown].max()) + 0.4
        for joint, first, last in zip(steps["joint s [m]"], steps["up s [m]"], steps["down s [m]"], strict=True):
            for axes in (above, below):
                axes.axvline(joint, color=BLACK, lw=0.9, ls=":")
            below.plot([first, last], [low + 0.4] * 2, color=BLACK, lw=2.4)
        above.plot([], [], color=BLACK, lw=0.9, ls=":", label="true joints")
        below.plot([], [], color=BLACK, lw=2.4, label="from step to step of the curvature")
        above.set(ylabel="35 m alignment [mm]")
        title = f"Jointed track at {SPEED:g} m/s: bogie pitch gyro (MEMS) and tachometer"
        below.set(xlim=SHOWN, ylim=(low, high), xlabel="distance [m]", ylabel="vertical curvature [1/km]")
        for axes in (above, below):
            legend(axes)
        above.set_title(title, pad=24)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        rows, steps = _parts(table)
        joint = steps["joint s [m]"]
        here = (joint > SHOWN[0]) & (joint < SHOWN[1])
        dips = _dips(rows)
        seen = np.array([np.abs(dips - one).min() < CLOSE for one in joint])
        fitted = np.isfinite(steps["angle [rad]"])
        apart = np.abs(steps["down s [m]"] - steps["up s [m]"] - WHEELBASE)
        slope, square = _line(steps["true angle [rad]"][fitted], steps["angle [rad]"][fitted] / WHEELBASE)
        return [
            _all("share of the joints shown that are dips in the 35 m alignment", seen[here]),
            _all("share of all joints of the run that are dips in the 35 m alignment", seen),
            _all("share of the joints shown that are found in the curvature", fitted[here]),
            _all("share of all joints of the run that are found in the curvature", fitted),
            _within("curvature steps shown: largest deviation from a wheelbase apart", float(apart[here].max())),
            _within("curvature steps of the run: largest deviation from a wheelbase apart", float(apart.max())),
            Claim.definite("step of the fitted curvature over dip angle: r squared", square, at_least(0.95)),
            Claim.definite("its slope times the wheelbase, 1 by geometry", slope * WHEELBASE, near(1.0, 0.1)),
        ]


def _values(length: float) -> dict[str, Any]:
    gyro = {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": ["pitch"], "rate": 256, "errors": "mems"}
    wheel = {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.005}
    return {
        "track": "jointed_60ft",
        "vehicle": "class175",
        "speed": {"kind": "constant", "speed": SPEED},
        "start": 25.0,
        "duration": round(length / SPEED),
        "sensors": [gyro, wheel],
        "seed": 2,
    }


def _steps(rows: pd.DataFrame, dip: TrueDip) -> dict[str, float]:
    """Places (m) where the curvature rises and falls most within 0.6 m of where the wheelsets are at the joint."""
    distance, curvature = np.asarray(rows[S]), np.asarray(rows["vertical_curvature [1/m]"])
    slope = ndimage.gaussian_filter1d(curvature, 1.0, order=1)
    step = {"joint s [m]": dip.s, "true angle [rad]": dip.angle}
    for name, sign in (("up", 1.0), ("down", -1.0)):
        near = np.flatnonzero(np.abs(distance - (dip.s - sign * WHEELBASE / 2)) < 0.6)
        top = int(near[(sign * slope[near]).argmax()])
        low, middle, high = sign * slope[top - 1 : top + 2]
        between = (high - low) / (2 * (2 * middle - low - high))
        step[f"{name} s [m]"] = float(distance[top] + between * (distance[top + 1] - distance[top]))
    return step


def _angle(fitted: dict[str, np.ndarray], dip: TrueDip) -> float:
    """Dip angle that the matched filter gives, rad; NaN where it has not found the joint."""
    return float(fitted["angle [rad]"][np.nanargmin(np.abs(fitted["true s [m]"] - dip.s))])


def _dips(rows: dict[str, np.ndarray]) -> np.ndarray:
    """Places of the dips in the alignment, m."""
    height = np.asarray(rows["alignment sharp [m]"])
    return np.asarray(rows[S])[signal.find_peaks(-height, prominence=PROMINENCE)[0]]


def _parts(table: pd.DataFrame) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Columns of the rows over distance, and those of the joints."""
    columns = {str(name): np.asarray(table[name], dtype=float) for name in table.columns}
    series = np.isfinite(columns[S])
    return {name: values[series] for name, values in columns.items()}, {
        name: values[~series] for name, values in columns.items()
    }


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope of the best line through the origin, and the squared correlation."""
    return float(x @ y / (x @ x)), float(np.corrcoef(x, y)[0, 1] ** 2)


def _all(what: str, held: np.ndarray) -> Claim:
    return Claim.definite(what, float(np.mean(held)), exactly(1.0), cases=held.size)


def _within(what: str, value: float) -> Claim:
    return Claim.definite(what, value, at_most(0.125, "m"))
