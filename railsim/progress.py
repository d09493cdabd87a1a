"""Progress with the remaining time: one bar for everything that may take more than two seconds."""

import logging
import sys
from collections.abc import Collection, Iterator
from typing import Any, TypeVar

from tqdm import tqdm

T = TypeVar("T")
LOGGER = "railsim"
SHOWN_AFTER = 2.0  # s
SELDOM = 10.0  # s between lines where stderr is a file
OFTEN = 0.2  # s between redraws on a terminal


def counting(
    total: float | None, what: str, unit: str, *, initial: float = 0, in_files: bool = False, wanted: bool = True
) -> Any:
    """A bar on stderr with the rate and the remaining time, gone when it ends; a context manager with `update(n)`.

    It shows after two seconds, on a terminal, and not where `--quiet` asks for silence.

    Parameters
    ----------
    total : how much there is to do, in `unit`; None where that is not known yet.
    what : what is done, in a word. unit : of `total`, plural.
    initial : how much of it is done already.
    in_files : write a line each ten seconds where stderr is no terminal, for jobs of hours, and keep the last one.
    wanted : False shows nothing, whatever else holds.
    """
    terminal = sys.stderr.isatty()
    shown = wanted and logging.getLogger(LOGGER).isEnabledFor(logging.WARNING) and (terminal or in_files)
    return tqdm(
        total=total,
        initial=initial,
        desc=what,
        unit=f" {unit}",
        delay=0.0 if in_files else SHOWN_AFTER,
        leave=in_files,
        disable=not shown,
        file=sys.stderr,
        dynamic_ncols=terminal,
        mininterval=OFTEN if terminal else SELDOM,
        maxinterval=SELDOM,
        smoothing=0.05,
    )


def counted(items: Collection[T], what: str, unit: str) -> Iterator[T]:
    """The items one by one, with a bar; as of `counting`."""
    with counting(len(items), what, unit) as bar:
        for item in items:
            yield item
            bar.update()
