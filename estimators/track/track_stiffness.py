"""Vertical stiffness of the track along the line, from the resonance of a wheelset on it."""

from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.noise import noise_floor
from estimators.speed.axleboxes import SETTLES, Axle, AxleboxEstimator, Line
from estimators.speed.odometry import integrate_speed
from estimators.track.stiffness_fit import FEWEST, Section, section
from estimators.track.stiffness_model import Common, Springs, expected
from estimators.track.stiffness_windows import Windows, windows
from railsim.measurements import Measurements
from railsim.spec import quantity

FINER = 6.0
"""Places of the grid in the shortest wave."""
MOST = 200
"""Windows that are fitted together; a longer record is cut into sections of so many."""


class TrackStiffness(AxleboxEstimator, frozen=True):
    """Vertical stiffness of the track along the line, from accelerometers on both axleboxes of an axle.

    It is the stiffness of a rail under a wheel at rest, in windows, by a likelihood of the axleboxes' spectra. The
    unsprung mass on the track resonates at 25 to 80 Hz, and the softer the track the lower. Roughness excites it; its
    spectrum is unknown but smooth. Level and ratio have deviations of their own: what data sheets leave open of
    wheelset and track moves all windows alike.
    """

    slowest: float = quantity(3.0, unit="m/s", source="illustrative: slower is marked as invalid", gt=0.5)
    length: float = quantity(20.0, unit="m, of the windows", source="illustrative", ge=5.0, le=200.0)
    lowest: float = quantity(14.0, unit="Hz", source="above the bogie on its primary springs", ge=5.0, le=50.0)
    highest: float = quantity(110.0, unit="Hz", source="beam and lumped track differ by 16 % there", ge=60.0, le=400.0)
    widest: float = quantity(0.3, unit="deviation over value that is still given", source="illustrative", gt=0.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """A row each `length` of line.

        Raises
        ------
        InputError : a channel, the speed or a parameter is missing, or the vehicle does not move.
        """
        self.need(measurements)
        odometry = integrate_speed(measurements, self.speed_source, self.slowest)
        axle = Axle.of(measurements, self.axle)
        moving = odometry.speed_at_knots[odometry.trusted]
        slow = max(float(np.quantile(moving, 0.02)) if moving.size else self.slowest, self.slowest)
        highest = min(self.highest, axle.reach)
        cells = max(1, int(np.ceil(self.length * FINER * highest / slow)))
        line = Line.of(axle, odometry, self.length / cells, SETTLES)
        found = windows(axle, line, self.length, self.lowest, highest)
        stated = max(axle.sheet.density(axle.rate) ** 2, noise_floor(axle.acceleration.mean(axis=0), axle.rate), 1e-10)
        common, springs = expected(measurements.vehicle, stated / 2.0)
        good = np.flatnonzero(found.used.any(axis=1))
        parts = np.array_split(good, max(1, -(-len(good) // MOST)))
        sections = [self._section(found.take(part), common, springs) for part in parts]
        columns = {name: np.full(len(found.s), np.nan) for name in COLUMNS}
        for part, one in zip(parts, sections, strict=True):
            for name, values in self._columns(one).items():
                columns[name][part] = values
        valid = np.zeros(len(found.s))
        valid[good] = 1.0
        series = pd.DataFrame({"s [m]": found.s, "time [s]": found.time, **columns, "valid [-]": valid})
        about: dict[str, Any] = {
            "settings": self.model_dump(mode="json"),
            "sections": [_told(one, found, part) for part, one in zip(parts, sections, strict=True) if part.size],
            "warnings": self._warnings(sections),
            **odometry.stated(),
        }
        return Estimate(self.name, series, about)

    def _section(self, found: Windows, common: Common, springs: Springs) -> Section | None:
        return section(found, common, springs) if len(found.s) >= FEWEST else None

    def _columns(self, found: Section | None) -> dict[str, np.ndarray]:
        """Of one section: nothing where it is not believed, and in windows that know too little."""
        if found is None or found.reason:
            return {}
        std = found.std()
        known = found.inside & (std <= self.widest)
        off, off_std = found.ratio(known)
        value, ratio = np.exp(found.log_stiffness[known]), np.exp(off)
        columns = {name: np.full(len(known), np.nan) for name in COLUMNS}
        for name, values in zip(COLUMNS, (value, value * std[known], ratio, ratio * off_std), strict=True):
            columns[name][known] = values
        return columns

    def _warnings(self, sections: list[Section | None]) -> list[str]:
        few = f"fewer than {FEWEST} windows of {self.length:g} m can be used: nothing is given"
        reasons = [few if one is None else one.reason for one in sections]
        return [f"stiffness is withheld: {one}" for one in dict.fromkeys(reasons) if one]


COLUMNS = (
    "track_stiffness [N/m]",
    "track_stiffness_std [N/m]",
    "track_stiffness_ratio [-]",
    "track_stiffness_ratio_std [-]",
)
"""Stiffness of a rail under a wheel, and the same over the geometric mean of the section."""


def _told(found: Section | None, all_windows: Windows, part: np.ndarray) -> dict[str, Any]:
    """What about.json holds of a section."""
    told: dict[str, Any] = {"from [m]": float(all_windows.s[part[0]]), "to [m]": float(all_windows.s[part[-1]])}
    if found is None or found.reason:
        return told
    shortest, longest = found.wavelengths
    return told | {
        "shortest wave [m]": shortest,
        "longest wave [m]": longest,
        "half wheelset mass [kg]": found.common.mass,
        "foundation of pads alone [N/m2]": found.common.pad,
        "sleepers [kg/m]": found.common.sleeper,
        "noise [m/s2/sqrt(Hz)]": float(np.sqrt(found.common.noise)),
    }
