"""Elements of a vehicle's suspension and of the weight that it carries, from nominal parameters.

Coordinates are "BODY.y" (left), "BODY.z" (up), "BODY.roll" (left side up), "BODY.pitch" (nose down), "BODY.yaw" (to the
left); BODY is "body", a bogie or a wheelset. A point x ahead, y to the left of and z above a centre of gravity moves by

    y - z roll + x yaw to the left,   z + y roll - x pitch upwards.

Springs stand in pairs, left and right: a pair is one element along its own direction, and one against the rotation that
its spacing resists. Lateral primary springs act at axle height, those of the secondary suspension at their own.
Longitudinal springs resist yaw; only where bodies surge on traction rods have they coordinates along the track (x), and
a point z above a centre of gravity moves by x + z pitch.

After Wickens (2003), Fundamentals of Rail Vehicle Dynamics, chapters 2 and 6.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from estimators.vehicle.linear_model import Element, Row, spring
from estimators.vehicle.parameters import Parameters
from railsim.constants import GRAVITY

BUMP_STOP = "bump_stop_slope"
"""Key among the parameters: slope of the lateral bump stop's force in N/m, 0 where not given."""

PIVOT = "pivot_distance"
"""Key among the parameters: distance of the bogies from the body's centre, m, where the body is a whole one; else half
a body stands on one bogie.
"""

YAW_GYRATION = 0.7
"""Squared radius of gyration of a coach's body in yaw over that of its bogies' distance from the centre, where the
inertia is not given: 0.68 to 0.73 in the Manchester benchmark and two coaches of the same kind.
"""


class Bogie(NamedTuple):
    """A bogie under the car body.

    Attributes
    ----------
    name : of its coordinates. position : of its centre before that of the body, m.
    wheelsets : their positions before the bogie's centre by name, m.
    """

    name: str
    position: float
    wheelsets: Mapping[str, float]


class Heights(NamedTuple):
    """Vertical distances, m.

    Attributes
    ----------
    bogie : bogie's centre of gravity above the axles. spring : secondary springs above the bogie's centre of gravity.
    body : body's centre of gravity above the secondary springs.
    """

    bogie: float
    spring: float
    body: float


LEVEL = Heights(0.0, 0.0, 0.0)
"""Assumption: all lateral springs act at the centres of gravity."""


def heights(p: Parameters) -> Heights:
    """Nominal heights."""
    return Heights(
        p["bogie_height"] - p["wheel_radius"],
        p["secondary_height"] - p["bogie_height"],
        p["body_height"] - p["secondary_height"],
    )


def half_vehicle_bogies(p: Parameters) -> tuple[Bogie, ...]:
    """One bogie with two wheelsets under half a body, whose other half holds the body's yaw and pitch."""
    arm = p["semi_wheelbase"]
    return (Bogie("bogie", 0.0, {"wheelset1": arm, "wheelset2": -arm}),)


def whole_vehicle_bogies(p: Parameters, distance: float) -> tuple[Bogie, Bogie]:
    """Both bogies of a whole vehicle, `distance` m from the body's centre."""
    arm = p["semi_wheelbase"]
    return (
        Bogie("bogie", distance, {"wheelset1": arm, "wheelset2": -arm}),
        Bogie("bogie2", -distance, {"wheelset3": arm, "wheelset4": -arm}),
    )


def whole_body_yaw_inertia(p: Mapping[str, Any]) -> float:
    """Moment of inertia of a whole body in yaw, kg m2: that of about.json, or else by the bogies' distance.

    `p` : parameters of half a vehicle.
    """
    guessed = YAW_GYRATION * 2.0 * p["body_mass"] * p["semi_bogie_spacing"] ** 2
    return float(p.get("body_yaw_inertia", guessed))


def masses(p: Parameters, bogies: Sequence[Bogie], coordinates: Sequence[str]) -> list[float]:
    """Mass (kg) or moment of inertia (kg m2) of each coordinate."""
    kinds = {"body": "body"} | {bogie.name: "bogie" for bogie in bogies}
    kinds |= {name: "wheelset" for bogie in bogies for name in bogie.wheelsets}
    inertias = []
    for coordinate in coordinates:
        name, _, axis = coordinate.partition(".")
        inertia = p[f"{kinds[name]}_mass" if axis in ("x", "y", "z") else f"{kinds[name]}_{axis}_inertia"]
        if axis == "x" and kinds[name] == "wheelset":  # it rolls
            inertia += p["wheelset_spin_inertia"] / p["wheel_radius"] ** 2
        inertias.append(inertia)
    return inertias


def longitudinal_springs(p: Parameters, bogies: Sequence[Bogie]) -> list[Element]:
    """Springs and dampers along the track: to a body that keeps its speed, and the axles' guidance."""
    springs, height = [], p["bogie_height"]
    for bogie in bogies:
        for above, stiffness, damping in (
            (
                p.get("traction_rod_height", p["secondary_height"]),
                p["traction_rod_stiffness"],
                p["traction_rod_damping"],
            ),
            (p["secondary_height"], 2.0 * p["secondary_longitudinal_stiffness"], 0.0),
            (p.get("yaw_damper_height", p["secondary_height"]), 0.0, 2.0 * p.get("yaw_damper_damping", 0.0)),
        ):
            direction = {f"{bogie.name}.x": 1.0, f"{bogie.name}.pitch": above - height, "body.x": -1.0}
            springs.append(spring(direction, stiffness, damping))
        stiffness, damping = (2.0 * p[f"primary_longitudinal_{kind}"] for kind in ("stiffness", "damping"))
        below = p["wheel_radius"] - height
        springs += [
            spring({f"{bogie.name}.x": 1.0, f"{bogie.name}.pitch": below, f"{name}.x": -1.0}, stiffness, damping)
            for name in bogie.wheelsets
        ]
    return springs


def lateral_springs(p: Parameters, bogies: Sequence[Bogie], above: Heights) -> list[Element]:
    """Lateral springs and dampers of both stages, the bump stop's slope among them."""
    springs = []
    for bogie in bogies:
        stiffness = 2.0 * p["secondary_lateral_stiffness"] + p.get(BUMP_STOP, 0.0)
        damping = 2.0 * p["secondary_lateral_damping"]
        springs.append(spring(secondary_shear(bogie, above), stiffness, damping))
        stiffness, damping = 2.0 * p["primary_lateral_stiffness"], 2.0 * p["primary_lateral_damping"]
        springs += [spring(primary_shear(bogie, name, above), stiffness, damping) for name in bogie.wheelsets]
    return springs


def primary_shear(bogie: Bogie, wheelset: str, above: Heights) -> Row:
    """Lateral movement of the bogie over a wheelset at axle height."""
    ahead, name = bogie.wheelsets[wheelset], bogie.name
    return {f"{name}.y": 1.0, f"{name}.roll": above.bogie, f"{name}.yaw": ahead, f"{wheelset}.y": -1.0}


def secondary_shear(bogie: Bogie, above: Heights) -> Row:
    """Lateral movement of the body over the bogie at the height of the secondary springs."""
    return {
        "body.y": 1.0, "body.roll": above.body, "body.yaw": bogie.position,
        f"{bogie.name}.y": -1.0, f"{bogie.name}.roll": above.spring,
    }  # fmt: skip


def yaw_springs(p: Parameters, bogies: Sequence[Bogie]) -> list[Element]:
    """Longitudinal springs and dampers of both stages, yaw dampers among them."""
    springs = []
    for bogie in bogies:
        square = p["secondary_half_spacing"] ** 2
        stiffness = 2.0 * p["secondary_longitudinal_stiffness"] * square
        damping = 2.0 * p.get("secondary_longitudinal_damping", 0.0) * square
        damping += 2.0 * p.get("yaw_damper_damping", 0.0) * p.get("yaw_damper_half_spacing", 0.0) ** 2
        springs.append(spring({f"{bogie.name}.yaw": 1.0, "body.yaw": -1.0}, stiffness, damping))
        square = p["primary_half_spacing"] ** 2
        stiffness = 2.0 * p["primary_longitudinal_stiffness"] * square
        damping = 2.0 * p["primary_longitudinal_damping"] * square
        springs += [
            spring({f"{bogie.name}.yaw": 1.0, f"{name}.yaw": -1.0}, stiffness, damping) for name in bogie.wheelsets
        ]
    return springs


def vertical_springs(p: Parameters, bogies: Sequence[Bogie]) -> list[Element]:
    """Vertical springs and dampers of both stages in bounce and pitch."""
    return primary_vertical_springs(p, bogies) + secondary_vertical_springs(p, bogies)


def primary_vertical_springs(p: Parameters, bogies: Sequence[Bogie]) -> list[Element]:
    """Vertical springs and dampers between axleboxes and bogies."""
    stiffness, damping = 2.0 * p["primary_vertical_stiffness"], 2.0 * p["primary_vertical_damping"]
    return [
        spring({f"{bogie.name}.z": 1.0, f"{bogie.name}.pitch": -ahead, f"{name}.z": -1.0}, stiffness, damping)
        for bogie in bogies
        for name, ahead in bogie.wheelsets.items()
    ]


def secondary_vertical_springs(p: Parameters, bogies: Sequence[Bogie]) -> list[Element]:
    """Vertical springs and dampers between bogies and body."""
    stiffness, damping = 2.0 * p["secondary_vertical_stiffness"], 2.0 * p["secondary_vertical_damping"]
    return [
        spring({"body.z": 1.0, "body.pitch": -bogie.position, f"{bogie.name}.z": -1.0}, stiffness, damping)
        for bogie in bogies
    ]


def roll_springs(p: Parameters, bogies: Sequence[Bogie]) -> list[Element]:
    """The same springs' resistance to roll, and the anti-roll bar's."""
    springs = []
    for bogie in bogies:
        square = p["secondary_half_spacing"] ** 2
        stiffness = 2.0 * p["secondary_vertical_stiffness"] * square + p.get("roll_bar_stiffness", 0.0)
        damping = 2.0 * p["secondary_vertical_damping"] * square
        springs.append(spring({"body.roll": 1.0, f"{bogie.name}.roll": -1.0}, stiffness, damping))
        square = p["primary_half_spacing"] ** 2
        stiffness, damping = (2.0 * p[f"primary_vertical_{kind}"] * square for kind in ("stiffness", "damping"))
        springs += [
            spring({f"{bogie.name}.roll": 1.0, f"{name}.roll": -1.0}, stiffness, damping) for name in bogie.wheelsets
        ]
    return springs


def body_above_springs(p: Parameters, bogies: Sequence[Bogie], above: Heights) -> list[Element]:
    """The car body's weight tips it, as its centre of gravity lies above its springs."""
    return [spring({"body.roll": 1.0}, -body_load(p, bogies) * above.body) for _ in bogies]


def carried_weight(p: Parameters, bogies: Sequence[Bogie], above: Heights) -> list[Element]:
    """Geometric stiffness of the weight that both stages carry.

    A weight P between an upper body of roll a and a lower one of roll b, whose spring stands h above the upper and k
    above the lower centre of gravity, has the potential P [(a + b) w + h a^2 - k b^2] / 2, w the spring's lateral
    stretch: the force that carries P turns with the mean of both bodies.
    """
    elements = body_above_springs(p, bogies, above)
    load = body_load(p, bogies)
    for bogie in bogies:
        roll = f"{bogie.name}.roll"
        elements += _turning(load, secondary_shear(bogie, above), "body.roll", roll)
        elements.append(spring({roll: 1.0}, -load * above.spring))
        share = (load + p["bogie_mass"] * GRAVITY) / len(bogie.wheelsets)
        for name in bogie.wheelsets:
            elements += _turning(share, primary_shear(bogie, name, above), roll, f"{name}.roll")
            elements.append(spring({roll: 1.0}, -share * above.bogie))
    return elements


def body_load(p: Parameters, bogies: Sequence[Bogie]) -> float:
    """Weight of the body that one bogie carries, N."""
    return p["body_mass"] * GRAVITY / len(bogies)


def suspension_elements(p: Parameters, bogies: Sequence[Bogie], above: Heights) -> list[Element]:
    """All of both stages that acts in lateral, yaw and roll motion: springs, dampers and the weight carried."""
    springs = lateral_springs(p, bogies, above) + yaw_springs(p, bogies) + roll_springs(p, bogies)
    return springs + carried_weight(p, bogies, above)


def _turning(load: float, shear: Row, upper: str, lower: str) -> list[Element]:
    """The force that carries a load turns with the mean roll of what it stands between."""
    mean = {upper: 0.5, lower: 0.5}
    return [Element(shear, mean, load), Element(mean, shear, load)]
