"""Item 5: Polach's law in its limits: Kalker's slope, oddness, saturation, friction that falls with slip."""

import math

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from experiments.reporting.plots import BLUE, GREEN, GREY, ORANGE, RED
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from experiments.validation.tables import of, values, where
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import linear_force
from railsim.contact.polach import SHEAR, friction_coefficient, polach_force

A, B, NORMAL, FRICTION = 6e-3, 5e-3, 6e4, 0.3
"""Semi-axes [m], load [N], friction (illustrative)."""

KALKER = kalker_coefficients(A / B)
LIMIT = FRICTION * NORMAL
UNIT = LIMIT / (SHEAR * A * B)
"""Creepage that is to mu N as 1 is to Kalker's coefficient."""

Creep = tuple[float, float, float]
PURE: dict[str, Creep] = {
    "longitudinal": (1.0, 0.0, 0.0),
    "lateral": (0.0, 1.0, 0.0),
    "spin": (0.0, 0.0, 1.0 / math.sqrt(A * B)),
}
STATIC, RATIO, DECAY, SPEED = 0.55, 0.4, 0.6, 20.0
"""Friction of a dry rail (Polach 2005) and speed [m/s] for the falling branch."""

SMALL = 1e-5
SIZE = "size"
_COMBINED: tuple[Creep, ...] = ((1.0, -0.5, 150.0), (0.3, 2.0, -80.0), (-2.0, 0.1, 40.0), (5.0, 5.0, 300.0))


class CreepLimits(Section):
    """Closed-form limits; no reference data needed."""

    item = 5
    title = "Polach's law in its limits"
    about = (
        "kA = kS = 1, semi-axes 6 and 5 mm, 60 kN, friction 0.3. At vanishing creepage of one kind (1e-5 of the "
        "creepage at which the linear force would reach mu N) the slope is Kalker's; the force changes its sign "
        "with all creepages; it never exceeds mu N and reaches it; far beyond saturation it is mu(w) N with mu(w) "
        "of Polach's falling friction. Longitudinal and lateral creepage together are told without a limit: "
        "Polach's slope opposes the slip, Kalker's does not quite."
    )
    source = "Kalker (1967) linear theory, table E.3 of Kalker (1990); Polach (2005), eq. 9"

    def compute(self, size: Size) -> pd.DataFrame:
        del size
        cases = []
        sizes = np.geomspace(SMALL, 30.0, 120)
        for kind, direction in PURE.items():
            for creepage in sizes:
                creep = _scaled(direction, UNIT * creepage)
                force, opposite = _force(creep), _force(_scaled(creep, -1.0))
                linear = math.hypot(*linear_force(*creep, A, B, *KALKER))
                cases.append(_row(kind, creepage, math.hypot(*force), linear) | {"oddness [N]": _sum(force, opposite)})
        for creepage in sizes:
            for creep in _COMBINED:
                given = _scaled(creep, UNIT * creepage)
                force, opposite = _force(given), _force(_scaled(given, -1.0))
                linear = math.hypot(*linear_force(*given, A, B, *KALKER))
                row = _row("combined with spin", creepage, math.hypot(*force), linear)
                cases.append(row | {"oddness [N]": _sum(force, opposite)})
        for angle in np.linspace(0.0, 0.5 * math.pi, 31):
            creep = (UNIT * SMALL * math.cos(angle), UNIT * SMALL * math.sin(angle), 0.0)
            linear = np.array(linear_force(*creep, A, B, *KALKER))
            apart = float(np.linalg.norm(np.array(_force(creep)) - linear))
            cases.append(_row("both directions", SMALL, apart, float(np.linalg.norm(linear))))
        for creepage in np.geomspace(1e-4, 0.5, 80):
            friction = friction_coefficient(STATIC, RATIO, DECAY, SPEED * creepage)
            force = polach_force(creepage, 0.0, 0.0, A, B, *KALKER, NORMAL, friction, 1.0, 1.0)
            stated = STATIC * ((1.0 - RATIO) * math.exp(-DECAY * SPEED * creepage) + RATIO) * NORMAL
            cases.append(_row("falling friction", creepage, -force[0], stated))
        return pd.DataFrame(cases)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        rows = []
        for kind in PURE:
            part = of(table, "kind", kind)
            rows.append(
                self.agrees_relatively(
                    f"{kind}: slope at vanishing creepage over Kalker's", _over_kalker(part), 1.0, 0.01, "-"
                )
            )
        bounded = where(table, ~table["kind"].isin(["both directions", "falling friction"]))
        odd = float(values(bounded, "oddness [N]").max()) / LIMIT
        rows.append(self.bounded("force of opposite creepages added, over mu N", odd, high=1e-9))
        rows.append(
            self.bounded("largest force over mu N", float(values(bounded, "ours [N]").max()) / LIMIT, high=1.0 + 1e-12)
        )
        for kind in ("longitudinal", "lateral"):
            last = float(values(of(table, "kind", kind), "ours [N]")[-1])
            rows.append(self.agrees_relatively(f"{kind}: force at 30 times, over mu N", last / LIMIT, 1.0, 0.02, "-"))
        both = of(table, "kind", "both directions")
        apart = float((values(both, "ours [N]") / values(both, "stated [N]")).max())
        rows.append(
            self.noted("longitudinal and lateral together: largest deviation from Kalker", 100.0 * apart, 0.0, "%")
        )
        return rows + self._falling(table)

    def _falling(self, table: pd.DataFrame) -> list[Row]:
        part = where(table, (table["kind"] == "falling friction") & (table[SIZE] >= 0.05))
        ours, stated = values(part, "ours [N]"), values(part, "stated [N]")
        at = int(np.argmax(np.abs(ours / stated - 1.0)))
        words = f"falling friction, 5 … 50 % creepage: force (worst, at {100.0 * values(part, SIZE)[at]:.2g} %)"
        fall = float(np.max(np.diff(ours)))
        return [
            self.agrees_relatively(words, 1e-3 * ours[at], 1e-3 * stated[at], 0.01, "kN"),
            self.bounded("falling friction: largest change of the force from point to point", fall, high=0.0, unit="N"),
        ]

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        left, middle, right = picture.subplots(1, 3)
        for kind, colour in zip(PURE, (BLUE, ORANGE, GREEN), strict=True):
            part = of(table, "kind", kind)
            left.loglog(part[SIZE], part["ours [N]"] / LIMIT, color=colour, label=kind)
            left.loglog(part[SIZE], part["stated [N]"] / LIMIT, color=colour, ls=":", lw=1.0)
            middle.semilogx(part[SIZE], part["ours [N]"] / part["stated [N]"], color=colour, label=kind)
        left.axhline(1.0, color=RED, lw=0.8)
        left.plot([], [], color=GREY, ls=":", label="Kalker, linear")
        left.set(title="force", xlabel="creepage G a b / (mu N)", ylabel="share of mu N", ylim=(1e-5, 4.0))
        middle.axhspan(0.99, 1.01, color=GREY, alpha=0.3, lw=0)
        middle.set(title="force over Kalker's", xlabel="creepage G a b / (mu N)", xlim=(1e-5, 1.0), ylim=(0.4, 1.05))
        part = of(table, "kind", "falling friction")
        right.plot(100.0 * part[SIZE], 1e-3 * part["ours [N]"], color=BLUE, label="Polach, mu(w)")
        right.plot(100.0 * part[SIZE], 1e-3 * part["stated [N]"], color=RED, ls=":", label="mu(w) N")
        right.set(title="falling friction, 20 m/s", xlabel="creepage in %", ylabel="force in kN", ylim=(0.0, None))
        for axes in (left, middle, right):
            axes.legend(frameon=False, fontsize=8)


def _scaled(creep: Creep, factor: float) -> Creep:
    x, y, spin = creep
    return factor * x, factor * y, factor * spin


def _force(creep: Creep) -> tuple[float, float]:
    x, y, spin = creep
    return polach_force(x, y, spin, A, B, *KALKER, NORMAL, FRICTION, 1.0, 1.0)


def _sum(force: tuple[float, float], opposite: tuple[float, float]) -> float:
    return math.hypot(force[0] + opposite[0], force[1] + opposite[1])


def _row(kind: str, size: float, ours: float, stated: float) -> dict[str, str | float]:
    return {"kind": kind, SIZE: size, "ours [N]": ours, "stated [N]": stated}


def _over_kalker(part: pd.DataFrame) -> float:
    return float(values(part, "ours [N]")[0] / values(part, "stated [N]")[0])
