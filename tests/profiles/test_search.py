"""Contact search: against closed forms, its own potential, and the Manchester benchmark A-2.2."""

import numpy as np
import pytest

from experiments.reporting.size import Size
from experiments.validation.contact_benchmark import (
    BENCHMARK,
    CREEPAGES,
    GEOMETRY,
    PUT_IN,
    SHIFT,
    ContactBenchmark,
    profiles,
)
from experiments.validation.reference import read
from railsim.contact.functions import ContactTable
from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile
from railsim.profiles.s1002 import s1002
from railsim.profiles.search import Side
from railsim.profiles.tables import contact_functions
from railsim.profiles.uic60 import uic60
from railsim.profiles.wear import worn
from railsim.profiles.wheelset import WheelsetOnTrack
from tests.profiles.reference import needs_reference

CONE = 0.05


@pytest.fixture(scope="module")
def sides() -> tuple[Profile, Profile]:
    return s1002(), uic60(1 / 40)


def cone() -> Profile:
    """A straight tread with a flange as steep as need be."""
    y = np.linspace(-0.07, 0.06, 651)
    flank = np.clip(-0.04 - y, 0.0, 0.01)
    return Profile("wheel", y, CONE * y - 2.8 * flank - np.clip(y + 0.05, None, 0.0) * 2.8, "cone")


def test_cone_on_an_arc_in_closed_form() -> None:
    side = Side(cone(), uic60(), Layout(), load=100.0)
    origin = side.rail_origin
    for shift in (-0.004, 0.0, 0.003):
        contact = side.at(shift)
        place = -0.3 * np.sin(np.arctan(CONE))  # on the crown of radius 300 mm; beyond its end: on that of 80 mm
        if place < -0.010228:
            first = np.arcsin(0.010228 / 0.3)
            place = -(0.22 * np.sin(first) + 0.08 * np.sin(np.arctan(CONE)))
        assert contact.rail_position == pytest.approx(place, abs=2e-5)
        assert contact.half_distance == pytest.approx(origin + place, abs=2e-5)
        assert contact.angle == pytest.approx(np.arctan(CONE), abs=1e-6)
        assert contact.wheel_position == pytest.approx(origin + place - 0.75 - shift, abs=2e-5)
        assert contact.radius == pytest.approx(0.46 - CONE * contact.wheel_position, abs=1e-8)
        assert contact.curvature == pytest.approx(1 / 0.08, rel=0.02)
        assert contact.rail_curvature == pytest.approx(1 / 0.08, rel=0.02)
        assert contact.wheel_curvature == pytest.approx(0.0, abs=1e-3)


def test_yaw_moves_the_contact_along_the_rail() -> None:
    side = Side(cone(), uic60(), Layout(), load=100.0)
    yaw = 0.02
    straight, turned = side.at(0.0), side.at(0.0, yaw=yaw)
    expected = -yaw * (turned.half_distance - straight.radius * CONE)  # -(b - r tan(delta)) yaw
    assert turned.position[0] == pytest.approx(expected, rel=1e-3)
    assert turned.angle == pytest.approx(straight.angle, abs=1e-4)


def test_roll_turns_the_wheel_about_its_centre(sides: tuple[Profile, Profile]) -> None:
    side = Side(*sides, Layout())
    roll, small = 1e-3, 1e-6
    straight = side.at(0.0, roll=roll)
    change = (side.at(0.0, roll=roll + small).height - side.at(0.0, roll=roll - small).height) / (2 * small)
    across, up = straight.position[1:]
    assert change == pytest.approx(-across - up * np.tan(straight.angle), rel=1e-3)


def test_lift_is_the_potential_of_the_averaged_angle(sides: tuple[Profile, Profile]) -> None:
    side = Side(*sides, Layout(), load=50e3)
    outline = side.outline()
    for shift in (-0.006, -0.001, 0.0, 0.002, 0.0052, 0.0058, 0.0075, 0.010):
        step = 1e-7
        rise = (side.contact(outline, shift + step).height - side.contact(outline, shift - step).height) / (2 * step)
        assert rise == pytest.approx(np.tan(side.contact(outline, shift).angle), rel=1e-4)


def test_small_loads_approach_the_rigid_search(sides: tuple[Profile, Profile]) -> None:
    soft, hard = (Side(*sides, Layout(), load=load).at(-0.004) for load in (50e3, 1.0))
    assert (
        abs(hard.wheel_position - hard.rigid_wheel_position)
        < 0.03e-3
        < abs(soft.wheel_position - soft.rigid_wheel_position)
    )
    assert hard.depth < 0.1e-6
    assert hard.height == pytest.approx(hard.rigid_height, abs=0.1e-6)


def test_tables_are_smooth_and_rise_to_the_flange(sides: tuple[Profile, Profile]) -> None:
    functions = contact_functions(*sides, Layout(), load=50e3)
    assert functions.shift == pytest.approx(-functions.shift[::-1], abs=1e-15)
    assert functions.lift[300] == 0.0
    angle = functions.contact_angle()
    assert np.degrees(angle.max()) == pytest.approx(70.0, abs=0.5)
    assert np.abs(np.diff(np.tan(angle))).max() < 0.6  # the step to the flange takes several cells
    assert np.diff(functions.radius[200:]).min() > 0.0
    assert functions.curvature.min() > 0.5
    assert functions.half_distance[[0, 300, 480]] == pytest.approx([0.7554, 0.7505, 0.7185], abs=1e-3)
    tread = np.abs(functions.shift) < 0.004
    side = Side(*sides, Layout(), load=50e3)
    direct = [side.at(float(shift)).angle for shift in functions.shift[tread][::20]]
    assert angle[tread][::20] == pytest.approx(direct, abs=1e-3)
    wide = contact_functions(*sides, Layout(gauge=1.445), load=50e3)
    assert wide.lift[500] < functions.lift[500]
    wheels = sides[0], worn(sides[0], 0.5)
    table = ContactTable.build(*(contact_functions(wheel, sides[1], Layout(), points=61) for wheel in wheels))
    assert np.isfinite(table.coefficients).all()


def test_symmetric_wheelset_is_level_and_mirrors(sides: tuple[Profile, Profile]) -> None:
    wheelset = WheelsetOnTrack(sides)
    table = wheelset.over(np.array([-0.003, 0.0, 0.003]))
    roll = table["roll [rad]"].to_numpy()
    assert roll == pytest.approx(-roll[::-1], abs=1e-7)
    mirrored = table["right.rolling_radius [m]"].to_numpy()[::-1]
    assert table["left.rolling_radius [m]"].to_numpy() == pytest.approx(mirrored, abs=1e-7)
    placed = wheelset.at(0.003)
    assert placed.left.height == pytest.approx(placed.right.height, abs=1e-7)
    worn_right = WheelsetOnTrack(sides, (worn(sides[0], 1.0), sides[1])).at(0.0)
    assert worn_right.left.radius != pytest.approx(worn_right.right.radius, abs=1e-5)


def test_no_overlap_is_said(sides: tuple[Profile, Profile]) -> None:
    with pytest.raises(ValueError, match="do not overlap"):
        Side(*sides, Layout()).at(0.2)
    with pytest.raises(ValueError, match="wheel and a rail"):
        Side(sides[1], sides[0], Layout())


@needs_reference
def test_manchester_a22_left_wheel() -> None:
    """Tighter than the validation report asks for: what this search reaches, conformal positions apart."""
    table = ContactBenchmark().compute(Size.FULL)
    assert len(table) == 21
    for row in table.to_dict("records"):
        apart = {what: row[f"{what}, ours"] - row[f"{what}, CONTACT"] for what in (*GEOMETRY, "longitudinal place")}
        conformal = row[SHIFT] < 0.9
        assert abs(apart["wheel place"]) < (0.4 if conformal else 0.02)
        assert abs(apart["rail place"]) < (0.4 if conformal else 0.02)
        assert abs(apart["longitudinal place"]) < 0.005
        assert abs(apart["contact angle"]) < (0.0015 if conformal else 2e-4)
        assert abs(apart["height"]) < 0.003
        along, across, spin = ((row[f"{what}, ours"], row[f"{what}, CONTACT"]) for what in CREEPAGES)
        assert across[0] == pytest.approx(across[1], rel=1e-3, abs=1e-9)
        if row[SHIFT] > 0.0:  # at 0 the two terms of the longitudinal creepage cancel: 2e-5 apart, stated
            assert along[0] == pytest.approx(along[1], rel=0.02)
            assert spin[0] == pytest.approx(spin[1], rel=0.02)
        else:
            assert along[0] == pytest.approx(along[1], abs=2.5e-5)
            assert spin[0] == pytest.approx(spin[1], rel=0.05)
            assert row[f"spin creepage, {PUT_IN}"] == pytest.approx(spin[1], rel=0.005)
            assert row[f"longitudinal creepage, {PUT_IN}"] == pytest.approx(along[1], rel=0.01)


@needs_reference
def test_manchester_a22_roll_from_both_sides() -> None:
    wheelset = WheelsetOnTrack(profiles())
    for row in read(BENCHMARK).to_dict("records"):
        placed = wheelset.at(-1e-3 * row["y_ws_mm"], yaw=-row["yaw_ws_rad"])
        assert placed.roll == pytest.approx(row["roll_ws_rad"], abs=1.3e-4)
        assert 1e3 * placed.height == pytest.approx(-row["z_ws_mm"], abs=0.1)
