"""What is refused before the first step: vehicles that fall, and steps that no vehicle can follow."""

import time
from dataclasses import replace

import numpy as np
import pytest

from railsim.constants import GRAVITY
from railsim.dynamics.equilibrium import state_size, steady_state
from railsim.dynamics.kernel import derivatives
from railsim.dynamics.plant import build_plant
from railsim.dynamics.workspace import NO_WHEELS, workspace
from railsim.engines.interface import Run
from railsim.errors import InputError
from railsim.model import Model
from railsim.scenario import load_scenario
from railsim.simulation import simulate_held
from railsim.track import read_track
from railsim.track.track import Track
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from tests.engines.rig import ENGINES, flat, go, make_run


def start(engine: str, model: Model) -> Run:
    """A run that is refused, or not."""
    run = make_run(model, flat(), 20.0, 1.0, start=25.0)
    go(engine, run)
    return run


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("vehicle", [Manchester, ManchesterWhole])
def test_body_that_its_springs_cannot_hold_upright_is_refused(
    engine: str, vehicle: type[Manchester | ManchesterWhole]
) -> None:
    """Roll stiffness 2 b^2 k + bar against m g h: with a millionfold mass nothing stands."""
    model = vehicle(body_mass=1e9).model()
    begun = time.process_time()
    with pytest.raises(InputError, match="does not stand: '.*' falls"):
        start(engine, model)
    assert time.process_time() - begun < 120.0  # compiling included; the run itself would take ten minutes


@pytest.mark.parametrize(("share", "falls"), [(0.8, False), (1.3, True)])
def test_body_falls_where_its_weight_is_more_than_its_springs_hold(share: float, falls: bool) -> None:
    """On both sides of m g h = 2 k b^2, the roll stiffness of the secondary springs; the primary ones are stiff."""
    base = Manchester(
        roll_bar_stiffness=0.0,
        secondary_vertical_stiffness=100e3,
        secondary_lateral_stiffness=5e7,
        primary_vertical_stiffness=5e7,
    )
    held = 2.0 * base.secondary_vertical_stiffness * base.secondary_half_spacing**2
    tall = base.but(body_height=base.secondary_height + share * held / (base.body_mass * GRAVITY))
    if not falls:
        start("compiled", tall.model())
        return
    with pytest.raises(InputError, match=r"'body\.(roll|y)' falls"):
        start("compiled", tall.model())


@pytest.mark.parametrize("vehicle", [Manchester, ManchesterWhole])
def test_every_random_build_finds_its_steady_state_on_rough_track(vehicle: type[Manchester | ManchesterWhole]) -> None:
    """Masses, springs, friction, speeds and places as they come, and a track that moves by 20 um from row to row, which
    once left the search without a start.
    """
    rng = np.random.default_rng(7)
    given = read_track("straight_erri_high")
    for _ in range(5):
        columns = {
            name: getattr(given, name) + 2e-5 * rng.standard_normal(given.s.size)
            for name in ("vertical", "lateral", "cross_level", "gauge_deviation")
        }
        changed = vehicle(
            body_mass=vehicle().body_mass * rng.uniform(0.7, 1.4),
            secondary_lateral_stiffness=160e3 * rng.uniform(0.7, 1.4),
            adhesion=Adhesion.build({"condition": str(rng.choice(["dry", "low", "very low"]))}),
        )
        run = make_run(
            changed.model(),
            Track(given.s, columns, "shaken"),
            rng.uniform(2.0, 40.0),
            0.1,
            start=rng.uniform(30.0, 200.0),
        )
        plant = build_plant(run.model, run.track, run.speed)
        state, change = steady_state(plant, run.start), np.empty(state_size(plant))
        derivatives(plant, 0.0, state, change, workspace(int(plant.core.joints)), NO_WHEELS)
        count = len(run.model.names)
        assert np.abs(change[count : 2 * count]).max() < 1e-4


@pytest.mark.parametrize("engine", ENGINES)
def test_movement_too_fast_for_the_steps_is_refused_with_its_name(engine: str) -> None:
    with pytest.raises(InputError, match=r"moves at .* Hz .* too fast for steps .* check masses and stiffnesses"):
        start(engine, Manchester(primary_vertical_stiffness=1e15).model())


def test_more_steps_are_the_cure_where_they_help() -> None:
    model = Manchester(primary_vertical_stiffness=1e12).model()
    with pytest.raises(InputError, match=r"give 'substeps' of (\d+) or more") as refused:
        start("compiled", model)
    needed = int(str(refused.value).split("'substeps' of ")[1].split()[0])
    finer = make_run(model, flat(), 20.0, 0.2, start=25.0, finer=needed)
    assert abs(go("compiled", finer)["bogie.z [m]"]).max() < 1e-3


@pytest.mark.parametrize("engine", ["compiled", "verlet"])
def test_a_series_spring_too_stiff_for_the_steps_is_refused_and_the_cures_work(engine: str) -> None:
    """A damper of 60 kN s/m behind 1 GN/m settles in 0.06 ms; steps of 0.49 ms let it grow until a wheel leaves."""
    model = ManchesterWhole(secondary_lateral_damping=60e3, lateral_damper_series_stiffness=1e9).model()
    with pytest.raises(InputError, match=r"settles in 0.06 ms.*'substeps' of (\d+) or more.*rigid") as refused:
        start(engine, model)
    needed = int(str(refused.value).split("'substeps' of ")[1].split()[0])
    finer = make_run(model, flat(), 20.0, 0.2, start=25.0)
    finer = replace(finer, substeps=needed)
    assert abs(go(engine, finer)["bogie.z [m]"]).max() < 1e-3
    rigid = ManchesterWhole(secondary_lateral_damping=60e3, lateral_damper_series_stiffness=None).model()
    assert abs(go(engine, make_run(rigid, flat(), 20.0, 0.2, start=25.0))["bogie.z [m]"]).max() < 1e-3


def test_a_start_on_a_flat_of_a_wheel_is_found_though_one_search_goes_astray() -> None:
    flat_wheel = {"kind": "wheel_flat", "wheelset": 1, "side": "left"}
    told = {"start": 240.58, "duration": 0.2, "sensors": [], "effects": [flat_wheel]}
    truth = simulate_held(load_scenario("curve_r400", told), "compiled")
    assert np.isfinite(truth["bogie.z [m]"]).all()
