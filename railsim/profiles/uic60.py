"""The rail head 60E1 (UIC 60): arcs of radius 300, 80 and 13 mm and sides of slope 1:20 (EN 13674-1)."""

import numpy as np

from railsim.profiles.profile import Profile

_RADII = (300.0, 80.0, 13.0)  # mm
_JOINTS = (20.456 / 2.0, 52.053 / 2.0)  # mm from the rail's axis: where the arcs meet with a common tangent
_SIDE = np.arctan(20.0)  # inclination at which the last arc meets the side [rad]
_DEPTH = 38.0  # mm below the top at which the sides end


def uic60(inclination: float = 0.0) -> Profile:
    """New rail head; `inclination` 1/20 or 1/40 leans it towards the track's centre."""
    half_y, half_z = _half_head()
    y = np.concatenate((-half_y[:0:-1], half_y))
    z = np.concatenate((half_z[:0:-1], half_z))
    rail = Profile("rail", 1e-3 * y, 1e-3 * z, "uic60")
    if inclination == 0.0:
        return rail
    leaning = rail.inclined(inclination)
    return Profile("rail", leaning.y, leaning.z, f"uic60_{round(1.0 / inclination)}")


def _half_head() -> tuple[np.ndarray, np.ndarray]:
    """Points from the top of the axis down one side [mm]."""
    large, middle, small = _RADII
    first = np.arcsin(_JOINTS[0] / large)
    centre_2 = np.array([(large - middle) * np.sin(first), -large + (large - middle) * np.cos(first)])
    second = np.arcsin((_JOINTS[1] - centre_2[0]) / middle)
    centre_3 = centre_2 + (middle - small) * np.array([np.sin(second), np.cos(second)])
    pieces = [
        _arc(np.array([0.0, -large]), large, 0.0, first, 52),
        _arc(centre_2, middle, first, second, 81)[1:],
        _arc(centre_3, small, second, _SIDE, 181)[1:],
    ]
    end = pieces[-1][-1]
    down = np.arange(0.2, end[1] + _DEPTH, 0.2)
    pieces.append(np.column_stack((end[0] + down / 20.0, end[1] - down)))
    points = np.concatenate(pieces)
    return points[:, 0], points[:, 1]


def _arc(centre: np.ndarray, radius: float, start: float, end: float, count: int) -> np.ndarray:
    angle = np.linspace(start, end, count)
    return centre + radius * np.column_stack((np.sin(angle), np.cos(angle)))
