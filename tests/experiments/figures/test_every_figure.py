"""Figures that take too long for the golden record's test, at their smallest size: computed, drawn and checked.

The quick ones are computed, drawn and checked by `tests/golden`, the validation report by its own tests.
"""

from collections.abc import Iterator

import pytest

from experiments.conformance.figures import computed_drawn_and_checked
from tests.golden.plugins import figure_kinds
from tests.golden.record import apart, quick


@pytest.fixture(scope="module", autouse=True)
def by_itself() -> Iterator[None]:
    """No earlier runs, no reference data, one thread of linear algebra."""
    with apart():
        yield


SLOW = [name for name in figure_kinds() if not quick(f"figures/{name}") and name != "validation"]


@pytest.mark.parametrize("name", SLOW)
def test_figure_is_computed_drawn_and_checked(name: str) -> None:
    assert list(computed_drawn_and_checked(figure_kinds()[name])) == []
