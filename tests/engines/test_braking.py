"""Braked half vehicle: what goes through the bogie along the track, brakes that hold, slide and re-adhesion."""

from typing import Any

import numpy as np
import pytest

from railsim import InputError
from railsim.constants import GRAVITY
from railsim.speed import Driven, Traction
from railsim.track import Track, read_track
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import ENGINES, Rows, flat, go, make_run, ratio

VEHICLE = Manchester()
WHEELS = [f"wheel{i}_{side}" for i in (1, 2) for side in ("left", "right")]
TORQUE = 2500.0  # N m on each wheelset: 5 % of the weight


def braked(time: tuple[float, ...] = (0.0, 0.5, 99.0), brake: tuple[float, ...] = (0.0, TORQUE, TORQUE)) -> Any:
    """Both wheelsets alike."""
    return [Traction(wheelset=i, time=time, brake=brake) for i in (1, 2)]


def ride(engine: str, adhesion: str, track: Track, speed: float, duration: float, traction: Any = ()) -> Rows:
    """Brakes act from the start, speed follows."""
    model = Manchester(adhesion=Adhesion.build(adhesion)).model()
    run = make_run(model, track, Driven(kind="driven", speed=speed), duration, traction=traction or braked(), start=0.0)
    return go(engine, run)


@pytest.mark.parametrize("engine", ENGINES)
def test_braking_loads_the_leading_wheelset(engine: str) -> None:
    """Moments about the rails under the bogie: 2 b dN = deceleration (body at its rod, bogie, wheelsets, and spin)."""
    result = ride(engine, "dry", flat(), 20.0, 5.0)
    late = result["time [s]"] > 3.5
    rate = -np.polyfit(result["time [s]"][late], result["speed [m/s]"][late], 1)[0]
    v = VEHICLE
    lever = v.body_mass * v.secondary_height + v.bogie_mass * v.bogie_height
    lever += 2.0 * (v.wheelset_mass * v.wheel_radius + v.wheelset_spin_inertia / v.wheel_radius)
    normal = [result[f"{wheel}.normal_force [N]"][late].mean() for wheel in WHEELS]
    transfer = 0.5 * (normal[0] + normal[1] - normal[2] - normal[3])
    assert transfer == pytest.approx(rate * lever / (2.0 * v.semi_wheelbase), rel=5e-3)
    pitch = 0.5 * transfer / (v.primary_vertical_stiffness * v.semi_wheelbase)
    sunk = result["wheelset2.z [m]"][late] - result["wheelset1.z [m]"][late]
    expected = pitch + sunk.mean() / (2.0 * v.semi_wheelbase)
    assert result["bogie.pitch [rad]"][late].mean() == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("engine", ENGINES)
def test_longitudinal_path_adds_no_force(engine: str) -> None:
    """Deceleration by momentum: creep forces over mass, on wheels that roll: torque over radius over mass and spin."""
    result = ride(engine, "dry", flat(), 20.0, 4.0)
    late = result["time [s]"] > 2.0
    rate = np.polyfit(result["time [s]"][late], result["speed [m/s]"][late], 1)[0]
    total = 4.0 * VEHICLE.wheel_load / GRAVITY
    pushed = sum(result[f"{wheel}.creep_force_x [N]"][late].mean() for wheel in WHEELS)
    assert rate == pytest.approx(pushed / total, rel=1e-4)
    rolling = total + 2.0 * VEHICLE.wheelset_spin_inertia / VEHICLE.wheel_radius**2
    assert rate == pytest.approx(-2.0 * TORQUE / VEHICLE.wheel_radius / rolling, rel=2e-3)


@pytest.mark.parametrize("adhesion", ["dry", "very low"])
def test_engines_agree_on_braking(adhesion: str) -> None:
    track = read_track("straight_erri_high")
    fast, reference = (
        go(
            engine,
            make_run(
                Manchester(adhesion=Adhesion.build(adhesion)).model(),
                track,
                Driven(kind="driven", speed=25.0),
                3.0,
                traction=braked(),
            ),
        )
        for engine in ("compiled", "exudyn")
    )
    for name in (
        "bogie.pitch [rad]", "bogie.z [m]", "wheelset1.y [m]", "wheelset2.yaw [rad]", "wheel2_right.normal_force [N]",
        "speed [m/s]", "wheelset1.spin [rad/s]",
    ):  # fmt: skip
        assert ratio(reference[name], fast[name]) < 5e-3, name


def test_steady_speed_without_torque_pitches_nothing() -> None:
    result = go("compiled", make_run(VEHICLE.model(), flat(), 20.0, 2.0))
    assert np.abs(result["bogie.pitch [rad]"]).max() < 1e-12


def test_locked_brake_holds_the_wheelset() -> None:
    """A brake is friction: with more torque than the rails give, wheels stop and stay, while the vehicle slides on."""
    result = ride("compiled", "very low", flat(), 20.0, 5.0, braked(brake=(0.0, 6000.0, 6000.0)))
    spin, late = result["wheelset1.spin [rad/s]"], result["time [s]"] > 4.0
    assert np.abs(spin[late]).max() < 0.01 * spin[0]
    assert result["speed [m/s]"][-1] > 18.0
    normal = result["wheel1_left.normal_force [N]"][late]
    held = -result["wheel1_left.creep_force_x [N]"][late] / normal
    assert held == pytest.approx(result["wheel1_left.friction [-]"][late], rel=5e-3)


def test_wheels_spin_up_again_where_the_brake_is_released() -> None:
    brake = braked((0.0, 0.5, 3.0, 3.2), (0.0, TORQUE, TORQUE, 0.0))
    result = ride("compiled", "very low", flat(), 20.0, 9.0, brake)
    slip = 1.0 - VEHICLE.wheel_radius * result["wheelset1.spin [rad/s]"] / result["speed [m/s]"]
    assert slip[result["time [s]"] > 2.9][0] > 0.3
    assert abs(slip[-1]) < 1e-3


def test_wheels_find_grip_again_where_friction_recovers() -> None:
    """Leaves on the rail from 15 m to 60 m: slide there, both wheelsets roll again behind, the brake still on."""
    s = np.arange(-40.0, 300.0, 0.5)
    track = Track(s, {"friction": np.where((s > 15.0) & (s < 60.0), 0.03, 0.4)}, "leaves")
    model = Manchester(adhesion=Adhesion(condition="low", k_adhesion=0.5, k_slip=0.4)).model()
    run = make_run(model, track, Driven(kind="driven", speed=20.0), 5.0, start=0.0, traction=braked())
    result = go("compiled", run)
    for i, ahead in ((1, 1.28), (2, -1.28)):
        slip = 1.0 - VEHICLE.wheel_radius * result[f"wheelset{i}.spin [rad/s]"] / result["speed [m/s]"]
        place = result["s [m]"] + ahead
        assert slip[place < 14.0].max() < 0.01
        assert slip[place < 60.0][-1] > 0.15
        assert abs(slip[-1]) < 0.01


def test_traction_takes_one_kind_of_action_and_no_negative_brake() -> None:
    for given in ({"torque": [1.0], "brake": [1.0]}, {}):
        with pytest.raises(InputError, match="give one of torque, brake and slip"):
            Traction.build({"wheelset": 1, "time": [0.0], **given})
    with pytest.raises(InputError, match=r"brake\.0: Input should be greater than or equal to 0"):
        Traction.build({"wheelset": 1, "time": [0.0], "brake": [-5.0]})
