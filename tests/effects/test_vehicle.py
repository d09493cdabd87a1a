"""Effects on vehicle, wheels and loads against closed forms."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from railsim import InputError, load_scenario
from railsim.analysis.energy import energy_over
from railsim.compiled import kernel
from railsim.constants import GRAVITY
from railsim.contact.wheel import ContactPoint, rolling_radius
from railsim.dynamics.equilibrium import initial_state
from railsim.dynamics.extras import doubled, second_on_rail, wheel_on_rail
from railsim.dynamics.plant import build_plant
from railsim.effects.interface import EFFECTS
from railsim.effects.wheel_changes import POINTS, flat_depth
from railsim.simulation import build_run
from tests.effects.rig import largest_difference, rows, scenario
from tests.engines.rig import Rows, go, ratio
from tests.engines.test_energy import NO_LOSSES

SMOOTH = {"track": "smooth", "duration": 1.0}
RADIUS = 0.42
PLACES = np.arange(50, 550, 50)  # cells of the contact's table
WHEELS = [(i, side) for i in (1, 2) for side in ("left", "right")]


def on_smooth_track(kind: str, **settings: Any) -> Rows:
    return rows([{"kind": kind, **settings}], **SMOOTH)


def peak(signal: np.ndarray) -> tuple[float, float]:
    """Frequency [Hz] and amplitude of the largest line of a signal at 1024 Hz, by a fine search."""
    time = np.arange(len(signal)) / 1024.0
    window = np.hanning(len(signal))
    shape = window * (signal - np.average(signal, weights=window))
    trial = np.arange(2.0, 100.0, 0.05)
    lines = np.abs(np.exp(-2j * np.pi * np.outer(trial, time)) @ shape) * 2.0 / window.sum()
    best = int(lines.argmax())
    return float(trial[best]), float(lines[best])


@pytest.mark.parametrize("order", [1, 3])
def test_a_wheel_that_is_not_round_is_heard_at_its_frequency(order: int):
    result = on_smooth_track("out_of_round", amplitude=2e-5, order=order)
    found, _ = peak(result["wheel1_left.normal_force [N]"])
    assert found == pytest.approx(order * 25.0 / (2 * np.pi * RADIUS), rel=0.02)


def test_unbalance_is_what_the_rails_carry_beside_weight_and_acceleration():
    """Sum of m f_z = normal forces - U w^2 cos(angle), at the true angle of rotation."""
    result = on_smooth_track("wheel_unbalance", unbalance=0.2)
    masses = {body.name: body.mass for body in scenario([], **SMOOTH).model.bodies}
    weight = sum(mass * result[f"{name}.specific_force_z [m/s2]"] for name, mass in masses.items())
    rails = sum(
        result[f"wheel{i}_{s}.normal_force [N]"] * np.cos(result[f"wheel{i}_{s}.contact_angle [rad]"])
        + result[f"wheel{i}_{s}.creep_force_y [N]"] * np.sin(result[f"wheel{i}_{s}.contact_angle [rad]"])
        for i, s in WHEELS
    )
    lift = -0.2 * (25.0 / RADIUS) ** 2 * np.cos(result["wheelset1.spin_angle [rad]"])
    assert np.abs(weight - rails - lift).max() < 0.02 * np.abs(lift).max()
    found, _ = peak(result["wheel1_left.normal_force [N]"])
    assert found == pytest.approx(25.0 / (2 * np.pi * RADIUS), rel=0.02)


def test_rounded_flat_is_half_as_deep_as_the_chord_of_a_fresh_one():
    for length in (0.02, 0.05):
        assert flat_depth(length, RADIUS) == pytest.approx(0.5 * RADIUS * (1 - np.cos(length / 2 / RADIUS)), rel=2e-3)


def test_flat_too_short_to_matter_does_not_shorten_the_step():
    """A fit that lets a flat shrink to nothing would else take minutes for each run."""
    setups = [
        scenario([{"kind": "wheel_flat", "length": length, "side": "left"}]).setup for length in (0.028, 0.02, 0.001)
    ]
    steps = [setup.longest_step for setup in setups]
    assert steps[0] == pytest.approx(1.4 * steps[1])
    assert steps[2] == steps[1]


@pytest.mark.parametrize("length", [0.083, 0.12])
def test_step_of_a_flat_is_short_enough_for_the_blow(length: float):
    """A long one lifts the wheel, and what it does when it comes down does not depend on how long the flat was."""
    run = build_run(scenario([{"kind": "wheel_flat", "length": length}], duration=1.0, **{"speed.speed": 30.0}))
    usual, converged = go("compiled", run), go("compiled", replace(run, substeps=8 * run.substeps))
    assert (converged["wheel1_left.normal_force [N]"] <= 0.0).mean() > 0.02
    assert ratio(usual["wheelset1.specific_force_z [m/s2]"], converged["wheelset1.specific_force_z [m/s2]"]) < 0.06
    assert ratio(usual["bogie.specific_force_z [m/s2]"], converged["bogie.specific_force_z [m/s2]"]) < 0.01


def test_flat_is_as_long_and_deep_as_stated():
    model = scenario([{"kind": "wheel_flat", "length": 0.05, "angle": 6.0, "side": "right"}]).model
    assert model.wheelsets[0].roundness is not None
    left, right = model.wheelsets[0].roundness
    assert not left.any()
    assert right.min() == pytest.approx(-flat_depth(0.05, RADIUS), rel=1e-2)
    assert np.count_nonzero(right) * 2 * np.pi * RADIUS / POINTS == pytest.approx(0.05, abs=0.003)
    assert right.argmin() * 2 * np.pi / POINTS == pytest.approx(6.0, abs=0.01)


def test_a_wheel_that_is_not_round_keeps_energy():
    """No losses: what the wheel lifts comes from its rotation."""
    lossless = {
        "vehicle": {"name": "class175", **NO_LOSSES, "adhesion": {"creep": False}},
        "effects": [{"kind": "out_of_round", "amplitude": 1e-4, "side": "both", "phase": np.pi / 2}],
        "speed.speed": 25.0,
        "duration": 1.0,
        "substeps": 8,
        "sensors": [],
    }
    run = build_run(load_scenario("smooth", lossless))
    at_rest = build_run(load_scenario("smooth", lossless | {"effects": []}))
    start = initial_state(build_plant(at_rest.model, at_rest.track, at_rest.speed), at_rest)
    energy = energy_over(replace(run, initial=start))
    turning = np.ptp(energy[:, 0])
    assert turning > 1.0  # J
    assert np.ptp(energy.sum(axis=1)) < 1e-3 * turning


def test_wheels_of_two_sizes_run_off_centre_by_the_rolling_line():
    """2 conicity u + difference = 0 with u the shift of the wheels; twice the conicity, half the way."""
    simple = {**SMOOTH, "vehicle": {"name": "class175", "pair": {"kind": "conical", "conicity": 0.1}}}
    unequal = {"kind": "wheel_radius_difference", "difference": 1e-4}
    one = rows([unequal], **simple)
    other = rows([unequal, {"kind": "conicity_change", "factor": 2.0}], **simple)
    once, twice = (
        0.5 * sum(run[f"wheel1_{s}.lateral_shift [m]"][0] for s in ("left", "right")) for run in (one, other)
    )
    assert once == pytest.approx(-1e-4 / 0.2, rel=0.02)
    assert twice == pytest.approx(-1e-4 / 0.4, rel=0.03)


def test_a_steeper_profile_is_steeper_for_a_wheel_that_turns_on_its_rail_too():
    """As where the profile is steeper: same rolling radius at the same place of the table, whatever the roll."""
    pair = {"kind": "conical", "conicity": 0.1, "upright_rails": 1.0}
    steep, usual = (
        plant_of(effects, {"name": "class175", "pair": {**pair, "conicity": conicity}})
        for effects, conicity in (([{"kind": "conicity_change", "factor": 2.0}], 0.1), ([], 0.2))
    )
    assert radii(usual, 0, 1e-3) != pytest.approx(radii(usual, 0, 0.0), abs=1e-6)
    for roll in (-1e-3, 0.0, 1e-3):
        for wheelset in (0, 1):
            assert radii(steep, wheelset, roll) == pytest.approx(radii(usual, wheelset, roll), abs=1e-9)


def test_one_wheelset_alone_may_be_steeper():
    """About the radius in the middle of the tread; of a second contact too."""
    vehicle = {"name": "class175_whole", "pair": {"kind": "profiles", "contacts": 2}}
    change = {"kind": "conicity_change", "factor": 2.0}
    worn, usual, twice = (
        plant_of(effects, vehicle)
        for effects in ([{**change, "wheelset": 3}], [], [{**change, "wheelset": 3}, {**change, "factor": 0.5}])
    )
    middle = np.repeat(usual.core.middle_radius, 2)[:, None]
    assert middle == pytest.approx(RADIUS, abs=1e-4)
    for wheelset in range(4):
        off, of_worn, of_both = (radii(one, wheelset, 0.0) - middle for one in (usual, worn, twice))
        assert of_worn == pytest.approx((2.0 if wheelset == 2 else 1.0) * off, abs=1e-12)
        assert of_both == pytest.approx((1.0 if wheelset == 2 else 0.5) * off, abs=1e-12)
    with pytest.raises(InputError, match="no wheelset 3"):
        plant_of([{**change, "wheelset": 3}], "class175")


def plant_of(effects: list[dict[str, Any]], vehicle: Any) -> Any:
    run = build_run(scenario(effects, **SMOOTH, vehicle=vehicle))
    return build_plant(run.model, run.track, run.speed)


def radii(plant: Any, wheelset: int, roll: float) -> np.ndarray:
    """(2 sides, first and second contact, places) rolling radii [m] of a wheelset in some cells of the table; those of
    second contacts are the first ones' where there are none.
    """
    found = np.empty((4, len(PLACES)))
    _radii(plant, wheelset, roll, PLACES, found)
    return found


@kernel
def _radii(plant, wheelset, roll, places, found):
    for side in range(2):
        for k, cell in enumerate(places):
            point = ContactPoint(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, cell, 0.5)
            found[2 * side : 2 * side + 2, k] = rolling_radius(wheel_on_rail(plant, wheelset, side), point, roll)
            if doubled(plant):
                found[2 * side + 1, k] = rolling_radius(second_on_rail(plant, wheelset, side), point, roll)


def test_payload_stands_on_the_wheels():
    loaded, empty = on_smooth_track("payload", mass=2000.0), rows([], **SMOOTH)
    more = sum(
        float(loaded[f"wheel{i}_{s}.normal_force [N]"][0] - empty[f"wheel{i}_{s}.normal_force [N]"][0])
        for i, s in WHEELS
    )
    assert more == pytest.approx(2000.0 * GRAVITY, rel=0.01)  # normal forces lean by the contact angle


@pytest.mark.parametrize(
    ("kind", "settings", "moment"),
    [("crosswind", {"force": 2000.0, "height": 2.3}, 4600.0), ("off_centre_load", {"moment": 4000.0}, 4000.0)],
)
def test_wheel_loads_balance_the_moment_about_the_track(kind: str, settings: dict[str, float], moment: float):
    result = on_smooth_track(kind, **settings)
    masses = {body.name: body.mass for body in scenario([], **SMOOTH).model.bodies}
    leaning = sum(mass * GRAVITY * float(result[f"{name}.y [m]"][0]) for name, mass in masses.items())
    left, right = (
        sum(
            float(result[f"wheel{i}_{s}.normal_force [N]"][0] * np.cos(result[f"wheel{i}_{s}.contact_angle [rad]"][0]))
            for i in (1, 2)
        )
        for s in ("left", "right")
    )
    assert 0.75 * (left - right) == pytest.approx(moment + leaning, rel=0.03)


def test_misaligned_wheelset_turns_by_its_angle_where_nothing_holds_it():
    """Without creep forces only the primary suspension turns a wheelset; the bogie gives way the other way."""
    free = {**SMOOTH, "vehicle": {"name": "class175", "adhesion": {"creep": False}}}
    result = rows([{"kind": "wheelset_misalignment", "angle": 5e-4}], **free)
    turned = result["wheelset1.yaw [rad]"][0] - result["bogie.yaw [rad]"][0]
    assert turned == pytest.approx(5e-4, rel=0.01)


def test_body_bends_freely_at_its_frequency():
    """Free-free: frequency / sqrt(1 - share)."""
    one = scenario([{"kind": "body_bending", "share": 0.3, "frequency": 8.0}])
    element = next(e for e in one.model.elements if e.name == "bending")
    pair = [6 * one.model.index(name) + 2 for name in ("body", "bending")]
    relative = one.model.relative(element.upper, element.lower, element.position)
    stiffness = (relative.T @ element.stiffness @ relative)[np.ix_(pair, pair)]
    squares = eigh(stiffness, np.diag(one.model.mass[pair]), eigvals_only=True)
    assert np.sqrt(squares[-1]) / (2 * np.pi) == pytest.approx(8.0 / np.sqrt(0.7))
    assert one.model.mass[pair].sum() == pytest.approx(scenario([]).model.mass[pair[0]])


def test_traction_goes_through_the_contacts():
    result = on_smooth_track("traction_torque", torque=1000.0)
    force = sum(result[f"wheel1_{side}.creep_force_x [N]"][-1] for side in ("left", "right"))
    assert force * RADIUS == pytest.approx(1000.0, rel=0.01)


def test_table_of_a_damper_is_the_damper():
    """-10 kN s/m between body and bogie, as a table and as half of the lateral damper taken away."""
    damper = 2 * 20e3
    table = {"displacement": [-1.0, 1.0], "velocity": [-1.0, 1.0], "force": [[0.5 * damper, -0.5 * damper]] * 2}
    tabled = rows([{"kind": "empirical_force", **table}])
    weak = rows([{"kind": "weak_lateral_damper", "factor": 0.5, "onset": 1e-9, "ramp": 1e-9}])
    assert largest_difference(tabled, weak) < 1e-6


def test_an_exposed_stretch_blows_where_it_is():
    gust = {"kind": "exposed_stretch", "place": 35.0, "length": 10.0}
    result = rows([gust], track="smooth", duration=1.0)
    calm = result["s [m]"] < 35.0
    assert np.abs(result["body.y [m]"][calm]).max() < 1e-9
    assert np.abs(result["body.y [m]"][~calm]).max() > 1e-4


def test_effects_stand_beside_each_other():
    """All but those that change the same damper twice and those that make the track long to compute."""
    left_out = ("lateral_damper_series_stiffness", "yaw_damper_series_stiffness", "rail_corrugation")
    one = scenario([kind.build({}).settings() for name, kind in EFFECTS.classes().items() if name not in left_out])
    run = build_run(one)
    assert build_plant(run.model, run.track, run.speed).core.elements > 8


@pytest.mark.parametrize("name", list(EFFECTS.classes()))
def test_a_vehicle_without_what_fails_is_refused_in_one_line(name: str):
    """The single wheelset has no bogie: an effect either works or says why not."""
    kind = EFFECTS.classes()[name]
    one = scenario([kind.build({}).settings()], vehicle="manchester") if kind.acts_on == "sensor" else None
    try:
        one = one or load_scenario("smooth", {"vehicle": "wheelset", "sensors": [], "effects": [kind.build({})]})
        run = build_run(one)
        build_plant(run.model, run.track, run.speed)
    except InputError as error:
        assert "\n" not in str(error)
        assert str(error).startswith("effects.0: effect")
