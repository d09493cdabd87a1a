"""Two contacts at once where a rail is two rails: CONTACT's `two_patches`, a wheel on a crossing."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root_scalar

from railsim.contact.functions import ContactTable
from railsim.contact.wheel import FASTSIM, ContactLaw, WheelForces, WheelOnRail, WheelState, second_forces, wheel_forces
from railsim.profiles.files import read_profile
from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile
from railsim.profiles.zones import two_contacts
from tests.profiles.reference import PROFILES, REFERENCE, needs_reference

CROSSING = REFERENCE / "contact" / "crossing"
RADIUS, RAIL, SHIFT, LOAD = 0.46, 0.750, 3.52e-3, 10e3
PLACE = 0.160
SPEED, SPIN = 2.0, 4.3481181


def slices(path: Path) -> tuple[np.ndarray, list[np.ndarray]]:
    """Places along the rail [m] and points (y, z down) [m] of a file of slices."""
    lines = re.findall(r"^\s*(\S+)\s+'(.+)'\s*$", path.read_text(), re.MULTILINE)
    return np.array([float(at) for at, _ in lines]), [np.loadtxt(path.parent / name) for _, name in lines]


def under_the_wheel(path: Path, place: float) -> Profile:
    """The rail as a wheel without yaw sees it: the highest of its cross-sections, each lowered by how much the wheel's
    circle rises ahead of its middle.
    """
    places, sections = slices(path)
    y = np.arange(-41e-3, 60e-3, 1e-4)
    heights = np.array([np.interp(y, *section.T[:2]) for section in sections])
    ahead = np.arange(-8e-3, 8.01e-3, 2.5e-4)
    seen = [
        np.array([np.interp(place + x, places, column) for column in heights.T]) + 0.5 * x * x / RADIUS for x in ahead
    ]
    up = -np.min(seen, axis=0)
    groove = (y > -24e-3) & (y < 26.5e-3)  # filled to a depth that the wheel does not reach
    across = np.linspace(0.0, np.pi, groove.sum())
    up[groove] = np.interp(across, across[[0, -1]], up[groove][[0, -1]]) - 2e-3 * np.sin(across)
    return Profile("rail", y, up, "crossing")


def reference(name: str) -> list[list[float]]:
    """Numbers below each line that begins with these titles."""
    text = (CROSSING / "two_patches.ref_out").read_text()
    return [[float(v) for v in line.split()] for line in re.findall(rf"^\s*{name}.*\n(.+)$", text, re.MULTILINE)]


@needs_reference
def test_both_patches_of_a_crossing() -> None:
    rail = under_the_wheel(CROSSING / "profiles" / "uk_interrupt_v2.slcs", PLACE)
    gauge = 2.0 * (RAIL + rail.gauge_point(0.014))
    made = two_contacts(read_profile(PROFILES / "MBench_S1002_v3.prw"), rail, Layout(gauge=gauge), load=LOAD)
    table = ContactTable.build(made)
    law = np.array(ContactLaw(0.3, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, FASTSIM))

    def wheels(z: float) -> tuple[WheelForces, WheelForces]:
        state = WheelState(SHIFT, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, SPEED, SPIN, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0)
        on = [
            WheelOnRail(table.start, table.spacing, table.coefficients[row], table.stiffness[row], 1.0, RADIUS)
            for row in (0, 2)
        ]
        return wheel_forces(on[0], law, state), second_forces(on[1], law, state)

    z = root_scalar(lambda height: sum(f.force_z for f in wheels(height)) - LOAD, bracket=(-0.01, 0.01)).root
    first, second = wheels(z)
    places = np.array([np.interp(SHIFT, made.shift, made.half_distance), second.shift])
    given = np.array(reference(r"XCP\(TR\)"))
    assert np.abs(places - 1e-3 * given[:, 1]).max() < 5e-4
    assert np.abs(np.arctan([first.tangent, second.tangent]) + given[:, 3]).max() < 0.02
    normal = np.array(reference("FN  "))[:, 0]
    assert np.array([first.normal, second.normal]) == pytest.approx(normal, rel=0.1)
