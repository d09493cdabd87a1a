"""Wheels that cross wind and cant unload, against statics of the Manchester vehicle written by hand."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize

from railsim.model import Load, Model
from railsim.track import Track
from railsim.vehicles.lookup import build_vehicle
from tests.engines.rig import Rows, curve, flat, go, make_run

G, HALF_RAILS = 9.81, 0.75  # m/s2; m from the middle of the track to a contact
CANT = 0.12  # m over 1.5 m, right rail higher: the field pulls to the left
WIND, HEIGHT = 10e3, 2.3  # N to the left for each bogie; m above the rails
BODY, BOGIE, AXLES = (16000.0, 1.8), (2615.0, 0.6), (2 * 1813.0, 0.46)  # kg, m: half a body, a bogie, its wheelsets
LIMIT = 5e-3
CASES = [("manchester", "compiled"), ("manchester", "exudyn"), ("manchester_whole", "compiled")]


def turned(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def energy(q: np.ndarray, lateral: float, upright: float, wind: float, axles: float) -> float:
    """Of half a body over a bogie over axles that stand [J]; q: y, z, roll of body and bogie, finite rotations.

    Both sides' springs act in the middle, along axes midway between both bodies; they are packed for G.
    """
    (y_1, z_1, a_1), (y_2, z_2, a_2), total = q[:3], q[3:], 0.0
    for upper, lower, above, below, k_y, k_z, k_roll, load in (
        (
            (y_1, BODY[1] + z_1, a_1),
            (y_2, BOGIE[1] + z_2, a_2),
            0.9 - 1.8,
            0.9 - 0.6,
            2 * 160e3,
            2 * 430e3,
            940e3,
            16000.0,
        ),
        ((y_2, BOGIE[1] + z_2, a_2), (axles, AXLES[1], 0.0), 0.46 - 0.6, 0.0, 4 * 3.884e6, 4 * 1.22e6, 0.0, 18615.0),
    ):
        ends = [np.array(c[:2]) + turned(c[2]) @ [0.0, arm] for c, arm in ((upper, above), (lower, below))]
        y, z = turned(0.5 * (upper[2] + lower[2])).T @ (ends[0] - ends[1])
        total += 0.5 * (k_y * y**2 + k_z * z**2 + (k_z + k_roll) * (upper[2] - lower[2]) ** 2) - load * G * z
    for (mass, _), y, z in ((BODY, y_1, z_1), (BOGIE, y_2, z_2)):
        total += mass * (upright * z - lateral * y)
    return total - wind * (y_1 - (HEIGHT - BODY[1]) * a_1)


def difference(lateral: float, upright: float, wind: float, axles: float) -> float:
    """Forces of the left wheels less those of the right ones, of the two wheelsets of a bogie [N]."""
    found = minimize(energy, np.zeros(6), (lateral, upright, wind, axles), method="BFGS", options={"gtol": 1e-3})
    y_1, z_1, _, y_2, z_2, _ = found.x
    moment = wind * HEIGHT
    for (mass, height), y, z in ((BODY, y_1, z_1), (BOGIE, y_2, z_2), (AXLES, axles, 0.0)):
        moment += mass * (lateral * (height + z) + upright * y)
    return moment / HALF_RAILS


def measured(model: Model, track: Track, engine: str) -> list[tuple[float, float]]:
    """Mean place of the wheelsets of each bogie [m], and left wheels' vertical forces less right ones' [N]."""
    rows = go(engine, make_run(model, track, 20.0, 2.0 / 1024.0, start=150.0))
    pairs = []
    for first in range(1, len(model.wheelsets) + 1, 2):
        y = 0.5 * sum(rows[f"wheelset{i}.y [m]"][0] for i in (first, first + 1))
        pairs.append((y, sum(vertical(rows, i, "left") - vertical(rows, i, "right") for i in (first, first + 1))))
    return pairs


def vertical(rows: Rows, number: int, side: str) -> float:
    wheel = f"wheel{number}_{side}"
    angle = rows[f"{wheel}.contact_angle [rad]"][0]
    normal, across = rows[f"{wheel}.normal_force [N]"][0], rows[f"{wheel}.creep_force_y [N]"][0]
    return float(normal * np.cos(angle) + across * np.sin(angle))


def model_in_wind(vehicle: str, wind: float) -> Model:
    model = build_vehicle({"name": vehicle, "bump_stop_gap": 1.0}).model()
    force = np.full(2, wind * len(model.wheelsets) / 2)
    loads = [
        Load("body", axis, "time", 0.0, 1.0, by * force) for axis, by in (("y", 1.0), ("roll", -(HEIGHT - BODY[1])))
    ]
    return dataclasses.replace(model, loads=tuple(loads))


@pytest.mark.parametrize(("vehicle", "engine"), CASES)
def test_cross_wind_unloads_the_wheels_on_its_side(vehicle: str, engine: str) -> None:
    for y, unloading in measured(model_in_wind(vehicle, WIND), flat(), engine):
        assert unloading == pytest.approx(difference(0.0, G, WIND, y), rel=LIMIT)
        assert unloading > 0.1 * 8 * 54.5e3 / 2


@pytest.mark.parametrize(("vehicle", "engine"), CASES)
def test_cant_unloads_the_wheels_on_the_high_rail(vehicle: str, engine: str) -> None:
    lean = np.arcsin(CANT / (2.0 * HALF_RAILS))
    track = curve(1e9, CANT, 300.0, before=10.0)
    for y, unloading in measured(model_in_wind(vehicle, 0.0), track, engine):
        expected = difference(G * np.sin(lean), G * np.cos(lean), 0.0, y)
        assert unloading == pytest.approx(expected, rel=LIMIT)
        assert unloading > 0.1 * 8 * 54.5e3 / 2
