"""A wheelset on both rails: roll that lets both wheels touch, contact quantities over the lateral shift."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import root_scalar

from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile
from railsim.profiles.search import ProfileContact, Side

_LARGEST_ROLL = 0.04  # rad


@dataclass(frozen=True)
class Placement:
    """A wheelset in contact with both rails; `left` and `right` in the frames of their own sides.

    Attributes
    ----------
    shift, roll, yaw : of the wheelset in the track frame (left +, left side up +, to the left +) [m, rad].
    height : of its centre above nominal [m].
    """

    shift: float
    roll: float
    yaw: float
    height: float
    left: ProfileContact
    right: ProfileContact


class WheelsetOnTrack:
    """Two independent sides.

    Parameters
    ----------
    left, right : (wheel, rail) profiles in the frames of their own sides; `right` defaults to the left ones.
    layout, load : as for `Side`.
    """

    def __init__(
        self,
        left: tuple[Profile, Profile],
        right: tuple[Profile, Profile] | None = None,
        layout: Layout | None = None,
        load: float = 10e3,
    ) -> None:
        self.layout = layout or Layout()
        self.left = Side(*left, self.layout, load)
        self.right = self.left if right is None else Side(*right, self.layout, load)

    def at(self, shift: float, yaw: float = 0.0, roll: float | None = None) -> Placement:
        """Place the wheelset at `shift` [m] and `yaw` [rad]; without `roll` both wheels touch.

        Raises
        ------
        ValueError : no roll within 0.04 rad lets both wheels touch.
        """
        if roll is None:
            roll = self._roll(shift, yaw)
        left, right = self._sides(shift, yaw, roll)
        return Placement(shift, roll, yaw, max(left.height, right.height), left, right)

    def over(self, shifts: np.ndarray, yaw: float = 0.0) -> pd.DataFrame:
        """Contact quantities of both sides over the lateral shift, one row each."""
        return pd.DataFrame([_row(self.at(float(shift), yaw)) for shift in shifts])

    def radius_difference(self, shifts: np.ndarray) -> np.ndarray:
        """Rolling radius left minus right over the lateral shift, both [m]."""
        placements = [self.at(float(shift)) for shift in shifts]
        return np.array([placement.left.radius - placement.right.radius for placement in placements])

    def _sides(self, shift: float, yaw: float, roll: float) -> tuple[ProfileContact, ProfileContact]:
        return self.left.at(shift, roll, yaw), self.right.at(-shift, -roll, -yaw)

    def _roll(self, shift: float, yaw: float) -> float:
        def excess(roll: float) -> float:
            left, right = self._sides(shift, yaw, roll)
            return left.height - right.height

        limit = _LARGEST_ROLL
        if excess(-limit) * excess(limit) > 0.0:
            raise ValueError(f"no roll lets both wheels touch at a shift of {1e3 * shift:.1f} mm")
        return root_scalar(excess, bracket=(-limit, limit), xtol=1e-8).root


_COLUMNS = {
    "wheel_place [m]": "wheel_position",
    "rail_place [m]": "rail_position",
    "contact_angle [rad]": "angle",
    "rolling_radius [m]": "radius",
    "curvature [1/m]": "curvature",
    "wheel_curvature [1/m]": "wheel_curvature",
    "rail_curvature [1/m]": "rail_curvature",
    "half_distance [m]": "half_distance",
}


def _row(placement: Placement) -> dict[str, float]:
    row = {"shift [m]": placement.shift, "roll [rad]": placement.roll, "height [m]": placement.height}
    for side, contact in (("left", placement.left), ("right", placement.right)):
        row |= {f"{side}.{title}": getattr(contact, field) for title, field in _COLUMNS.items()}
    return row
