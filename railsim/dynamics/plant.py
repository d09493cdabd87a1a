"""Plant: the arrays that the compiled kernels read, made from a model, a track and a speed."""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from railsim.contact.wheel import ContactLaw
from railsim.dynamics.corunning import FIRST_VOID, VOID
from railsim.dynamics.tables import build_extras, corunning_numbers, wheel_load
from railsim.errors import InputError
from railsim.force_laws import MOST_NUMBERS
from railsim.model import AXES, TRACK, LinearElement, Model, NonlinearElement
from railsim.speed import SpeedTables
from railsim.track.kernel import (
    COMPLIANCE,
    CURVATURE,
    EAST,
    GRADIENT,
    HEADING,
    NORTH,
    ROLL,
    UP,
    TrackTables,
    sample,
)

POSE_CHANNELS = 6  # of the track frame elsewhere, seen from the vehicle frame: x, y, z [m]; roll, pitch, yaw [rad]
USUAL_ELEMENTS = 24  # nonlinear elements that every layout has room for
USUAL_FINITE = 2  # elements that are evaluated to second order
USUAL_LOADS = 8
POSE_ROUNDING = 1e-13  # m, rad: smaller than this everywhere = straight
REACH = 5.0  # m; farther from its track frame's origin a body's movements are no small displacements in curves


class Plant(NamedTuple):
    """What a kernel reads: one record of small fixed-size arrays and five long tables (few arguments, so that calls
    stay cheap).
    """

    core: Any  # numpy record; see `_core_type`
    track: np.ndarray  # (cells, channels, 4) of `TrackTables`
    contact: np.ndarray  # (2 or 4, cells, channels, 4) of `ContactTable`
    pose: np.ndarray  # (1 + w + joints, cells, 6, 4): the chord's direction, each wheelset's place, each joint's frames
    knots: np.ndarray  # (k, 2 + 3 w) time, speed, torques, slips, brakes of `SpeedTables`
    tables: np.ndarray  # numbers of loads, tabulated laws and wheels that are not round, one after the other


def _capacity(count: int, usual: int) -> int:
    """Room for `count` entries: `usual`, doubled until it is enough, so that few layouts are ever compiled."""
    return usual * 2 ** math.ceil(math.log2(max(count / usual, 1.0)))


def _core_type(model: Model) -> np.dtype:
    """Record of a vehicle with n free coordinates, b bodies, w wheelsets; each layout is compiled once."""
    frames, joints = _frame_room(model)
    usual = USUAL_FINITE if frames == 1 else 4 * USUAL_FINITE
    return _layout(
        len(model.free), len(model.bodies), len(model.wheelsets),
        _capacity(len(model.nonlinear), USUAL_ELEMENTS), frames, joints,
        _capacity(sum(element.finite for element in model.elements), usual),
        _capacity(len(model.loads), USUAL_LOADS), 2 * model.contact.contacts, _track_room(model),
    )  # fmt: skip


@lru_cache(maxsize=64)
def _layout(
    n: int, b: int, w: int, elements: int, frames: int, joints: int, finite: int, loads: int, contacts: int, track: int
) -> np.dtype:
    fields = [
        ("mass", "f8", n),
        ("link_start", "i8", n + 1),  # of each coordinate's links; the last one's end
        ("link", "i8", n * n),  # other coordinate whose displacement or rate gives a force on this one
        ("link_stiffness", "f8", n * n),
        ("link_damping", "f8", n * n),
        ("preload", "f8", n),  # forces of the preloaded springs and static loads at q = 0
        ("coordinate", "i8", (b, 6)),  # index of the free coordinate, -1 where held
        ("chord_body", "i8"),
        ("reference_body", "i8"),
        ("body_mass", "f8", b),
        ("vertical_load", "f8", b),  # static, downwards in the track frame
        ("inertia", "f8", (b, 3)),
        ("position", "f8", (b, 3)),
        ("sunk", "f8", b),  # of the position below the design height
        ("frames", "i8"),  # track frames that bodies refer to
        (
            "frame_offset",
            "f8",
            frames,
        ),  # of their origins ahead of the reference; one: not `moving_frame.general`
        ("body_frame", "i8", b),
        ("local", "f8", (b, 3)),  # place ahead of, beside and above the origin of the body's own frame
        ("moves_along", "i8"),  # bodies are free along the track
        ("driver_body", "i8"),  # follows the prescribed motion
        ("driver_origin", "f8"),
        ("joints", "i8"),  # pairs of bodies in two frames that elements join
        ("joint_bodies", "i8", (joints, 2)),  # upper, lower
        ("joint_arm", "f8", (joints, 3)),  # from the upper body's centre of gravity to the place of the joint
        ("joint_pose", "i8", joints),
        ("wheelset_body", "i8", w),
        ("spin_inertia", "f8", w),
        ("radius", "f8", w),
        ("steeper", "f8", w),  # `Wheelset.steeper`
        ("middle_radius", "f8", 2),  # rolling radii in the middle of the tread, left and right
        ("axlebox", "f8", w),  # half spacing of the axleboxes
        ("frame_body", "i8", w),  # carried by the axleboxes, -1 = none
        ("elements", "i8"),  # nonlinear elements in use
        ("law_code", "i8", elements),
        ("direction", "f8", (elements, n)),
        ("element_joint", "i8", elements),  # -1 = both bodies refer to one frame
        ("element_arms", "f8", (elements, 2, 3)),  # of an element of a joint, from the bodies' centres of gravity
        ("element_axis", "i8", elements),
        ("chord_direction", "f8", elements),  # of the yaw of the body that keeps the chord's direction
        ("parameters", "f8", (elements, MOST_NUMBERS)),
        ("states", "i8"),  # of all elements
        ("element_state", "i8", elements),  # -1 = none
        ("loads", "i8"),
        ("load_body", "i8", loads),
        ("load_axis", "i8", loads),
        ("load_over", "i8", loads),  # 0 = time, 1 = distance
        ("load_start", "f8", loads),
        ("load_step", "f8", loads),
        ("load_offset", "i8", loads),  # place in the tables
        ("load_count", "i8", loads),
        ("round_points", "i8"),  # a turn; 0 = all wheels are round
        ("round_offset", "i8", (w, 2)),
        ("uneven", "i8"),  # wheels not round or unbalanced, or rails that give way
        ("unbalance", "f8", (w, 2, 3)),  # kg m, rad, m: size, angle, lateral place
        ("finite", "i8"),  # finite elements in use
        ("finite_joint", "i8", finite),  # -1 = both bodies refer to one frame
        ("finite_bodies", "i8", (finite, 2)),  # upper, lower
        ("finite_arms", "f8", (finite, 2, 3)),  # from the bodies' centres of gravity
        ("finite_stiffness", "f8", (finite, 6, 6)),
        ("finite_damping", "f8", (finite, 6, 6)),
        ("finite_preload", "f8", (finite, 3)),
        ("contact_start", "f8"),
        ("contact_spacing", "f8"),
        ("contact_stiffness", "f8", contacts),  # more than two: `extras.doubled`
        ("law", "f8", len(ContactLaw._fields)),
        ("compliant", "i8"),  # rails give way
        ("static_deflection", "f8"),  # under the wheels' mean static load on the mean compliance
        ("s0", "f8"),
        ("ds", "f8"),
        ("cells", "i8"),
        ("friction_given", "i8"),
        ("curved", "i8"),
        ("driven", "i8"),
        ("resistance", "f8", 3),
        ("path_frame", "i8"),  # body that the wheelsets pull, -1 = longitudinal forces pitch nothing
        ("path_mass", "f8", 2),  # of all wheelsets, of the frame
        ("path_lever", "f8", 2),  # height of axles and of the rod above the frame's centre of gravity
        ("corunning", "f8", track),  # numbers of `dynamics.corunning`; one: no track runs with a wheelset
        ("mobility", "f8", (w, 5)),  # inverse masses of a wheelset's y, z and roll, and of its rails' z and y
        ("implicit", "f8", 2),  # of its contacts: inertia per stiffness [s2] and per damping [s]; 0 = explicit
    ]
    return np.dtype([field if len(field) == 2 else (field[0], field[1], field[2]) for field in fields], align=True)


def _track_room(model: Model) -> int:
    """Room for the numbers of a track that runs with the wheelsets; one where there is none."""
    return 1 if model.corunning is None else FIRST_VOID + VOID * _capacity(len(model.voids), 4)


def _frame_room(model: Model) -> tuple[int, int]:
    """Room for track frames and joints; one and one where the model needs no more than one frame."""
    origins, pairs = _origins(model), _joints(model)
    if len(origins) == 1 and not model.moves_along:
        return 1, 1
    return _capacity(len(origins), 4), _capacity(len(pairs), 4)


def _origins(model: Model) -> list[float]:
    """Origins of the track frames, the reference's first."""
    others = {body.origin for body in model.bodies} - {model.origin(model.reference)}
    return [model.origin(model.reference), *sorted(others, reverse=True)]


def _joints(model: Model) -> list[tuple[str, str]]:
    """Pairs of bodies in two frames, upper and lower, in the order in which elements join them."""
    joined = [e for e in (*model.elements, *model.nonlinear) if model.joins_frames(e)]
    return list(dict.fromkeys((e.upper, e.lower) for e in joined))


def build_plant(model: Model, track: TrackTables, speed: SpeedTables) -> Plant:
    """Arrays of a run.

    Raises
    ------
    InputError : the model does not fit together.
    """
    model.check()
    free, bodies = model.free, len(model.bodies)
    core = np.zeros(1, _core_type(model)).view(np.recarray)[0]
    coordinate = np.full(6 * bodies, -1)
    coordinate[free] = np.arange(len(free))
    chord = -1 if model.chord_yaw is None else model.index(model.chord_yaw)
    wheelset_body = [model.index(w.body) for w in model.wheelsets]
    curved = _curved(track)
    finite = [element for element in model.elements if element.finite]
    stiffness, damping = model.assembled([element for element in model.elements if not element.finite])
    values = {
        "mass": model.mass[free],
        **_links(stiffness[np.ix_(free, free)], damping[np.ix_(free, free)]),
        "preload": model.preload[free],
        "coordinate": coordinate.reshape(bodies, 6),
        "chord_body": chord,
        "reference_body": model.index(model.reference),
        "body_mass": [b.mass for b in model.bodies],
        "vertical_load": [model.vertical_load.get(b.name, 0.0) for b in model.bodies],
        "inertia": [b.inertia for b in model.bodies],
        "position": [b.position for b in model.bodies],
        "sunk": [b.sunk for b in model.bodies],
        "wheelset_body": wheelset_body,
        "spin_inertia": [w.spin_inertia for w in model.wheelsets],
        "radius": [w.radius for w in model.wheelsets],
        "steeper": [w.steeper for w in model.wheelsets],
        "middle_radius": model.contact.middle_radius,
        "axlebox": [w.axlebox_half_spacing for w in model.wheelsets],
        "frame_body": [-1 if w.frame is None else model.index(w.frame) for w in model.wheelsets],
        "elements": len(model.nonlinear),
        "finite": len(finite),
        "contact_start": model.contact.start,
        "contact_spacing": model.contact.spacing,
        "contact_stiffness": model.contact.stiffness,
        "law": tuple(model.law),
        "compliant": track.compliant and model.corunning is None,
        "static_deflection": wheel_load(model) * float(track.coefficients[:, COMPLIANCE, 0].mean()),
        "s0": track.s0,
        "ds": track.ds,
        "cells": track.count,
        "friction_given": track.friction_given,
        "curved": curved,
        "driven": speed.driven,
        "resistance": speed.resistance,
    }
    tables, extras = build_extras(model)
    extras["uneven"] = extras["uneven"] or values["compliant"]
    values["corunning"] = corunning_numbers(model, track)
    values["mobility"] = _mobilities(model, coordinate.reshape(bodies, 6))
    values |= _path(model) | _frames(model)
    for name, value in (values | extras).items():
        if core[name].ndim:
            core[name][: len(value)] = value  # there may be room for more
        else:
            core[name] = value
    joints = _joints(model)
    for row, element in enumerate(model.nonlinear):
        relative = model.relative(element.upper, element.lower, element.position)
        axis = AXES.index(element.axis)
        core["direction"][row] = relative[axis, free]
        if chord >= 0:
            core["chord_direction"][row] = relative[axis, 6 * chord + AXES.index("yaw")]
        core["element_joint"][row], core["element_axis"][row] = _joint(model, element, joints), axis
        if element.lower != TRACK:
            core["element_arms"][row] = _arms(model, element)
    for row, element in enumerate(finite):
        core["finite_joint"][row] = _joint(model, element, joints)
        core["finite_bodies"][row] = [model.index(element.upper), model.index(element.lower)]
        core["finite_arms"][row] = _arms(model, element)
        core["finite_stiffness"][row], core["finite_damping"][row] = element.stiffness, element.damping
        core["finite_preload"][row] = element.preload
    ahead = [model.bodies[i].position[0] - model.bodies[i].origin for i in wheelset_body]
    between = [model.origin(upper) - model.origin(lower) for upper, lower in joints]
    pose = _poses(track, model.trailing_pivot if model.chord_yaw else None, ahead, between, curved)
    knots = np.column_stack((speed.time, speed.speed, speed.torque, speed.slip, speed.brake))
    return Plant(core, track.coefficients, np.ascontiguousarray(model.contact.coefficients), pose, knots, tables)


def check_reach(plant: Plant, model: Model) -> None:
    """Refuse bodies that stand too far from the track frame to which their coordinates refer.

    Raises
    ------
    InputError : a body of a run on a curved track stands farther than `REACH` from its frame's origin.
    """
    farthest = max(model.bodies, key=lambda body: abs(body.position[0] - body.origin))
    distance = abs(farthest.position[0] - farthest.origin)
    if plant.core.curved and distance > REACH:
        raise InputError(
            f"model: '{farthest.name}' stands {distance:g} m from the origin of its track frame; on curves, cant and "
            f"gradients this engine takes bodies within {REACH:g} m: give the body an 'origin' near its place, use "
            "engine exudyn, or straight, level track"
        )


def _mobilities(model: Model, coordinate: np.ndarray) -> np.ndarray:
    """(w, 5) inverse masses of what a wheel and its rail move; 0 where that is held."""
    rails = [0.0, 0.0] if model.corunning is None else [1.0 / model.corunning[0], 1.0 / model.corunning[1]]
    rows = []
    for wheelset in model.wheelsets:
        body = model.index(wheelset.body)
        masses = model.mass[[6 * body + axis for axis in (1, 2, 3)]]
        rows.append([*np.where(coordinate[body, 1:4] >= 0, 1.0 / masses, 0.0), *rails])
    return np.array(rows)


def _joint(model: Model, element: LinearElement | NonlinearElement, joints: list[tuple[str, str]]) -> int:
    """Joint of an element, -1 where it joins bodies of one frame."""
    return joints.index((element.upper, element.lower)) if model.joins_frames(element) else -1


def _arms(model: Model, element: LinearElement | NonlinearElement) -> list[np.ndarray]:
    """From both bodies' centres of gravity to the element [m]."""
    bodies = (model.bodies[model.index(name)] for name in (element.upper, element.lower))
    return [np.subtract(element.position, body.position) for body in bodies]


def _joint_arm(model: Model, pair: tuple[str, str]) -> np.ndarray:
    """From the centre of gravity of a joint's upper body to its first element [m]."""
    joining = (*model.elements, *model.nonlinear)
    first = next(element for element in joining if (element.upper, element.lower) == pair)
    return _arms(model, first)[0]


def _frames(model: Model) -> dict[str, Any]:
    """Track frames and joints."""
    origins, joints = _origins(model), _joints(model)
    return {
        "frames": len(origins),
        "frame_offset": origins,
        "body_frame": [origins.index(body.origin) for body in model.bodies],
        "local": [np.subtract(body.position, (body.origin, 0.0, 0.0)) for body in model.bodies],
        "moves_along": model.moves_along,
        "driver_body": model.driver,
        "driver_origin": model.bodies[model.driver].origin,
        "joints": len(joints),
        "joint_bodies": np.array([[model.index(name) for name in pair] for pair in joints], dtype=int).reshape(-1, 2),
        "joint_arm": np.array([_joint_arm(model, pair) for pair in joints]).reshape(-1, 3),
        "joint_pose": 1 + len(model.wheelsets) + np.arange(len(joints)),
    }


def _links(stiffness: np.ndarray, damping: np.ndarray) -> dict[str, np.ndarray]:
    """What is not nought of two matrices (n, n), row by row."""
    rows, columns = np.nonzero((stiffness != 0.0) | (damping != 0.0))
    return {
        "link_start": np.searchsorted(rows, np.arange(len(stiffness) + 1)),
        "link": columns,
        "link_stiffness": stiffness[rows, columns],
        "link_damping": damping[rows, columns],
    }


def _path(model: Model) -> dict[str, Any]:
    if model.path is None:
        return {"path_frame": -1}
    frame = model.bodies[model.index(model.path.frame)]
    axles = sum(model.bodies[model.index(w.body)].mass for w in model.wheelsets)
    heights = np.array([model.wheelsets[0].radius, model.path.rod_height])
    return {
        "path_frame": model.index(model.path.frame),
        "path_mass": [axles, frame.mass],
        "path_lever": heights - frame.position[2],
    }


def _curved(track: TrackTables) -> bool:
    return any(bool(np.abs(track.coefficients[:, c]).max() > POSE_ROUNDING) for c in (CURVATURE, ROLL, GRADIENT))


def _poses(
    track: TrackTables, pivot: float | None, offsets: list[float], joints: list[float], curved: bool
) -> np.ndarray:
    """Pose tables of a plant: of the chord to the pivot so far behind [m], all zero where there is none; of the track
    frame at each of `offsets` [m]; and of the frames of each joint, so far ahead of each other [m].
    """
    if not curved:
        return np.zeros((1 + len(offsets) + len(joints), 1, POSE_CHANNELS, 4))
    chord = np.zeros((track.count, POSE_CHANNELS, 4)) if pivot is None else _spline(track, _chord(track, pivot))
    ahead = [_spline(track, _seen(track, offset)) for offset in offsets]
    return np.ascontiguousarray(np.stack([chord, *ahead, *(_spline(track, _turned(track, at)) for at in joints)]))


def _spline(track: TrackTables, rows: np.ndarray) -> np.ndarray:
    """(cells, 6, 4) of poses (cells + 1, 6) at the track's nodes."""
    return np.transpose(CubicSpline(_nodes(track), rows).c[::-1], (1, 2, 0))


def _chord(track: TrackTables, pivot: float) -> np.ndarray:
    """Pose of a body on the track frame at s - `pivot` and the one at s, in the direction of this chord."""
    rows = _seen(track, -pivot)
    rows[:, 5] = np.arctan2(-rows[:, 1], -rows[:, 0])
    return rows


def _seen(track: TrackTables, offset: float) -> np.ndarray:
    """(nodes, 6): x, y, z, roll, pitch, yaw of the track frame at s + `offset` [m] seen from the one at s."""
    position, relative = _elsewhere(track, offset)
    pitch = -np.arcsin(np.clip(relative[:, 2, 0], -1.0, 1.0))
    roll = np.arctan2(relative[:, 2, 1], relative[:, 2, 2])
    yaw = np.arctan2(relative[:, 1, 0], relative[:, 0, 0])
    return np.column_stack((position, roll, pitch, yaw))


def _turned(track: TrackTables, offset: float) -> np.ndarray:
    """(nodes, 6): how the track frame at s + `offset` [m] is displaced from where straight track has it, and its
    rotation vector, both seen from the one at s.
    """
    position, relative = _elsewhere(track, offset)
    return np.column_stack((position - [offset, 0.0, 0.0], Rotation.from_matrix(relative).as_rotvec()))


def _elsewhere(track: TrackTables, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Origin (nodes, 3) and rotation (nodes, 3, 3) of the track frame at s + `offset` [m] seen from the one at s."""
    nodes = _nodes(track)
    here, origin = _frame(track, nodes), _origin(track, nodes)
    there = np.clip(nodes + offset, nodes[0], nodes[-1])
    frame = _frame(track, there)
    beyond = (nodes + offset - there)[:, None]  # straight on beyond the ends of the file
    relative = np.einsum("nji,njk->nik", here, frame)
    position = np.einsum("nji,nj->ni", here, _origin(track, there) + beyond * frame[:, :, 0] - origin)
    return position, relative


def _nodes(track: TrackTables) -> np.ndarray:
    return track.s0 + track.ds * np.arange(track.count + 1)


def _frame(track: TrackTables, s: np.ndarray) -> np.ndarray:
    """(n, 3, 3) rotation of the track frame: heading, then gradient, then roll of the track plane."""
    heading, climb, roll = (sample(track, c, s) for c in (HEADING, GRADIENT, ROLL))
    cz, sz, cy, sy, cx, sx = np.cos(heading), np.sin(heading), np.cos(climb), -np.sin(climb), np.cos(roll), np.sin(roll)
    rows = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _origin(track: TrackTables, s: np.ndarray) -> np.ndarray:
    return np.column_stack([sample(track, c, s) for c in (EAST, NORTH, UP)])
