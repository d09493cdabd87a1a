"""Turning the points of a profile file into the common frame, by the shape of wheels and rails."""

from typing import Literal

import numpy as np

from railsim.errors import InputError
from railsim.profiles.profile import Kind, Profile

GaugeSide = Literal["negative", "positive"]

FLANGE_BACK = 0.070
"""Distance of the taping line from the flange's back [m]."""

_FLAT = 0.3  # largest slope of tread, flange tip and rail crown
_BACKWARD = 1e-3  # m; longest way that flat pieces may run against the others before the points count as unsorted

_SAME = 2e-5  # m; points nearer than that to the one before are dropped


def oriented(points: np.ndarray, kind: Kind, gauge_side: GaugeSide | None, stem: str, name: str) -> Profile:
    """Profile from `points` (n, 2) [m] in whichever direction they are; `name` stands in front of messages.

    Raises
    ------
    InputError : points out of order, no flange, taping line cannot be placed.
    """
    points = points[np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > _SAME))]
    _check_order(points, name)
    y, z = points.T if points[-1, 0] > points[0, 0] else points[::-1].T
    y, z = _wheel(y, z, name) if kind == "wheel" else _rail(y, z, gauge_side)
    return Profile(kind, y, z, stem).zeroed()


def _pieces(y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Middles (y, z) and steps (dy, dz) of the pieces between points."""
    return 0.5 * (y[1:] + y[:-1]), 0.5 * (z[1:] + z[:-1]), np.diff(y), np.diff(z)


def _check_order(points: np.ndarray, name: str) -> None:
    _, _, step_y, step_z = _pieces(*points.T)
    flat = step_y[np.abs(step_z) < np.abs(step_y)]
    backward = min(-flat[flat < 0.0].sum(), flat[flat > 0.0].sum())
    if backward > _BACKWARD:
        raise InputError(
            f"{name}: {1e3 * backward:.1f} mm of flat pieces run backwards; list the points in order along the profile"
        )


def _wheel(y: np.ndarray, z: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    lateral, height, step_y, step_z = _pieces(y, z)
    flat = np.abs(step_z) < _FLAT * np.abs(step_y)
    order = np.argsort(height[flat])
    share = np.cumsum(np.abs(step_y[flat])[order])
    if share.size == 0 or share[-1] < 0.03:
        raise InputError(f"{name}: no tread found (30 mm with a slope below {_FLAT:g}); is it a wheel?")
    tread = height[flat][order][np.searchsorted(share, 0.5 * share[-1])]
    tip = flat & (np.abs(height - tread) > 0.015)
    if not tip.any():
        raise InputError(f"{name}: no flange found (tip 15 mm or more off the tread); is it a wheel, are units right?")
    if np.median(height[tip]) > tread:
        z = -z
    if np.median(lateral[tip]) > np.median(lateral[flat & ~tip]):
        y, z = -y[::-1], z[::-1]
    at_tip = float(y[np.argmin(z)])
    if 0.008 <= at_tip <= 0.022:
        y = y - FLANGE_BACK
    elif not -0.062 <= at_tip <= -0.048:
        raise InputError(
            f"{name}: flange tip at y = {1e3 * at_tip:.1f} mm; shift y so that 0 is the flange's back (tip near 15)"
            " or the taping line (tip near -55)"
        )
    return y, z


def _rail(y: np.ndarray, z: np.ndarray, gauge_side: GaugeSide | None) -> tuple[np.ndarray, np.ndarray]:
    lateral, height, step_y, step_z = _pieces(y, z)
    flat = np.abs(step_z) < _FLAT * np.abs(step_y)
    crown = np.average(height[flat], weights=np.abs(step_y[flat])) if flat.any() else height.max()
    if np.abs(z.min() - crown) < np.abs(z.max() - crown):
        z, height = -z, -height
        crown = -crown
    steep = ~flat & (height < crown - 0.005)
    sides = {bool(side) for side in lateral[steep] > np.median(lateral[flat])}
    mirrored = sides == {True} if gauge_side is None else gauge_side == "positive"
    return (-y[::-1], z[::-1]) if mirrored else (y, z)
