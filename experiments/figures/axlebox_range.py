"""What makes ±100 g axlebox accelerometers lose long waves: each error of the sensor on its own.

Ward et al. (2011), section 3.1: a wave of 2 mm and 30 m is 0.18 m/s2 at 45 m/s, a fraction of a range of 1000 m/s2, so
that the signal is likely to drown. Which error of the sensor drowns it, and at which speed, is not said there.
"""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.accuracy_claims import LOST, pick
from experiments.figures.parted import PartedFigure, Parts, table_of
from experiments.reporting.claims import Claim, at_least, at_most
from experiments.reporting.plots import BLUE, GREEN, ORANGE, PURPLE, RED
from experiments.reporting.size import Size
from experiments.runs.axlebox_errors import ADDED, CASES, IDEAL, rows
from experiments.runs.track_accuracy import LENGTHS
from railsim.analysis.statistics import root_mean_square

SPECIMENS = 3
FAST_LENGTH, SMOKE_LENGTH = 400.0, 250.0  # m
FAST_SPEEDS, SMOKE_SPEEDS = (15.0, 45.0), (45.0,)  # m/s
SMOKE_CASES = (IDEAL, "12 bit, vibration", "impacts of twice the range")
KEPT = 0.1
"""Share of a band's true size that an ideal sensor may leave as error (illustrative)."""
COLOURS = {4.0: PURPLE, 8.0: BLUE, 15.0: GREEN, 30.0: ORANGE, 45.0: RED}


class AxleboxRange(PartedFigure):
    """Error of D2 over its true size by every error of the sensor and speed; straight track, compiled engine."""

    def parts(self, size: Size) -> Parts:
        """A part each speed; a row a case, speed and specimen."""
        speeds = size.of(tuple(LENGTHS), FAST_SPEEDS, SMOKE_SPEEDS)
        names = list(size.of(tuple(CASES), tuple(CASES), SMOKE_CASES))
        seeds = size.of(SPECIMENS, 1)
        return {
            f"{speed:g}_m_s": table_of(
                rows, speed, size.of(length, min(length, FAST_LENGTH), SMOKE_LENGTH), "compiled", names, seeds
            )
            for speed, length in LENGTHS.items()
            if speed in speeds
        }

    def draw(self, table: pd.DataFrame) -> Picture:
        """A line a case, a mark a speed."""
        picture = Picture(figsize=(10.0, 6.4), layout="constrained")
        axes = picture.subplots()
        names = list(dict.fromkeys(table["case"]))
        for speed, colour in COLOURS.items():
            of_speed = pick(table, **{"speed [m/s]": speed})
            if not of_speed.empty:
                ratios = [_ratio(of_speed, name) for name in names]
                axes.semilogx(ratios, range(len(names)), "o", color=colour, ms=6, label=f"{speed:g} m/s")
        axes.axvline(LOST, color="black", lw=0.9, ls="--")
        axes.text(1.05 * LOST, len(names) - 0.5, "lost", fontsize=9, va="center")
        axes.set_yticks(range(len(names)), names)
        axes.invert_yaxis()
        axes.set(xlabel="rms error of D2 (25 to 70 m) over its true size")
        axes.set_title("±100 g axlebox accelerometers, each error on its own", loc="left")
        axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """Whether each error makes the article's claim come true, at the lowest, a middle and the highest speed; that
        an ideal sensor keeps the waves, and what is added besides too, at every speed.
        """
        claims = []
        speeds = sorted(set(table["speed [m/s]"]))
        for name in dict.fromkeys(table["case"]):
            alone = name in (IDEAL, ADDED)
            for speed in speeds if alone else dict.fromkeys((speeds[0], speeds[len(speeds) // 2], speeds[-1])):
                value = _ratio(pick(table, **{"speed [m/s]": speed}), name)
                target = at_most(KEPT, meaning="kept") if alone else at_least(LOST, meaning="lost")
                source = CASES[name].source
                what = f"{name}{f' ({source})' if source else ''}, {speed:g} m/s: error of D2 over its true size"
                claims.append(
                    Claim.definite(what, value, target, len(pick(table, case=name, **{"speed [m/s]": speed})))
                )
        return claims


def _ratio(table: pd.DataFrame, name: str) -> float:
    """Rms error over the specimens over the true size."""
    chosen = pick(table, case=name)
    error, true = (chosen[f"{what} [mm]"].to_numpy(float) for what in ("rms error", "true rms"))
    return root_mean_square(error) / float(np.mean(true))
