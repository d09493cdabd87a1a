"""Item 9: braking at 5 % of the weight on dry and on very low adhesion, without wheel-slide protection."""

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from estimators.speed.speed_plain import SpeedPlain
from estimators.speed.speed_refined import SpeedRefined
from experiments.reporting.plots import BLUE, GREY, ORANGE, RED
from experiments.reporting.size import Size
from experiments.scoring.speed import speed_errors
from experiments.validation.interface import Row, Section
from railsim import load_scenario, measure, simulate
from railsim.analysis.statistics import root_mean_square
from railsim.truth import SPEED

CONDITIONS = {"dry": "braking_dry", "very low": "braking_very_low"}
"""Adhesion and the shipped scenario."""

WHEEL = "wheelset1.speed [m/s]"
TACHOMETER, SLIP, CREEPAGE, FORCE = "tachometer [m/s]", "slip [-]", "creepage [-]", "creep force [N]"
ESTIMATORS = {"plain [m/s]": SpeedPlain(), "refined [m/s]": SpeedRefined()}


def braking(fast: bool) -> pd.DataFrame:
    """Both runs over time at the tachometer's rate; NaN where an estimate is not valid.

    Parameters
    ----------
    fast : the compiled engine instead of Exudyn.

    Returns
    -------
    Columns "adhesion", "time [s]", true speed, that of the leading wheelset's tachometer and of both cross-correlation
    estimators, slip (V - r0 omega) / V, longitudinal creepage (mean of both wheels) and creep force of that wheelset.
    """
    tables = []
    for adhesion, name in CONDITIONS.items():
        scenario = load_scenario(name)
        truth = simulate(scenario, engine="compiled" if fast else "exudyn")
        measured = measure(truth, scenario).measurements
        time = measured.time(WHEEL)

        def at(values: np.ndarray, time: np.ndarray = time, true: np.ndarray = truth.time) -> np.ndarray:
            return np.interp(time, true, values)

        speed, radius = at(truth[SPEED]), float(truth.about["vehicle"]["wheel_radius [m]"])
        sides = ("left", "right")
        table = pd.DataFrame({"adhesion": adhesion, "time [s]": time, SPEED: speed, TACHOMETER: measured[WHEEL]})
        table[SLIP] = 1.0 - radius * at(truth["wheelset1.spin [rad/s]"]) / speed
        table[CREEPAGE] = at(np.mean([truth[f"wheel1_{side}.creepage_x [-]"] for side in sides], axis=0))
        table[FORCE] = at(np.sum([truth[f"wheel1_{side}.creep_force_x [N]"] for side in sides], axis=0))
        for column, estimator in ESTIMATORS.items():
            table[column] = speed + np.interp(time, *speed_errors(estimator.estimate(measured), truth))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


class Braking(Section):
    """The tachometer fails with the wheel; the bogie's bounce and pitch do not."""

    item = 9
    title = "Braking on dry and on very low adhesion"
    about = (
        "A Class 175-like half vehicle at 30 m/s, friction brakes of 5 % of its weight from 5 s to 30 s, no "
        "wheel-slide protection. Slip is (V - r0 omega) / V of the leading wheelset; the tachometer's error is "
        "relative to the true speed and compared with the longitudinal creepage in the contact. Both by root "
        "mean square over the run and by the largest value, which for the tachometer on very low adhesion exceeds 1 % "
        "for some samples as the wheel stops and starts again: it waits for its next pulse. The cross-correlation "
        "speed is that of the refined estimator from bogie sensors "
        "(industrial grade); "
        "the plain one knows whole samples of delay only and steps as the speed changes, sliding or not."
    )
    source = "issue 3, item 9; presets of railsim.contact.adhesion"
    size = (11.0, 5.5)

    def compute(self, size: Size) -> pd.DataFrame:
        return braking(size.reduced)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        return braking_rows(self, table)

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        axes = picture.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2.0, 1.0))
        for column, adhesion in enumerate(CONDITIONS):
            part = _part(table, adhesion)
            above, below = axes[0, column], axes[1, column]
            above.plot(part["time [s]"], part[TACHOMETER], color=RED, label="tachometer")
            above.plot(part["time [s]"], part["plain [m/s]"], color=ORANGE, lw=1.0, label="cross-correlation, plain")
            above.plot(part["time [s]"], part["refined [m/s]"], color=BLUE, lw=2.0, label="cross-correlation, refined")
            above.plot(part["time [s]"], part[SPEED], color="black", lw=1.0, ls="--", label="true")
            above.set_title(f"{adhesion} adhesion", fontsize=10)
            below.plot(part["time [s]"], part[SLIP], color=GREY)
            below.set_xlabel("time in s")
        axes[0, 0].set_ylabel("speed in m/s")
        axes[0, 0].legend(loc="lower left", fontsize=8)
        axes[1, 0].set_ylabel("slip of the\nleading wheelset")


def braking_rows(section: Section, table: pd.DataFrame) -> list[Row]:
    """No slide on dry, a slide on very low, and who knows the speed."""
    rows = []
    for adhesion in CONDITIONS:
        part = _part(table, adhesion)
        largest = float(part[SLIP].to_numpy(float).max())
        low, high = (-np.inf, 0.01) if adhesion == "dry" else (0.2, np.inf)
        rows.append(section.bounded(f"{adhesion}: largest slip", largest, low, high))
        apart = _relative(part, TACHOMETER) + part[CREEPAGE].to_numpy(float)
        rows.append(
            section.bounded(f"{adhesion}: tachometer error and slip, rms of the sum", _rms_of_known(apart), high=0.01)
        )
        rows.append(
            section.bounded(
                f"{adhesion}: tachometer error and slip, largest sum", float(np.abs(apart).max()), high=0.01
            )
        )
        error = _relative(part, "refined [m/s]")
        rows.append(section.bounded(f"{adhesion}: cross-correlation speed, rms error", _rms_of_known(error), high=0.01))
        rows.append(
            section.bounded(
                f"{adhesion}: cross-correlation speed, largest error", float(np.nanmax(np.abs(error))), high=0.01
            )
        )
        valid = float(np.isfinite(error).mean())
        rows.append(section.bounded(f"{adhesion}: share of the run with a valid estimate", valid, low=0.9))
        plain = _rms_of_known(_relative(part, "plain [m/s]"))
        rows.append(section.noted(f"{adhesion}: plain cross-correlation, rms error", plain, None, "-"))
    return rows


def _part(table: pd.DataFrame, adhesion: str) -> pd.DataFrame:
    return table.loc[np.asarray(table["adhesion"] == adhesion)]


def _relative(part: pd.DataFrame, column: str) -> np.ndarray:
    """Error over the true speed."""
    return part[column].to_numpy(float) / part[SPEED].to_numpy(float) - 1.0


def _rms_of_known(values: np.ndarray) -> float:
    return root_mean_square(values[np.isfinite(values)])
