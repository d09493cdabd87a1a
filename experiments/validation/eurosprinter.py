"""Item 2: longitudinal creep curves of the Eurosprinter locomotive, by FASTSIM and by Polach's law."""

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase
from scipy.optimize import OptimizeResult, least_squares

from experiments.reporting.plots import BLUE, GREY, ORANGE, RED
from experiments.reporting.size import Size
from experiments.validation.drawing import limit_lines
from experiments.validation.interface import Row, Section, worst
from experiments.validation.reference import read
from experiments.validation.tables import of, values
from railsim.contact.fastsim import creep_gradient, fastsim_force, fastsim_reduced, spiryagin_slope
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.polach import SHEAR, friction_coefficient, polach_force

CURVES = "contact/creep_curves_eurosprinter.csv"
A, B, LOAD, FRICTION, SPEED = 6.304e-3, 12.61e-3, 106.7e3, 0.33, 10.0
"""Semi-axes [m], load [N], friction and speed [m/s] as CONTACT's example tractcurv states them (Polach 2005)."""

KALKER = kalker_coefficients(0.5, 0.28)
PARAMETERS = ("kA", "kS", "A", "B")
COULOMB, MODIFIED = "fastsim_coulomb", "fastsim_modified_falling_friction"
LAYER = "contact_falling_friction_interface_layer"
STATIC = {LAYER: 0.33, MODIFIED: 0.36}
"""mu0 of the two falling-friction cases (tractcurv)."""

CREEPAGE, THEIRS = "creepage [-]", "reference [Fx/N]"
WORDS = {
    COULOMB: "FASTSIM, Coulomb",
    "contact_coulomb": "CONTACT, Coulomb",
    MODIFIED: "modified FASTSIM, falling friction",
    LAYER: "CONTACT, falling friction, interface layer",
}


class Eurosprinter(Section):
    """Four series of CONTACT's example tractcurv."""

    item = 2
    title = "Eurosprinter creep curves"
    about = (
        "Longitudinal creepage 0…25 %, radius 625 mm, 106.7 kN a wheel, 10 m/s, semi-axes 6.304 mm (along) and "
        "12.61 mm. FASTSIM is compared twice: on the grid that the engines use (10 strips of 16 cells of equal "
        "share), as a share of mu N, and on the grid of CONTACT's example (48 x 44 equal cells over 1.1 times the "
        "ellipse, backward Euler), value by value. Polach's kA, kS, A, B are fitted to the two series with "
        "falling friction."
    )
    source = "CONTACT, tractcurv.ref_out (contact/creep_curves_eurosprinter.csv)"
    needs = (CURVES,)
    size = (12.0, 7.5)

    def compute(self, size: Size) -> pd.DataFrame:
        del size
        return pd.concat([_series(name) for name in WORDS], ignore_index=True)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        rows = []
        for series in (COULOMB, MODIFIED):
            part = of(table, "series", series)
            rows.append(self._largest(part, "FASTSIM", "FASTSIM, engines' grid", 0.02))
            ours, theirs = values(part, "FASTSIM on CONTACT's grid [Fx/N]"), values(part, THEIRS)
            at = worst(ours, theirs, relative=True)
            words = f"{WORDS[series]}: FASTSIM, CONTACT's grid (worst share, at {_percent(part, at)})"
            rows.append(self.agrees_relatively(words, ours[at], theirs[at], 0.02, "Fx/N"))
        for series in (LAYER, MODIFIED):
            part = of(table, "series", series)
            rows.append(self._largest(part, "Polach, fitted", "Polach with fitted kA, kS, A, B", 0.03))
            rows += [
                self.noted(f"{WORDS[series]}: fitted {name}", float(values(part, name)[0]), None, _unit(name))
                for name in PARAMETERS
            ]
        part = of(table, "series", "contact_coulomb")
        ours, theirs = values(part, "FASTSIM [Fx/N]"), values(part, THEIRS)
        at = worst(ours, theirs)
        words = f"CONTACT, Coulomb: FASTSIM (worst, at {_percent(part, at)})"
        rows.append(self.noted(words, ours[at] / FRICTION, theirs[at] / FRICTION, "mu N"))
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        panels = picture.subplots(2, 3, height_ratios=(1.6, 1.0), sharex=True)
        for column, series in enumerate((COULOMB, MODIFIED, LAYER)):
            part = of(table, "series", series)
            top, bottom = panels[:, column]
            creepage = 100.0 * part[CREEPAGE]
            top.plot(creepage, part[THEIRS], "o", color=GREY, mfc="none", ms=6, label="reference")
            styles = {"FASTSIM": (BLUE, "-"), "FASTSIM on CONTACT's grid": (ORANGE, "-"), "Polach, fitted": (RED, "--")}
            for law, (colour, style) in styles.items():
                ours = values(part, f"{law} [Fx/N]")
                if np.isnan(ours).any():
                    continue
                top.plot(creepage, ours, color=colour, ls=style, lw=1.4, label=law)
                bottom.plot(creepage, 100.0 * (ours - part[THEIRS]) / FRICTION, color=colour, ls=style, lw=1.4)
            top.set_title(WORDS[series], fontsize=10)
            top.set(ylabel="Fx / N", xscale="log", xlim=(0.01, 30.0), ylim=(0.0, 0.37))
            limits = {COULOMB: (-2.0, 2.0), MODIFIED: (-3.0, -2.0, 2.0, 3.0), LAYER: (-3.0, 3.0)}
            limit_lines(bottom, *limits[series])
            bottom.set(ylabel="difference in % of mu N", xlabel="creepage in %", ylim=(-4.0, 4.0))
            top.legend(frameon=False, fontsize=8, loc="lower right")

    def _largest(self, part: pd.DataFrame, law: str, words: str, limit: float) -> Row:
        ours, theirs = values(part, f"{law} [Fx/N]") / FRICTION, values(part, THEIRS) / FRICTION
        at = worst(ours, theirs)
        what = f"{WORDS[str(part['series'].iloc[0])]}: {words} (worst, at {_percent(part, at)})"
        return self.agrees(what, ours[at], theirs[at], limit, "mu N")


def reference_curve(series: str) -> np.ndarray:
    """(points, 2): creepage and size of Fx / N."""
    table = read(CURVES)
    part = of(table, "series", series)
    return np.column_stack((part["creepage_x [-]"], -part["Fx/Fn [-]"]))


def coulomb(creepage: float) -> float:
    """Fx / N by FASTSIM with constant friction, on the engines' grid."""
    return -fastsim_force(creepage, 0.0, 0.0, A, B, *KALKER, LOAD, FRICTION, 1.0, 1.0)[0] / LOAD


def modified(creepage: float) -> tuple[float, float]:
    """Friction and share of Kalker's slope of the modified FASTSIM (Spiryagin et al. 2013), numbers of tractcurv."""
    friction = friction_coefficient(0.36, 0.38, math.log(2.0) / 0.99, SPEED * creepage)
    gradient = creep_gradient(creepage, 0.0, 0.0, A, B, *KALKER[:2], LOAD, friction)
    return friction, spiryagin_slope(0.54 * gradient, 0.54, 0.02, 0.62)


def reduced(creepage: float) -> float:
    """Fx / N by the modified FASTSIM, on the engines' grid."""
    friction, slope = modified(creepage)
    return -fastsim_reduced(creepage, 0.0, 0.0, A, B, *KALKER, LOAD, friction, slope, 10, 16)[0] / LOAD


def contact_grid(creepage: float, friction: float, slope: float) -> float:
    """Fx / N on the grid of CONTACT's example: 48 x 44 equal cells over 1.1 times the ellipse, backward Euler."""
    columns, rows, scale = 48, 44, 1.1
    step, height = 2.0 * scale / columns, 2.0 * scale / rows
    x = scale - (np.arange(columns) + 0.5) * step
    y = -scale + (np.arange(rows) + 0.5) * height
    bound_0 = friction * 2.0 / (math.pi * A * B)
    growth = creepage * step * A * slope * 3.0 * SHEAR * KALKER[0] / (8.0 * A) / LOAD
    traction, total = np.zeros(rows), 0.0
    for along in x:
        inside = along**2 + y**2 < 1.0
        traction = np.where(inside, np.minimum(traction + growth, bound_0 * (1.0 - along**2 - y**2)), 0.0)
        total += traction.sum()
    return total * step * height * A * B


def polach(creepage: float, static: float, parameters: np.ndarray) -> float:
    """Fx / N by Polach's law with kA, kS, A, B."""
    k_a, k_s, ratio, decay = parameters
    friction = friction_coefficient(static, ratio, decay, SPEED * creepage)
    return -polach_force(creepage, 0.0, 0.0, A, B, *KALKER, LOAD, friction, k_a, k_s)[0] / LOAD


def fit_polach(curve: np.ndarray, static: float) -> OptimizeResult:
    """kA, kS, A, B (`x`) that fit a curve (points, 2) best; `fun`: differences as shares of mu N (mu 0.33)."""

    def residuals(parameters: np.ndarray) -> np.ndarray:
        found = np.array([polach(creepage, static, parameters) for creepage in curve[:, 0]])
        return (found - curve[:, 1]) / FRICTION

    bounds = ([0.01, 0.001, 0.05, 0.0], [1.0, 1.0, 1.0, 5.0])
    return least_squares(residuals, (0.5, 0.2, 0.4, 0.6), bounds=bounds)


def _series(series: str) -> pd.DataFrame:
    curve = reference_curve(series)
    table = pd.DataFrame({"series": series, CREEPAGE: curve[:, 0], THEIRS: curve[:, 1]})
    by_law: dict[str, Callable[[float], float]] = {}
    if series in (COULOMB, "contact_coulomb"):
        by_law = {"FASTSIM": coulomb, "FASTSIM on CONTACT's grid": lambda c: contact_grid(c, FRICTION, 1.0)}
    elif series == MODIFIED:
        by_law = {"FASTSIM": reduced, "FASTSIM on CONTACT's grid": lambda c: contact_grid(c, *modified(c))}
    for law, function in by_law.items():
        table[f"{law} [Fx/N]"] = [function(creepage) for creepage in curve[:, 0]]
    if series in STATIC:
        fit = fit_polach(curve, STATIC[series])
        table["Polach, fitted [Fx/N]"] = [polach(creepage, STATIC[series], fit.x) for creepage in curve[:, 0]]
        for name, value in zip(PARAMETERS, fit.x, strict=True):
            table[name] = value
    return table


def _percent(part: pd.DataFrame, at: int) -> str:
    return f"{100.0 * values(part, CREEPAGE)[at]:.2g} %"


def _unit(name: str) -> str:
    return "s/m" if name == "B" else "-"
