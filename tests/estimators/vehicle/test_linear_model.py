"""The assembled vehicle against other derivations: springs by hand, an energy in finite rotations, the simulator."""

from typing import NamedTuple

import numpy as np
import pytest

from estimators.vehicle.contact import arcs, creep_forces, gyroscopic, relations, weight, wheelsets
from estimators.vehicle.creep import kalker_slopes
from estimators.vehicle.lateral_roll import COORDINATES
from estimators.vehicle.linear_model import Element, Kinematics, Reduced, reduce, spring
from estimators.vehicle.parameters import Parameters
from estimators.vehicle.suspension import (
    Bogie,
    carried_weight,
    half_vehicle_bogies,
    heights,
    lateral_springs,
    masses,
    roll_springs,
    vertical_springs,
    yaw_springs,
)
from railsim.vehicles.class175 import Class175
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.manchester import Manchester

VEHICLES = pytest.mark.parametrize("vehicle", [Manchester(), Class175()], ids=["manchester", "class175"])
SPEED = 30.0


def test_two_masses_on_springs_have_the_frequencies_of_the_textbook() -> None:
    """Equal masses and springs, wall, mass, mass: omega^2 = (3 -+ sqrt 5) / 2 k / m (Den Hartog 1956, section 3.3)."""
    k, m = 5.0, 2.0
    reduced = reduce(
        [spring({"first": 1.0, "wall": -1.0}, k), spring({"second": 1.0, "first": -1.0}, k)],
        (m, m),
        Kinematics(("first", "second"), ("wall",)),
    )
    expected = (3.0 + np.array([-1.0, 1.0]) * np.sqrt(5.0)) / 2.0 * k / m
    assert np.linalg.eigvalsh(reduced.stiffness / m) == pytest.approx(expected)
    static = reduced.response(np.zeros(1))[0, :, 0]
    assert static == pytest.approx(1.0)  # both follow a wall that moves slowly


def test_related_coordinate_passes_its_force_on_only_where_reactions_count() -> None:
    """A lever: its end moves twice as far as the mass, so that a spring there is four times as stiff for it."""
    moving = Kinematics(("mass",), (), {"end": {"mass": 2.0}})
    elements = [spring({"end": 1.0}, 3.0), Element({"mass": 1.0}, {"end": 1.0}, 5.0)]
    assert reduce(elements, (1.0,), moving).stiffness[0, 0] == pytest.approx(4.0 * 3.0 + 2.0 * 5.0)
    assert reduce(elements, (1.0,), moving, reactions=False).stiffness[0, 0] == pytest.approx(2.0 * 5.0)


@VEHICLES
def test_stiffness_and_damping_are_those_of_the_simulated_vehicle(vehicle: HalfVehicle) -> None:
    """All sixteen coordinates, geometric stiffness of the preloads included."""
    p, model = vehicle.nominal(), vehicle.model()
    p |= {"wheelset_roll_inertia": p["wheelset_yaw_inertia"]}
    bogies, free = half_vehicle_bogies(p), list(model.names)
    elements = suspension(p, bogies) + vertical_springs(p, bogies)
    reduced = reduce(elements, masses(p, bogies, free), Kinematics(free))
    names = [f"{body.name}.{axis}" for body in model.bodies for axis in ("x", "y", "z", "roll", "pitch", "yaw")]
    chosen = np.array([names.index(name) for name in free])
    for ours, theirs in ((reduced.stiffness, model.stiffness), (reduced.damping, model.damping)):
        expected = theirs[np.ix_(chosen, chosen)]
        np.testing.assert_allclose(ours, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(np.diag(reduced.mass), model.mass[chosen], rtol=1e-12)


@VEHICLES
def test_frequencies_are_those_of_an_energy_in_finite_rotations(vehicle: HalfVehicle) -> None:
    """Without creep: second derivatives of the energy below, which shares nothing with the assembly."""
    p = vehicle.nominal()
    bogies, geometry = half_vehicle_bogies(p), arcs(p)
    elements = suspension(p, bogies)
    for wheelset in wheelsets(p, bogies):
        elements += weight(wheelset, geometry)
    inertia = masses(p, bogies, COORDINATES)
    reduced = reduce(elements, inertia, Kinematics(COORDINATES, (), relations(geometry, wheelsets(p, bogies))))
    root = np.sqrt(inertia)
    expected = np.linalg.eigvalsh(second_derivatives(p, len(COORDINATES)) / np.outer(root, root))
    found = np.sort(np.linalg.eigvals(reduced.stiffness / np.square(root)[:, None]).real)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-3)


def test_two_half_vehicles_are_a_whole_one_whose_body_does_not_yaw() -> None:
    """Two bogies under a body of twice the mass: 17 lateral coordinates, the half vehicle's oscillations among them."""
    p = Class175().nominal()
    arm, distance = p["semi_wheelbase"], p["semi_bogie_spacing"]
    bogies = tuple(
        Bogie(f"bogie{k}", x, {f"wheelset{2 * k - 1}": arm, f"wheelset{2 * k}": -arm})
        for k, x in ((1, distance), (2, -distance))
    )
    twice = p | {"body_mass": 2.0 * p["body_mass"], "body_roll_inertia": 2.0 * p["body_roll_inertia"]}
    twice |= {"body_yaw_inertia": 2.0 * p["body_mass"] * distance**2 / 3.0}
    names = [f"wheelset{k}.{axis}" for k in range(1, 5) for axis in ("y", "yaw")]
    names += [f"bogie{k}.{axis}" for k in (1, 2) for axis in ("y", "roll", "yaw")] + ["body.y", "body.roll"]
    assert running(twice, bogies, [*names, "body.yaw"]).stiffness.shape == (17, 17)
    whole = eigenvalues(running(twice, bogies, names))
    for value in eigenvalues(running(p, half_vehicle_bogies(p), COORDINATES)):
        assert np.min(np.abs(whole - value)) < 1e-6 * max(1.0, abs(value))


def test_body_yaw_of_a_whole_vehicle_moves_the_ends_apart() -> None:
    """Free yaw on lateral secondary springs alone: 2 x 2 k distance^2, closed form."""
    p = Class175().nominal() | {"body_yaw_inertia": 1.0}
    bogies = (Bogie("bogie1", 9.0, {}), Bogie("bogie2", -9.0, {}))
    reduced = reduce(lateral_springs(p, bogies, heights(p)), masses(p, bogies, ["body.yaw"]), Kinematics(["body.yaw"]))
    assert reduced.stiffness[0, 0] == pytest.approx(4.0 * p["secondary_lateral_stiffness"] * 81.0)


def suspension(p: Parameters, bogies: tuple[Bogie, ...]) -> list[Element]:
    """What holds bodies, bogies and wheelsets together across the track."""
    above = heights(p)
    return [
        *lateral_springs(p, bogies, above),
        *yaw_springs(p, bogies),
        *roll_springs(p, bogies),
        *carried_weight(p, bogies, above),
    ]


def running(p: Parameters, bogies: tuple[Bogie, ...], names: list[str] | tuple[str, ...]) -> Reduced:
    """The vehicle on its contacts at `SPEED`."""
    elements, geometry = suspension(p, bogies), arcs(p)
    for wheelset in wheelsets(p, bogies):
        elements += creep_forces(wheelset, kalker_slopes(p), SPEED) + weight(wheelset, geometry)
        elements += gyroscopic(wheelset, SPEED)
    return reduce(elements, masses(p, bogies, names), Kinematics(names, (), relations(geometry, wheelsets(p, bogies))))


def eigenvalues(reduced: Reduced) -> np.ndarray:
    """Of the first-order form, 1/s."""
    return np.linalg.eigvals(reduced.first_order()[0])


def second_derivatives(p: Parameters, size: int, step: float = 1e-3) -> np.ndarray:
    """Of `energy` at rest, by central differences, in the order of `COORDINATES`."""
    found, unit = np.empty((size, size)), step * np.eye(size)
    for i in range(size):
        for j in range(size):
            corners = [(a, b, energy(a * unit[i] + b * unit[j], p)) for a in (1, -1) for b in (1, -1)]
            found[i, j] = sum(a * b * value for a, b, value in corners) / (4.0 * step**2)
    return found


def energy(q: np.ndarray, p: Parameters) -> float:
    """Elastic and potential energy of the half vehicle, every spring between points that bodies carry along; heights of
    bogie and body stay as they are. Wheel and rail heads are arcs.
    """
    r, half, g = p["wheel_radius"], p["half_gauge"], 9.81
    bogie = Posed((0.0, 0.0, p["bogie_height"]), (q[4], 0.0), q[5], q[6])
    body = Posed((0.0, 0.0, p["body_height"]), (q[7], 0.0), q[8], 0.0)
    total = stage(p, "secondary", body, bogie, (0.0, p["secondary_height"]), p["body_mass"] * g)
    total += 0.5 * p["roll_bar_stiffness"] * (q[8] - q[5]) ** 2
    rate, curvature = p["design_contact_angle_rate"], p["design_contact_curvature"]
    wheel_radius = 0.5 / rate * (1.0 + np.sqrt(1.0 + 4.0 * rate / curvature))  # R_w - R_r = 1 / rate
    gain = wheel_radius * rate
    angle = p["design_conicity"] / gain
    for number, x in enumerate((p["semi_wheelbase"], -p["semi_wheelbase"])):
        y, yaw = q[2 * number : 2 * number + 2]
        shift = y / (1.0 - r * angle / half)
        roll = angle * shift / half
        lift = 0.5 * rate * shift**2 + gain * roll * shift - 0.5 * angle * half * yaw**2
        wheelset = Posed((x, 0.0, r), (y, lift), roll, yaw)
        total += p["wheelset_mass"] * g * lift
        total += stage(p, "primary", bogie, wheelset, (x, r), 0.5 * (p["body_mass"] + p["bogie_mass"]) * g)
    return total


class Posed(NamedTuple):
    """A body: its centre of gravity at rest (x, y, z), how far that moved (y, z), m, and its roll and yaw, rad."""

    rest: tuple[float, float, float]
    moved: tuple[float, float]
    roll: float
    yaw: float

    def carried(self, point: np.ndarray) -> np.ndarray:
        """Where a point of the body is that is at `point` at rest, (3,)."""
        rest = np.array(self.rest)
        return rest + (0.0, *self.moved) + rotation(self.roll, self.yaw) @ (point - rest)


def stage(p: Parameters, name: str, upper: Posed, lower: Posed, at: tuple[float, float], load: float) -> float:
    """Energy of a pair of springs that carry `load`; `at` : their position along the track and height at rest. Their
    forces are those along the axes that have turned by half of both bodies' roll.
    """
    total, half = 0.0, p[f"{name}_half_spacing"]
    axes = rotation(0.5 * (upper.roll + lower.roll), 0.0)
    for side in (half, -half):
        point = np.array([at[0], side, at[1]])
        along, across, above = axes.T @ (upper.carried(point) - lower.carried(point))
        total += 0.5 * p[f"{name}_longitudinal_stiffness"] * along**2
        total += 0.5 * p[f"{name}_lateral_stiffness"] * across**2
        total += 0.5 * p[f"{name}_vertical_stiffness"] * above**2 - 0.5 * load * above
    return total


def rotation(roll: float, yaw: float) -> np.ndarray:
    """Rotation matrix of a roll and then a yaw."""
    about_x = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    about_z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    return about_z @ about_x
