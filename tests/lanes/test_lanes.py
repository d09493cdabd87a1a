"""Runs side by side in lanes are the runs of the compiled engine, whatever runs beside them."""

import re
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest

import railsim
from railsim import compiled, room
from railsim.engines.interface import CHUNK, Diverged
from railsim.errors import InputError
from railsim.lanes import machine
from railsim.lanes.buffers import Buffers
from railsim.lanes.fleet import BLOCK, Job, Piece, advance, prepare
from railsim.lanes.machine import machine_for
from railsim.lanes.source import Source, module_name
from railsim.scenario import Scenario, load_scenario
from railsim.simulation import build_run, load_engine, simulate

WHEELSET = "wheelset_varying"
WORN = {"kind": "conicity_change", "factor": 1.5, "wheelset": 2}


def _job(name: str, number: int = 0, **changes: Any) -> Job:
    return prepare(number, build_run(load_scenario(name, {key.replace("__", "."): v for key, v in changes.items()})))


def _rows(jobs: Sequence[Job], **options: Any) -> dict[int, np.ndarray]:
    done: dict[int, list[np.ndarray]] = {}
    for piece in advance(jobs, **options):
        assert isinstance(piece, Piece)
        done.setdefault(piece.job.number, []).append(piece.rows.copy())
    return {number: np.concatenate(pieces) for number, pieces in done.items()}


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        (WHEELSET, {"vehicle__adhesion__law": "fastsim"}),
        (WHEELSET, {"effects": [{"kind": "wheel_flat"}, {"kind": "wheel_unbalance"}]}),
        (
            "braking_dry",
            {"effects": ["crosswind", "empirical_force", "primary_friction"]},
        ),  # driven by forces, loads, laws
        ("curve_s1002_flange", {"vehicle__pair__upright_rails": 0.8, "effects": [WORN]}),  # two contacts a wheel
        ("flexible_track", {}),
        (WHEELSET, {"vehicle__pair__upright_rails": 1.0}),
        ("whole_coach", {}),  # several track frames, in a curve
    ],
)
def test_a_lane_runs_as_the_compiled_engine_does(name: str, changes: dict[str, Any]) -> None:
    job = _job(name, duration=0.7, **changes)
    assert job.refused is None
    expected = np.concatenate(list(load_engine("compiled")(job.run)))
    given = _rows([job])[0]
    assert given.shape == expected.shape
    np.testing.assert_array_equal(given[:, 0], expected[:, 0])
    largest = np.maximum(np.abs(expected).max(axis=0), 1e-9)
    assert (np.abs(given - expected).max(axis=0) / largest).max() < 1e-7  # of differences between large forces


def _different(count: int) -> list[Job]:
    return [
        _job(WHEELSET, i, duration=0.3 + 0.11 * (i % 5), vehicle__wheelset_mass=1100.0 + 20.0 * i, start=30.0 + i)
        for i in range(count)
    ]


def test_what_runs_beside_does_not_matter() -> None:
    """Forty runs of unequal length through sixteen lanes: each as if it ran alone, in pieces or in one."""
    jobs = _different(40)
    together = _rows(jobs)
    assert sorted(together) == list(range(40))
    pieces = _rows(jobs, longest=2 * BLOCK)
    threads = _rows(jobs, threads=2)
    for number in (0, 7, 16, 39):
        alone = _rows([jobs[number]])[number]
        for rows in (together, pieces, threads):
            np.testing.assert_array_equal(rows[number], alone)


def test_a_run_that_leaves_its_rails_ends_as_it_would_alone_and_the_others_do_not_notice() -> None:
    """Rails that run away under one vehicle: the same message as by `compiled`."""
    jobs = _different(5)
    state = jobs[2].state.copy()
    state[len(jobs[2].plant.core.mass)] = 30.0  # m/s sideways
    jobs[2] = Job(2, jobs[2].run, jobs[2].plant, state)
    given = list(advance(jobs))
    errors = [result for result in given if not isinstance(result, Piece)]
    assert [job.number for job, _ in errors] == [2]
    assert re.search(r"wheel1_(left|right) leaves its rail at t = 0\.0", str(errors[0][1]))
    alone = _rows([jobs[3]])[3]
    (beside,) = [result.rows for result in given if isinstance(result, Piece) and result.job.number == 3]
    np.testing.assert_array_equal(beside, alone)


def test_numbers_that_are_not_finite_end_a_run() -> None:
    job = _job(WHEELSET, duration=0.3)
    state = job.state.copy()
    state[0] = np.nan
    (result,) = advance([Job(0, job.run, job.plant, state)])
    assert not isinstance(result, Piece)
    error = result[1]
    assert isinstance(error, Diverged)
    assert "is not finite at t = 0.0000 s" in str(error)


def test_memory_comes_back_when_the_last_view_is_gone() -> None:
    buffers = Buffers()
    first = buffers.take((10, 3))
    address, column = first.ctypes.data, first[:, 1]
    del first
    assert buffers.take((10, 3)).ctypes.data != address
    del column
    assert buffers.take((11, 3)).ctypes.data == address


def test_simulate_many_gives_what_the_engine_gives_alone() -> None:
    """Vehicles in lanes, and one that lanes refuse: each answer under its own number."""
    made = [load_scenario(WHEELSET, {"duration": 0.3, "vehicle.wheelset_mass": mass}) for mass in (1100.0, 1300.0)]
    soft = made[0].but(effects=[{"kind": "soft_track"}])
    scenarios: list[Scenario] = [*made, soft]
    answers = dict(railsim.simulate_many(iter(scenarios)))
    assert sorted(answers) == [0, 1, 2]
    for number in (0, 1, 2):
        truth = answers[number]
        assert isinstance(truth, railsim.Truth)
        expected = simulate(scenarios[number], "lanes", cache=False)
        assert truth.about == expected.about
        np.testing.assert_array_equal(truth.frame().to_numpy(), expected.frame().to_numpy())


def test_some_channels_are_those_of_the_whole_truth() -> None:
    scenario = load_scenario(WHEELSET, {"duration": 0.3})
    ((_, some),) = railsim.simulate_many([scenario], channels=["wheelset1.y [m]"])
    ((_, whole),) = railsim.simulate_many([scenario])
    assert isinstance(some, railsim.Truth)
    assert isinstance(whole, railsim.Truth)
    assert len(some.columns) < 10
    np.testing.assert_array_equal(some["wheelset1.y [m]"], whole["wheelset1.y [m]"])
    with pytest.raises(InputError, match="no 'bogie.y'"):
        list(railsim.simulate_many([scenario], channels=["bogie.y"]))


def test_runs_that_do_not_fit_into_memory_are_refused_before_they_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "available_memory", lambda: 1e6)
    scenarios = [load_scenario(WHEELSET, {"duration": 2.0})] * 3
    with pytest.raises(InputError, match="a set of 3 runs side by side takes"):
        list(railsim.simulate_many(scenarios))


def test_a_run_off_the_track_is_an_answer() -> None:
    scenario = load_scenario("braking_dry", {"duration": 1.0})
    object.__setattr__(scenario, "start", float(scenario.geometry.s[-1]) - 12.0)
    ((_, answer),) = list(railsim.simulate_many([scenario]))
    assert isinstance(answer, InputError)
    assert "track" in str(answer)


def test_lane_loops_hold_no_scalar_arithmetic(monkeypatch: pytest.MonkeyPatch) -> None:
    """The compiler refuses to fill vectors without a word; what it made is counted, instruction by instruction."""
    job = _job(WHEELSET, duration=0.3)
    source = Source(job.plant, len(job.state), len(job.names), machine.LANES)
    options = {"_nrt": False, "nogil": True, "fastmath": {"contract", "reassoc", "nsz"}, "error_model": "numpy"}
    monkeypatch.setattr(compiled, "kernel", lambda function: numba.njit(**options)(function))
    world: dict[str, Any] = {}
    wheel = ModuleType(module_name(source.wheel))
    monkeypatch.setitem(sys.modules, wheel.__name__, wheel)
    exec(compile(source.wheel, "wheel", "exec"), wheel.__dict__)
    exec(compile(source.text, "lanes", "exec"), world)
    array, addresses = numba.float64[::1], numba.int64[:, ::1]
    for name, arguments in (
        ("wheel", (array, addresses, numba.int64, numba.int64)),
        ("derivative", (array, addresses)),
        ("observer", (array, addresses)),
    ):
        function = world[name]
        function.compile(arguments)
        assembly = function.inspect_asm(function.signatures[0])
        packed, single = (
            len(re.findall(rf"^\s+v?(?:add|sub|mul|div|sqrt|fn?m(?:add|sub)\d+){kind}\b", assembly, re.MULTILINE))
            for kind in ("pd", "sd")
        )
        assert packed > 50, name
        assert single == 0, (name, packed, single)


def test_one_structure_is_one_machine() -> None:
    """Other numbers, track and speed: the same compiled lanes. Another law: others."""
    first, second = _job(WHEELSET), _job(WHEELSET, vehicle__wheelset_mass=1500.0, start=40.0)
    other = _job(WHEELSET, vehicle__adhesion__law="fastsim")
    machines = [machine_for(job.plant, len(job.state), len(job.names)) for job in (first, second, other)]
    assert machines[0] is machines[1]
    assert machines[0] is not machines[2]
    assert CHUNK % BLOCK == 0
