"""Runs that must fail say when, where and what."""

import dataclasses
import re
import warnings

import numpy as np
import pytest

from railsim.dynamics.channels import channel_names
from railsim.dynamics.guard import check_rows
from railsim.engines.interface import Diverged
from railsim.errors import InputError
from railsim.force_laws import Scheduled
from railsim.model import NonlinearElement
from railsim.scenario import load_scenario
from railsim.simulation import build_run
from railsim.track.track import Track
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import ENGINES, go, make_run


def jolt(column: str, height: float) -> Track:
    """Straight track with one bell-shaped defect at 40 m."""
    s = np.arange(0.0, 200.2, 0.2)
    return Track(s, {column: height * np.exp(-(((s - 40.0) / 1.0) ** 2))}, "jolt")


@pytest.mark.parametrize("engine", ENGINES)
def test_derailment_names_time_place_and_wheel(engine: str) -> None:
    run = make_run(Manchester().model(), jolt("lateral", 0.08), 20.0, 4.0)
    with pytest.raises(Diverged) as caught:
        go(engine, run)
    found = re.search(r"(wheel\d_\w+) leaves its rail at t = ([\d.]+) s, s = ([\d.]+) m", str(caught.value))
    assert found, str(caught.value)
    assert "\n" not in str(caught.value)
    assert 0.7 < float(found[2]) < 2.0
    assert float(found[3]) == pytest.approx(20.0 + 20.0 * float(found[2]), abs=0.1)


@pytest.mark.parametrize("engine", ENGINES)
def test_numbers_that_grow_without_bound_end_the_run(engine: str) -> None:
    """A damper far beyond what the explicit step can follow, which only appears during the run."""
    model = Manchester().model()
    late = NonlinearElement(
        "late", "bogie", "wheelset1", (1.28, 0.0, 0.46), "z", Scheduled(damping=1e8, onset=0.02, ramp=0.01)
    )
    model = dataclasses.replace(model, nonlinear=(*model.nonlinear, late))
    with pytest.raises(Diverged) as caught:
        go(engine, make_run(model, jolt("vertical", 0.002), 20.0, 4.0))
    message = str(caught.value)
    assert "\n" not in message
    when = re.search(r"t = ([\d.]+) s", message)
    assert when, message
    assert 0.0 < float(when[1]) < 0.1
    assert re.search(r"s = [\d.]+ m", message), message
    assert re.match(r"(body|bogie|wheelset\d|wheel\d_\w+)", message), message


def test_solver_that_gives_up_names_place_and_body() -> None:
    """Below 3 m/s Exudyn solves implicitly, and its Newton iteration fails where the wheels fly."""
    model = Manchester().model()
    with pytest.raises(Diverged, match=r"^(body|bogie|wheelset\d|wheel\d_\w+).* t = .* s.*s = [\d.]+ m"):
        go("exudyn", make_run(model, jolt("lateral", 2.0), 2.5, 12.0))


def test_steps_with_which_no_run_ends_are_refused() -> None:
    """A fit goes to the bound of a spring in series, and stands beside it by rounding."""
    nearly_rigid = {"kind": "yaw_damper_series_stiffness", "compliance": 1e-23}
    with pytest.raises(InputError, match=r"integration steps of \de-19 s"):
        build_run(load_scenario("yaw_dampers", {"effects": [nearly_rigid]}))
    with pytest.raises(InputError, match="make 'substeps' smaller"):
        build_run(load_scenario("yaw_dampers", {"substeps": 10**9}))


def test_rows_that_are_both_infinite_and_minus_infinite_end_the_run_without_a_warning() -> None:
    run = make_run(Manchester().model(), jolt("vertical", 0.0), 20.0, 1.0)
    names = channel_names(run.model)
    rows = np.zeros((3, len(names)))
    rows[:, 0] = np.arange(3) / run.rate
    body = run.model.bodies[0].name
    rows[2, names.index(f"{body}.y [m]")], rows[2, names.index(f"{body}.z [m]")] = np.inf, -np.inf
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(Diverged, match=rf"^{body}: state is not finite"):
            check_rows(rows, 3, names, run)
