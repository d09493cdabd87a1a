"""The Verlet engine: the compiled engine's motion, second order, stable where its steps are longest."""

from dataclasses import replace

import numpy as np
import pytest

from railsim.effects.interface import EFFECTS
from railsim.engines.interface import CHUNK
from railsim.simulation import build_run
from railsim.speed import Constant
from railsim.track import read_track
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.class175 import Class175
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.wheelset import WheelsetVehicle
from tests.effects.rig import scenario
from tests.engines.rig import RATE, flat, go, make_run, ratio

PARTS = ("wheelset1", "wheelset2", "bogie")
MOTION = [f"{body}.{q}" for body in PARTS for q in ("y [m]", "z [m]", "yaw [rad]")]
FORCES = [f"{body}.specific_force_{axis} [m/s2]" for body in PARTS for axis in "yz"]
NAMES = [name for name, kind in EFFECTS.classes().items() if kind.acts_on != "sensor"]
FINE = 8  # times finer than usual is the converged motion


@pytest.mark.parametrize(
    ("vehicle", "track", "speed", "duration"),
    [
        (Manchester(), "straight_erri_high", 50.0, 3.0),
        (Class175(), "straight_erri_high", 20.0, 3.0),
        (Manchester(), "straight_erri_low", 5.0, 4.0),
        (Manchester(adhesion=Adhesion(law="fastsim")), "straight_erri_high", 50.0, 0.75),
        (WheelsetVehicle(), "curve_r400", 14.0, 4.0),
    ],
    ids=["fast", "usual", "slow", "fastsim", "wheelset in a curve"],
)
def test_its_motion_is_that_of_the_converged_one(vehicle: Vehicle, track: str, speed: float, duration: float) -> None:
    model, geometry = vehicle.model(), read_track(track)
    converged = go("compiled", make_run(model, geometry, speed, duration, finer=FINE))
    quick = go("verlet", make_run(model, geometry, speed, duration))
    for name in MOTION:
        if name in converged.names:
            assert ratio(quick[name], converged[name]) < 5e-4, name


@pytest.mark.parametrize("name", NAMES)
def test_feels_every_effect(name: str) -> None:
    run = build_run(scenario([EFFECTS.pick(name).build({})], duration=1.0))
    fast, quick = go("compiled", run), go("verlet", run)
    for channel in MOTION:
        assert ratio(quick[channel], fast[channel]) < 5e-4, channel


def test_accelerations_are_near_to_the_converged_ones() -> None:
    """Of the whole of what an axle box feels; Runge-Kutta's at twice its step are too large by 4 %, in every band."""
    run = build_run(scenario([]))
    converged = go("compiled", replace(run, substeps=FINE * run.substeps))
    runs = {"fast": go("compiled", run), "quick": go("verlet", run)}
    runs["coarse"] = go("compiled", replace(run, substeps=1))
    worst = {name: max(ratio(rows[c], converged[c]) for c in FORCES) for name, rows in runs.items()}
    assert worst["fast"] < 0.005
    assert worst["quick"] < 0.02
    assert worst["coarse"] > 0.04


def test_error_falls_with_the_square_of_the_step() -> None:
    model, geometry = Manchester().model(), read_track("straight_erri_high")
    converged = go("compiled", make_run(model, geometry, 50.0, 2.0, finer=FINE))
    coarse, fine = (go("verlet", make_run(model, geometry, 50.0, 2.0, finer=finer)) for finer in (1, 2))
    for name in ("wheelset1.y [m]", "bogie.yaw [rad]", "bogie.z [m]"):
        order = np.log2(ratio(coarse[name], converged[name]) / ratio(fine[name], converged[name]))
        assert order == pytest.approx(2.0, abs=0.15), name


@pytest.mark.parametrize("speed", [17.8, 6.0, 1.0])
def test_stable_where_creep_forces_are_stiffest_for_their_step(speed: float) -> None:
    """Just above speeds at which Runge-Kutta's step is halved; thrown aside, the wheelset comes back to the middle."""
    model = Manchester().model()
    first = np.zeros(2 * len(model.names) + 2 * len(model.wheelsets) + 2)
    first[model.names.index("wheelset1.y")] = 1e-3
    first[-4:-2], first[-2:] = speed / 0.46, (20.0, speed)
    thrown = go("verlet", make_run(model, flat(), speed, 3.0, initial=first))
    same = go("compiled", make_run(model, flat(), speed, 3.0, initial=first))
    assert ratio(thrown["wheelset1.y [m]"], same["wheelset1.y [m]"]) < 2e-3


def test_a_run_goes_on_where_a_chunk_ends() -> None:
    model, geometry = Manchester().model(), read_track("straight_erri_high")
    whole = go("verlet", make_run(model, geometry, 50.0, (CHUNK + 8) / RATE))
    force = whole["bogie.specific_force_z [m/s2]"][CHUNK - 3 : CHUNK + 4]
    short = go("verlet", make_run(model, geometry, 50.0, 0.5))
    assert np.array_equal(short.rows, whole.rows[: len(short.rows)])
    assert np.abs(np.diff(force, 3)).max() < 0.1 * np.abs(force - 9.81).max()


def test_distance_is_that_of_the_speed() -> None:
    """Which is prescribed: nothing is lost over many steps."""
    result = go("verlet", make_run(Manchester().model(), flat(1300.0), Constant(speed=20.0), 60.0, start=0.0))
    assert result["s [m]"][-1] == pytest.approx(1200.0, abs=1e-6)
    assert np.abs(result["wheelset1.y [m]"]).max() < 1e-9
