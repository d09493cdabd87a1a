"""A whole vehicle against the half one, against a potential written by hand, and in both engines."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from railsim.constants import GRAVITY
from railsim.model import LinearElement, Model
from railsim.track.track import Track
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.whole_vehicle import WholeVehicle
from tests.engines.rig import Rows, go, make_run, ratio

SPACING = 19.0  # m, of the Manchester vehicle's bogies


def periodic(length: float = 240.0) -> Track:
    """Straight track whose irregularities come again after one bogie spacing, so that both bogies see the same."""
    s = np.arange(-40.0, length, 0.1)
    waves = {
        column: sum(
            size * 1e-3 * np.sin(2.0 * np.pi * n * s / SPACING + phase + n)
            for n, size in ((1, 1.5), (2, 1.0), (5, 0.4))
        )
        for column, phase in (("vertical", 0.0), ("lateral", 1.0), ("cross_level", 2.0), ("gauge_deviation", 3.0))
    }
    return Track(s, waves, "periodic")


def held_along(model: Model) -> Model:
    """The model with all bodies held along the track, springs along it left out, and the body's pitch and yaw held."""

    def cut(matrix: np.ndarray) -> np.ndarray:
        kept = matrix.copy()
        kept[0, :] = kept[:, 0] = 0.0
        return kept

    bodies = tuple(
        dataclasses.replace(
            body, free=tuple(a for a in body.free if a != "x" and not (body.name == "body" and a in ("pitch", "yaw")))
        )
        for body in model.bodies
    )
    elements = tuple(dataclasses.replace(e, stiffness=cut(e.stiffness), damping=cut(e.damping)) for e in model.elements)
    return dataclasses.replace(model, bodies=bodies, elements=elements)


def test_whole_vehicle_with_pitch_and_yaw_held_moves_as_the_half_one() -> None:
    vehicle = ManchesterWhole(yaw_damper_damping=200e3)
    whole = held_along(vehicle.model())
    half = dataclasses.replace(vehicle.half().model(), path=None)
    results = [go("compiled", make_run(model, periodic(), 30.0, 4.0, start=30.0)) for model in (whole, half)]
    for name in results[1].names:
        if name.startswith(("body", "bogie", "wheel", "primary")) and "specific_force_x" not in name:
            a, b = (result[name] for result in results)
            assert np.abs(a - b).max() <= 1e-9 * max(np.abs(b).max(), 1e-6), name
    assert results[0]["bogie2.y [m]"] == pytest.approx(results[0]["bogie.y [m]"], abs=1e-9)
    assert np.ptp(results[0]["bogie.y [m]"]) > 1e-3


def potential(vehicle: WholeVehicle, q: np.ndarray) -> float:
    """Energy of springs, preloads and weights [J] with the wheelsets held, rotations as large as they are: body
    (y, z and rotation vector), then both bogies (x, y, z and rotation vector).
    """
    v, spacing = vehicle, vehicle.semi_bogie_spacing
    bodies = {
        "body": ((-spacing, 0.0, v.body_height), np.concatenate(([0.0], q[:5]))),
        "bogie1": ((0.0, 0.0, v.bogie_height), q[5:11]),
        "bogie2": ((-2.0 * spacing, 0.0, v.bogie_height), q[11:17]),
    }

    def point(name: str, at: np.ndarray) -> tuple[np.ndarray, Rotation]:
        centre, moved = bodies.get(name, (at, np.zeros(6)))
        turned = Rotation.from_rotvec(moved[3:])
        return np.add(centre, moved[:3]) + turned.apply(at - np.array(centre)), turned

    def joint(upper: str, lower: str, at: np.ndarray, stiffness: np.ndarray, load: float) -> float:
        above, turned_above = point(upper, at)
        below, turned_below = point(lower, at)
        between = (turned_below.inv() * turned_above).as_rotvec()
        middle = turned_below * Rotation.from_rotvec(0.5 * between)
        stretch = np.concatenate((middle.inv().apply(above - below), between))
        return 0.5 * stretch @ stiffness @ stretch - load * stretch[2]

    def two(springs: tuple[float, float, float], half: float) -> np.ndarray:
        """Stiffness of a spring on the left and one on the right."""
        x, y, z = (2.0 * spring for spring in springs)
        square = half**2
        return np.diag([x, y, z, z * square, 0.0, x * square])

    energy = GRAVITY * v.body_mass * q[1] + GRAVITY * v.bogie_mass * (q[7] + q[13])
    secondary = two(
        (v.secondary_longitudinal_stiffness, v.secondary_lateral_stiffness, v.secondary_vertical_stiffness),
        v.secondary_half_spacing,
    )
    secondary[3, 3] += v.roll_bar_stiffness
    secondary[0, 0] += v.traction_rod_stiffness
    primary = two(
        (v.primary_longitudinal_stiffness, v.primary_lateral_stiffness, v.primary_vertical_stiffness),
        v.primary_half_spacing,
    )
    carried, pressed = 0.5 * v.body_mass * GRAVITY, 0.5 * (0.5 * v.body_mass + v.bogie_mass) * GRAVITY
    for bogie, x in (("bogie1", 0.0), ("bogie2", -2.0 * spacing)):
        energy += joint("body", bogie, np.array([x, 0.0, v.secondary_height]), secondary, carried)
        for ahead in (v.semi_wheelbase, -v.semi_wheelbase):
            energy += joint(bogie, "rail", np.array([x + ahead, 0.0, v.wheel_radius]), primary, pressed)
    return energy


def hessian(vehicle: WholeVehicle, step: float = 1e-3) -> np.ndarray:
    """Second derivatives of `potential` at rest, by differences of fourth order."""
    count, weights = 17, {-2: 1.0, -1: -8.0, 1: 8.0, 2: -1.0}

    def slope(q: np.ndarray) -> np.ndarray:
        rows = np.eye(count) * step
        return np.array([sum(w * potential(vehicle, q + k * row) for k, w in weights.items()) for row in rows]) / (
            12.0 * step
        )

    rows = np.eye(count) * step
    found = np.array([sum(w * slope(k * row) for k, w in weights.items()) for row in rows]) / (12.0 * step)
    return 0.5 * (found + found.T)


def test_modes_are_those_of_a_potential_written_by_hand() -> None:
    vehicle = ManchesterWhole()
    model = vehicle.model()
    kept = [i for i, name in enumerate(model.names) if name.startswith(("body", "bogie"))]
    free = model.free[kept]
    ours = np.sqrt(np.sort(np.linalg.eigvals(model.stiffness[np.ix_(free, free)] / model.mass[free][:, None]).real))
    v = vehicle
    turning = (v.body_roll_inertia, v.body_pitch_inertia, v.body_yaw_inertia)
    bogie = (*(v.bogie_mass,) * 3, v.bogie_roll_inertia, v.bogie_pitch_inertia, v.bogie_yaw_inertia)
    mass = np.array([v.body_mass, v.body_mass, *turning, *bogie, *bogie])
    by_hand = np.sqrt(np.sort(np.linalg.eigvals(hessian(vehicle) / mass[:, None]).real))
    assert ours == pytest.approx(by_hand, rel=1e-6)
    # what everybody knows of this coach: lower sway, yaw, bounce of the body
    assert ours[:2] / (2.0 * math.pi) == pytest.approx([0.54, 0.86], abs=0.03)


def spread(first: Rows, second: Rows, names: list[str]) -> dict[str, float]:
    """Difference over standard deviation, by channel."""
    return {name: ratio(first[name], second[name]) for name in names}


def test_elements_joined_across_frames_must_be_finite() -> None:
    from railsim.errors import InputError

    model = ManchesterWhole().model()
    secondary = next(e for e in model.elements if e.name == "secondary")
    assert isinstance(secondary, LinearElement)
    small = tuple(dataclasses.replace(e, finite=False) if e is secondary else e for e in model.elements)
    with pytest.raises(InputError, match="'secondary' joins bodies in two track frames"):
        dataclasses.replace(model, elements=small).check()


def test_half_of_a_whole_vehicle_is_the_half_vehicle_of_its_parameters() -> None:
    half, known = ManchesterWhole(bogie_mass=3000.0).half(), Manchester(bogie_mass=3000.0)
    assert {k: v for k, v in half.settings().items() if k != "name"} == {
        k: v for k, v in known.settings().items() if k != "name"
    }
