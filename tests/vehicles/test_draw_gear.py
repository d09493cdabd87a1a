"""A whole vehicle on its draw gear: a mass on a spring; held where the gear is stiff; free where it drives itself."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from railsim.model import Model
from railsim.scenario import load_scenario
from railsim.simulation import build_run
from tests.effects.rig import rows
from tests.engines.rig import Rows, ratio

SOFT = 0.2e6  # N/m
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
    found = _rows(1e6, engine, track="curve_r400", start=285.0, duration=6.0)
    for name in ("train.y [m]", "train.z [m]", "train.yaw [rad]"):
        assert np.abs(found[name] - found[name][0]).max() < 1e-3, name


def test_both_engines_feel_the_same():
    fast, reference = _rows(1e6), _rows(1e6, engine="exudyn")
    for name in MOTION:
        assert ratio(reference[name], fast[name]) < 5e-3, name


def _settings(stiffness: float | None) -> dict[str, Any]:
    return {"vehicle": {"name": "class175_whole", "draw_gear_stiffness": stiffness}, "start": 30.0}


def _rows(stiffness: float | None, engine: str = "compiled", **changes: Any) -> Rows:
    return rows([], engine, **{**_settings(stiffness), **changes})


def _model(stiffness: float) -> Model:
    return build_run(load_scenario("straight_erri_high", _settings(stiffness))).model


def _mass(model: Model) -> float:
    return sum(body.mass for body in model.bodies if body.name != "train")
