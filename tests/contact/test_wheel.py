"""Forces of one wheel: gradient of a potential, gravitational stiffness, loss of contact, and the mirror."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.contact.fastsim import fastsim_force
from railsim.contact.functions import AXIS_A, AXIS_B, C11, C22, C23, ContactTable
from railsim.contact.linear import linear_force
from railsim.contact.pairs import WheelRailPair
from railsim.contact.polach import friction_coefficient, polach_force
from railsim.contact.wheel import (
    FASTSIM,
    LINEAR,
    POLACH,
    SLOWEST,
    ContactLaw,
    WheelForces,
    WheelOnRail,
    WheelState,
    wheel_forces,
)

RADIUS, HALF = 0.46, 0.75
SMOOTH = ContactTable.build(WheelRailPair().contact_functions(RADIUS, HALF))
CONE = ContactTable.build(WheelRailPair(kind="conical", conicity=0.05).contact_functions(RADIUS, HALF))
ELASTIC = ContactLaw(0.4, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0)
FULL = ContactLaw(0.4, 0.4, 0.6, 1.0, 0.4, 1e-4, 1.0)


def wheel(
    table: ContactTable, side: int, law: ContactLaw, place: np.ndarray, pace: np.ndarray | None = None,
    spin: float = 20.0 / RADIUS, curvature: float = 0.0, rail: tuple[float, float] = (0.0, 0.0),
) -> WheelForces:  # fmt: skip
    """`place`: y, z, roll, yaw of the wheelset; `rail`: lateral and vertical deviation."""
    rates = np.zeros(4) if pace is None else pace
    cells, stiffness = table.coefficients[side], float(table.stiffness[side])
    constants = WheelOnRail(table.start, table.spacing, cells, stiffness, 1.0 - 2.0 * side, RADIUS)
    state = WheelState._make([*place, *rates, 20.0, spin, law.friction, rail[0], 0.0, rail[1], 0.0, curvature])
    return wheel_forces(constants, np.array(law), state)


def energy(side: int, place: np.ndarray) -> float:
    """2/5 C p_n^2.5 [J]."""
    normal = wheel(SMOOTH, side, ELASTIC, place).normal
    return 0.4 * normal * (normal / SMOOTH.stiffness[side]) ** (2.0 / 3.0)


PLACES = st.tuples(st.floats(-7e-3, 7e-3), st.floats(-6e-4, -2e-4), st.floats(-2e-4, 2e-4), st.floats(-0.02, 0.02))


@settings(max_examples=100)
@given(PLACES, st.sampled_from([0, 1]))
def test_elastic_forces_are_the_gradient_of_the_energy(place: tuple[float, ...], side: int) -> None:
    q = np.array(place)
    found = wheel(SMOOTH, side, ELASTIC, q)
    if found.normal < 1e3:
        return
    steps = 1e-7 * np.eye(4)
    slope = [-(energy(side, q + e) - energy(side, q - e)) / 2e-7 for e in steps]
    forces = (found.force_y, found.force_z, found.moment_x, found.moment_z)
    assert forces == pytest.approx(slope, rel=1e-4, abs=1e-3 * found.normal * np.array([1.0, 1.0, 1.0, 0.1]).min())
    assert (found.force_x, found.moment_spin) == (0.0, 0.0)


def test_cone_has_the_gravitational_stiffnesses_of_the_paper() -> None:
    """Ward et al. 2011, (16) and (17): lateral W lambda phi with phi of the shift, yaw moment + l W lambda psi."""
    load = 60e3
    sunk = (load / CONE.stiffness[0]) ** (2.0 / 3.0)
    yaw = 1e-3
    moment = sum(wheel(CONE, side, ELASTIC, np.array([0.0, -sunk, 0.0, yaw])).moment_z for side in (0, 1))
    assert moment == pytest.approx(2.0 * load * 0.05 * yaw * (HALF - RADIUS * 0.05), rel=0.01)


@settings(max_examples=100)
@given(PLACES, PLACES, st.floats(-0.01, 0.01), st.floats(40.0, 46.0))
def test_right_wheel_is_the_mirror_of_the_left(
    place: tuple[float, ...], pace: tuple[float, ...], curvature: float, spin: float
) -> None:
    flip = np.array([-1.0, 1.0, -1.0, -1.0])
    q, v = np.array(place), np.array(pace)
    left = wheel(SMOOTH, 0, FULL, q, v, spin, curvature, (1e-3, 2e-4))
    right = wheel(SMOOTH, 1, FULL, flip * q, flip * v, spin, -curvature, (-1e-3, 2e-4))
    turned = {"force_y", "moment_x", "moment_z", "creep_force_y", "creepage_y", "spin_creepage", "tangent", "shift"}
    for name, value in left._asdict().items():
        sign = -1.0 if name in turned else 1.0
        assert getattr(right, name) == pytest.approx(sign * value, rel=1e-6, abs=1e-6), name


def test_lifted_wheel_exerts_nothing() -> None:
    found = wheel(SMOOTH, 0, FULL, np.array([0.0, 1e-3, 0.0, 0.0]))
    assert found[:9] == (0.0,) * 9


@pytest.mark.parametrize("code", [POLACH, FASTSIM, LINEAR])
def test_lifted_wheel_that_slides_exerts_nothing_and_its_rail_keeps_its_friction(code: int) -> None:
    law = FULL._replace(law=float(code))
    found = wheel(SMOOTH, 0, law, np.array([1e-3, 1e-3, 1e-4, 5e-3]), np.array([0.2, 0.1, 0.05, 0.02]), spin=0.0)
    assert found[:9] == (0.0,) * 9
    assert found.friction == FULL.friction


def test_damping_cannot_pull() -> None:
    q = np.array([0.0, -1e-4, 0.0, 0.0])
    law = FULL._replace(damping=10.0)
    assert wheel(SMOOTH, 0, law, q, np.array([0.0, 1.0, 0.0, 0.0])).normal == 0.0
    assert wheel(SMOOTH, 0, law, q, np.array([0.0, -0.01, 0.0, 0.0])).normal > wheel(SMOOTH, 0, ELASTIC, q).normal


def test_creepages_of_a_shifted_wheelset() -> None:
    """Rolling freely: longitudinal creepages (r0 - r) / r0, and the lateral one of a yawed wheelset is -yaw.

    The wheel is 0.2 mm deep in the rail: it touches where it is nearest to it, 0.2 mm sin(delta) before its shift.
    """
    shifted = wheel(CONE, 0, FULL, np.array([2e-3, -1e-4, 0.0, 0.0]))
    assert shifted.creepage_x == pytest.approx(-0.05 * (2e-3 - 2e-4 * 0.05) / RADIUS, rel=1e-4)
    yawed = wheel(CONE, 0, FULL, np.array([0.0, -1e-4, 0.0, 1e-3]))
    assert yawed.creepage_y == pytest.approx(-1e-3, rel=2e-3)
    assert yawed.creep_force_y > 0.0
    turning = wheel(CONE, 0, FULL, np.array([0.0, -1e-4, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.1]))
    assert turning.creepage_x == pytest.approx(-HALF * 0.1 / 20.0, rel=1e-3)


@pytest.mark.parametrize("side", [0, 1])
def test_slip_of_a_yawed_wheelset_is_its_velocity_along_and_across_its_own_heading(side: int) -> None:
    """Turned by the yaw (second order): V cos + y' sin less what the wheel rolls, and y' cos - V sin in the contact."""
    speed, across, yaw, spin = 20.0, 0.5, 0.03, 43.8
    q, pace = np.array([1e-3, -2e-4, 0.0, yaw]), np.array([across, 0.0, 0.0, 0.0])
    found = wheel(SMOOTH, side, FULL, q, pace, spin=spin)
    reference = (speed**4 + SLOWEST**4) ** 0.25
    along = speed * np.cos(yaw) + across * np.sin(yaw) - found.radius * spin
    aside = (across * np.cos(yaw) - speed * np.sin(yaw)) / np.cos(np.arctan(found.tangent))
    assert found.creepage_x * reference == pytest.approx(along, abs=speed * yaw**3)
    assert found.creepage_y * reference == pytest.approx(aside, abs=speed * yaw**3)


@pytest.mark.parametrize("side", [0, 1])
def test_creep_force_turns_with_the_wheelset(side: int) -> None:
    """Its lateral part is tilted by the contact angle, and both are turned about z by the yaw (second order)."""
    yaw = 0.03
    q, pace = np.array([2e-3, -2e-4, 0.0, yaw]), np.array([0.05, 0.0, 0.0, 0.0])
    full = wheel(SMOOTH, side, FULL, q, pace, spin=43.8)
    elastic = wheel(SMOOTH, side, FULL._replace(creep=0.0), q, pace, spin=43.8)
    assert min(abs(full.creep_force_x), abs(full.creep_force_y)) > 0.05 * full.normal
    angle = np.arctan(full.tangent)
    level, turn = (
        full.creep_force_y * np.cos(angle),
        np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]),
    )
    expected = turn @ [full.creep_force_x, level]
    found = full.force_x - elastic.force_x, full.force_y - elastic.force_y
    assert found == pytest.approx(tuple(expected), abs=yaw**3 * full.normal)
    assert full.force_z - elastic.force_z == pytest.approx(full.creep_force_y * np.sin(angle), rel=1e-9)
    assert full.moment_spin - elastic.moment_spin == pytest.approx(-full.radius * full.creep_force_x, rel=1e-9)


def patch(found: WheelForces) -> list[float]:
    """Semi-axes and Kalker's coefficients of the left wheel where it touches."""
    place = (found.shift - SMOOTH.start) / SMOOTH.spacing
    cell = int(place)
    row = SMOOTH.coefficients[0, cell] @ (place - cell) ** np.arange(4)
    scale = np.cbrt(found.normal)
    return [row[AXIS_A] * scale, row[AXIS_B] * scale, *row[[C11, C22, C23]]]


@pytest.mark.parametrize("code", [POLACH, FASTSIM, LINEAR])
def test_code_of_the_law_chooses_the_creep_force(code: int) -> None:
    """Creep force of a wheel = the law called on its own, with that wheel's creepages and contact patch."""
    q = np.array([2e-3, -1e-4, 1e-4, 2e-3])
    found = wheel(SMOOTH, 0, FULL._replace(law=float(code)), q)
    creep = found.creepage_x, found.creepage_y, found.spin_creepage
    slip_speed = np.hypot(found.creepage_x, found.creepage_y) * (20.0**4 + SLOWEST**4) ** 0.25
    friction = friction_coefficient(FULL.friction, FULL.friction_ratio, FULL.friction_decay, slip_speed)
    assert found.friction == pytest.approx(friction, rel=1e-12)
    limited = [found.normal, friction, FULL.k_adhesion, FULL.k_slip]
    laws: list[tuple[Any, list[float], float]] = [
        (polach_force, limited, 1.0),
        (fastsim_force, limited, 1.0),
        (linear_force, [], 0.5 * (FULL.k_adhesion + FULL.k_slip)),
    ]
    law, more, share = laws[code]
    expected = share * np.array(law(*creep, *patch(found), *more))
    assert np.hypot(*expected) > 0.05 * friction * found.normal
    assert (found.creep_force_x, found.creep_force_y) == pytest.approx(tuple(expected), rel=1e-9)


def test_linear_law_knows_no_limit() -> None:
    found = wheel(SMOOTH, 0, FULL._replace(law=float(LINEAR)), np.array([0.0, -1e-4, 0.0, 0.0]), spin=0.0)
    assert -found.creep_force_x > 10.0 * FULL.friction * found.normal


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("shift", [0.0, 2e-3])
def test_a_wheel_that_turns_on_an_upright_rail_touches_where_two_turned_arcs_are_nearest(side: int, shift: float):
    """Found on a grid of points, by geometry alone; half the difference of two opposite turns."""
    pair, turn, sign = WheelRailPair(), 1.5e-3, 1.0 - 2.0 * side
    upright = ContactTable.build(pair.but(upright_rails=1.0).sides(RADIUS, HALF)[0])
    found = {}
    for roll in (turn, -turn):
        place = np.array([shift - RADIUS * roll, 0.0, roll, 0.0])
        place[1] = _touching(upright, side, place)
        found[roll] = [wheel(table, side, ELASTIC, place).radius for table in (upright, SMOOTH)]
    grown = 0.5 * (found[turn][0] - found[-turn][0]) - 0.5 * (found[turn][1] - found[-turn][1])
    angle = float(np.arctan(wheel(SMOOTH, side, ELASTIC, np.array([shift, -1e-5, 0.0, 0.0])).tangent)) * sign
    assert grown == pytest.approx(
        0.5 * (_grown(pair, angle, sign * turn) - _grown(pair, angle, -sign * turn)), rel=0.02
    )
    assert abs(grown) > 1e-5


def _touching(table: ContactTable, side: int, place: np.ndarray) -> float:
    """Height [m] at which the wheel is some micrometres deep."""
    heights = np.linspace(-3e-3, 3e-3, 6001)
    return next(z for z in heights[::-1] if wheel(table, side, ELASTIC, np.array([place[0], z, *place[2:]])).normal > 0)


def _grown(pair: WheelRailPair, angle: float, turn: float) -> float:
    """Of the radius where a wheel's arc, turned by an angle about the place where it touched, is nearest to the rail's.

    Across: outwards +; up: +. Both arcs had the slope `angle` there; the wheel's height falls where its radius grows.
    """
    across = np.linspace(-8e-3, 8e-3, 160001)
    wheel_arc, rail_arc = (
        np.sqrt(r**2 - across**2) - r + np.tan(angle) * across
        for r in (pair.wheel_profile_radius, pair.rail_head_radius)
    )
    turned = np.stack(
        [np.cos(turn) * across - np.sin(turn) * wheel_arc, np.sin(turn) * across + np.cos(turn) * wheel_arc]
    )
    nearest = int(np.argmin(turned[1] - np.interp(turned[0], across, rail_arc)))
    return float(-wheel_arc[nearest])
