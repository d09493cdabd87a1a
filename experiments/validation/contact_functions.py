"""Item 4, second part: contact functions of S1002 on 60E1 for several gauges."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from experiments.reporting.plots import BLUE, GREY, ORANGE, RED
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from experiments.validation.tables import of, values, where
from railsim.profiles.conicity import equivalent_conicity
from railsim.profiles.files import read_profile
from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile
from railsim.profiles.search import Side
from railsim.profiles.wheelset import WheelsetOnTrack

GAUGES = (1.430, 1.435, 1.440)
COLOURS = {1430.0: ORANGE, 1435.0: BLUE, 1440.0: RED}
GAUGE, SHIFT, SCALED = "gauge [mm]", "shift [m]", "shift [mm]"
LOAD = 55e3  # N; a loaded wheel
REACH = 8.0  # mm
TREAD = 0.2  # rad; contact angle up to which both contacts are on the tread
PANELS = {
    "left.rolling_radius [m]": ("rolling radius − r0", "mm", 1e3, 0.46),
    "left.contact_angle [rad]": ("contact angle", "rad", 1.0, 0.0),
    "left.wheel_place [m]": ("contact on the wheel", "mm", 1e3, 0.0),
    "left.rail_place [m]": ("contact on the rail", "mm", 1e3, 0.0),
    "left.curvature [1/m]": ("sum of lateral curvatures", "1/m", 1.0, 0.0),
    "roll [rad]": ("roll of the wheelset", "mrad", 1e3, 0.0),
}


class ContactFunctionsOverGauge(Section):
    """What the kernels' tables are made of, with both wheels in contact."""

    item = 4
    part = "b"
    title = "Contact functions of S1002 on 60E1 over the gauge"
    about = (
        "Wheelset with new S1002 wheels on 60E1 rails at 1:40, 55 kN a wheel, gauges 1430, 1435 and 1440 mm, roll "
        "such that both wheels touch. Checked are identities: the left and right wheel are mirror images, the "
        "slope of the wheel's height over its shift is the tangent of the contact angle (the lift is a potential, "
        "so that the contact neither makes nor eats energy); and what is known of the pair: conicity near 0.18 at "
        "3 mm and 1435 mm, falling with a wider gauge, with the flange at play that grows by half of the gauge's "
        "change."
    )
    source = "identities; conicity of S1002 on 60E1 1:40: Manchester benchmark A-2.2 (CONTACT)"
    size = (14.0, 8.0)

    def compute(self, size: Size) -> pd.DataFrame:
        shifts = 1e-3 * np.linspace(-REACH, REACH, size.of(97, 49, 25))
        profiles = read_profile("s1002"), read_profile("uic60_40")
        parts = []
        for gauge in GAUGES:
            layout = Layout(gauge=gauge)
            table = WheelsetOnTrack(profiles, layout=layout, load=LOAD).over(shifts)
            table.insert(0, GAUGE, 1e3 * gauge)
            table["rise - tan(angle) [-]"] = _potential(profiles, layout, shifts)
            parts.append(table)
        return pd.concat(parts, ignore_index=True)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        left = values(table, "left.rolling_radius [m]").reshape(len(GAUGES), -1)
        right = values(table, "right.rolling_radius [m]").reshape(len(GAUGES), -1)
        mirror = float(np.abs(left - right[:, ::-1]).max())
        rise = float(np.abs(values(table, "rise - tan(angle) [-]")).max())
        conicity = {gauge: _conicity(table, gauge) for gauge in COLOURS}
        flange_contact = {gauge: _flange(table, gauge) for gauge in COLOURS}
        rows = [
            self.bounded(
                "rolling radius, right over mirrored left: largest difference", 1e6 * mirror, high=1.0, unit="µm"
            ),
            self.bounded("slope of the height less tan(contact angle), largest", rise, high=1e-3),
            self.agrees("conicity at 3 mm, gauge 1435 mm", conicity[1435.0], 0.18, 0.02, "-"),
        ]
        for narrow, wide in ((1430.0, 1435.0), (1435.0, 1440.0)):
            words = f"gauge {narrow:g} over {wide:g} mm: conicity at 3 mm, ratio"
            rows.append(self.bounded(words, conicity[narrow] / conicity[wide], low=1.0))
            words = f"gauge {narrow:g} to {wide:g} mm: flange touches later by"
            rows.append(
                self.agrees(
                    words, flange_contact[wide] - flange_contact[narrow], 2.5, 0.2, "mm", "half of the gauge's change"
                )
            )
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        panels = picture.subplots(2, 4)
        for gauge, colour in COLOURS.items():
            part = of(table, GAUGE, gauge)
            for axes, (column, (title, unit, factor, zero)) in zip(panels.flat, PANELS.items(), strict=False):
                axes.plot(1e3 * part[SHIFT], factor * (part[column] - zero), color=colour, label=f"{gauge:g} mm")
                axes.set_title(title if column == "roll [rad]" else f"left: {title}", fontsize=10)
                axes.set_ylabel(unit)
            difference = 1e3 * (part["left.rolling_radius [m]"] - part["right.rolling_radius [m]"])
            panels[1, 2].plot(1e3 * part[SHIFT], difference, color=colour)
        panels[0, 1].set_yscale("log")
        panels[1, 0].set(yscale="log")
        panels[1, 2].set(ylabel="mm", ylim=(-6.0, 6.0))
        panels[1, 2].set_title("radius, left minus right", fontsize=10)
        for axes in panels.flat[:-1]:
            axes.set_xlabel("shift to the left in mm")
        panels[0, 0].legend(title="gauge", frameon=False, fontsize=8)
        _chords(panels[1, 3], of(table, GAUGE, 1435.0))


def _potential(profiles: tuple[Profile, Profile], layout: Layout, shifts: np.ndarray) -> np.ndarray:
    """d(height)/d(shift) of one wheel, by central differences, less the tangent of its contact angle."""
    side, step = Side(*profiles, layout, LOAD), 1e-7
    outline = side.outline()
    rises = [
        (side.contact(outline, shift + step).height - side.contact(outline, shift - step).height) / (2.0 * step)
        - np.tan(side.contact(outline, shift).angle)
        for shift in map(float, shifts)
    ]
    return np.array(rises)


def _conicity(table: pd.DataFrame, gauge: float) -> float:
    part = of(table, GAUGE, gauge)
    difference = values(part, "left.rolling_radius [m]") - values(part, "right.rolling_radius [m]")
    return float(equivalent_conicity(values(part, SHIFT), difference, np.array([3e-3]))[0])


def _flange(table: pd.DataFrame, gauge: float) -> float:
    """Shift [mm] at which the left contact leaves the tread."""
    part = where(table, (table[GAUGE] == gauge) & (table[SHIFT] > 0.0))
    angle, shift = values(part, "left.contact_angle [rad]"), 1e3 * values(part, SHIFT)
    first = int(np.argmax(angle > TREAD))
    return float(np.interp(TREAD, angle[first - 1 : first + 1], shift[first - 1 : first + 1]))


def _chords(axes: Axes, part: pd.DataFrame) -> None:
    """Both profiles, one above the other, and lines between the places that touch."""
    wheel, rail = read_profile("s1002"), read_profile("uic60_40")
    apart = 12.0
    near = (wheel.y > -0.056) & (wheel.y < 0.045)
    axes.plot(1e3 * wheel.y[near], 1e3 * wheel.z[near] + apart, color=GREY, lw=1.5)
    head = rail.z > -0.02
    offset = 1e3 * (Side(wheel, rail, Layout(), LOAD).rail_origin - Layout().half_taping())
    axes.plot(1e3 * rail.y[head] + offset, 1e3 * rail.z[head], color=GREY, lw=1.5)
    for row in part.iloc[::2].to_dict("records"):
        on_wheel, on_rail = 1e3 * row["left.wheel_place [m]"], 1e3 * row["left.rail_place [m]"]
        heights = (
            float(np.interp(on_wheel, 1e3 * wheel.y, 1e3 * wheel.z)) + apart,
            float(np.interp(on_rail, 1e3 * rail.y[head], 1e3 * rail.z[head])),
        )
        colour = RED if row["left.contact_angle [rad]"] > TREAD else BLUE
        axes.plot([on_wheel, on_rail + offset], heights, color=colour, lw=0.6)
    axes.set_title("left: touching places, 1435 mm", fontsize=10)
    axes.set(xlabel="y from the taping line in mm", ylabel="mm")
    axes.set_aspect("equal", adjustable="box")
