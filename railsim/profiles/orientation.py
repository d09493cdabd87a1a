"""Turning the points of a profile file into the common frame, by the shape of wheels and rails."""

from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.signal import find_peaks

from railsim.errors import InputError
from railsim.profiles.profile import Kind, Profile

GaugeSide = Literal["negative", "positive"]

FLANGE_BACK = 0.070
"""Distance of the taping line from the flange's back [m]."""

_FLAT = 0.3  # largest slope of tread, flange tip and rail crown
_BACKWARD = 1e-3  # m; longest way that flat pieces may run against the others before the points count as unsorted

_VALLEY = 0.015  # m; two tops with a deeper valley between them are two heads, as of a rail and its guard rail

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
    if kind == "wheel":
        return Profile(kind, *_wheel(y, z, name), stem).zeroed()
    y, z, said = _rail(y, z, gauge_side, name)
    return Profile(kind, y, z, stem, said).zeroed()


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


def _rail(
    y: np.ndarray, z: np.ndarray, gauge_side: GaugeSide | None, name: str
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Points of one head with the gauge side at negative y, and what was taken for granted."""
    lateral, height, step_y, step_z = _pieces(y, z)
    flat = np.abs(step_z) < _FLAT * np.abs(step_y)
    if not flat.any():
        raise InputError(f"{name}: nothing is flatter than a slope of {_FLAT:g}; is it the head of a rail?")
    crown = np.average(height[flat], weights=np.abs(step_y[flat]))
    if np.abs(z.min() - crown) < np.abs(z.max() - crown):
        z = -z
    y, z, guarded = _one_head(y, z, name)
    lateral, height, step_y, step_z = _pieces(y, z)
    flat = np.abs(step_z) < _FLAT * np.abs(step_y)
    crown = np.average(height[flat], weights=np.abs(step_y[flat]))
    steep = ~flat & (height < crown - 0.005)
    sides = {bool(side) for side in lateral[steep] > np.median(lateral[flat])}
    said: tuple[str, ...] = ()
    if guarded is not None:
        said = (f"{name}: two heads; the one at y = 0 is taken, its gauge side is towards the other (a guard rail)",)
        gauge_side = gauge_side or guarded
    elif gauge_side is None and len(sides) > 1:
        said = (f"{name}: both sides of the head are there; the negative one is taken as gauge side (gauge_side)",)
    elif gauge_side is None and not sides:
        said = (f"{name}: no side of the head is there; the negative one is taken as gauge side (gauge_side)",)
    mirrored = sides == {True} if gauge_side is None else gauge_side == "positive"
    return (-y[::-1], z[::-1], said) if mirrored else (y, z, said)


def _one_head(y: np.ndarray, z: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray, GaugeSide | None]:
    """Points of the running rail, and the side of it on which a guard rail stands, if there is one.

    Raises
    ------
    InputError : several heads, of which none or more than one stands over y = 0.
    """
    padded = np.concatenate(([z.min() - 1.0], z, [z.min() - 1.0]))
    tops = find_peaks(padded, prominence=_VALLEY)[0] - 1
    if tops.size < 2:
        return y, z, None
    valleys = [first + int(np.argmin(z[first:last])) for first, last in pairwise(tops)]
    parts = [slice(*ends) for ends in pairwise([0, *(one + 1 for one in valleys), y.size])]
    heads = [part for part in parts if _stands_over_origin(y[part], z[part])]
    if len(heads) != 1:
        raise InputError(
            f"{name}: {tops.size} heads (a guard rail?), and y = 0 is not over one of them; keep the points of the "
            "running rail only, or count y from its middle"
        )
    part = heads[0]
    return y[part], z[part], "negative" if part.start > 0 else "positive"


def _stands_over_origin(y: np.ndarray, z: np.ndarray) -> bool:
    head = y[z > z.max() - _VALLEY]
    return bool(head.min() <= 0.0 <= head.max())
