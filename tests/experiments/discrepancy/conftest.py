"""A short nominal scenario as a recording of itself, its bank in a folder of its own, each test with a whole budget."""

from collections.abc import Iterator

import pytest

from experiments.discrepancy.baseline.forward import Meter
from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.result.planning import nominal_problem
from railsim import load_scenario


@pytest.fixture(scope="session")
def meter() -> Meter:
    return Meter()


@pytest.fixture(autouse=True)
def _unspent(meter: Meter):
    """What other tests have spent does not shorten this one."""
    meter.spent = 0.0


@pytest.fixture(scope="session")
def problem(tmp_path_factory: pytest.TempPathFactory, meter: Meter) -> Iterator[Problem]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache") / "truth"))
        nominal = nominal_problem(load_scenario("yaw_dampers", {"duration": 9.5}))
        yield nominal.but(forward=nominal.forward.but(meter=meter))
