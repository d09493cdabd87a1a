"""Item 1b: the other side of the Manchester contact benchmark A-2.2: the right wheel, which runs against its flange."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase
from scipy.optimize import root_scalar

from experiments.reporting.plots import BLUE, GREEN, ORANGE, RED
from experiments.reporting.size import Size
from experiments.validation.contact_benchmark import BENCHMARK, FRICTION, LAWS, PROFILES, SHIFT, profiles
from experiments.validation.interface import Row, Section, worst
from experiments.validation.reference import read
from experiments.validation.tables import values, where
from railsim.contact.functions import ContactTable
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.wheel import FASTSIM, ContactLaw, WheelForces, WheelOnRail, WheelState, second_forces, wheel_forces
from railsim.profiles.creepage import creepages
from railsim.profiles.layout import Layout
from railsim.profiles.search import ProfileContact, Side
from railsim.profiles.wheelset import WheelsetOnTrack
from railsim.profiles.zones import two_contacts

LOAD = 10e3  # N, vertical
LAW = np.array(ContactLaw(FRICTION, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, FASTSIM))
ROOT = 5.0
"""Shifts from here on touch at the root of the flange or on its face [mm]."""

FACE = 6.2
"""Shifts from here on touch at the flange's face alone [mm]."""

BETWEEN = (6.1, 6.12, 6.14, 6.16, 6.18, 6.2, 6.3)
"""Shifts between the benchmark's that are listed besides [mm]."""

ROLL, THEIR_ROLL = "roll, ours [mrad]", "roll, benchmark [mrad]"
APART = "shift to the same roll [mm]"
"""How far the wheelset must be moved to have the benchmark's roll: on a flange the roll alone says little."""

FIRST, SECOND = "tread", "flange"


class ContactRight(Section):
    """21 lateral shifts of the right wheel, the flange root among them."""

    item = 1
    part = "b"
    title = "Manchester contact benchmark A-2.2, right wheel"
    about = (
        "The same 21 positions, of the wheel that runs against its flange. Published numbers of this side are not at "
        "hand: what is listed is ours, by the mirror (shift, roll and yaw with their signs turned). Two things can be "
        "compared: the roll that the benchmark states lets both wheels touch, so that it depends on the right wheel as "
        "much as on the left one; and at 0 mm both sides are alike. Creep forces are those of both laws at the same "
        "creepages on one Hertzian ellipse under the normal force that carries 10 kN without creep, and those of two "
        "contacts, tread and flange, each with its own ellipse, creepages and force by FASTSIM, under 10 kN in all."
    )
    source = "roll and the left wheel: CONTACT open r2707, mbench_a22_left.ref_out (contact/mbench_a22_left.csv)"
    needs = (BENCHMARK, *PROFILES)
    size = (11.0, 4.5)

    def compute(self, size: Size) -> pd.DataFrame:
        del size
        wheel, rail = profiles()
        wheelset, side = WheelsetOnTrack((wheel, rail)), Side(wheel, rail, Layout())
        table = ContactTable.build(two_contacts(wheel, rail, Layout(), load=LOAD))
        given = read(BENCHMARK)
        positions = [_position(wheelset, side, table, row) for row in given.to_dict("records")]
        between = [_position(wheelset, side, table, row, own_roll=True) for row in _between(given)]
        return pd.DataFrame(positions + between).sort_values(SHIFT, ignore_index=True)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        stated = where(table, table[THEIR_ROLL].notna())
        tread, face = where(stated, stated[SHIFT] < FACE), where(stated, stated[SHIFT] > FACE)
        ours, theirs = values(tread, ROLL), values(tread, THEIR_ROLL)
        at = worst(ours, theirs)
        words = f"roll of the wheelset on tread and root (worst, at {values(tread, SHIFT)[at]:g} mm)"
        rows = [self.agrees(words, ours[at], theirs[at], 0.02, "mrad")]
        apart = values(face, APART)
        at = worst(apart, np.zeros_like(apart))
        words = f"shift to the benchmark's roll on the flange (worst, at {values(face, SHIFT)[at]:g} mm)"
        rows.append(self.agrees(words, apart[at], 0.0, 0.05, "mm"))
        given = read(BENCHMARK).to_dict("records")[0]
        rows += [
            self.agrees("wheel place at 0 mm", values(table, "wheel place [mm]")[0], -given["ycp_w_mm"], 0.7, "mm"),
            self.agrees(
                "contact angle at 0 mm",
                values(table, "contact angle [rad]")[0],
                given["contact_angle_rad"],
                0.02,
                "rad",
            ),
        ]
        root = where(table, table[SHIFT] > ROOT)
        for direction in "xy":
            polach, fastsim, two = (
                values(root, f"{name} F{direction} [mu N]") for name in ("Polach", "FASTSIM", "two contacts")
            )
            rows.append(
                self.noted(
                    f"F{direction} beyond {ROOT:g} mm, Polach minus FASTSIM, largest",
                    100.0 * np.abs(polach - fastsim).max(),
                    None,
                    "% of mu N",
                )
            )
            rows.append(
                self.noted(
                    f"F{direction} beyond {ROOT:g} mm, one ellipse minus two, largest",
                    100.0 * np.abs(fastsim - two).max(),
                    None,
                    "% of mu N",
                )
            )
        return rows

    def listing(self, table: pd.DataFrame) -> pd.DataFrame:
        """Every position."""
        return table

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        panels = picture.subplots(1, 3)
        shift = values(table, SHIFT)
        panels[0].plot(shift, values(table, "contact angle [rad]"), color=BLUE, label="one contact")
        for name, colour in ((FIRST, GREEN), (SECOND, ORANGE)):
            normal = values(table, f"{name} normal force [N]")
            angle = np.where(normal > 0.0, values(table, f"{name} contact angle [rad]"), np.nan)
            panels[0].plot(shift, angle, "o", ms=4, color=colour, label=name)
            panels[1].plot(shift, 1e-3 * normal, "o-", ms=4, color=colour, label=name)
        for name, colour in (("FASTSIM", BLUE), ("Polach", RED), ("two contacts", GREEN)):
            panels[2].plot(shift, values(table, f"{name} Fy [mu N]"), color=colour, label=name)
        for axes, title, unit in zip(
            panels,
            ("contact angle", "normal force", "lateral creep force"),
            ("rad", "kN", "share of mu N"),
            strict=True,
        ):
            axes.set(title=title, ylabel=unit, xlabel="lateral shift to the right in mm")
            axes.legend(frameon=False, fontsize=7)


def _between(given: pd.DataFrame) -> list[dict[str, float]]:
    """Positions of our own between the benchmark's, where the contact passes from the root to the flange's face."""
    columns = ("y_ws_mm", "yaw_ws_rad", "vx_mm_s", "vpitch_rad_s")
    shift = values(given, columns[0])
    return [{name: float(np.interp(at, shift, values(given, name))) for name in columns} for at in BETWEEN]


def _rigid_roll(side: Side, shift: float, yaw: float) -> float:
    """Roll (field side of the right wheel up) at which both wheels touch without interpenetration, as the benchmark's
    positions have it [rad].
    """

    def excess(roll: float) -> float:
        return side.at(shift, roll, yaw).rigid_height - side.at(-shift, -roll, -yaw).rigid_height

    return root_scalar(excess, bracket=(-0.04, 0.04), xtol=1e-9).root


def _apart(side: Side, shift: float, yaw: float, roll: float) -> float:
    """How far from `shift` the wheelset rolls by `roll` [m]."""

    def excess(moved: float) -> float:
        return _rigid_roll(side, shift + moved, yaw) - roll

    return root_scalar(excess, bracket=(-2e-4, 2e-4), xtol=1e-8).root


def _position(
    wheelset: WheelsetOnTrack, side: Side, table: ContactTable, row: Mapping[Any, Any], own_roll: bool = False
) -> dict[str, float]:
    """One position, in the frame of the right side: y to the field, roll field side up, yaw to the field; forces on the
    wheel along the rail and, in the contact plane, to the field.
    """
    shift, yaw = 1e-3 * row["y_ws_mm"], row["yaw_ws_rad"]
    roll = -wheelset.at(-shift, -yaw).roll if own_roll else -row["roll_ws_rad"]
    speed, spin = 1e-3 * row["vx_mm_s"], -row["vpitch_rad_s"]
    contact = side.at(shift, roll, yaw)
    creep = creepages(contact, roll, yaw, speed, spin)
    columns = {
        SHIFT: row["y_ws_mm"],
        ROLL: -1e3 * _rigid_roll(side, shift, yaw),
        THEIR_ROLL: math.nan if own_roll else 1e3 * row["roll_ws_rad"],
        APART: math.nan if own_roll else 1e3 * _apart(side, shift, yaw, roll),
        "wheel place [mm]": 1e3 * contact.wheel_position,
        "rail place [mm]": 1e3 * contact.rail_position,
        "contact angle [rad]": contact.angle,
        "height [mm]": 1e3 * contact.height,
        "longitudinal creepage [-]": creep[0],
        "lateral creepage [-]": creep[1],
        "spin creepage [1/m]": creep[2],
    }
    return columns | _one(contact, creep) | _two(table, shift, roll, yaw, speed, spin)


def _one(contact: ProfileContact, creep: tuple[float, float, float]) -> dict[str, float]:
    """Creep forces on one ellipse as shares of mu N."""
    normal = LOAD / math.cos(contact.angle)
    ellipse = hertz_ellipse(math.cos(contact.angle) / contact.radius, contact.curvature)
    a, b = ellipse.longitudinal * math.cbrt(normal), ellipse.lateral * math.cbrt(normal)
    columns = {}
    for name, law in LAWS.items():
        force = law(*creep, a, b, *kalker_coefficients(a / b), normal, FRICTION, 1.0, 1.0)
        for direction, value in zip("xy", force, strict=True):
            columns[f"{name} F{direction} [mu N]"] = value / (FRICTION * normal)
    return columns


def _two(table: ContactTable, shift: float, roll: float, yaw: float, speed: float, spin: float) -> dict[str, float]:
    """Both contacts of a wheel that carries the load."""

    def wheels(height: float) -> tuple[WheelForces, WheelForces]:
        state = WheelState(shift, height, roll, yaw, 0.0, 0.0, 0.0, 0.0, speed, spin, FRICTION, 0.0, 0.0, 0.0, 0.0, 0.0)
        first, second = (
            WheelOnRail(table.start, table.spacing, table.coefficients[k], float(table.stiffness[k]), 1.0, 0.46)
            for k in (0, 2)
        )
        return wheel_forces(first, LAW, state), second_forces(second, LAW, state)

    def excess(height: float) -> float:
        return sum(forces.force_z for forces in wheels(height)) - LOAD

    found = wheels(root_scalar(excess, bracket=(-0.03, 0.03)).root)
    columns = {}
    for name, forces in zip((FIRST, SECOND), found, strict=True):
        columns[f"{name} normal force [N]"] = forces.normal
        columns[f"{name} contact angle [rad]"] = math.atan(forces.tangent)
        columns[f"{name} spin creepage [1/m]"] = forces.spin_creepage
    limit = FRICTION * sum(forces.normal for forces in found)
    columns["two contacts Fx [mu N]"] = sum(forces.creep_force_x for forces in found) / limit
    columns["two contacts Fy [mu N]"] = sum(forces.creep_force_y for forces in found) / limit
    return columns
