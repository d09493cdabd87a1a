"""Both engines, and the compiled one at half its step, give the same motion."""

import numpy as np
import pytest

from railsim.engines.interface import CHUNK
from railsim.speed import Constant
from railsim.track import read_track
from railsim.vehicles.class175 import Class175
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.wheelset import WheelsetVehicle
from tests.engines.rig import RATE, flat, go, make_run, ratio

CHANNELS = [f"{body}.{q}" for body in ("wheelset1", "wheelset2", "bogie") for q in ("y [m]", "z [m]", "yaw [rad]")]


@pytest.mark.parametrize(
    ("vehicle", "track", "speed", "duration"),
    [
        (Manchester(), "straight_erri_high", 50.0, 4.0),
        (Class175(), "straight_erri_high", 20.0, 6.0),
        (Manchester(), "straight_erri_low", 5.0, 12.0),
        (Class175(), "curve_r400", 28.0, 20.0),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Vehicle) else str(value),
)
def test_engines_agree(vehicle: Vehicle, track: str, speed: float, duration: float) -> None:
    """The whole table of tracks and speeds stands in docs/physics.md."""
    model, geometry = vehicle.model(), read_track(track)
    fast = go("compiled", make_run(model, geometry, speed, duration))
    halved = go("compiled", make_run(model, geometry, speed, duration, finer=2))
    reference = go("exudyn", make_run(model, geometry, speed, duration))
    for name in CHANNELS:
        assert ratio(reference[name], fast[name]) < 5e-3, name
        assert ratio(halved[name], fast[name]) < 1e-3, name


WHOLE = (
    [
        f"{body}.{q}"
        for body in ("body", "bogie", "bogie2", "wheelset1", "wheelset4")
        for q in ("y [m]", "roll [rad]", "yaw [rad]")
    ]
    + [f"{body}.z [m]" for body in ("body", "bogie", "bogie2")]
    + [f"wheel{i}_left.creep_force_y [N]" for i in (1, 3)]
)


@pytest.mark.parametrize(
    ("vehicle", "track", "speed", "start"),
    [(ManchesterWhole(), "straight_erri_high", 50.0, 30.0), (Class175Whole(), "curve_r400", 14.0, 285.0)],
    ids=lambda value: type(value).__name__ if isinstance(value, Vehicle) else str(value),
)
def test_engines_agree_on_whole_vehicles(vehicle: Vehicle, track: str, speed: float, start: float) -> None:
    """Over 120 m, in the second case through a transition into the curve, where the compiled engine joins three track
    frames; Exudyn knows none.
    """
    steady = Constant(speed=speed)
    model, geometry = vehicle.pulled(vehicle.model(), steady, 120.0 / speed), read_track(track)
    fast, reference = (
        go(engine, make_run(model, geometry, speed, 120.0 / speed, start=start)) for engine in ("compiled", "exudyn")
    )
    for name in WHOLE:
        assert ratio(reference[name], fast[name]) < 5e-3, name


def test_engines_agree_on_the_slow_curve_of_a_wheelset() -> None:
    """Just above the speed where a longer step would be allowed: the rolling mode of mass and spin needs it shorter."""
    model, geometry = WheelsetVehicle().model(), read_track("curve_r400")
    fast, reference = (go(engine, make_run(model, geometry, 14.0, 4.0)) for engine in ("compiled", "exudyn"))
    for name in ("wheelset1.y [m]", "wheelset1.yaw [rad]", "wheelset1.spin [rad/s]", "wheel1_left.creepage_x [-]"):
        assert ratio(reference[name], fast[name]) < 5e-3, name


def test_engines_agree_at_rest() -> None:
    model = Manchester().model()
    fast, reference = (go(engine, make_run(model, flat(), 20.0, 1.0)) for engine in ("compiled", "exudyn"))
    for name in CHANNELS:
        assert np.abs(reference[name] - fast[name]).max() < 1e-10, name


def test_exudyn_accelerations_are_whole_where_a_chunk_begins() -> None:
    duration = (CHUNK + 64) / RATE
    model, geometry = Manchester().model(), read_track("straight_erri_high")
    result = go("exudyn", make_run(model, geometry, 50.0, duration))
    force = result["bogie.specific_force_z [m/s2]"][CHUNK - 3 : CHUNK + 4]
    assert np.abs(np.diff(force, 3)).max() < 0.1 * np.abs(force - 9.81).max()
    assert force[3] != pytest.approx(9.81, abs=1e-3)


def test_exudyn_knows_the_accelerations_of_its_first_row() -> None:
    """A body that starts out of its equilibrium."""
    model = Manchester().model()
    rest = make_run(model, flat(), 20.0, 0.01)
    rows = {}
    for engine in ("compiled", "exudyn"):
        first = np.zeros(2 * len(model.names) + 2 * len(model.wheelsets) + 2)
        first[model.names.index("body.z")] = 0.005
        first[-4:-2] = 20.0 / 0.46
        first[-2:] = 20.0, 20.0
        rows[engine] = go(engine, make_run(model, flat(), 20.0, 0.01, initial=first))
    force = {engine: result["body.specific_force_z [m/s2]"][0] for engine, result in rows.items()}
    assert force["exudyn"] == pytest.approx(force["compiled"], rel=1e-5)
    assert force["compiled"] < 9.81 - 0.2
    assert rest.rows == 11
