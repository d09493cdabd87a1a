"""Where both rails lie under the wheelset, from the track as it was measured and found again by the wheelset's path."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.optimize import minimize

from estimators.interface import Missing
from estimators.signals.bands import Band, band_pass
from estimators.vehicle.state_space import CANT_BASE
from estimators.wheel_rail.wheelset_motion import NEEDED, WheelsetMotion, nominal
from railsim.errors import InputError
from railsim.measurements import Measurements

FINDING = Band(15.0, 60.0)  # m; longer than Klingel's, in which the wheelset follows the rails
SPACING = 0.1  # m
NO_RAILS = (
    "the measured track with 'lateral [m]' or 'left_lateral [m]': name its file under 'track' in the map (of a "
    "simulation: set track_measured to true)"
)
"""What is missing where the rails' lateral position is not known, and how to give it."""


def missing_rails(measurements: Measurements) -> Missing:
    """What is missing where the track was not measured, or not sideways."""
    track = measurements.track
    known = track is not None and bool({"lateral [m]", "left_lateral [m]"} & set(track.columns))
    return Missing() if known else Missing(others=(NO_RAILS,))


@dataclass(frozen=True)
class Rails:
    """Lateral position of the rails under the wheelset over time, in the motion's band, m, shapes (n,).

    centre : of both rails, left +. gauge : deviation of the gauge, wider +. distance : on the track, m.
    """

    centre: np.ndarray
    gauge: np.ndarray
    distance: np.ndarray


class Survey:
    """The measured track as functions of distance.

    s : m. centre : lateral position of the rails' middle, m. gauge : deviation, m. height : wheel radius times the
    rails' roll, left side up +, m.

    Raises
    ------
    InputError : the recording has no measured track, or none with a lateral column.
    """

    def __init__(self, measurements: Measurements) -> None:
        table = measurements.track
        names = [] if table is None else list(table.columns)
        if table is None or missing_rails(measurements):
            raise InputError(f"the wheel-rail geometry needs {NO_RAILS}")
        self.s = table["s [m]"].to_numpy()
        column = {name: table[name].to_numpy() if name in names else np.zeros(len(self.s)) for name in _COLUMNS}
        own = [column["lateral [m]"] + half * column["gauge_deviation [m]"] for half in (0.5, -0.5)]
        left, right = own[0] + column["left_lateral [m]"], own[1] + column["right_lateral [m]"]
        self.centre, self.gauge = (left + right) / 2.0, left - right
        level = column["cross_level [m]"] + column["right_vertical [m]"] - column["left_vertical [m]"]
        self.height = -nominal(measurements, "wheel_radius") * level / CANT_BASE

    def rails(self, motion: WheelsetMotion, offset: float, scale: float) -> Rails:
        """Rails under the wheelset if it began at `offset` (m) and went `scale` times its measured way."""
        distance = offset + scale * motion.distance
        return Rails(self.middle(motion, distance), np.interp(distance, self.s, self.gauge), distance)

    def middle(self, motion: WheelsetMotion, distance: np.ndarray) -> np.ndarray:
        """Lateral position of the rails' middle (m) in the band at the places `distance` (m), shapes (n,)."""
        return motion.band.filter(np.interp(distance, self.s, self.centre))

    def find(self, motion: WheelsetMotion) -> float:
        """Distance (m) at which the record begins: where the wheelset's path fits the rails best.

        Raises
        ------
        InputError : the way is longer than the measured track.
        """
        distance = np.arange(0.0, motion.distance[-1], SPACING)
        if distance[-1] > self.s[-1] - self.s[0]:
            raise InputError(
                f"the record covers {distance[-1]:.0f} m, the measured track {self.s[-1] - self.s[0]:.0f} m; "
                "give the track of the whole way"
            )
        path = band_pass(np.interp(distance, motion.distance, motion.y), SPACING, FINDING)
        grid = np.arange(self.s[0], self.s[-1], SPACING)
        centre = band_pass(np.interp(grid, self.s, self.centre), SPACING, FINDING)
        agreement = signal.correlate(centre, path, "valid", "fft")
        size = signal.correlate(centre**2, np.ones(len(path)), "valid", "fft")
        return float(grid[int(np.argmax(agreement / np.sqrt(np.maximum(size, 1e-3 * size.max()))))])


def centre_fit(measurements: Measurements, motion: WheelsetMotion, survey: Survey) -> tuple[float, float]:
    """Offset (m) and scale (-) of the way for which the yaw rate is predicted best by the shift on a cone.

    Klingel's motion with the nominal suspension: -r0 l psi' / V = lambda (y - d) + moment / f11, lambda and f11 free.
    """
    radius, half, inertia, stiffness, damping = (nominal(measurements, name) for name in NEEDED)
    moment = inertia * motion.yaw_acceleration + stiffness * motion.yaw + damping * motion.yaw_rate
    rows = np.flatnonzero(motion.valid)[::4]
    output, held = (-radius * half * motion.yaw_rate / motion.speed)[rows], moment[rows]

    def misfit(offset: float, scale: float) -> float:
        shift = (motion.y - survey.middle(motion, offset + scale * motion.distance))[rows]
        regressors = np.stack([shift, shift**3 * 1e5, held], axis=1)
        return 1e3 * float(np.std(output - regressors @ np.linalg.lstsq(regressors, output, rcond=None)[0]))

    return refine(misfit, survey.find(motion))


def refine(misfit: Callable[[float, float], float], offset: float) -> tuple[float, float]:
    """Offset (m) and scale (-) for which `misfit(offset, scale)` is least, near `offset` and one."""
    starts = np.array([offset + step for step in np.arange(-2.0, 2.1, 0.25)])
    best = float(starts[int(np.argmin([misfit(float(one), 1.0) for one in starts]))])
    simplex = np.array([[best, 0.0], [best + 0.2, 0.0], [best - 0.3, 1.0]])
    solution = minimize(
        lambda x: misfit(float(x[0]), 1.0 + 1e-3 * float(x[1])),
        x0=simplex[0],
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 5e-3, "fatol": 1e-7, "maxfev": 120},
    )
    return float(solution.x[0]), 1.0 + 1e-3 * float(solution.x[1])


_COLUMNS = (
    "lateral [m]", "gauge_deviation [m]", "left_lateral [m]", "right_lateral [m]", "cross_level [m]",
    "left_vertical [m]", "right_vertical [m]",
)  # fmt: skip
