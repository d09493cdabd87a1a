"""A short nominal scenario as a recording of itself, its bank in a folder of its own."""

from collections.abc import Iterator

import pytest

from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.result.planning import nominal_problem
from railsim import load_scenario


@pytest.fixture(scope="session")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Problem]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache") / "truth"))
        yield nominal_problem(load_scenario("yaw_dampers", {"duration": 9.5}))
