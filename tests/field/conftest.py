"""A recording to be written in other formats, and one process that reads them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from railsim import Recording, load_scenario, measure, simulate
from railsim.field.guard import Guard


@pytest.fixture(scope="session")
def original(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Six seconds at 30 m/s with the default scenario's sensors; not to be changed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        changes = {"duration": 6.0, "speed": {"kind": "constant", "speed": 30.0}, "start": 60.0}
        scenario = load_scenario("default", changes)
        return measure(simulate(scenario, "compiled"), scenario, folder=tmp_path_factory.mktemp("field") / "original")


@pytest.fixture(scope="session")
def guard() -> Iterator[Guard]:
    """A reading process that all tests share, since its start takes a second."""
    with Guard() as shared:
        yield shared


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """An empty folder for input."""
    folder = tmp_path / "in"
    folder.mkdir()
    return folder
