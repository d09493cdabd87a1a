"""Two contacts of one wheel: the wheel's profile in two zones, each with contact functions of its own.

The zones meet at one place of the wheel, the edge: there the gap between both profiles is largest when the rigid
contact jumps from the one side to the other. The zones are told apart by place, never by which is deeper, so that each
zone's lift is one smooth function of u.

A zone whose patch stays clear of the edge is a pair of its own: the quasi-elastic search of `railsim.profiles.search`
restricted to the zone gives the height h(u) of the wheel under the nominal load. The lift is the curve that lies the
Hertzian approach D above it, measured across the curve: so the kernels' depth there is D exactly.

Where one patch reaches over the edge, both zones take part in it, and two whole springs would count it twice. There a
zone's depth comes from a foundation of strips across the wheel (Winkler's; as in the semi-Hertzian method of Ayasse
and Chollet 2005, Vehicle System Dynamics 43): a strip of width dY that overlaps by d carries K d dY, normal to the
profiles. The strips of both zones together carry the nominal load; each zone's share n_k of it gives the depth
(n_k / C_k)^(2/3) whose Hertzian force is that share. The sum is right at the nominal load, and the lifts remain
functions of u alone.
"""

from dataclasses import dataclass, replace

import numpy as np

from railsim.contact.functions import ContactFunctions
from railsim.contact.hertz import hertz_ellipse
from railsim.errors import InputError
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
    clear : share from 0 to 1 to which each contact stays clear of the edge.
    hertz : stiffness C of the contact [N/m^1.5]. approach : depth p_n where the wheel stands at the height that the
    zone's quasi-elastic search gives; with it half the nominal load is carried at the height at which Hertz has it in
    the contact nearest to the jump that is clear of the edge [m].
    """

    contacts: list[ProfileContact | None]
    clear: np.ndarray
    hertz: float
    approach: float

    @classmethod
    def made(
        cls, contacts: list[ProfileContact | None], clear: np.ndarray, own: ProfileContact, hertz: float, load: float
    ) -> "Zone":
        """A zone of stiffness `hertz` under a nominal `load` [N]."""
        true = hertzian(own)
        approach = (0.5 * load / hertz) ** (2.0 / 3.0) - (0.5 * load / true) ** (2.0 / 3.0)
        return cls(contacts, clear, hertz, approach + own.depth * np.cos(own.angle))


def hertzian(contact: ProfileContact) -> float:
    """Stiffness C of a contact [N/m^1.5]."""
    return hertz_ellipse(1.0 / contact.radius, max(contact.curvature, LEAST_CURVATURE)).stiffness


def strip_stiffness(contact: ProfileContact) -> float:
    """K [N/m^2] with which strips carry a parabolic gap as Hertz does: K (4/3) sqrt(2 / curvature) = C."""
    return 0.75 * hertzian(contact) * float(np.sqrt(0.5 * max(contact.curvature, LEAST_CURVATURE)))


def zone_edge(side: Side, outline: Outline, reach: float) -> tuple[float, float] | None:
    """Place on the wheel between the two zones, and shift u of the jump [m]; None where the rigid contact never jumps
    by `LEAST_TURN`.
    """
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
                edge = float(side.lateral[points[between[np.argmax(gap[between])]]]), float(u)
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
    InputError : tread and flange never touch apart from each other.
    """
    side = Side(wheel, rail, layout, load)
    outline = side.outline()
    found = zone_edge(side, outline, reach)
    if found is None:
        first = contact_functions(wheel, rail, layout, load, blend, reach, points)
        return replace(first, second=replace(first, lift=first.lift - _ABSENT))
    step, margin, weights = averaging_weights(blend, reach, points)
    count = margin + points - 1
    fine = step * np.arange(-count, count + 1)
    edge, jump = found
    parts = [[_contact(side, outline, float(u), zone) for u in fine] for zone in ((edge, np.inf), (-np.inf, edge))]
    clear = [_clear(side, outline, fine, edge, part) for part in parts]
    row = int(np.searchsorted(fine, jump))
    tread = _last_clear(parts[0][row::-1], clear[0][row::-1])
    flange = _last_clear(parts[1][row:], clear[1][row:])
    middle = hertzian(side.contact(outline, 0.0))
    zones = (
        Zone.made(parts[0], clear[0], tread, middle, load),
        Zone.made(parts[1], clear[1], flange, hertzian(flange), load),
    )
    lifts = _lifts(side, outline, fine, edge, zones, load)
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


def _clear(
    side: Side, outline: Outline, fine: np.ndarray, edge: float, contacts: list[ProfileContact | None]
) -> np.ndarray:
    """Share from 0 to 1 to which each contact stays clear of the edge: 1 where the edge does not touch."""
    share = np.ones(len(fine))
    for row, (u, contact) in enumerate(zip(fine, contacts, strict=True)):
        if contact is not None:
            points, gap, _ = side.gap(outline, float(u))
            at_edge = side.height(float(np.interp(edge, side.lateral[points], gap)))
            share[row] = np.clip((contact.rigid_height - at_edge) / contact.depth, 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def _last_clear(contacts: list[ProfileContact | None], clear: np.ndarray) -> ProfileContact:
    """The first contact that stays wholly clear of the edge.

    Raises
    ------
    InputError : there is none.
    """
    for contact, share in zip(contacts, clear, strict=True):
        if contact is not None and share == 1.0:
            return contact
    raise InputError("contacts: tread and flange of this pair never touch apart from each other; use 1")


def _lifts(
    side: Side, outline: Outline, fine: np.ndarray, edge: float, zones: tuple[Zone, Zone], load: float
) -> list[np.ndarray]:
    """Lift of each zone over `fine` [m]."""
    curves: list[list[tuple[float, float]]] = [[], []]
    for row, u in enumerate(fine):
        height, forces = 0.0, np.zeros(2)
        if min(zone.clear[row] for zone in zones) < 1.0:
            height, forces = _shared(side, outline, float(u), edge, zones, row, load)
        for curve, zone, force in zip(curves, zones, forces, strict=True):
            contact = zone.contacts[row]
            if contact is not None:
                curve.append(_on_lift(zone, contact, float(u), float(zone.clear[row]), height, float(force)))
    return [_continued(fine, *np.array(curve).T) for curve in curves]


def _shared(
    side: Side, outline: Outline, shift: float, edge: float, zones: tuple[Zone, Zone], row: int, load: float
) -> tuple[float, np.ndarray]:
    """Height of the wheel's centre on strips [m], and what each zone carries of the load [N]."""
    points, gap, across = side.gap(outline, shift)
    common = strip_stiffness(side.contact(outline, shift))
    strips = [common, common]
    for k, zone in enumerate(zones):
        contact = zone.contacts[row]
        if contact is not None and zone.clear[row] > 0.0:
            strips[k] += zone.clear[row] * (strip_stiffness(contact) - common)
    stiffness = np.where(side.lateral[points] > edge, *strips) * np.gradient(across)
    return strip_forces(side, points, gap, edge, stiffness, load)


def _on_lift(
    zone: Zone, contact: ProfileContact, shift: float, clear: float, height: float, force: float
) -> tuple[float, float]:
    """A point of a zone's lift: shift and height [m]. With the wheel at `height` its strips carry `force` [N]."""
    across, up = np.sin(contact.angle), np.cos(contact.angle)
    own = np.array([shift - zone.approach * across, contact.height + zone.approach * up])
    shared = np.array([shift, contact.rigid_height])
    if force > 0.0:
        depth = (force / zone.hertz) ** (2.0 / 3.0)
        shared = np.array([shift - depth * across, height + depth * up])
    place = clear * own + (1.0 - clear) * shared
    return float(place[0]), float(place[1])


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
