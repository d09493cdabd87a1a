"""Tasks side by side: what they ask for at a time is run at once."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, cast

import pytest

from experiments.discrepancy.railway.together import Together
from railsim.engines.interface import Run

MOST = 4  # tasks at a time


class Bench:
    """Runs are numbers; their truths are their squares."""

    def __init__(self) -> None:
        self.batches: list[list[int]] = []
        self.together = Together(cast("Any", self.run), MOST)

    def run(self, runs: Sequence[int]) -> Iterator[tuple[int, Any]]:
        self.batches.append(list(runs))
        for place, one in reversed(list(enumerate(runs))):
            yield place, None if one < 0 else one**2

    def task(self, *numbers: int) -> Callable[[], list[int | None]]:
        """Asks for one number after the other."""

        def ask() -> list[int | None]:
            found: list[int | None] = []
            for one in numbers:
                runs = cast("list[Run]", [one])
                self.together.ask(runs, lambda place, truth: found.append(cast("int | None", truth)))
            return found

        return ask


def test_results_are_in_order_and_runs_are_made_together() -> None:
    bench = Bench()
    found = bench.together.all_of([bench.task(1, 2, 3), bench.task(4, -5), bench.task(6)])
    assert found == [[1, 4, 9], [16, None], [36]]
    assert bench.batches == [[1, 4, 6], [2, -5], [3]]


def test_more_tasks_than_fit_at_a_time() -> None:
    bench = Bench()
    count = 2 * MOST + 1
    found = bench.together.all_of([bench.task(k, k + 100) for k in range(count)])
    assert found == [[k**2, (k + 100) ** 2] for k in range(count)]
    assert max(len(one) for one in bench.batches) == MOST


def test_tasks_alone_and_within_tasks_need_no_others() -> None:
    bench = Bench()
    assert bench.task(7)() == [49]
    nested = bench.together.all_of([lambda: bench.together.all_of([bench.task(1), bench.task(2)]), bench.task(3)])
    assert nested == [[[1], [4]], [9]]


def test_an_error_reaches_the_caller_and_nobody_waits_for_ever() -> None:
    bench = Bench()

    def fails() -> list[int | None]:
        bench.task(1)()
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        bench.together.all_of([fails, bench.task(1, 2, 3)])

    def broken(runs: Sequence[Run]) -> Iterator[tuple[int, None]]:
        raise RuntimeError("engine")

    other = Together(broken, MOST)
    ask = lambda: other.ask(cast("list[Run]", [1]), lambda place, truth: None)  # noqa: E731
    with pytest.raises(RuntimeError, match="engine"):
        other.all_of([ask, ask])
