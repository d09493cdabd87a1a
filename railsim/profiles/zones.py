"""Two contacts of one wheel: the wheel's profile in two zones, each with contact functions of its own.

The zones meet at one place of the wheel, the edge: there the gap between both profiles is largest when the rigid
contact jumps from the one side to the other. The zones are told apart by place, never by which is deeper, so that each
zone's lift is one smooth function of u.

A zone whose patch stays clear of the edge is a pair of its own: the quasi-elastic search of `railsim.profiles.search`
restricted to the zone gives the height h(u) of the wheel under the nominal load. The lift is the curve that lies the
Hertzian approach D above it, measured across the curve: so the kernels' depth there is D exactly.

Where one patch reaches over the edge, both zones take part in it, and two whole springs would count it twice. There
the depth comes from a foundation of strips across the wheel (Winkler's; the semi-Hertzian method of Ayasse and Chollet
2005, Vehicle System Dynamics 43): a strip of width dY that overlaps by d carries K d dY, normal to the profiles. The
strips of both zones together carry the nominal load; each zone's share n_k of it gives the depth (n_k / C_k)^(2/3)
whose Hertzian force is that share. The sum is right at the nominal load, and the lifts remain functions of u alone.
"""

from dataclasses import dataclass, replace

import numpy as np

from railsim.contact.functions import ContactFunctions
from railsim.contact.hertz import hertz_ellipse
from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile
from railsim.profiles.search import Outline, ProfileContact, Side
from railsim.profiles.tables import LEAST_CURVATURE, SUBSTEPS, averaging_weights, contact_functions

LEAST_TURN = np.radians(5.0)
"""Smallest turn of the contact plane in a jump of the rigid contact for which a wheel has two zones [rad]."""

SHARP = 1e3  # 1/m; more curvature is that of a zone's edge, not of a profile
_ABSENT = 0.1  # m; so far away is a second contact that a pair never has
FEWEST = 3  # points of the wheel over the rail
STRAIGHT = 10  # rows whose mean slope continues a lift beyond its ends
_SCAN = 2.5e-5  # m; step of u in which the jump is looked for


@dataclass(frozen=True)
class Zone:
    """Contacts of one zone over u; None where it is not over the rail.

    Attributes
    ----------
    hertz : stiffness C of its contact [N/m^1.5]. approach : depth of the quasi-elastic search under the nominal load,
    normal to the profiles, where the zone carries it alone [m].
    """

    contacts: list[ProfileContact | None]
    hertz: float
    approach: float

    @classmethod
    def carried(cls, contacts: list[ProfileContact | None], row: int) -> "Zone":
        """A zone that carries the load alone in that row.

        Raises
        ------
        ValueError : it is not over the rail there.
        """
        alone = contacts[row]
        if alone is None:
            raise ValueError("the wheel's zone is not over the rail")
        return cls(contacts, hertzian(alone), alone.depth * np.cos(alone.angle))


def hertzian(contact: ProfileContact) -> float:
    """Stiffness C of a contact [N/m^1.5]."""
    return hertz_ellipse(1.0 / contact.radius, max(contact.curvature, LEAST_CURVATURE)).stiffness


def strip_stiffness(hertz: float, curvature: float) -> float:
    """K [N/m^2] with which strips carry a parabolic gap as Hertz does: K (4/3) sqrt(2 / curvature) = C."""
    return 0.75 * hertz * float(np.sqrt(0.5 * max(curvature, LEAST_CURVATURE)))


def zone_edge(side: Side, outline: Outline, reach: float) -> float | None:
    """Place on the wheel between the two zones [m]; None where the rigid contact never jumps by `LEAST_TURN`."""
    best, edge, before = LEAST_TURN, None, None
    for u in np.arange(-reach, reach, _SCAN):
        points, gap, _ = side.gap(outline, float(u))
        nearest = int(np.argmin(gap))
        here = points[nearest], float(np.arctan(outline.slope[points[nearest]]))
        if before is not None and abs(here[1] - before[1]) > best:
            low, high = sorted((here[0], before[0]))
            between = np.nonzero((points > low) & (points < high))[0]
            if between.size > 0:
                best = abs(here[1] - before[1])
                edge = float(side.lateral[points[between[np.argmax(gap[between])]]])
        before = here
    return edge


def strip_forces(
    side: Side, points: np.ndarray, gap: np.ndarray, edge: float, stiffness: np.ndarray, load: float
) -> tuple[float, np.ndarray]:
    """Height of the wheel's centre [m] at which strips of `stiffness` [N/m] under `points` carry `load` [N], and what
    those on the tread's side and on the flange's side of the edge carry of it [N].
    """
    order = np.argsort(gap)
    total = np.cumsum(stiffness[order])
    moment = np.cumsum(stiffness[order] * gap[order])
    level = (load + moment) / total  # of the height at which the first strips carry the load
    count = int(np.argmax(np.append(level[:-1] <= gap[order][1:], True)))
    force = stiffness * np.clip(level[count] - gap, 0.0, None)
    upper = side.lateral[points] > edge
    return side.height(float(level[count])), np.array([force[upper].sum(), force[~upper].sum()])


def two_contacts(
    wheel: Profile,
    rail: Profile,
    layout: Layout,
    load: float = 10e3,
    blend: float = 2.5e-4,
    reach: float = 0.015,
    points: int = 601,
) -> ContactFunctions:
    """Contact functions of the zone with the tread, and as their `second` those of the zone with the flange.

    Parameters are those of `contact_functions`; a pair without a second contact gets one that is never reached.

    Raises
    ------
    ValueError : wheel and rail do not overlap within `reach`, or the rail lacks its gauge face.
    """
    side = Side(wheel, rail, layout, load)
    outline = side.outline()
    edge = zone_edge(side, outline, reach)
    if edge is None:
        first = contact_functions(wheel, rail, layout, load, blend, reach, points)
        return replace(first, second=replace(first, lift=first.lift - _ABSENT))
    step, margin, weights = averaging_weights(blend, reach, points)
    count = margin + points - 1
    fine = step * np.arange(-count, count + 1)
    zones = ((edge, np.inf), (-np.inf, edge))
    whole = [side.contact(outline, float(u)) for u in fine]
    tread, flange = (
        [_contact(side, outline, float(u), zone) for u in fine] for zone in ((edge, np.inf), (-np.inf, edge))
    )
    zones = Zone.carried(tread, count), Zone.carried(flange, _alone(tread, flange))
    lifts = _lifts(side, outline, fine, edge, zones, whole, load)
    first, second = (_tabled(fine, zone, lift, weights, reach, points) for zone, lift in zip(zones, lifts, strict=True))
    zero = first.lift[points // 2]
    return replace(first, lift=first.lift - zero, hertz=None, second=replace(second, lift=second.lift - zero))


def _tabled(
    fine: np.ndarray, zone: Zone, lift: np.ndarray, weights: np.ndarray, reach: float, points: int
) -> ContactFunctions:
    """Contact functions of one zone, averaged as those of a single contact are."""
    columns = np.column_stack((lift, _filled(fine, zone.contacts)))
    averaged = np.column_stack([np.convolve(column, weights, mode="valid") for column in columns.T])[::SUBSTEPS]
    return ContactFunctions(
        shift=np.linspace(-reach, reach, points),
        lift=averaged[:, 0],
        radius=averaged[:, 1],
        half_distance=averaged[:, 2],
        curvature=np.clip(averaged[:, 3], LEAST_CURVATURE, SHARP),
        hertz=zone.hertz,
    )


def _contact(side: Side, outline: Outline, shift: float, zone: tuple[float, float]) -> ProfileContact | None:
    """Contact of one zone; None where it is not over the rail."""
    points = side.gap(outline, shift, zone)[0]
    return side.contact(outline, shift, zone) if points.size > FEWEST else None


def _alone(first: list[ProfileContact | None], second: list[ProfileContact | None]) -> int:
    """First row in which the second zone carries the load alone.

    Raises
    ------
    ValueError : there is none.
    """
    for row, (tread, flange) in enumerate(zip(first, second, strict=True)):
        if flange is not None and (tread is None or flange.height - tread.height > flange.depth):
            return row
    raise ValueError("no shift of the wheel brings its second zone to the rail alone; use one contact")


def _lifts(
    side: Side,
    outline: Outline,
    fine: np.ndarray,
    edge: float,
    zones: tuple[Zone, Zone],
    whole: list[ProfileContact],
    load: float,
) -> list[np.ndarray]:
    """Lift of each zone over `fine` [m]."""
    curves: list[list[tuple[float, float]]] = [[], []]
    for row, u in enumerate(fine):
        points, gap, across = side.gap(outline, float(u))
        at_edge = side.height(float(np.interp(edge, side.lateral[points], gap)))
        common = strip_stiffness(hertzian(whole[row]), whole[row].curvature)
        clear = [_clear(zone.contacts[row], at_edge) for zone in zones]
        strips = [common, common]
        for k, zone in enumerate(zones):
            contact = zone.contacts[row]
            if contact is not None:
                strips[k] += clear[k] * (strip_stiffness(zone.hertz, contact.curvature) - common)
        stiffness = np.where(side.lateral[points] > edge, *strips) * np.gradient(across)
        height, forces = strip_forces(side, points, gap, edge, stiffness, load)
        for k, zone in enumerate(zones):
            contact = zone.contacts[row]
            if contact is not None:
                depth = _depth(zone, contact, clear[k], height, forces[k])
                curves[k].append((u - depth * np.sin(contact.angle), height + depth * np.cos(contact.angle)))
    return [_continued(fine, *np.array(curve).T) for curve in curves]


def _clear(contact: ProfileContact | None, at_edge: float) -> float:
    """Share from 0 to 1 to which a zone's contact stays clear of the edge, which touches at the height `at_edge`."""
    if contact is None:
        return 1.0
    share = float(np.clip((contact.rigid_height - at_edge) / contact.depth, 0.0, 1.0))
    return share * share * (3.0 - 2.0 * share)


def _depth(zone: Zone, contact: ProfileContact, clear: float, height: float, force: float) -> float:
    """Depth of a zone's contact with the wheel at `height` [m], at which its strips carry `force` [N]."""
    cosine = float(np.cos(contact.angle))
    own = zone.approach + (contact.height - height) * cosine
    shared = (force / zone.hertz) ** (2.0 / 3.0) if force > 0.0 else (contact.rigid_height - height) * cosine
    return clear * own + (1.0 - clear) * shared


def _continued(fine: np.ndarray, shift: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values at `shift`, which may turn back a little, over `fine`; straight beyond the ends."""
    order = np.flatnonzero(np.diff(np.maximum.accumulate(shift), prepend=-np.inf) > 1e-9)
    shift, values = shift[order], values[order]
    result = np.interp(fine, shift, values)
    few = min(STRAIGHT, len(shift) - 1)
    for beyond, end, other in ((fine < shift[0], 0, few), (fine > shift[-1], -1, -1 - few)):
        slope = (values[end] - values[other]) / (shift[end] - shift[other])
        result[beyond] = values[end] + slope * (fine[beyond] - shift[end])
    return result


def _filled(fine: np.ndarray, contacts: list[ProfileContact | None]) -> np.ndarray:
    """(rows, 3) radius, half distance and curvature; where the zone is not over the rail those of the nearest row."""
    rows = [(u, c.radius, c.half_distance, c.curvature) for u, c in zip(fine, contacts, strict=True) if c is not None]
    given = np.array(rows).T
    return np.column_stack([np.interp(fine, given[0], column) for column in given[1:]])
