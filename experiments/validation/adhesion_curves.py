"""Item 6: creep curves for dry, wet, low and very low adhesion (wheel load of 4000 kg, 20 m/s)."""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from experiments.reporting.claims import Target, above, at_most, below
from experiments.reporting.plots import BLUE, GREEN, GREY, PURPLE, RED
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from railsim.constants import GRAVITY
from railsim.contact.adhesion import CONDITIONS, AdhesionCondition
from railsim.contact.fastsim import fastsim_force
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import creep_coefficients
from railsim.contact.polach import friction_coefficient, polach_force

LOAD = 4000.0 * GRAVITY  # N
SPEED = 20.0  # m/s
WHEEL_RADIUS, RAIL_RADIUS = 0.46, 0.30  # m; cone on a rail head, illustrative: the article gives no contact geometry
LARGEST, CLOSE = 0.10, 0.006  # creepage
COLOURS = (GREEN, BLUE, RED, PURPLE)
CREEPAGE = "creepage [-]"


class ContactConditions(NamedTuple):
    """Semi-axes [m] and Kalker's coefficients, in the order in which creep laws take them."""

    a: float
    b: float
    c11: float
    c22: float
    c23: float


class AdhesionCurves(Section):
    """Figure 8 of the paper, by number."""

    item = 6
    title = "Creep curves for dry, wet, low and very low adhesion"
    about = (
        "Figure 8 of the paper: wheel load 4000 kg, 20 m/s. Maxima and initial slopes must be ordered as in the "
        "paper. The paper prints no numbers; the other rows check the curves against the parameters that they "
        "were drawn from."
    )
    source = "Ward et al. (2011), fig. 8; parameters Polach (2005), for the two low ones illustrative"
    size = (11.0, 5.4)

    def compute(self, size: Size) -> pd.DataFrame:
        del size
        return creep_curves()

    def rows(self, table: pd.DataFrame) -> list[Row]:
        return [self.aimed(*comparison) for comparison in comparisons(table)]

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        draw_curves(table, picture)


def creep_curves() -> pd.DataFrame:
    """Longitudinal creep force over creepage at a fixed contact patch, by Polach's law and by FASTSIM."""
    creepage = np.concatenate(([1e-6], np.geomspace(1e-5, CLOSE, 80)[:-1], np.linspace(CLOSE, LARGEST, 200)))
    columns = {CREEPAGE: creepage, "Kalker [N]": creepage * creep_coefficients(*_curvatures(), LOAD).f11}
    contact = _contact()
    for name, condition in CONDITIONS.items():
        columns[_column(name)] = _curve(polach_force, condition, contact, creepage)
        columns[_column(name, "FASTSIM")] = _curve(fastsim_force, condition, contact, creepage)
    return pd.DataFrame(columns)


def comparisons(table: pd.DataFrame) -> list[tuple[str, float, Target]]:
    """What the curves must bear out: quantity, value, where it should lie."""
    peaks = {name: float(_forces(table, name).max()) for name in CONDITIONS}
    slopes = {name: _slope(table, name) for name in CONDITIONS}
    kalker = float(table["Kalker [N]"].to_numpy(float)[0] / table[CREEPAGE].to_numpy(float)[0])
    used = max(peaks[name] / (condition.friction * LOAD) for name, condition in CONDITIONS.items())
    shares = max(abs(slopes[name] / (condition.initial_share * kalker) - 1.0) for name, condition in CONDITIONS.items())
    left = max(float(_forces(table, name)[-1]) / peaks[name] for name in CONDITIONS)
    apart = max(
        float(np.abs(_forces(table, name) - _forces(table, name, "FASTSIM")).max()) / (condition.friction * LOAD)
        for name, condition in CONDITIONS.items()
    )
    return [
        *_ordered("largest creep force", peaks),
        *_ordered("initial slope", slopes),
        ("largest creep force over mu0 N, largest of the four", used, at_most(1.0)),
        ("initial slope against (kA + kS) / 2 of Kalker's: deviation", shares, below(0.01)),
        ("force at 10 % creepage over the largest, largest of the four", left, below(1.0)),
        ("FASTSIM against Polach: difference over mu0 N", apart, below(0.05)),
    ]


def _ordered(what: str, values: dict[str, float]) -> list[tuple[str, float, Target]]:
    """For each two neighbours: the better adhesion has more."""
    pairs = itertools.pairwise(values.items())
    return [(f"{what}: {better} over {worse}", high / low, above(1.0)) for (better, high), (worse, low) in pairs]


def draw_curves(table: pd.DataFrame, picture: FigureBase) -> None:
    """Whole curves, and their start."""
    whole, close = picture.subplots(1, 2, width_ratios=(1.5, 1.0))
    for (name, condition), colour in zip(CONDITIONS.items(), COLOURS, strict=True):
        _draw_curve(whole, table, name, colour)
        _draw_curve(close, table, name, colour)
        slope = _slope(table, name)
        reach = 0.45 * condition.friction * LOAD / slope
        close.plot([0.0, 100.0 * reach], [0.0, 1e-3 * slope * reach], color=colour, lw=5.0, alpha=0.3, zorder=1)
        _label(whole, table, name, colour)
    close.plot(100.0 * table[CREEPAGE], 1e-3 * table["Kalker [N]"], color=GREY, lw=1.0, ls="--", zorder=1)
    close.annotate("Kalker,\nlinear", (0.13, 12.4), color=GREY, ha="right", fontsize=9)
    whole.set(xlim=(0.0, 100.0 * LARGEST), ylim=(0.0, 18.0), title="whole curve, with its maximum")
    close.set(xlim=(0.0, 100.0 * CLOSE), ylim=(0.0, 14.4), title="start (thick: initial slope)")
    for axes in (whole, close):
        axes.set_xlabel("longitudinal creepage [%]")
        axes.set_ylabel("creep force [kN]")
    whole.plot([], [], color=GREY, lw=2.0, label="Polach (2005)")
    whole.plot([], [], color=GREY, lw=1.4, ls=":", label="FASTSIM, slope reduced alike")
    whole.legend(loc="upper right", frameon=False, fontsize=9)
    contact = _contact()
    picture.suptitle(
        f"Creep curves: wheel load 4000 kg, {SPEED:g} m/s, "
        f"semi-axes {1e3 * contact.a:.2f} mm (along) and {1e3 * contact.b:.2f} mm"
    )


def _curvatures() -> tuple[float, float]:
    return 1.0 / WHEEL_RADIUS, 1.0 / RAIL_RADIUS


def _contact() -> ContactConditions:
    ellipse = hertz_ellipse(*_curvatures())
    a, b = ellipse.longitudinal * LOAD ** (1.0 / 3.0), ellipse.lateral * LOAD ** (1.0 / 3.0)
    return ContactConditions(a, b, *kalker_coefficients(a / b))


def _curve(
    law: Callable[..., tuple[float, float]],
    condition: AdhesionCondition,
    contact: ContactConditions,
    creepage: np.ndarray,
) -> np.ndarray:
    """Size of the longitudinal creep force [N]."""
    c = condition
    forces = []
    for value in creepage:
        friction = friction_coefficient(c.friction, c.friction_ratio, c.friction_decay, SPEED * value)
        forces.append(-law(value, 0.0, 0.0, *contact, LOAD, friction, c.k_adhesion, c.k_slip)[0])
    return np.array(forces)


def _column(condition: str, law: str = "Polach") -> str:
    return f"{condition}, {law} [N]"


def _forces(table: pd.DataFrame, name: str, law: str = "Polach") -> np.ndarray:
    return table[_column(name, law)].to_numpy(float)


def _slope(table: pd.DataFrame, name: str) -> float:
    """Creep force over creepage at the first, smallest creepage [N]."""
    return float(_forces(table, name)[0] / table[CREEPAGE].to_numpy(float)[0])


def _draw_curve(axes: Axes, table: pd.DataFrame, name: str, colour: str) -> None:
    creepage = 100.0 * table[CREEPAGE]
    axes.plot(creepage, 1e-3 * table[_column(name)], color=colour, lw=2.0, zorder=3)
    axes.plot(creepage, 1e-3 * table[_column(name, "FASTSIM")], color=colour, lw=1.4, ls=":", zorder=3)


def _label(axes: Axes, table: pd.DataFrame, name: str, colour: str) -> None:
    """Name and maximum above the curve's maximum; the lowest curve has more room below."""
    force = _forces(table, name)
    peak = int(force.argmax())
    point = (100.0 * table[CREEPAGE].to_numpy(float)[peak], 1e-3 * force[peak])
    below = name == list(CONDITIONS)[-1]
    axes.plot(*point, "o", color=colour, ms=5.0, zorder=4)
    axes.annotate(
        f"{name}: {point[1]:.1f} kN at {point[0]:.1f} %",
        point,
        (0.0, -5.0 if below else 7.0),
        textcoords="offset points",
        color=colour,
        weight="bold",
        ha="center",
        va="top" if below else "bottom",
    )
