"""Where effects with a place or a time are looked for: recordings whose effect has a place that nobody tells."""

from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.core.levels import fit_levels, sums
from experiments.discrepancy.core.model import Fit, Hypothesis
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem, raised
from experiments.discrepancy.railway.along import Along, at_times, placeable, reach
from experiments.discrepancy.railway.cases import ALL, VERTICAL, nominal, recorded
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.effects.interface import EFFECTS
from railsim.scenario import Scenario
from railsim.simulation import measure, simulate_held

FEW = VERTICAL[:2]
LATERAL = [one for one in ALL if one["name"] in {"bogie", "body"}]


def sought(effects: list[dict[str, Any]], sensors: list[dict[str, Any]], seed: int) -> dict[str, float]:
    """The likeliest numbers of the last effect by what the nominal model leaves."""
    measured = recorded(np.random.default_rng(seed), "home", effects, sensors)
    system = Railway(Record(evidence_of(measured, nominal("home", sensors))))
    plugin = EFFECTS.classes()[effects[-1]["kind"]]
    along = Along(system, plugin, {}, plugin.parameters())
    return dict(zip(along.numbers, along.seek(system, untouched(system))[0], strict=True))


def untouched(system: Railway) -> Fit:
    """The nominal model with the levels that fit it best."""
    problem, nominal_build = Problem(system, Hypothesis(), Policy()), np.zeros(len(system.coordinates))
    groups = problem.groups(nominal_build, system.covariances(nominal_build, ()))
    psi = fit_levels(sums(groups), problem.levels, raised(problem.levels)).psi
    nothing = np.zeros((0, 0))
    return Fit(Hypothesis(), system, nominal_build, psi, 0.0, 0.0, nothing, nothing, groups, ())


def test_a_dip_is_looked_for_where_it_is() -> None:
    """Within a quarter of its length: a fit finds the rest."""
    found = sought([{"kind": "hanging_sleepers", "place": 150.0, "deflection": 3e-3}], list(FEW), 5)
    assert found["place"] == pytest.approx(150.0, abs=1.0)
    assert found["deflection"] == pytest.approx(3e-3, rel=0.4)


def test_joints_are_looked_for_at_their_distance() -> None:
    found = sought([{"kind": "rail_joints", "first": 55.0, "spacing": 25.0, "depth": 3e-3}], list(FEW), 7)
    assert found["spacing"] == pytest.approx(25.0, abs=0.1)
    assert (found["first"] - 55.0 + 12.5) % 25.0 - 12.5 == pytest.approx(0.0, abs=0.5)


def test_a_gust_is_looked_for_when_it_blows_and_from_which_side() -> None:
    found = sought([{"kind": "wind_gust", "begin": 6.0, "duration": 2.0, "force": -12000.0}], LATERAL, 8)
    assert found["begin"] == pytest.approx(6.0, abs=0.5)
    assert found["force"] == pytest.approx(-12000.0, rel=0.7)


def test_a_patch_of_low_adhesion_is_looked_for_where_it_lies() -> None:
    """To a frame's hop at each end: 1 s at 20 m/s."""
    found = sought([{"kind": "local_low_adhesion", "place": 100.0, "length": 80.0, "factor": 0.1}], LATERAL, 9)
    assert found["place"] == pytest.approx(100.0, abs=20.0)
    assert found["place"] + found["length"] == pytest.approx(180.0, abs=20.0)


def test_a_local_second_effect_is_looked_for_beside_a_strong_first() -> None:
    """A primary damper with less than half its damping, and a place where sleepers hang: 33 times the noise there."""
    damper = {"kind": "weak_primary_damper", "factor": 0.4, "bogie": 1}
    sensors = [one for one in VERTICAL if one["name"] in {"bogie", "axlebox1_left"}]
    found = sought([damper, {"kind": "hanging_sleepers", "place": 150.0, "deflection": 3e-3}], sensors, 6)
    assert found["place"] == pytest.approx(150.0, abs=1.0)


def test_what_has_no_place_or_has_a_wave_is_not_placed() -> None:
    kinds = {name for name, one in EFFECTS.classes().items() if placeable(one)}
    assert {"hanging_sleepers", "rail_joints", "wind_gust", "local_low_adhesion"} <= kinds
    assert not {"weak_primary_damper", "gauge_variation"} & kinds


def test_places_follow_the_speed() -> None:
    """20 m/s within the scale of the speed that the recording has."""
    measured = recorded(np.random.default_rng(3), "home", (), FEW)
    record = Record(evidence_of(measured, nominal("home", FEW)))
    assert float(np.diff(at_times(record, np.array([3.0, 8.0])))[0]) == pytest.approx(100.0, rel=5e-3)
    first, last = reach(record, "distance")
    assert last - first == pytest.approx(20.0 * (record.duration - 2.0), rel=5e-3)


def test_no_two_copies_are_at_one_place_where_the_vehicle_stands() -> None:
    """It stands for 5 s: copies there would be one of many times its size."""
    time, speed = (0.0, 8.0, 11.0, 16.0, 19.0, 26.0), (15.0, 15.0, 0.0, 0.0, 15.0, 15.0)
    told = nominal("home", FEW)
    settings = {"duration": 26.0, "speed": {"kind": "profile", "time": time, "speed": speed}}
    told = Scenario.build(told.values() | settings)
    system = Railway(Record(evidence_of(measure(simulate_held(told, "compiled"), told).measurements, told)))
    plugin = EFFECTS.classes()["exposed_stretch"]
    along = Along(system, plugin, {}, plugin.parameters())
    for long in {tuple(one.values.items()) for one in along.copies}:
        places = sorted(one.place for one in along.copies if tuple(one.values.items()) == long)
        assert len(places) > 10 and min(np.diff(places)) > 0.1
