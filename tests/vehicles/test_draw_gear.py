"""A whole vehicle on its draw gear: a mass on a spring; held where the gear is stiff; free where it drives itself."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from experiments.discrepancy.railway.answers import places
from railsim.constants import GRAVITY
from railsim.model import Model
from railsim.scenario import load_scenario
from railsim.simulation import build_run
from tests.effects.rig import rows
from tests.engines.rig import Rows, ratio

SOFT = 0.2e6  # N/m
CURVE: dict[str, Any] = {"track": "curve_r400", "start": 285.0, "duration": 6.0}
FASTER: dict[str, Any] = {"kind": "profile", "time": [0.0, 1.1, 3.6], "speed": [20.0, 20.0, 22.0]}
MOTION = ("body.z [m]", "body.pitch [rad]", "bogie.pitch [rad]", "wheelset1.y [m]")


def test_all_of_it_swings_on_a_soft_gear_as_one_mass_on_a_spring():
    model = _model(SOFT)
    free, mass = model.free, np.array(model.mass)[model.free]
    squares, shapes = eigh(np.array(model.stiffness)[np.ix_(free, free)], np.diag(mass))
    along = [k for k, name in enumerate(model.names) if name.endswith(".x")]
    together = np.abs((mass[along] @ shapes[along]) / math.sqrt(mass[along].sum()))
    mode = int(np.argmax(together))
    assert together[mode] > 0.99
    assert squares[mode] == pytest.approx(SOFT / _mass(model), rel=0.02)


def test_its_damper_is_a_share_of_critical():
    model = _model(1e6)
    gear = next(one for one in model.elements if one.name == "draw_gear")
    assert gear.stiffness[0, 0] == 1e6
    assert gear.damping[0, 0] / (2.0 * math.sqrt(gear.stiffness[0, 0] * _mass(model))) == pytest.approx(0.7)


def test_a_stiff_gear_holds_the_body():
    held, stiff, soft = (_rows(stiffness) for stiffness in (None, 1e9, 1e6))
    for name in MOTION:
        assert ratio(stiff[name], held[name]) < 0.02, name
    pitch = "bogie.pitch [rad]"
    assert ratio(soft[pitch], held[pitch]) > 5.0 * ratio(stiff[pitch], held[pitch])


def test_on_a_gear_far_below_all_that_moves_it_runs_like_one_that_coasts():
    """Which is free along the track by another way: its speed follows from the forces."""
    soft, coasting = _rows(1e3), _rows(1e6, speed={"kind": "driven", "speed": 25.0})
    assert "train.y [m]" in soft.names and "train.y [m]" not in coasting.names
    for name in MOTION:
        assert ratio(soft[name], coasting[name]) < 0.02, name


@pytest.mark.parametrize("engine", ["compiled", "exudyn"])
def test_the_train_stays_on_its_track_in_a_curve(engine: str):
    found = _rows(1e6, engine, **CURVE)
    for name in ("train.y [m]", "train.z [m]", "train.yaw [rad]"):
        assert np.abs(found[name] - found[name][0]).max() < 1e-3, name


def test_both_engines_feel_the_same():
    fast, reference = _rows(1e6), _rows(1e6, engine="exudyn")
    for name in MOTION:
        assert ratio(reference[name], fast[name]) < 5e-3, name
    for name in ("body.x [m]", "bogie.x [m]", "wheelset4.x [m]", "bogie2.x_rate [m/s]"):
        assert ratio(reference[name], fast[name]) < 2e-2, name


def test_in_a_curve_both_engines_move_alike_along_the_track_and_the_gear_pulls_what_the_wheels_resist():
    """But for the gear itself: connectors of Exudyn take the turning of a damper that stands across for movement."""
    fast, reference = (_rows(1e6, engine, **CURVE) for engine in ("compiled", "exudyn"))
    for name in ("bogie.x [m]", "bogie2.x [m]", "wheelset1.x [m]", "wheelset3.x [m]"):
        first, second = (found[name] - found["body.x [m]"] for found in (fast, reference))
        assert ratio(second, first) < 5e-2, name
    circle = fast["time [s]"] > 3.2
    pull, resistance = -1e6 * fast["body.x [m]"], np.zeros(len(circle))
    for number in range(1, 5):
        yaw = fast[f"wheelset{number}.yaw [rad]"]
        for side in ("left", "right"):
            along, aside, slope = (
                fast[f"wheel{number}_{side}.{one}"]
                for one in ("creep_force_x [N]", "creep_force_y [N]", "contact_angle [rad]")
            )
            resistance -= along * np.cos(yaw) - aside * np.cos(slope) * np.sin(yaw)
    assert pull[circle].mean() == pytest.approx(resistance[circle].mean(), rel=0.05)
    assert resistance[circle].mean() > 100.0


@pytest.mark.parametrize("stiffness", [1e4, 1e6])
def test_the_vehicle_keeps_the_prescribed_speed_as_it_changes_whatever_its_gear(stiffness: float):
    """Else it would hang 0.8 m x 50 t / gear behind, and swing there."""
    found = _rows(stiffness, track="smooth", speed=FASTER, duration=4.0)
    wanted = np.interp(found["time [s]"], FASTER["time"], FASTER["speed"])
    assert np.abs(found["body.x [m]"]).max() < 1e-3
    for number in range(1, 5):
        rolled = 0.42 * found[f"wheelset{number}.spin [rad/s]"]
        assert np.abs(rolled - wanted).max() < 0.02


def test_the_pull_is_that_of_all_masses_and_of_the_wheels_spin():
    model = build_run(load_scenario("smooth", {**_settings(1e6), "speed": FASTER, "duration": 4.0})).model
    (load,) = model.loads
    impulse = float(load.step * (load.values.sum() - 0.5 * load.values[[0, -1]].sum()))
    spin = sum(one.spin_inertia / one.radius**2 for one in model.wheelsets)
    assert impulse == pytest.approx((_mass(model) + spin) * 2.0)
    assert (load.body, load.axis, load.over, load.values[-1]) == ("body", "x", "time", 0.0)
    assert not _model(1e6).loads


def test_both_engines_feel_the_pull_the_same():
    fast, reference = (
        _rows(1e6, engine, track="smooth", speed=FASTER, duration=3.0) for engine in ("compiled", "exudyn")
    )
    for name in ("body.x [m]", "bogie.pitch [rad]", "bogie.x [m]", "wheelset1.spin [rad/s]"):
        assert ratio(reference[name], fast[name]) < 2e-2, name


def test_displacement_along_the_track_is_that_of_its_rate_and_of_its_acceleration():
    """A body's own accelerometer feels the second derivative, with gravity as it pitches: simulated apart from x."""
    found = _rows(1e6)
    dt = float(np.diff(found["time [s]"]).mean())
    for body in ("body", "bogie2"):
        x, rate, pitch = (found[f"{body}.{one}"] for one in ("x [m]", "x_rate [m/s]", "pitch [rad]"))
        assert ratio(np.gradient(x, dt)[2:-2], rate[2:-2]) < 2e-2, body
        felt = found[f"{body}.specific_force_x [m/s2]"] + GRAVITY * pitch
        assert ratio(np.gradient(rate, dt)[2:-2], felt[2:-2]) < 2e-2, body


def test_what_cannot_move_along_the_track_stays_at_its_place():
    assert not rows([])["bogie.x [m]"].any()


def _settings(stiffness: float | None) -> dict[str, Any]:
    return {"vehicle": {"name": "class175_whole", "draw_gear_stiffness": stiffness}, "start": 30.0}


def _rows(stiffness: float | None, engine: str = "compiled", **changes: Any) -> Rows:
    return rows([], engine, **{**_settings(stiffness), **changes})


def _model(stiffness: float) -> Model:
    return build_run(load_scenario("straight_erri_high", _settings(stiffness))).model


def _mass(model: Model) -> float:
    return sum(body.mass for body in model.bodies if body.name != "train")


def test_places_of_unknown_forces_are_those_of_the_vehicle_along_the_track_where_it_can_move():
    half = build_run(load_scenario("straight_erri_high", {"vehicle": "class175"})).model
    along = [{one.name for one in places(model) if one.axis == "x"} for model in (_model(1e6), half)]
    assert along[0] >= {"secondary x", "secondary2 x", "primary1 x", "primary4 x"}
    assert not any("train" in name or "draw_gear" in name for name in along[0])
    assert along[1] == set()
