"""Models larger than the half vehicle, and wheelsets far from the reference."""

from dataclasses import replace

import numpy as np
import pytest

from railsim.dynamics.equilibrium import steady_state
from railsim.dynamics.moving_frame import pose
from railsim.dynamics.plant import build_plant
from railsim.errors import InputError
from railsim.force_laws import DryFriction, Maxwell
from railsim.model import Load, LongitudinalPath, Model, NonlinearElement
from railsim.track import read_track
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import curve, flat, go, make_run
from tests.engines.side_by_side import alone, joined, joined_state

RADIUS = 600.0


def yaws(model: Model, s: float) -> list[float]:
    """Yaw [rad] in a circle's middle at `s` [m] by pose table: of the chord, then of each wheelset's place."""
    run = make_run(model, curve(RADIUS, 0.0, 380.0), 20.0, 0.1)
    plant, here = build_plant(run.model, run.track, run.speed), np.empty(12)
    found = []
    for row in range(len(plant.pose)):
        pose(plant, row, s, here)
        found.append(float(here[5]))
    return found


def test_chord_is_known_by_name_and_a_wheelset_far_behind_keeps_the_direction_of_its_own_track():
    """A chord of length c turns by c / 2R, the track as far behind by c / R."""
    model = Manchester().model()
    behind = 12.0
    bodies = tuple(
        replace(body, position=(-behind, *body.position[1:])) if body.name == "wheelset2" else body
        for body in model.bodies
    )
    chord, first, second = yaws(replace(model, bodies=bodies), 250.0)
    assert chord == pytest.approx(-model.trailing_pivot / (2.0 * RADIUS), rel=1e-3)
    assert first == pytest.approx(1.28 / RADIUS, rel=1e-3)
    assert second == pytest.approx(-behind / RADIUS, rel=1e-3)
    short = yaws(replace(model, trailing_pivot=4.0), 250.0)[0]
    assert short == pytest.approx(-4.0 / (2.0 * RADIUS), rel=1e-3)
    assert yaws(replace(model, chord_yaw=None), 250.0)[0] == 0.0


OFFSETS = (0.0, 0.0, -13.0, -21.0)  # m; on straight track vehicles may stand anywhere
START = 60.0
TOLERANCE = 1e-9  # a process that compiles sums in another order


def loaded(factor: float) -> Model:
    """A half vehicle with a body of its own, and with a quarter of what the usual layout has room for."""
    base = Manchester()
    model = base.but(body_mass=base.body_mass * factor).model()
    friction = [
        NonlinearElement(f"friction{i}", "body", "bogie", (0.1 * i, 0.0, 0.9), axis, DryFriction(200.0 * factor, 2e-3))
        for i, axis in enumerate(("y", "z", "roll", "yaw", "y", "z", "pitch"))
    ]
    series = NonlinearElement("series", "body", "bogie", (0.0, 0.0, 0.9), "y", Maxwell(4e6, 1e4))
    loads = [Load("body", axis, "time", 0.0, 1.0, np.full(2, 1e3 * factor)) for axis in ("y", "z", "roll")]
    nonlinear = (*model.nonlinear, *friction, series)
    return replace(model, nonlinear=nonlinear, loads=tuple(loads), law=base.model().law, path=None, chord_yaw=None)


def test_vehicles_in_one_model_move_as_each_alone() -> None:
    """16 bodies, 8 wheelsets, 64 coordinates, 36 nonlinear and 4 finite elements, 12 loads.

    In one engine: to compile kernels for such a model takes half a minute in each. The others run whole vehicles.
    """
    models = [loaded(factor) for factor in (1.0, 1.1, 0.9, 1.05)]
    track, duration = read_track("straight_erri_high"), 0.5
    runs = [make_run(m, track, 30.0, duration, start=START + x) for m, x in zip(models, OFFSETS, strict=True)]
    states = [steady_state(build_plant(run.model, run.track, run.speed), run.start) for run in runs]
    together = make_run(
        joined(models, OFFSETS), track, 30.0, duration, start=START, initial=joined_state(models, states)
    )
    assert together.substeps == runs[0].substeps
    found = go("compiled", together)
    for number, (model, run) in enumerate(zip(models, runs, strict=True)):
        own = go("compiled", replace(run, initial=states[number]))
        for name, other in alone(model, number, 2).items():
            largest = float(np.abs(own[name]).max())
            assert np.abs(own[name] - found[other]).max() <= TOLERANCE * max(largest, 1e-3), (name, number)
    assert np.abs(found["body_3.y [m]"] - found["body_0.y [m]"]).max() > 1e-4


def test_vehicles_beside_each_other_run_through_a_curve_as_each_alone() -> None:
    models = [loaded(factor) for factor in (1.0, 1.1, 0.9, 1.05)]
    track, places = curve(400.0, 0.1, 200.0, 30.0), (0.0,) * len(models)
    runs = [make_run(m, track, 20.0, 2.0, start=25.0) for m in models]
    states = [steady_state(build_plant(run.model, run.track, run.speed), run.start) for run in runs]
    state = joined_state(models, states)
    found = go("compiled", make_run(joined(models, places), track, 20.0, 2.0, start=25.0, initial=state))
    for number, (model, run) in enumerate(zip(models, runs, strict=True)):
        own = go("compiled", replace(run, initial=states[number]))
        for name, other in alone(model, number, 2).items():
            largest = float(np.abs(own[name]).max())
            assert np.abs(own[name] - found[other]).max() <= 1e-9 * max(largest, 1e-3), (name, number)
    assert np.abs(found["body_3.yaw_rate [rad/s]"]).max() == 0.0
    assert np.abs(found["bogie_3.roll [rad]"]).max() > 1e-3


def test_bodies_far_from_the_reference_are_refused_on_curves_only() -> None:
    model = joined([loaded(1.0), loaded(1.0), loaded(1.0), loaded(1.0)], OFFSETS)
    with pytest.raises(InputError, match="'wheelset2_3' stands 22.28 m from the origin .* use engine exudyn"):
        go("compiled", make_run(model, curve(400.0, 0.1, 200.0, 30.0), 20.0, 0.1, start=60.0))


def test_steady_state_of_many_is_that_of_each():
    models = [loaded(factor) for factor in (1.0, 1.1, 0.9, 1.05)]
    track = read_track("straight_erri_high")
    run = make_run(joined(models, OFFSETS), track, 30.0, 0.1, start=START)
    together = steady_state(build_plant(run.model, run.track, run.speed), START)
    runs = [make_run(m, track, 30.0, 0.1, start=START + x) for m, x in zip(models, OFFSETS, strict=True)]
    states = [steady_state(build_plant(each.model, each.track, each.speed), each.start) for each in runs]
    assert together == pytest.approx(joined_state(models, states), abs=1e-8)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"reference": "frame"}, "no body 'frame'; there are body, bogie"),
        ({"reference": "wheelset1"}, "'wheelset1' must stand at x = 0"),
        ({"wheelsets": ()}, "needs a wheelset"),
        ({"trailing_pivot": 0.0}, "'body' keeps a chord's direction"),
        ({"chord_yaw": "bogie"}, "'bogie' keeps a chord's direction"),
        ({"path": LongitudinalPath("body", 0.9)}, "'body' must be free to pitch"),
    ],
)
def test_model_that_does_not_fit_together_is_refused_in_one_line(changes: dict, words: str):
    run = make_run(Manchester().model(), flat(), 20.0, 0.1)
    with pytest.raises(InputError, match=words) as refused:
        build_plant(replace(run.model, **changes), run.track, run.speed)
    assert "\n" not in str(refused.value)


def test_parts_that_the_engines_would_take_for_something_else_are_refused():
    model = Manchester().model()
    run = make_run(model, flat(), 20.0, 0.1)
    first, second = model.wheelsets
    twins = tuple(replace(body, name="bogie") for body in model.bodies)
    to_track = (replace(model.elements[0], lower="track"), *model.elements[1:])
    other_frame = (first, replace(second, frame="body"))
    smaller = (first, replace(second, radius=0.45))
    along = (replace(model.nonlinear[0], axis="across"),)
    for changes, words in (
        ({"bodies": twins}, "one name"),
        ({"elements": to_track}, "'secondary' must join two bodies"),
        ({"wheelsets": other_frame}, "all wheelsets under 'bogie'"),
        ({"wheelsets": smaller}, "'wheelset2' must stand"),
        ({"nonlinear": along}, "'bump_stop' acts along 'across'"),
    ):
        with pytest.raises(InputError, match=words):
            build_plant(replace(model, **changes), run.track, run.speed)
