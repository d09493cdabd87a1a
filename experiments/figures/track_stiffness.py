"""Track stiffness found from axleboxes: error beside its Cramer-Rao bound, and how often the stated interval holds."""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.accuracy_claims import pick
from experiments.figures.parted import PartedFigure, Parts
from experiments.reporting.claims import Claim, at_least, at_most
from experiments.reporting.intervals import of_mean_share, of_median, of_share
from experiments.reporting.plots import BLUE, GREY, ORANGE
from experiments.reporting.size import Size
from experiments.runs.track_stiffness import CASES, NINETY, SPEEDS, study, summary
from railsim.analysis.statistics import root_mean_square

SEEDS = 3
SMOKE_CASES = ("soft zone", "rigid rails")
SHOWN, SHOWN_SPEED = "soft zone", 25.0
RIGID = "rigid rails"
COVERED, TIMES, WRONG = 0.9, 2.0, 0.05
RUN = ["case", "speed [m/s]", "seed"]


class TrackStiffness(PartedFigure):
    """One line, and all cases of the study; half vehicle, compiled engine."""

    def parts(self, size: Size) -> Parts:
        """A part each case; a row each window of each run."""
        speeds, seeds = size.of(SPEEDS, (25.0, 55.0), (SHOWN_SPEED,)), size.of(SEEDS, 1)
        cases = size.of(tuple(CASES), tuple(CASES), SMOKE_CASES)
        return {case.replace(" ", "_").replace("/", "_"): partial(study, case, speeds, seeds) for case in cases}

    def draw(self, table: pd.DataFrame) -> Picture:
        """Above one line; below errors and bounds by case."""
        picture = Picture(figsize=(9.0, 8.2), layout="constrained")
        above, below = picture.subplots(2, height_ratios=(1.0, 1.5))
        one = pick(table, case=SHOWN, **{"speed [m/s]": SHOWN_SPEED})
        one = pick(one, seed=np.asarray(one["seed"]).min())
        s, true, found, std = (np.asarray(one[name]) for name in ("s [m]", "true [N/m]", "found [N/m]", "std [-]"))
        above.fill_between(
            s, found * (1.0 - 2.0 * std) / 1e6, found * (1.0 + 2.0 * std) / 1e6, color=BLUE, alpha=0.25, lw=0,
            label="2 deviations",
        )  # fmt: skip
        above.plot(s, found / 1e6, ".-", color=BLUE, label="found")
        above.plot(s, true / 1e6, color=ORANGE, lw=2.0, label="true")
        above.set(xlabel="distance [m]", ylabel="stiffness of a rail [MN/m]", ylim=(0.0, None))
        above.set_title(f"{SHOWN}, {SHOWN_SPEED:g} m/s: windows of 20 m", loc="left")
        rows = summary(table).iloc[[name != RIGID for name in dict.fromkeys(table["case"])]]
        places = np.arange(len(rows))
        for column, colour, label, mark in (
            ("rms", BLUE, "error", "o"),
            ("ratio rms", ORANGE, "error of the ratio to the line's mean", "s"),
            ("bound", GREY, "Cramér-Rao bound", "|"),
        ):
            below.plot(100.0 * rows[column], places, mark, color=colour, label=label, ms=7, mew=2 if mark == "|" else 1)
        names = [f"{row['case']} ({100.0 * row['answered']:.0f} %)" for _, row in rows.iterrows()]
        below.set_yticks(places, names)
        below.invert_yaxis()
        below.set(xlabel="rms in % of the stiffness", xlim=(0.0, None))
        told = np.isfinite(np.asarray(pick(table, case=RIGID)["found [N/m]"]))
        withheld = f"on rigid rails {told.sum()} of {len(told)}"
        below.set_title(f"by case (windows that are answered; {withheld})", loc="left")
        for axes in (above, below):
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
            axes.set_title(axes.get_title(loc="left"), loc="left", pad=24)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """Coverage of 90 % intervals and error over bound, at home and away; rigid rails withheld. Runs are the cases:
        what is not known of a track moves all windows of a run alike.
        """
        claims = []
        runs = [_Run.of(rows) for _, rows in table.groupby(RUN, sort=False)]
        for where, away in (("at home", False), ("away from home", True)):
            told = [one for one in runs if one.away == away and one.case != RIGID and len(one.error)]
            if not told:
                continue
            for name, shares in (
                ("stiffness", np.array([one.covered for one in told])),
                ("ratio", np.array([one.ratio_covered for one in told])),
            ):
                text = f"{name} within its stated 90 % interval, {where}"
                interval = of_mean_share(shares)
                claims.append(Claim.sampled(text, float(shares.mean()), at_least(COVERED), interval, len(told) > 1))
            over = np.array([one.over_bound for one in told])
            text = f"error of the ratio over the Cramer-Rao bound, {where}, median of the runs"
            claims.append(Claim.sampled(text, float(np.median(over)), at_most(TIMES), of_median(over), len(told) > 1))
        answered = np.array([len(one.error) > 0 for one in runs if one.case == RIGID])
        if len(answered):
            text = "runs on rigid rails with a stiffness stated"
            claims.append(Claim.sampled(text, float(answered.mean()), at_most(WRONG), of_share(answered)))
        return claims


class _Run(NamedTuple):
    """Windows of one run that are answered."""

    case: str
    away: bool
    error: np.ndarray
    covered: float
    ratio_covered: float
    over_bound: float

    @classmethod
    def of(cls, rows: pd.DataFrame) -> "_Run":
        told = np.isfinite(np.asarray(rows["found [N/m]"]))
        error, std, ratio, ratio_std, bound = (
            np.asarray(rows[name])[told]
            for name in ("error [-]", "std [-]", "ratio error [-]", "ratio std [-]", "bound [-]")
        )
        if not told.any():
            return cls(str(rows["case"].iloc[0]), bool(rows["away"].iloc[0]), error, np.nan, np.nan, np.nan)
        return cls(
            str(rows["case"].iloc[0]),
            bool(rows["away"].iloc[0]),
            error,
            float(np.mean(np.abs(error) <= NINETY * std)),
            float(np.mean(np.abs(ratio) <= NINETY * ratio_std)),
            root_mean_square(ratio) / root_mean_square(bound),
        )
