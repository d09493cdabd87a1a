"""Every figure that the golden record does not compute in each test run: computed, drawn and checked in seconds."""

import pytest

from experiments.conformance.figures import computed_drawn_and_checked
from experiments.figures.interface import FIGURES
from tests.golden.record import quick

FOUND = FIGURES.classes()


@pytest.fixture(scope="module", autouse=True)
def runs_of_its_own(tmp_path_factory: pytest.TempPathFactory):
    """No run that another test or a user has left; the figures share theirs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.mark.parametrize("name", [name for name in FOUND if not quick(f"figures/{name}")])
def test_figure_is_computed_drawn_and_checked(name: str):
    """The others are drawn in tests/golden, of the table that is computed there."""
    assert list(computed_drawn_and_checked(FOUND[name])) == []
