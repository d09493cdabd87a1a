"""Runs of equations (11) to (15) that figures 14 to 16 share, and their true geometry."""

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from estimators.wheel_rail.section_rls import Geometry, Signals
from railsim.contact.linear import creep_coefficients
from railsim.profiles.pair import ProfilePair
from railsim.track import Track, featured
from railsim.wheelset import RollingTable, WheelsetParameters, rolling_table, simulate_wheelset
from railsim.wheelset.equations import wheel_at
from railsim.wheelset.parameters import Coefficients

SPEED, RATE, START = 30.0, 1024.0, 25.0
SETTLED = 1.0  # s left out at the start
WIDTH = 5e-4  # m of a section
FEWEST = 0.004  # share of the samples that a section needs to be counted
PAIR = {"kind": "profiles", "wheel": "s1002", "rail": "uic60_40"}


def contact(wear: float = 0.0) -> RollingTable:
    """S1002 on 60E1 (1:40), as new or worn."""
    left, _ = ProfilePair.build(PAIR | {"wear": wear}).sides(0.45, 0.75)
    return rolling_table(left.shift, left.radius, left.contact_angle())


def parameters() -> WheelsetParameters:
    """The default wheelset with the creep coefficients of the new profiles at the centred place."""
    base = WheelsetParameters()
    left, _ = ProfilePair.build(PAIR).sides(base.wheel_radius, base.half_width)
    f11, f22, f23 = creep_coefficients(
        1.0 / base.wheel_radius, float(np.interp(0.0, left.shift, left.curvature)), base.load / 2.0, 0.7
    )
    return base.but(longitudinal_creep=f11, lateral_creep=f22, lateral_spin_creep=f23)


def track(seed: int, gauge: bool) -> Track:
    """4 km with lateral (and gauge) irregularity of 2 mm, like `paddington_bristol_like` with another seed."""
    made = featured.main_line(f"line_{seed}", seed=seed)
    return made if gauge else Track(made.s, {"lateral": made.columns()["lateral"]}, made.name, [])


def run(wheels: RollingTable, seed: int, gauge: bool, duration: float) -> tuple[Signals, Coefficients]:
    """Signals of an ideal sensor set, as section 4.3.1 assumes, and the numbers that it takes as known."""
    known = parameters()
    table = simulate_wheelset(known, wheels, track(seed, gauge), SPEED, duration, rate=RATE, start=START)
    return ideal_signals(known, table, SPEED)


def ideal_signals(parameters: WheelsetParameters, run: pd.DataFrame, speed: float) -> tuple[Signals, Coefficients]:
    """The article's measured quantities without error from a run of `simulate_wheelset`."""
    c = parameters.coefficients()
    time = run["time [s]"].to_numpy()

    def get(name: str) -> np.ndarray:
        return run[name].to_numpy()

    left, right = get("track.left_lateral [m]"), get("track.right_lateral [m]")
    force = c.k_y * (get("suspended_mass.y [m]") - get("wheelset.y [m]"))
    force = force + c.f_y * (get("suspended_mass.y_rate [m/s]") - get("wheelset.y_rate [m/s]"))
    signals = Signals(
        get("wheelset.y_rate [m/s]"),
        get("wheelset.y_acceleration [m/s2]"),
        get("wheelset.yaw [rad]"),
        get("wheelset.yaw_rate [rad/s]"),
        get("wheelset.yaw_acceleration [rad/s2]"),
        get("wheelset.roll [rad]"),
        CubicSpline(time, get("wheelset.roll [rad]"))(time, 1),
        force,
        get("wheelset.y [m]") - (left + right) / 2.0,
        left - right,
        np.full(len(time), speed),
    )
    settled = time >= SETTLED
    return Signals(*(values[settled] for values in signals)), c


def true_geometry(wheels: RollingTable, shift: np.ndarray, gauge: np.ndarray) -> Geometry:
    """Radii and angles at shifts (m) with gauge deviations (m), shapes (n,)."""
    left = np.array([wheel_at(wheels, 0, float(one))[:] for one in shift - gauge / 2.0])
    right = np.array([wheel_at(wheels, 1, float(one))[:] for one in -shift - gauge / 2.0])
    radius, angle = 0, 3
    return Geometry(
        left[:, radius] + right[:, radius],
        left[:, radius] - right[:, radius],
        left[:, angle] + right[:, angle],
        left[:, angle] - right[:, angle],
    )
