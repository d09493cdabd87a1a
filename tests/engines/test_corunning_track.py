"""The track that runs with the wheelsets: energy, forces at a dip, engines, effects, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from railsim.analysis.energy import energy_over
from railsim.dynamics.channels import CORUNNING
from railsim.dynamics.corunning import COORDINATES, LEFT_Z, RIGHT_Z, track_place
from railsim.dynamics.equilibrium import steady_state
from railsim.dynamics.plant import build_plant
from railsim.dynamics.tables import wheel_load
from railsim.effects.hanging_sleepers import HangingSleepers
from railsim.effects.interface import Setup
from railsim.effects.soft_track import SoftTrack
from railsim.errors import InputError
from railsim.model import Model
from railsim.scenario import load_scenario
from railsim.speed import Constant
from railsim.track import Track, read_track
from railsim.track.flexible import CoRunning, FlexibleTrack
from railsim.track.kernel import build_tables
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.wheelset import WheelsetVehicle
from tests.engines.rig import Rows, flat, go, make_run
from tests.engines.test_energy import NO_LOSSES

UNIFORM = FlexibleTrack(stiffness_variation=0.0)
UNDAMPED = UNIFORM.but(
    pad_damping_vertical=0.0, pad_damping_lateral=0.0, ballast_damping_vertical=0.0, ballast_damping_lateral=0.0
)


def on(track: FlexibleTrack, vehicle: Vehicle) -> Model:
    """The vehicle on a track that runs with its wheelsets."""
    return replace(vehicle.model(), corunning=track.corunning())


def lumped(track: CoRunning) -> tuple[float, float, float]:
    """Mass [kg], stiffness [N/m] and damping [N s/m] of a rail and what is below it in its static shape."""
    share = track.pad_stiffness_z * (track.compliance - 1.0 / track.pad_stiffness_z)
    share = 1.0 / (1.0 + 1.0 / share)  # of the rail's deflection that the sleeper takes part in
    mass = track.rail_mass_z + 0.5 * track.sleeper_mass_z * share**2
    damping = track.ballast_damping_z * share**2 + track.pad_damping_z * (1.0 - share) ** 2
    return mass, 1.0 / track.compliance, damping


@pytest.mark.parametrize("speed", [20.0, 30.0])
@pytest.mark.parametrize("bed", [40e6, 70e6])
@pytest.mark.parametrize("vehicle", [WheelsetVehicle(), Manchester()], ids=lambda one: type(one).__name__)
def test_force_at_a_dip_is_p2_of_jenkins(vehicle: Vehicle, bed: float, speed: float) -> None:
    """Jenkins et al. (1974): two straight ramps 6 m long meet in the total angle of 10 mrad; forces below 200 Hz."""
    alpha, half_length = 5e-3, 6.0
    model = on(UNIFORM.but(ballast_stiffness_vertical=bed), vehicle)
    s = np.arange(0.0, 90.0, 0.05)
    dip = np.minimum(0.0, alpha * (np.abs(s - 50.0) - half_length))
    run = replace(make_run(model, Track(s, {"vertical": dip}, "dip"), speed, 36.0 / speed), rate=4096.0, substeps=2)
    result = go("compiled", run)
    assert model.corunning is not None
    wheelset = model.bodies[model.index("wheelset1")]
    place = result["s [m]"] + wheelset.position[0] - 50.0
    force = sosfiltfilt(butter(4, 200.0, fs=4096.0, output="sos"), result["wheel1_left.normal_force [N]"])
    highest = force[(place > 0.0) & (place < 0.03 * speed)].max()
    unsprung, still = 0.5 * wheelset.mass, wheel_load(model)
    mass, stiffness, damping = lumped(model.corunning)
    share = np.sqrt(unsprung / (unsprung + mass))
    loss = 1.0 - np.pi * damping / (4.0 * np.sqrt(stiffness * (unsprung + mass)))
    expected = still + 2.0 * alpha * speed * share * loss * np.sqrt(stiffness * unsprung)
    assert highest == pytest.approx(expected, rel=0.15)
    assert highest > 1.5 * still


def test_energy_of_vehicle_and_track_is_kept() -> None:
    """No dampers, no creep: a bogie that is 1 mm too high and beside its springs, over 1 s at a fine step."""
    model = on(UNDAMPED, Manchester(**NO_LOSSES))
    still = make_run(model, flat(), 20.0, 1.0)
    x = steady_state(build_plant(model, still.track, still.speed), still.start)
    rest = energy_over(replace(still, duration=0.001, initial=x.copy()))[0].sum()
    x[[model.names.index(name) for name in ("bogie.y", "bogie.z")]] += 1e-3
    run = replace(still, substeps=32, initial=x)
    total = energy_over(run).sum(axis=1)
    assert total[0] - rest > 1.0
    assert np.abs(total - total[0]).max() < 1e-6 * (total[0] - rest)
    rails = go("compiled", run)["track1.left_rail_z [m]"]
    assert np.ptp(rails) > 1e-5


def test_static_deflection_is_in_the_surveyed_height() -> None:
    """The vehicle stands as on rigid rails, and the rails are down by load over stiffness, the sleepers with them."""
    vehicle = Manchester()
    rigid, moving = (go("compiled", make_run(m, flat(), 20.0, 0.1)) for m in (vehicle.model(), on(UNIFORM, vehicle)))
    for name in ("wheelset1.z [m]", "body.z [m]"):
        assert moving[name][0] == pytest.approx(rigid[name][0], abs=1e-6)  # rails spread by micrometres
    own = UNIFORM.corunning()
    down = wheel_load(vehicle.model()) * own.compliance
    assert moving["track2.right_rail_z [m]"][0] == pytest.approx(-down, rel=1e-3)
    pads = wheel_load(vehicle.model()) / own.pad_stiffness_z
    assert moving["track2.sleeper_z [m]"][0] == pytest.approx(pads - down, rel=1e-3)
    assert moving["track1.support_stiffness [N/m]"][0] == pytest.approx(1.0 / own.compliance)
    for name in moving.names[1:]:
        assert np.ptp(moving[name]) < 1e-6 * max(1.0, np.abs(moving[name]).max()) or name.startswith(
            ("s [m]", "position", "track", "wheelset1.spin_angle", "wheelset2.spin_angle")
        ), name


@pytest.mark.parametrize(
    ("vehicle", "track", "speed"),
    [
        (Manchester(), "straight_erri_high", 30.0),
        (Class175Whole(), "curve_r400", 20.0),
        (WheelsetVehicle(), "straight_erri_low", 8.0),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Vehicle) else str(value),
)
def test_engines_agree(vehicle: Vehicle, track: str, speed: float) -> None:
    """At a quarter of the default step, where little is taken implicit, after the kick of the start over rough rails:
    in parts of every channel's largest movement.
    """
    run = make_run(on(FlexibleTrack(), vehicle), read_track(track), speed, 2.0, start=30.0, finer=4)
    fast, other = (go(engine, run) for engine in ("compiled", "verlet"))
    for name in fast.names:
        seen, expected = other[name][512:], fast[name][512:]
        assert np.abs(seen - expected).max() <= 5e-3 * max(np.abs(expected - fast[name][0]).max(), 1e-9), name


def test_default_step_gives_the_motion_of_a_fine_one() -> None:
    """At the default step the light rails' contacts are implicit; at an eighth of it they are not."""
    model, track = on(FlexibleTrack(), Manchester()), read_track("straight_erri_low")
    coarse, fine = (go("compiled", make_run(model, track, 20.0, 3.0, finer=finer)) for finer in (1, 8))
    for name in fine.names:
        moved = np.abs(fine[name] - fine[name][0]).max()
        assert np.abs(coarse[name] - fine[name]).max() <= 1e-2 * max(moved, 1e-9), name
    for name in ("wheelset1.y [m]", "wheelset1.yaw [rad]", "bogie.z [m]", "track1.left_rail_z [m]"):
        assert np.abs(coarse[name] - fine[name]).max() <= 5e-3 * np.abs(fine[name] - fine[name][0]).max(), name


def over(track: Track, *effects: HangingSleepers | SoftTrack, flexible: FlexibleTrack | None = UNIFORM) -> Rows:
    """A run at 20 m/s over 60 m with effects."""
    setup = Setup(Manchester(), track, (), Constant(speed=20.0), (), 3.0, flexible_track=flexible)
    for effect in effects:
        setup = effect.install(setup)
    run = make_run(setup.model, setup.track, 20.0, 3.0)
    return go("compiled", run)


def test_wheels_press_hanging_sleepers_down_until_the_gap_is_closed() -> None:
    level = read_track("straight_erri_low")
    level = Track(level.s, {"vertical": np.zeros(level.s.size)}, "level")
    result = over(level, HangingSleepers(deflection=2e-3, place=50.0, length=4.0))
    down = result["track1.left_rail_z [m]"]
    assert down[0] - down.min() == pytest.approx(2e-3, rel=0.25)
    assert result["track1.void_gap [m]"].max() == pytest.approx(2e-3, rel=1e-3)
    assert result["wheelset1.z [m]"].min() == pytest.approx(-2e-3, rel=0.25)
    assert np.ptp(result["wheel1_left.normal_force [N]"]) > 1e3
    flat_out = over(level)
    assert np.ptp(flat_out["track1.left_rail_z [m]"]) < 1e-9


def test_soft_track_and_a_column_of_the_file_change_what_is_below_the_rails() -> None:
    level = Track(np.linspace(0.0, 120.0, 601), {"vertical": np.zeros(601)}, "level")
    own = UNIFORM.corunning()
    soft = over(level, SoftTrack(softness=2e-8, variation=0.5, wavelength=6.0))["track1.support_stiffness [N/m]"]
    assert 1.0 / soft.min() == pytest.approx(own.compliance + 3e-8, rel=1e-3)
    assert 1.0 / soft.max() == pytest.approx(own.compliance + 1e-8, rel=1e-3)
    stiffness = np.where(level.s < 60.0, 80e6, 40e6)
    stated = Track(level.s, level.columns() | {"stiffness": stiffness}, "stated")
    result = over(stated)
    assert result["track1.support_stiffness [N/m]"][[0, -1]] == pytest.approx([80e6, 40e6])
    down = result["track1.left_rail_z [m]"]
    assert down[-1] - down[0] == pytest.approx(wheel_load(Manchester().model()) * (1 / 80e6 - 1 / 40e6), rel=0.1)


def test_sleepers_are_heard_where_their_stiffness_varies() -> None:
    """A tone at speed over spacing, in phase with the wave of the stiffness."""
    level = Track(np.linspace(0.0, 120.0, 601), {"vertical": np.zeros(601)}, "level")
    even, uneven = (
        over(level, flexible=FlexibleTrack(stiffness_variation=depth))["wheelset1.specific_force_z [m/s2]"]
        for depth in (0.0, 0.05)
    )
    assert np.ptp(even[1024:]) < 1e-6
    spectrum = np.abs(np.fft.rfft((uneven[1024:3072] - uneven[1024:3072].mean()) * np.hanning(2048)))
    assert 0.5 * float(spectrum.argmax()) == pytest.approx(20.0 / 0.6, abs=0.5)


def test_a_start_over_a_void_stands() -> None:
    level = Track(np.linspace(0.0, 120.0, 601), {"vertical": np.zeros(601)}, "level")
    setup = Setup(Manchester(), level, (), Constant(speed=20.0), (), 1.0, flexible_track=UNIFORM)
    setup = HangingSleepers(deflection=3e-3, place=21.25, length=6.0).install(setup)
    run = make_run(setup.model, level, 20.0, 0.1)
    plant = build_plant(run.model, run.track, run.speed)
    x = steady_state(plant, run.start)
    at = int(track_place(plant))
    down = x[at : at + 2 * COORDINATES].reshape(2, COORDINATES)[:, [LEFT_Z, RIGHT_Z]]
    assert down.min() < -2.5e-3


@pytest.mark.parametrize(
    ("engine", "expected"),
    [
        ("compiled", (54422.85495838255, -6.308353322446253e-05, 9.800914366567348)),
        ("verlet", (54422.591220325114, -6.308354155661762e-05, 9.800910891751428)),
    ],
)
def test_rigid_rails_give_what_they_gave_before_there_was_another_track(
    engine: str, expected: tuple[float, float, float]
) -> None:
    """Numbers of the version before; on one machine every bit is the same."""
    result = go(engine, make_run(Manchester().model(), read_track("straight_erri_low"), 20.0, 0.5))
    names = ("wheel1_left.normal_force [N]", "wheelset2.y [m]", "bogie.specific_force_z [m/s2]")
    assert [result[name][-1] for name in names] == pytest.approx(expected, rel=1e-9)
    assert result.rows.shape == (513, 151)
    assert "flexible_track" not in load_scenario("default").values()


def test_rigid_rails_stay_as_they_are() -> None:
    """The record of the plant's numbers is the only thing that a rigid run shares with the moving track."""
    model = Manchester().model()
    run = make_run(model, read_track("straight_erri_low"), 20.0, 0.5)
    plant = build_plant(model, run.track, run.speed)
    assert plant.core.corunning.shape == (1,)
    assert not any("rail_z" in name or "sleeper" in name for name in go("compiled", run).names)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"flexible_track.sleeper_spacing": 0.0}, r"flexible_track\.sleeper_spacing.*0\.3"),
        ({"flexible_track.rail_mass": -60.0}, r"flexible_track\.rail_mass"),
        ({"flexible_track.pads": 1.0}, r"flexible_track\.pads: unknown key"),
    ],
)
def test_bad_numbers_are_refused_with_one_line(changes: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        load_scenario("default", {"flexible_track": {}, "duration": 2.0, **changes})
    assert "\n" not in str(refused.value)


def test_steps_too_long_for_stiff_pads_are_refused() -> None:
    stiff = {"flexible_track": {"pad_stiffness_vertical": 4e9}, "duration": 2.0}
    load_scenario("default", stiff)
    with pytest.raises(InputError, match=r"substeps: .* unstable .* give at least \d+ or leave it out"):
        load_scenario("default", {**stiff, "substeps": 2})


def test_a_column_that_is_stiffer_than_the_pads_is_refused() -> None:
    level = Track(np.linspace(0.0, 120.0, 121), {"stiffness": np.full(121, 5e8)}, "stiff")
    model = on(UNIFORM, Manchester())
    with pytest.raises(InputError, match="ballast of negative stiffness"):
        build_plant(model, build_tables(level), make_run(model, flat(), 20.0, 1.0).speed)


def test_exudyn_moves_the_same_track() -> None:
    """Absolute coordinates, and explicit steps for the rails' contacts: neither the moving frame nor what is implicit
    in `compiled` enters.
    """
    run = make_run(on(FlexibleTrack(), Manchester()), read_track("straight_erri_low"), 20.0, 0.75)
    fast, reference = (go(engine, run) for engine in ("compiled", "exudyn"))
    for name in (
        *(f"track{i}.{quantity}" for i in (1, 2) for quantity in CORUNNING),
        *("wheelset1.y [m]", "wheelset2.yaw [rad]", "bogie.z [m]", "wheel1_left.creep_force_y [N]"),
    ):
        moved = np.abs(reference[name] - reference[name][0]).max()
        assert np.abs(fast[name] - reference[name]).max() <= 5e-3 * max(moved, 1e-9), name
