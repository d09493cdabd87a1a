"""Figure 16: the estimates of figure 15 with 2 mm of gauge variation, and why they do not converge."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from estimators.wheel_rail.section_rls import Signals, known_parts, regress
from experiments.figures.fig15 import NAMES, draw, sections, whole, worst
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, above, at_most, between
from experiments.reporting.plots import SKY
from experiments.reporting.size import Size
from experiments.runs.rolling_radii import FEWEST, WIDTH, contact, run
from experiments.runs.speed import rows_where
from railsim.wheelset.parameters import Coefficients

SEED, DURATION, FAST_DURATION = 15, 120.0, 40.0
UNKNOWN, REGRESSOR, STEADY = "gauge not in the regression", "known gauge in the regression", "no gauge variation"
CASES = {STEADY: (False, False), UNKNOWN: (True, False), REGRESSOR: (True, True)}
SQUARES = "known gauge: sections of shift and gauge"
SIDE = 2e-4  # m of shift and of gauge of such a section
AT_ONE_SHIFT = 5  # sections of one shift that its spread needs


class Fig16(Figure):
    """Local parabolas; gauge constant, varying and left out, varying and known."""

    def compute(self, size: Size) -> pd.DataFrame:
        wheels = contact()
        tables = []
        for name, (varies, used) in CASES.items():
            signals, known = run(wheels, SEED, varies, FAST_DURATION if size.reduced else DURATION)
            one = sections(signals, known, wheels, 2, used)
            tables.append(one.assign(case=name, **conditioning(signals, known, used)))
        signals, known = run(wheels, SEED, True, FAST_DURATION if size.reduced else DURATION)
        squares = sections(signals, known, wheels, 1, True, SIDE, SIDE)
        return pd.concat([*tables, squares.assign(case=SQUARES)], ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        squares = rows_where(table, table["case"] == SQUARES)
        rest = rows_where(table, table["case"] != SQUARES)
        picture = draw(rest, "Recursive least squares with 2 mm of gauge variation", (UNKNOWN, REGRESSOR, STEADY))
        for axes, name in zip(picture.axes, NAMES, strict=True):
            inside = (1e3 * squares[name]).between(*axes.get_ylim())
            shown = squares.loc[inside]
            axes.plot(1e3 * shown["shift [m]"], 1e3 * shown[name], ".", color=SKY, ms=2, zorder=0, label=SQUARES)
        picture.axes[1].legend(handles=picture.axes[1].lines[-1:], markerscale=4, loc="upper left")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        by_case = {name: rows_where(table, table["case"] == name) for name in CASES}
        radii = {name: typical(rows, "sum_of_radii") for name, rows in by_case.items()}
        angles = {name: typical(rows, "sum_of_angles") for name, rows in by_case.items()}
        signal = float(by_case[UNKNOWN]["angle_signal [-]"].iloc[0])
        own = float(by_case[STEADY]["angle_signal [-]"].iloc[0])
        predicted = float(by_case[UNKNOWN]["angle_std [rad]"].iloc[0])
        extent = float(np.ptp(by_case[UNKNOWN]["true sum_of_angles"]))
        condition = float(np.max(by_case[UNKNOWN]["condition [-]"].to_numpy()))
        spread = radii[UNKNOWN] / max(radii[STEADY], 1e-12)
        squares = rows_where(table, table["case"] == SQUARES)
        extent_of_radii = float(np.ptp(by_case[STEADY]["true sum_of_radii"]))
        true_radius = float(np.mean(by_case[STEADY]["true sum_of_radii"]))
        enough = whole(by_case[STEADY])
        values = {
            "(r_L + r_R): rms error by gauge variation over that without": (spread, above(2.0)),
            "(r_L + r_R), gauge left out: rms error over the range ('some spreading' in the article; its range of "
            f"{1e3 * extent_of_radii:.2g} mm is {1e2 * extent_of_radii / true_radius:.2g} % of the radii, which any "
            "moment of the gauge outweighs)": (radii[UNKNOWN], at_most(1.0)),
            "(r_L + r_R), gauge known and in the regression: rms error over the range (a polynomial of the gauge "
            f"leaves {radii[REGRESSOR] / radii[UNKNOWN]:.2g} of that; sections of it leave what follows)": (
                radii[REGRESSOR],
                at_most(1.0),
            ),
            "(r_L + r_R), sections of shift and gauge: rms error over the range": (
                typical(squares, "sum_of_radii"),
                at_most(0.05),
            ),
            "(r_L + r_R), the same: spread of the estimates at one shift over the range without gauge ('some "
            "spreading')": (at_one_shift(squares, "sum_of_radii") / extent_of_radii, between(0.1, 1.0)),
            "(d_L + d_R), sections of shift and gauge: rms error over the range: it was the gauge": (
                typical(squares, "sum_of_angles"),
                at_most(0.5),
            ),
            "(d_L + d_R), gauge left out: rms error over the range: fails to converge": (angles[UNKNOWN], above(1.0)),
            "(d_L + d_R), gauge known: rms error over the range: still fails": (angles[REGRESSOR], above(1.0)),
            "condition number of the scaled regressors": (condition, at_most(20.0)),
            "moment by (d_L + d_R) psi over the rest of the equation: what spoils it": (signal, at_most(0.05)),
            "the same without gauge variation": (own, above(0.05)),
            "standard deviation of (d_L + d_R) by that noise over its range": (predicted / extent, above(1.0)),
            "(r_L - r_R), gauge known: largest error over the range": (
                worst(by_case[REGRESSOR], "difference_of_radii"),
                at_most(0.05),
            ),
        }
        return [Claim.definite(text, value, target, enough=enough) for text, (value, target) in values.items()]

    def notes(self) -> list[str]:
        """What the numbers mean."""
        return [
            "At one shift the gauge changes r_L - r_R, which enters (12) with l f11 / r0; (d_L + d_R) enters with "
            "l W psi / 2 only. The residual is coloured and correlates with psi, so that more data help slowly.",
        ]


def typical(rows: pd.DataFrame, name: str) -> float:
    """Root mean square error over the range of the true values."""
    true = rows[f"true {name}"]
    return float(np.sqrt(np.mean((rows[name] - true) ** 2)) / np.ptp(true))


def at_one_shift(rows: pd.DataFrame, name: str) -> float:
    """Root mean square, over shifts, of the standard deviation of the estimates at different gauges."""
    at = np.round(rows["shift [m]"].to_numpy() / SIDE).astype(int)
    values = rows[name].to_numpy()
    found = [np.var(values[at == one]) for one in np.unique(at) if np.sum(at == one) >= AT_ONE_SHIFT]
    return float(np.sqrt(np.mean(found)))


def conditioning(signals: Signals, known: Coefficients, used: bool) -> dict[str, float]:
    """How large the term of (delta_L + delta_R) in (12) is beside what the regression leaves, and what follows.

    "angle_signal [-]": standard deviation of l W S psi / 2 for a change of S by 0.05 rad over that of the residual.
    "angle_std [rad]": of S from a section's samples, if residuals are alike for 0.1 s.
    """
    solution = regress(signals, known, WIDTH, 2, used)
    enough = solution.samples >= FEWEST * len(signals.shift)
    output = known_parts(signals, known)[1]
    turning = solution.history[1]
    left = output - turning[:, 0] * signals.yaw - turning[:, 1] * signals.roll_rate - turning[:, 2]
    late = slice(len(output) // 3, None)
    residual = known.I * float(np.std(left[late]))
    moment = known.l * known.W * 0.05 / 2.0 * float(np.std(signals.yaw))
    samples = float(np.median(solution.samples[enough])) / max(1.0, 0.1 / 1024.0**-1)
    return {
        "angle_signal [-]": moment / residual,
        "angle_std [rad]": 2.0 * residual / (known.l * known.W * float(np.std(signals.yaw)) * np.sqrt(samples)),
    }
