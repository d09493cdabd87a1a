"""Ways in which a comparison of a vehicle with its model went wrong elsewhere; none of them may come back."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.core.levels import fit_levels, sums
from experiments.discrepancy.core.model import Effect, Hypothesis, Library
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem, raised
from experiments.discrepancy.core.search import healthy_fit, places
from experiments.discrepancy.core.verdict import decide
from experiments.discrepancy.railway.answer import answer
from experiments.discrepancy.railway.build import setup_at
from experiments.discrepancy.railway.cases import ALL, VERTICAL, nominal, recorded
from experiments.discrepancy.railway.library import found_library
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.statement import chance
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.effects.interface import EFFECTS
from railsim.engines.interface import default_substeps
from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.simulation import measure, simulate_held

FEW = VERTICAL[:2]


@pytest.fixture(scope="module")
def system() -> Railway:
    """A healthy vehicle on two channels."""
    return Railway(Record(evidence_of(recorded(np.random.default_rng(12), "home", (), FEW), nominal("home", FEW))))


def test_what_only_the_speed_signal_predicts_is_left_out_and_said() -> None:
    """The longitudinal accelerometer, whose prediction has the tachometer's errors."""
    sensors: list[dict[str, Any]] = [{**one, "axes": ["x", "z"]} for one in FEW]
    record = Record(evidence_of(recorded(np.random.default_rng(3), "home", (), sensors), nominal("home", sensors)))
    assert {name.partition(" ")[0].rpartition("_")[2] for name in record.channels} == {"z"}
    assert any("acceleration_x" in text and "speed" in text for text in record.left_out)


@pytest.mark.parametrize(("setting", "steps"), [("survey loud", {1, 2}), ("survey quiet", {-2, -1})])
def test_errors_of_the_track_that_are_stated_wrong_are_found(setting: str, steps: set[int]) -> None:
    """A factor of 2.5 too small or too large; steps are factors of two."""
    system = Railway(Record(evidence_of(recorded(np.random.default_rng(8), setting, (), FEW), nominal("home", FEW))))
    found = system.about(np.zeros(len(system.coordinates)), (), None)
    assert found.survey is not None and found.survey[0] in steps


def test_a_track_is_not_taken_as_uncertain_because_the_model_lies_off_on_it() -> None:
    """Registered 0.3 m off, short waves are better absent; with the errors stated right they are there."""
    record = Record(evidence_of(recorded(np.random.default_rng(8), "home", (), FEW), nominal("home", FEW)))
    off = dataclasses.replace(record.registration, start=record.registration.start + 0.3)
    vars(record)["registration"] = off
    system = Railway(record)
    found = system.about(np.zeros(len(system.coordinates)), (), None)
    assert abs((found.survey or (0,))[0]) <= 1  # steps of a factor of two; None is as stated


def test_nuisances_are_never_worse_than_the_untouched_model(system: Railway) -> None:
    """By the one measure that decides, each with the levels that fit it best."""
    none, zero = healthy_fit(system, Policy()), np.zeros(len(system.coordinates))
    problem = Problem(none.system, Hypothesis(), Policy())
    groups = problem.groups(zero, [one.components for one in none.groups])
    untouched = fit_levels(sums(groups), problem.levels, raised(problem.levels)).cost + problem.prior(zero)
    assert none.cost <= untouched + 0.5


def test_a_standstill_makes_no_step_finer_and_moves_no_place() -> None:
    """A recording of the nominal vehicle itself that stands for 4 s, simulated with the fine steps that this takes."""
    time, speed = (0.0, 6.0, 9.0, 13.0, 16.0, 24.0), (15.0, 15.0, 0.0, 0.0, 15.0, 15.0)
    settings = {"duration": 24.0, "speed": {"kind": "profile", "time": time, "speed": speed}}
    told = nominal("home", FEW)
    told = Scenario.build(told.values() | settings | {"track_errors": {"vertical_std": 1e-6}})
    measured = measure(simulate_held(told, "compiled"), told).measurements
    stop = Railway(Record(evidence_of(measured, told)))
    fine, coarse = (
        default_substeps(one.model, one.speed_tables, told.output_rate) for one in (told.setup, stop.nominal)
    )
    assert fine >= 8 * coarse
    (seen,), (shown,) = stop.observed, stop.predict(np.zeros((1, len(stop.coordinates))), ())
    assert 8 < seen.shape[1] < 20
    apart = np.mean(np.abs(shown[0] - seen) ** 2, axis=(0, 1)) / np.mean(np.abs(seen) ** 2, axis=(0, 1))
    assert np.sqrt(apart).max() < 0.05


def test_the_place_is_that_of_the_likeliest_and_a_name_far_ahead_is_said(system: Railway) -> None:
    """Evidence decides alone: an unknown that is 170 nats worse gives no place, a name 1378 nats ahead no `unknown`."""
    none, policy = healthy_fit(system, Policy()), Policy()
    effect = Effect("weak_yaw_damper", "weak_yaw_damper", (dataclasses.replace(system.coordinates[0], spread=1.0),))
    library = Library((effect,))
    wide = [one for one in system.levels if one.place]

    def fitted(gain: float, effects: tuple[Effect, ...] = (), unknown: int | None = None) -> Any:
        levels = () if unknown is None else (wide[unknown],)
        return dataclasses.replace(none, hypothesis=Hypothesis(effects, levels), evidence=none.evidence + gain)

    where = places(system.levels, library)
    far = decide([none, fitted(1378.0, (effect,)), fitted(400.0, (), 0)], library, where, policy)
    assert far.action.kind == "name" and far.action.families == ("weak_yaw_damper",)
    lost = decide([none, fitted(400.0, (), 0), fitted(230.0, (), 1)], library, where, policy)
    assert (lost.action.kind, lost.action.place) == ("unknown", wide[0].place)


def test_no_probability_is_said_to_be_one_or_nothing() -> None:
    assert [chance(one) for one in (1.0, 0.5, 0.0)] == ["over 0.999", "0.500", "under 0.001"]


def test_another_creep_law_is_a_coordinate_and_strains_no_tolerance() -> None:
    """FASTSIM's curve under a sheet of Polach's: a driving torque on all wheels imitates the difference."""
    sensors = ({**ALL[0], "axes": ["y"]}, {**ALL[-1], "axes": ["yaw"]})
    measured = recorded(np.random.default_rng(21), "other law", (), sensors)
    system = Railway(Record(evidence_of(measured, nominal("home", sensors))))
    found, names = healthy_fit(system, Policy()), [one.name for one in system.coordinates]
    assert found.x[names.index("creep law")] == pytest.approx(1.0, abs=0.2)
    built = [(x / one.spread, one.name) for x, one in zip(found.x, system.build, strict=False)]
    assert max(abs(x) for x, _ in built) < 3.0, built


def test_what_holds_the_speed_on_a_line_s_gradients_is_no_fault() -> None:
    """A torque of 400 N m on each wheelset: 0.8 % of the weight. All of a vehicle in service have some."""
    sensors = ({**ALL[0], "axes": ["y"]}, {**ALL[-1], "axes": ["yaw"]})
    torque = {"kind": "traction_torque", "torque": 400.0}
    measured = recorded(np.random.default_rng(22), "home", (torque,), sensors)
    found = answer(evidence_of(measured, nominal("home", sensors)), ["traction_torque"])
    names = [row.fit.hypothesis.name for row in found.verdict.rows]
    assert found.verdict.action.kind == "none", names
    assert names.index("small traction_torque") < names.index("traction_torque")


def test_rails_that_give_way_as_in_service_are_no_fault(system: Railway) -> None:
    """No rail is rigid: up to half of 1 / (50 MN/m) is ordinary, whatever its waves."""
    (effect,) = (one for one in found_library(system, ["soft_track"]).library.effects if one.kind == "name")
    (small,) = Library((effect,)).small
    (softness, *waves), (fault, *others) = small.own, effect.own
    assert (softness.name, softness.mean, softness.spread) == ("softness", 0.0, 1e-8)
    assert fault.mean > softness.spread and waves == others


def test_a_step_to_a_wheel_that_fits_no_rail_is_a_run_that_fails(system: Railway) -> None:
    """An effect that needs the model, installed on such a vehicle."""
    record, fast = system.record, EFFECTS.pick("traction_torque").build({"torque": 500.0})
    worn = {"log pair.wheel_profile_radius": -2.0}
    with pytest.raises(InputError, match="wheel_profile_radius"):
        setup_at(record, record.evidence.track, worn, (fast,))
