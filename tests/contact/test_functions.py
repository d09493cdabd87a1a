"""Contact functions and their tables: closed forms of the analytic pairs, Hertz's stiffness, the mirrored wheel."""

import dataclasses

import numpy as np
import pytest

from railsim.analysis.curving.contact import Side
from railsim.contact.functions import AXIS_A, AXIS_B, BY_TURN, C22, LIFT, RADIUS, ContactFunctions, ContactTable
from railsim.contact.hertz import STEEL_POISSON, STEEL_YOUNG
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.pairs import WheelRailPair
from railsim.profiles.pair import ProfilePair

WHEEL, HALF = 0.46, 0.75  # m


def value(table: ContactTable, side: int, channel: int, shift: float) -> float:
    """What the table says of one channel at a shift."""
    place = (shift - table.start) / table.spacing
    cell = int(place)
    return float(table.coefficients[side, cell, channel] @ (place - cell) ** np.arange(4))


def test_cone_as_wide_as_its_rail_head_is_as_stiff_as_a_sphere_on_a_plane() -> None:
    """Johnson (1985), eqs. 4.22 and 4.23: both curvatures 1 / R, so N = 4/3 E* sqrt(R) p^1.5 and a = b."""
    radius = 0.35
    pair = WheelRailPair(kind="conical", conicity=0.05, rail_head_radius=radius)
    table = ContactTable.build(pair.contact_functions(radius, HALF))
    modulus = STEEL_YOUNG / (2.0 * (1.0 - STEEL_POISSON**2))
    assert table.stiffness == pytest.approx([4.0 / 3.0 * modulus * np.sqrt(radius)] * 2, rel=1e-9)
    a = (3.0 * radius / (4.0 * modulus)) ** (1.0 / 3.0)
    axes = [value(table, 0, channel, 0.0) for channel in (AXIS_A, AXIS_B)]
    assert axes == pytest.approx([a, a], rel=1e-6, abs=0.0)
    assert value(table, 0, C22, 0.0) == pytest.approx(kalker_coefficients(1.0)[1], rel=1e-6)


def test_arcs_have_the_contact_of_wickens() -> None:
    """Wickens (2003), section 2.5: with d = R_w - R_r the contact angle grows by u / d, the wheel's contact moves by
    R_w u / d and the rail's by R_r u / d, and the equivalent conicity is the angle at rest times R_w / d.
    """
    pair = WheelRailPair()
    apart = pair.wheel_profile_radius - pair.rail_head_radius
    functions = pair.contact_functions(WHEEL, HALF)
    tread = np.abs(functions.shift) < 2e-3
    u = functions.shift[tread]
    at_rest = pair.conicity * apart / pair.wheel_profile_radius
    assert functions.contact_angle()[tread] == pytest.approx(at_rest + u / apart, abs=1e-5)
    assert functions.half_distance[tread] == pytest.approx(HALF - pair.rail_head_radius / apart * u, abs=1e-8)
    lift = apart * np.log(np.cos(at_rest) / np.cos(at_rest + u / apart))  # integral of the angle's tangent
    assert functions.lift[tread] == pytest.approx(lift, abs=1e-9)
    assert functions.radius[tread] == pytest.approx(WHEEL + pair.wheel_profile_radius / apart * lift, abs=1e-9)
    assert functions.curvature[tread] == pytest.approx(1.0 / 0.3 - 1.0 / 0.5)


def test_flange_climbs_at_its_angle() -> None:
    functions = WheelRailPair(flange_angle=1.1).contact_functions(WHEEL, HALF)
    assert functions.contact_angle()[-1] == pytest.approx(1.1, abs=1e-3)
    climbed = np.diff(functions.radius) / np.diff(functions.lift)
    assert climbed[-1] == pytest.approx(1.0, rel=1e-6)  # the wheel's contact moves as the wheel does


def test_profiles_that_nearly_fit_each_other_are_refused() -> None:
    with pytest.raises(ValueError, match=r"more than 0\.05 m"):
        WheelRailPair(wheel_profile_radius=0.34).contact_functions(WHEEL, HALF)


def test_table_meets_the_functions_and_mirrors_the_right_wheel() -> None:
    functions = WheelRailPair().contact_functions(WHEEL, HALF)
    table = ContactTable.build(functions)
    for at in (3, 150, 300, 444, 597):
        u = float(functions.shift[at]) + 1e-12
        for channel, expected in ((LIFT, functions.lift[at]), (RADIUS, functions.radius[at])):
            assert value(table, 0, channel, u) == pytest.approx(expected, abs=1e-10)
            assert value(table, 1, channel, -u) == pytest.approx(expected, abs=1e-10)
    between = 0.3 * functions.shift[300] + 0.7 * functions.shift[301]
    lift, mirrored = value(table, 0, LIFT, between), value(table, 1, LIFT, -between)
    assert lift == pytest.approx(mirrored, abs=1e-15)
    assert lift == pytest.approx(functions.lift[301] * 0.7, rel=1e-3)


def test_functions_cannot_be_changed() -> None:
    """Tables are kept by the functions that they are made of."""
    functions = WheelRailPair().contact_functions(WHEEL, HALF)
    with pytest.raises(dataclasses.FrozenInstanceError):
        functions.lift = 2.0 * functions.lift  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize("shift", [np.linspace(-0.01, 0.012, 23), np.linspace(-0.1, 0.1, 21) ** 3 * 10.0])
def test_grids_that_are_not_uniform_and_symmetric_are_refused(shift: np.ndarray) -> None:
    flat = np.zeros_like(shift)
    functions = ContactFunctions(shift, 0.05 * shift, 0.46 + flat, 0.75 + flat, 3.0 + flat)
    with pytest.raises(ValueError, match="uniform grid that is symmetric"):
        ContactTable.build(functions)


@pytest.mark.parametrize("contacts", [1, 2])
def test_the_roll_moves_a_contact_by_what_the_profiles_have_and_never_far(contacts: int) -> None:
    """The balance of steady curving has its own search for a tilted wheel; here where the tread is round (S1002)."""
    pair = ProfilePair(kind="profiles", contacts=contacts, upright_rails=1.0)
    left, right = pair.sides(WHEEL, HALF)
    assert right is None
    for functions in (left, left.second):
        if functions is not None:
            assert functions.upright == 1.0
            assert np.abs(functions.channels()[:, BY_TURN]).max() <= 0.3
    assert not pair.but(upright_rails=0.0).sides(WHEEL, HALF)[0].channels()[:, BY_TURN].any()


def test_the_radius_of_a_rolled_wheel_is_that_of_a_tilted_profile() -> None:
    """Against the search of the steady balance, which has the two arcs as curves and tilts one of them."""
    functions, roll = WheelRailPair().sides(WHEEL, HALF)[0], 5e-4
    upright = dataclasses.replace(functions, upright=1.0)
    for shift in (-4e-3, 0.0, 3e-3):
        height = WHEEL + float(np.interp(shift, functions.shift, functions.lift))
        tilted = [
            Side(functions, 1.0).deepest_point(shift - WHEEL * one, height - HALF * one, one, 0.0).value[RADIUS]
            for one in (roll, -roll)
        ]
        by_turn = np.interp(shift, upright.shift, upright.channels()[:, BY_TURN])
        assert 0.5 * (tilted[0] - tilted[1]) == pytest.approx(roll * by_turn, rel=0.02)
