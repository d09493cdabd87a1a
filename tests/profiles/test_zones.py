"""Two contacts at once: a wheel of two flanks against statics by hand, and the load shared beside strips of our own."""

import numpy as np
import pytest
from scipy.optimize import root, root_scalar

from railsim.contact.functions import ContactFunctions, ContactTable
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.wheel import ContactLaw, WheelForces, WheelOnRail, WheelState, second_forces, wheel_forces
from railsim.profiles.files import read_profile
from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile
from railsim.profiles.search import Side
from railsim.profiles.tables import contact_functions
from railsim.profiles.zones import two_contacts, zone_edge

RADIUS, NOMINAL = 0.46, 55e3
TREAD, FLANK, CORNER, HEAD = np.arctan(0.05), np.radians(40.0), -0.03, 0.013
ELASTIC = np.array(ContactLaw(0.4, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0))


def two_flanks() -> tuple[Profile, Profile]:
    """A wheel of two cones that meet in a corner, and a rail with a round head that fits into it."""
    y = np.arange(-0.055, 0.06, 2e-5)
    z = np.where(y > CORNER, np.tan(TREAD) * y, np.tan(TREAD) * CORNER + np.tan(FLANK) * (y - CORNER))
    angle = np.linspace(-0.47 * np.pi, 0.47 * np.pi, 800)
    head = np.column_stack((HEAD * np.sin(angle), HEAD * np.cos(angle) - HEAD))
    foot = head[0] + [0.0, -0.02], head[-1] + [0.0, -0.02]
    rail = np.vstack((foot[0], head, foot[1]))
    return Profile("wheel", y, z, "two flanks").zeroed(), Profile("rail", rail[:, 0], rail[:, 1], "round head").zeroed()


def both_contacts(table: ContactTable, y: float, z: float) -> tuple[WheelForces, WheelForces]:
    """Forces of a left wheel without creep."""
    state = WheelState(y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 20.0, 20.0 / RADIUS, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0)
    first, second = (
        WheelOnRail(table.start, table.spacing, table.coefficients[row], table.stiffness[row], 1.0, RADIUS)
        for row in (0, 2)
    )
    return wheel_forces(first, ELASTIC, state), second_forces(second, ELASTIC, state)


def test_two_flanks_carry_what_statics_says() -> None:
    made = two_contacts(*two_flanks(), Layout(), load=NOMINAL)
    table = ContactTable.build(made)
    across, down = 18e3, 55e3
    by_hand = np.linalg.solve([[np.sin(TREAD), np.sin(FLANK)], [np.cos(TREAD), np.cos(FLANK)]], [across, down])

    def missing(place: np.ndarray) -> list[float]:
        first, second = both_contacts(table, *(1e-3 * place))
        return [first.force_y + second.force_y + across, first.force_z + second.force_z - down]

    place = root(missing, [1e3 * meeting() + 0.02, 1e3 * np.interp(meeting(), made.shift, made.lift) - 0.05]).x
    first, second = both_contacts(table, *(1e-3 * place))
    assert np.abs(missing(place)).max() < 1.0
    assert np.arctan([first.tangent, second.tangent]) == pytest.approx([TREAD, FLANK], abs=2e-3)
    assert [first.normal, second.normal] == pytest.approx(by_hand, rel=2e-3)
    own = made.second
    assert own is not None
    touching = float(np.interp(0.0, own.lift - made.lift, made.shift))
    assert touching == pytest.approx(meeting(), abs=3e-5)


def meeting() -> float:
    """Shift at which the head, its centre on the bisector, touches both flanks [m]."""
    wheel, rail = two_flanks()
    side = Side(wheel, rail, Layout())
    inward = np.array([-np.sin(TREAD), np.cos(TREAD)]), np.array([-np.sin(FLANK), np.cos(FLANK)])
    level = [float(n @ [CORNER, np.tan(TREAD) * CORNER]) - HEAD for n in inward]
    centre = np.linalg.solve(np.array(inward), level)  # of the head, in the wheel's frame
    return side.rail_origin - Layout().half_taping() - float(centre[0])


def strips(side: Side, shift: float, edge: float, load: float) -> np.ndarray:
    """Normal forces [N] on both sides of the edge of a bed of strips under a total `load`, each as stiff as Hertz's
    theory has it for the curvature of the whole contact.
    """
    outline = side.outline()
    points, gap, across = side.gap(outline, shift)
    contact = side.contact(outline, shift)
    hertz = hertz_ellipse(1.0 / contact.radius, contact.curvature).stiffness
    stiffness = 0.75 * hertz * np.sqrt(0.5 * contact.curvature)
    strength = stiffness * np.gradient(across)
    ends = float(gap.min()), float(gap.min()) + 1e-3
    level = root_scalar(lambda d: strength @ np.clip(d - gap, 0.0, None) - load, bracket=ends).root
    force = strength * np.clip(level - gap, 0.0, None)
    tread = side.lateral[points] > edge
    return np.array([force[tread].sum(), force[~tread].sum()])


@pytest.fixture(scope="module")
def s1002() -> tuple[Side, ContactFunctions, float, float]:
    """S1002 on 60E1 (1:40): side, contact functions, edge and shift of the jump."""
    wheel, rail = read_profile("s1002", "wheel"), read_profile("uic60_40", "rail")
    side = Side(wheel, rail, Layout(), NOMINAL)
    found = zone_edge(side, side.outline(), 0.015)
    assert found is not None
    return side, two_contacts(wheel, rail, Layout(), load=NOMINAL), *found


@pytest.mark.parametrize(("share_of_load", "limit"), [(1.0, 0.08), (0.6, 0.18), (1.5, 0.18)])
def test_the_load_is_shared_as_by_strips(
    s1002: tuple[Side, ContactFunctions, float, float], share_of_load: float, limit: float
) -> None:
    """Within a tenth of a millimetre of u the patch of this nearly conformal pair moves over the edge."""
    side, made, edge, jump = s1002
    table, load = ContactTable.build(made), share_of_load * NOMINAL
    worst = 0.0
    for u in np.arange(jump - 4e-4, jump + 2e-4, 2e-5):

        def excess(height: float, u: float = u) -> float:
            return sum(force.normal for force in both_contacts(table, u, height)) - load

        z = root_scalar(excess, bracket=(-5e-3, 20e-3)).root
        normal = np.array([force.normal for force in both_contacts(table, u, z)])
        expected = strips(side, u, edge, load)
        worst = max(worst, float(np.abs(normal - expected).max() / load))
    assert worst < limit


def test_apart_from_the_edge_nothing_differs_from_one_contact(
    s1002: tuple[Side, ContactFunctions, float, float],
) -> None:
    made = s1002[1]
    single = contact_functions(read_profile("s1002", "wheel"), read_profile("uic60_40", "rail"), Layout(), NOMINAL)
    own = made.second
    assert own is not None
    tread, flange = np.abs(made.shift) < 4.7e-3, (made.shift > 7.2e-3) & (made.shift < 7.6e-3)
    for part, ours in ((tread, made), (flange, own)):
        assert np.diff(ours.lift[part]) == pytest.approx(np.diff(single.lift[part]), rel=2e-3, abs=1e-8)
        assert ours.radius[part] == pytest.approx(single.radius[part], abs=1e-5)
    assert (own.lift[tread] < made.lift[tread] - 5e-4).all()
    assert (made.lift[flange] < own.lift[flange] - 5e-4).all()
    assert made.stiffness() == single.stiffness()


def test_a_pair_that_never_jumps_has_a_second_contact_far_away() -> None:
    y = np.linspace(-0.055, 0.06, 400)
    wheel = Profile("wheel", y, 0.05 * y, "cone").zeroed()
    made = two_contacts(wheel, two_flanks()[1], Layout(), load=NOMINAL)
    assert made.second is not None
    assert (made.second.lift < made.lift - 0.05).all()
