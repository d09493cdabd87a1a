"""Speed that follows from forces: gradient, rotating wheels, traction and the energy of coasting."""

import numpy as np
import pytest

from railsim import simulate
from railsim.constants import GRAVITY
from railsim.model import Model
from railsim.scenario import Scenario
from railsim.speed import Driven, Traction
from railsim.track.synthesis import Segment, Transition, design, distances
from railsim.track.track import Track
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import ENGINES, Rows, flat, go, make_run

CLIMB = 0.01


def hill() -> Track:
    """Level, a ramp of 40 m, then a constant climb."""
    s = distances(400.0, 0.2)
    columns = design([Segment(40.0), Transition(40.0), Segment(320.0, gradient=CLIMB)], s)
    return Track(s, {"gradient": columns["gradient"]}, "hill")


def masses(model: Model) -> tuple[float, float]:
    """Mass of all bodies, and mass with the share of the rotating wheels at pure rolling [kg]."""
    total = sum(body.mass for body in model.bodies)
    return total, total + sum(w.spin_inertia / w.radius**2 for w in model.wheelsets)


def heights(model: Model, result: Rows) -> np.ndarray:
    """Potential of gravity of the whole vehicle [J]: every body on the hill at its own distance."""
    track, s = hill(), result["s [m]"]
    dense = np.linspace(0.0, 400.0, 200_001)
    rise = np.concatenate([[0.0], np.cumsum(track.at(0.5 * (dense[1:] + dense[:-1])).gradient) * (dense[1] - dense[0])])
    return np.sum([b.mass * GRAVITY * np.interp(s + b.position[0], dense, rise) for b in model.bodies], axis=0)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_climb_slows_the_vehicle_and_its_wheels(engine: str) -> None:
    model = Manchester().model()
    result = go(engine, make_run(model, hill(), Driven(kind="driven", speed=20.0), 12.0))
    total, rolling = masses(model)
    late = result["time [s]"] > 8.0
    rate = np.polyfit(result["time [s]"][late], result["speed [m/s]"][late], 1)[0]
    assert rate == pytest.approx(-GRAVITY * CLIMB * total / rolling, rel=2e-3)
    assert result["acceleration [m/s2]"][late].mean() == pytest.approx(rate, rel=1e-2)


@pytest.mark.parametrize("engine", ENGINES)
def test_coasting_turns_speed_into_height(engine: str) -> None:
    model = Manchester().model()
    result = go(engine, make_run(model, hill(), Driven(kind="driven", speed=20.0), 12.0))
    total, _ = masses(model)
    moving = 0.5 * total * result["speed [m/s]"] ** 2
    for wheelset in model.wheelsets:
        moving = moving + 0.5 * wheelset.spin_inertia * result[f"{wheelset.body}.spin [rad/s]"] ** 2
    lost, gained = moving[0] - moving[-1], heights(model, result)[-1] - heights(model, result)[0]
    assert gained > 2e5
    assert lost == pytest.approx(gained, rel=2e-3)


def test_resistance_slows_on_the_level() -> None:
    model = Manchester().model()
    speed = Driven(kind="driven", speed=20.0, resistance=(500.0, 20.0, 1.0))
    result = go("compiled", make_run(model, flat(), speed, 4.0, start=0.0))
    _, rolling = masses(model)
    expected = -(500.0 + 20.0 * 20.0 + 400.0) / rolling
    assert np.polyfit(result["time [s]"][:2048], result["speed [m/s]"][:2048], 1)[0] == pytest.approx(
        expected, rel=0.01
    )


def test_torque_accelerates_whole_vehicle() -> None:
    model = Manchester().model()
    traction = [Traction(wheelset=i, time=(0.0, 0.5, 10.0), torque=(0.0, 2000.0, 2000.0)) for i in (1, 2)]
    result = go(
        "compiled", make_run(model, flat(), Driven(kind="driven", speed=10.0), 4.0, start=0.0, traction=traction)
    )
    _, rolling = masses(model)
    late = result["time [s]"] > 2.0
    rate = np.polyfit(result["time [s]"][late], result["speed [m/s]"][late], 1)[0]
    assert rate == pytest.approx(2.0 * 2000.0 / 0.46 / rolling, rel=5e-3)


def test_nothing_chatters_at_standstill() -> None:
    """Creepage stays finite as the speed goes to zero, and the step is short enough for it."""
    speed = {"kind": "profile", "time": [0.0, 6.0, 9.0], "speed": [4.0, 0.0, 0.0]}
    scenario = Scenario.build(
        {"track": "straight_erri_low", "vehicle": "manchester", "speed": speed, "duration": 9.0, "name": "stop"}
    )
    truth = simulate(scenario, engine="compiled")
    standing = truth.time > 7.0
    assert np.abs(truth["wheelset1.spin [rad/s]"][standing]).max() < 1e-5
    change = np.diff(truth["wheel1_left.creep_force_x [N]"][standing])
    assert np.abs(change).max() < 50.0
