"""Figure 19: detected speed while the vehicle accelerates from 40 to 48 m/s at 1 m/s2."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_least, below, near
from experiments.reporting.plots import BLACK, BLUE, GREEN, ORANGE, PURPLE
from experiments.reporting.size import Size
from experiments.reporting.style import dots
from experiments.reporting.units import KMH
from experiments.runs.speed import error, rows_where, speed_table
from railsim.analysis.statistics import root_mean_square

STARTS, ENDS = 15.0, 23.0  # s of the acceleration
ACCELERATION = 1.0  # m/s2
WINDOW = 1.0  # s of the plain variant: short at high speed (section 5.2)


class Fig19(Figure):
    """Delay of the plain variant under acceleration, and what the refined one's motion model makes of it."""

    def compute(self, size: Size) -> pd.DataFrame:
        speed = {"kind": "profile", "time": [0.0, STARTS, ENDS], "speed": [40.0, 40.0, 48.0]}
        values = {"track": "straight_erri_low", "speed": speed, "duration": 33.0}
        return speed_table("40 to 48 m/s", values, size.reduced, window=WINDOW, slowest=15.0, forward=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 8.0), layout="constrained")
        top, bottom = picture.subplots(2, 1, sharex=True)
        time = table["time [s]"].to_numpy()
        for name, colour, width in (
            ("plain", ORANGE, 0.9),
            ("refined industrial", GREEN, 1.2),
            ("refined", BLUE, 1.2),
            ("refined forward", PURPLE, 1.4),
        ):
            label = {
                "plain": f"plain, {WINDOW:g} s window, ideal sensors",
                "refined": "refined, ideal sensors",
                "refined forward": "refined, industrial MEMS and longitudinal accelerometer",
            }
            text = label.get(name, "refined, industrial MEMS")
            if name == "plain":
                dots(top, time, table[f"{name} [km/h]"].to_numpy(dtype=float), colour, text)
                dots(bottom, time, error(table, name), colour, None)
            else:
                top.plot(time, table[f"{name} [km/h]"], color=colour, lw=width, label=text)
                bottom.plot(time, error(table, name), color=colour, lw=width)
        top.plot(time, table["true [km/h]"], color=BLACK, lw=1.0, ls="--", label="true")
        bottom.axhline(0.0, color=BLACK, lw=0.8)
        delayed = -KMH * ACCELERATION * WINDOW / 2.0
        bottom.hlines(delayed, STARTS + WINDOW, ENDS, color=BLACK, ls=":", lw=1.2, label="half a window late: -a T / 2")
        top.set_ylabel("speed [km/h]")
        bottom.set_ylabel("speed error [km/h]")
        bottom.set_xlabel("time [s]")
        bottom.set_ylim(-4.5, 3.0)
        top.set_xlim(5.0, time[-1])
        top.set_ylim(140.0, 178.0)
        top.legend(loc="upper left", markerscale=4.0)
        bottom.legend(loc="lower left")
        picture.suptitle("Speed from bogie sensors during acceleration at 1 m/s² (straight_erri_low, 1 ms sampling)")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        time = table["time [s]"]
        steady = rows_where(table, time.between(STARTS + WINDOW, ENDS))
        changing = rows_where(table, time.between(STARTS - 1.0, ENDS + 4.0))
        offset = float(np.nanmean(error(steady, "plain")))
        delay = -offset / (KMH * ACCELERATION)
        plain = _rms_of_all(error(changing, "plain"))
        forward = _rms_of_all(error(changing, "refined forward"))
        refined, noisy = _rms_of_all(error(changing, "refined")), _rms_of_all(error(changing, "refined industrial"))
        half = WINDOW / 2
        return [
            Claim.definite("plain: offset in acceleration, the detected speed is late", offset, below(0.0, "km/h")),
            Claim.definite("plain: delay, near half the window", delay, near(half, 0.4 * half, "s")),
            *(
                Claim.definite(
                    f"refined, {sensors}: rms error beats plain by a factor", plain / error, at_least(factor)
                )
                for sensors, error, factor in (
                    ("ideal sensors", refined, 2.0),
                    ("industrial MEMS", noisy, 2.0),
                    ("industrial MEMS and longitudinal accelerometer", forward, 10.0),
                )
            ),
        ]


def _rms_of_all(errors: np.ndarray) -> float:
    """Root mean square; infinite where a value is missing."""
    return root_mean_square(errors) if np.isfinite(errors).all() else float("inf")
