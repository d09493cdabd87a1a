"""Figure 15: rolling radii and contact angles by recursive least squares in sections, gauge constant."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from estimators.wheel_rail.section_rls import Geometry, Signals, geometry, regress
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_most
from experiments.reporting.plots import BLACK, BLUE, GREEN, ORANGE, RED
from experiments.reporting.size import Size
from experiments.reporting.style import line_inside
from experiments.runs.rolling_radii import FEWEST, RATE, WIDTH, contact, parameters, run, true_geometry
from experiments.runs.speed import rows_where
from railsim.wheelset import RollingTable
from railsim.wheelset.parameters import Coefficients

SEED, DURATION, FAST_DURATION = 15, 120.0, 40.0
LEAST = 30  # samples of a section of any width
NARROW = 5e-5  # m: sections in which a line is enough for the contact angles too
DEGREES = {0: "as printed (constant)", 1: "local linear", 2: "local parabola", 3: "local cubic"}
LINEAR = "local linear, sections of 0.05 mm"
COLOURS = (RED, ORANGE, BLUE, GREEN)
NAMES = Geometry._fields
LABELS = dict(
    zip(NAMES, ("$r_L + r_R$ [mm]", "$r_L - r_R$ [mm]", "$δ_L + δ_R$ [mrad]", "$δ_L - δ_R$ [mrad]"), strict=True)
)
WITHIN = 0.05
WRONG = {"f22": 1.03, "f11": 0.97}
"""Creep coefficients that the estimator has by so much too high or low, for what the article does not look at."""


class Fig15(Figure):
    """New S1002 on 60E1 by equations (11) to (15), 30 m/s; everything that (5) to (8) take as known is known."""

    def compute(self, size: Size) -> pd.DataFrame:
        wheels = contact()
        signals, known = run(wheels, SEED, False, FAST_DURATION if size.reduced else DURATION)
        tables = [sections(signals, known, wheels, degree).assign(case=name) for degree, name in DEGREES.items()]
        tables.append(sections(signals, known, wheels, 1, width=NARROW).assign(case=LINEAR))
        tables.append(sections(signals, known, wheels, 0, width=NARROW).assign(case="as printed, narrow"))
        wrong = known._replace(**{name: factor * getattr(known, name) for name, factor in WRONG.items()})
        tables.append(sections(signals, wrong, wheels, 2).assign(case="creep 3 % wrong"))
        return pd.concat(tables, ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        cases = (DEGREES[0], DEGREES[1], LINEAR, DEGREES[3])
        return draw(table, "Recursive least squares without gauge variation", cases)

    def check(self, table: pd.DataFrame) -> list[Claim]:
        rows = {name: rows_where(table, table["case"] == name) for name in table["case"].unique()}
        best, enough = rows[DEGREES[3]], whole(rows[DEGREES[3]])

        def within(text: str, case: str, name: str = "sum_of_radii") -> Claim:
            return Claim.definite(text, worst(rows[case], name), at_most(WITHIN), enough=enough)

        c = parameters().coefficients()
        leverage = c.f11 * float(np.ptp(best["true sum_of_radii"])) / c.r0 / (2.0 * c.f22)
        return [
            *(
                within(f"{name}, {how}: largest error over the range", case, name)
                for how, case in ((LINEAR, LINEAR), (f"{DEGREES[3]}, sections of 0.5 mm", DEGREES[3]))
                for name in NAMES
            ),
            within("(r_L + r_R), local linear: largest error over the range", DEGREES[1]),
            within(
                "(r_L + r_R), regressors as printed in (6) (one constant a section: within it d_L - d_R changes by "
                "more than the whole effect of r_L + r_R)",
                DEGREES[0],
            ),
            within("(r_L + r_R), as printed, sections of 0.05 mm (the same, a tenth as large)", "as printed, narrow"),
            within(
                "(r_L + r_R), f11 and f22 known within 3 % only (its whole range changes the coefficient it is read "
                f"from by {leverage:.2g} only)",
                "creep 3 % wrong",
            ),
        ]

    def notes(self) -> list[str]:
        """Why two claims do not hold."""
        return [
            "As printed, (6) has one constant a section; the contact angles change within it by more than the whole "
            "effect of r_L + r_R. Narrower sections do not help below 0.05 mm; a line within the section does.",
            "r_L + r_R is read from the coefficient of psi, 2 (f22 - f11) + 2 f11 (r_L + r_R) / (2 r0): its range "
            "changes that by 0.1 %, so that the creep coefficients must be known far better than 0.1 %.",
        ]


def sections(
    signals: Signals,
    known: Coefficients,
    wheels: RollingTable,
    degree: int,
    gauge: bool = False,
    width: float = WIDTH,
    gauge_width: float | None = None,
) -> pd.DataFrame:
    """Estimates at the end of the run and true values, each section that was visited enough; at nominal gauge where
    sections are of the shift alone.
    """
    solution = regress(signals, known, width, degree, gauge, gauge_width=gauge_width)
    share = FEWEST * width / WIDTH if gauge_width is None else 0.0
    enough = solution.samples >= max(share * len(signals.shift), LEAST)
    estimate = geometry(solution.coefficients[:, enough], known)
    true = true_geometry(wheels, solution.centres[enough], solution.gauges[enough])
    table = pd.DataFrame({
        "shift [m]": solution.centres[enough],
        "gauge [m]": solution.gauges[enough],
        "samples": solution.samples[enough],
        "condition [-]": solution.condition[enough],
    })  # fmt: skip
    for name in NAMES:
        table[name], table[f"true {name}"] = getattr(estimate, name), getattr(true, name)
    return table


def whole(rows: pd.DataFrame) -> bool:
    """Whether a table of sections is of a run as long as the claims are about."""
    return float(rows["samples"].to_numpy(dtype=float).sum()) > 0.5 * (DURATION + FAST_DURATION) * RATE


def worst(table: pd.DataFrame, name: str) -> float:
    """Largest error over the range of the true values."""
    true = table[f"true {name}"]
    return float((table[name] - true).abs().max() / np.ptp(true))


def draw(table: pd.DataFrame, title: str, cases: tuple[str, ...]) -> Picture:
    """A panel for each quantity, scaled to the true range and what lies within thrice of it."""
    picture = Picture(figsize=(10.0, 7.5), layout="constrained")
    panels = picture.subplots(2, 2)
    for axes, name in zip(panels.flat, NAMES, strict=True):
        last = rows_where(table, table["case"] == cases[-1])
        true = 1e3 * last[f"true {name}"].to_numpy()
        room = 1.5 * float(np.ptp(true))
        limits = float(np.min(true)) - room, float(np.max(true)) + room
        for case, colour in zip(cases, COLOURS, strict=False):
            rows = rows_where(table, table["case"] == case)
            shift, values = (1e3 * rows[column].to_numpy(dtype=float) for column in ("shift [m]", name))
            size = 4.0 if len(rows) < 40 else 1.5
            line_inside(axes, shift, values, limits, color=colour, marker="o", ms=size, lw=0.9, label=case)
        axes.plot(1e3 * last["shift [m]"], true, color=BLACK, lw=1.6, label="true")
        axes.set(xlabel="y - d [mm]", ylabel=LABELS[name])
    picture.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    picture.suptitle(f"{title}: estimates of each section; triangles: beyond the frame")
    return picture
