"""Item 4: measured MiniProf wheels: profiles, contact functions, equivalent conicity."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from experiments.reporting.plots import BLACK, BLUE, GREEN, GREY, RED
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from experiments.validation.reference import folder
from experiments.validation.tables import of, values, where
from railsim.profiles.conicity import equivalent_conicity
from railsim.profiles.files import read_profile
from railsim.profiles.profile import Profile
from railsim.profiles.wheelset import WheelsetOnTrack

WHEELS = ("Car7216_0001r.whl", "Car7358_0001r.whl", "avg_wheel.whl")
MEASURED_RAIL, OTHER_RAIL = "avg_HR.BAN", "uic60_40"
NEW = "s1002"
COLOURS = {NEW: GREY, WHEELS[0]: BLUE, WHEELS[1]: RED, WHEELS[2]: GREEN}
WHEEL_TOLERANCE, RAIL_TOLERANCE = 5e-5, 2e-5  # m, rms; smoothing of the measured profiles
AMPLITUDES = np.arange(1.0, 8.01, 0.5)  # mm
FLANGE_CONTACT = 0.3  # rad; contact angle beyond which it is the flange that touches
LATERAL, HEIGHT, AMPLITUDE, CONICITY = "y [mm]", "z [mm]", "amplitude [mm]", "conicity [-]"
SHIFT, DIFFERENCE, ANGLE, ON_WHEEL = "shift [mm]", "difference [mm]", "left angle [rad]", "left place on wheel [mm]"
CURVATURE, RAIL_CURVATURE = "left wheel curvature [1/m]", "left rail curvature [1/m]"
PLAUSIBLE = "plausibility, our limit; S1002: EN 13715"


class MeasuredWheels(Section):
    """Three wheels on the rail that was measured with them and on 60E1, beside S1002."""

    item = 4
    title = "Measured wheels"
    about = (
        "Three MiniProf wheels (smoothed to 0.05 mm rms) as wheelsets of two equal wheels, 1360 mm between the "
        "flange backs, on a measured rail (0.02 mm rms) and on 60E1 at 1:40, gauge 1435 mm: wheels with treads "
        "near 1:20, which were not made for 60E1. Checked are the flange against that of S1002; a rolling-radius "
        "difference that rises with the shift everywhere (single-valued, and of the right hand: a wheelset that "
        "moves to the left runs on the larger left wheel); and the conicity as long as no flange touches, from "
        "that of a cone 1:40 to 0.6. A conicity below the tread's slope belongs to a convex tread, whose contact "
        "moves along the rail more than along the wheel: the estimate slope times rail curvature over the sum of "
        "both curvatures stands beside it."
    )
    source = "MiniProf files of CONTACT's test bank (profiles/*.whl, avg_HR.BAN)"
    needs = tuple(f"profiles/{name}" for name in (*WHEELS, MEASURED_RAIL))
    size = (15.0, 7.5)

    def compute(self, size: Size) -> pd.DataFrame:
        shifts = np.linspace(-10.0, 10.0, size.of(81, 41, 21))
        rails = {
            MEASURED_RAIL: read_profile(folder() / "profiles" / MEASURED_RAIL).smoothed(RAIL_TOLERANCE),
            OTHER_RAIL: read_profile(OTHER_RAIL),
        }
        new = read_profile(NEW)
        parts = [_outline(rail).assign(kind="rail", rail=name) for name, rail in rails.items()]
        for name in COLOURS:
            given = new if name == NEW else read_profile(folder() / "profiles" / name)
            wheel = new if name == NEW else given.smoothed(WHEEL_TOLERANCE)
            parts.append(_outline(given).assign(kind="profile", wheel=name))
            parts.append(pd.DataFrame([flange_measures(given)]).assign(kind="flange", wheel=name))
            for rail_name, rail in rails.items():
                found = _functions(wheel, rail, shifts)
                parts += [part.assign(wheel=name, rail=rail_name) for part in found]
        return pd.concat(parts, ignore_index=True)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        new = _part(table, "flange", NEW).iloc[0]
        rows = []
        for wheel in WHEELS:
            flange = _part(table, "flange", wheel).iloc[0]
            rows += [
                self.agrees(f"{wheel}: flange height", flange["Sh [mm]"], new["Sh [mm]"], 3.0, "mm", PLAUSIBLE),
                self.agrees(f"{wheel}: flange thickness", flange["Sd [mm]"], new["Sd [mm]"], 4.0, "mm", PLAUSIBLE),
                self.bounded(f"{wheel}: qR", flange["qR [mm]"], low=6.5, unit="mm", source="EN 15313: in service"),
            ]
            for rail in (MEASURED_RAIL, OTHER_RAIL):
                rows += self._of_pair(table, wheel, rail)
        return rows

    def _of_pair(self, table: pd.DataFrame, wheel: str, rail: str) -> list[Row]:
        function, conicity = _part(table, "function", wheel, rail), _part(table, "conicity", wheel, rail)
        words = f"{wheel} on {rail}"
        rise = np.diff(values(function, DIFFERENCE)) / np.diff(values(function, SHIFT))
        free = play(function)
        within = where(conicity, conicity[AMPLITUDE] < free)
        conicities, amplitudes = values(within, CONICITY), values(within, AMPLITUDE)
        low, high = int(np.argmin(conicities)), int(np.argmax(conicities))
        at_2 = float(np.interp(2.0, amplitudes, conicities))
        middle = where(function, function[SHIFT].abs() <= 2.0)
        share = middle[RAIL_CURVATURE] / (middle[RAIL_CURVATURE] + middle[CURVATURE])
        estimate = float((np.tan(middle[ANGLE]) * share).mean())
        return [
            self.bounded(f"{words}: least slope of the radius difference over the shift", float(rise.min()), low=0.0),
            self.noted(f"{words}: shift at which a flange touches", free, None, "mm"),
            self.bounded(f"{words}: least conicity (at {amplitudes[low]:g} mm)", conicities[low], low=0.025),
            self.bounded(f"{words}: largest conicity (at {amplitudes[high]:g} mm)", conicities[high], high=0.6),
            self.noted(f"{words}: conicity at 2 mm, beside slope times share of curvature", at_2, estimate, "-"),
        ]

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        panels = picture.subplots(2, 4)
        for name, colour in COLOURS.items():
            _draw_wheel(panels, table, name, colour)
        _draw_rails(panels[0, 2], table)
        titles = ("wheels", "height above S1002", "rails", f"equivalent conicity on {OTHER_RAIL}")
        titles += (f"radius difference on {MEASURED_RAIL}", f"radius difference on {OTHER_RAIL}")
        titles += (f"contact angle of the left wheel on {MEASURED_RAIL}", f"equivalent conicity on {MEASURED_RAIL}")
        for axes, title in zip(panels.flat, titles, strict=True):
            axes.set_title(title, fontsize=10)
        panels[0, 0].set(xlabel="y from the taping line in mm", ylabel="z in mm", aspect="equal")
        panels[0, 0].legend(frameon=False, fontsize=7, loc="lower right")
        panels[0, 1].set(xlabel="y from the taping line in mm", ylabel="mm", xlim=(-40.0, 50.0), ylim=(-4.0, 2.0))
        for axes in (panels[1, 0], panels[1, 1]):
            axes.set(xlabel="shift to the left in mm", ylabel="left minus right in mm", xlim=(-8, 8), ylim=(-3, 3))
        panels[1, 2].set(xlabel="shift to the left in mm", ylabel="rad", ylim=(0.0, 0.15))
        for axes in (panels[0, 3], panels[1, 3]):
            axes.axhspan(0.025, 0.6, color=GREY, alpha=0.15, lw=0)
            axes.set(xlabel="amplitude in mm", ylabel="tan γe (dotted: flange touches)", ylim=(0.0, 0.7))


def flange_measures(wheel: Profile) -> dict[str, float]:
    """Sh, Sd, qR of a wheel [mm] (EN 15313): tip above the taping line; from the back to the flank 10 mm above the
    taping line; across from there to the flank 2 mm below the tip. The back is 70 mm from the taping line.
    """
    y, z = 1e3 * wheel.y, 1e3 * wheel.z
    tip = int(np.argmin(z))
    flank = slice(tip, int(np.argmin(np.abs(y))))
    low, high = (float(np.interp(level, z[flank], y[flank])) for level in (-10.0, z[tip] + 2.0))
    return {"Sh [mm]": float(-z[tip]), "Sd [mm]": low + 70.0, "qR [mm]": low - high}


def play(function: pd.DataFrame) -> float:
    """Smallest shift to the left at which the left flange touches [mm]."""
    touching = where(function, (function[SHIFT] > 0.0) & (function[ANGLE] > FLANGE_CONTACT))
    return float(values(touching, SHIFT).min())


def _functions(wheel: Profile, rail: Profile, shifts: np.ndarray) -> list[pd.DataFrame]:
    """Contact functions over the shift [mm], and the equivalent conicity."""
    functions = WheelsetOnTrack((wheel, rail)).over(1e-3 * shifts)
    difference = 1e3 * (functions["left.rolling_radius [m]"] - functions["right.rolling_radius [m]"])
    function = pd.DataFrame(
        {
            "kind": "function",
            SHIFT: shifts,
            DIFFERENCE: difference,
            ANGLE: functions["left.contact_angle [rad]"],
            ON_WHEEL: 1e3 * functions["left.wheel_place [m]"],
            CURVATURE: functions["left.wheel_curvature [1/m]"],
            RAIL_CURVATURE: functions["left.rail_curvature [1/m]"],
        }
    )
    tangent = equivalent_conicity(shifts, difference.to_numpy(), AMPLITUDES)
    return [function, pd.DataFrame({"kind": "conicity", AMPLITUDE: AMPLITUDES, CONICITY: tangent})]


def _outline(profile: Profile) -> pd.DataFrame:
    return pd.DataFrame({LATERAL: 1e3 * profile.y, HEIGHT: 1e3 * profile.z})


def _part(table: pd.DataFrame, kind: str, wheel: str | None = None, rail: str | None = None) -> pd.DataFrame:
    part = of(table, "kind", kind)
    part = part if wheel is None else of(part, "wheel", wheel)
    return part if rail is None else of(part, "rail", rail)


def _draw_wheel(panels: np.ndarray, table: pd.DataFrame, name: str, colour: str) -> None:
    outline, new = _part(table, "profile", name), _part(table, "profile", NEW)
    panels[0, 0].plot(outline[LATERAL], outline[HEIGHT], color=colour, lw=1.2, label=name)
    tread = outline[outline[LATERAL] > -45.0]
    level = np.interp(tread[LATERAL], *(new.loc[new[LATERAL] > -55.0, column] for column in (LATERAL, HEIGHT)))
    panels[0, 1].plot(tread[LATERAL], tread[HEIGHT] - level, color=colour, lw=1.2)
    for rail, axes, last in ((MEASURED_RAIL, panels[1, 0], panels[1, 3]), (OTHER_RAIL, panels[1, 1], panels[0, 3])):
        function, conicity = _part(table, "function", name, rail), _part(table, "conicity", name, rail)
        axes.plot(function[SHIFT], function[DIFFERENCE], color=colour, lw=1.4)
        free = conicity[AMPLITUDE] < play(function)
        last.plot(conicity[AMPLITUDE], conicity[CONICITY], color=colour, lw=1.0, ls=":")
        last.plot(conicity[AMPLITUDE][free], conicity[CONICITY][free], "o-", color=colour, lw=1.4, ms=3)
        if rail == MEASURED_RAIL:
            panels[1, 2].plot(function[SHIFT], function[ANGLE], color=colour, lw=1.4)


def _draw_rails(axes: Axes, table: pd.DataFrame) -> None:
    for rail, colour in ((MEASURED_RAIL, BLACK), (OTHER_RAIL, GREY)):
        outline = _part(table, "rail", rail=rail)
        outline = where(outline, outline[HEIGHT] > -20.0)
        face = float(values(where(outline, outline[HEIGHT] < -13.0), LATERAL).min())
        axes.plot(outline[LATERAL] - face, outline[HEIGHT], color=colour, lw=1.2, label=rail)
    axes.set(xlabel="y from the gauge face in mm", ylabel="z in mm", aspect="equal")
    axes.legend(frameon=False, fontsize=8)
