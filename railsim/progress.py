"""Progress with the remaining time: one bar for everything that may take more than two seconds."""

import logging
import math
import os
import sys
import threading
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from tqdm import tqdm

T = TypeVar("T")
LOGGER = "railsim"
SHOWN_AFTER = 2.0  # s
SELDOM = 10.0  # s between lines where stderr is a file
OFTEN = 0.2  # s between redraws on a terminal
TICK = 1.0  # s between redraws while nothing is counted
COLUMNS, ROWS = 80, 24  # of a terminal that does not say its size, as some in containers

# A bar's own lock is a semaphore of the system, which a killed worker leaves behind, with a warning.
tqdm.set_lock(threading.RLock())


@contextmanager
def counting(
    total: float | None,
    what: str,
    unit: str,
    *,
    initial: float = 0,
    in_files: bool = False,
    wanted: bool = True,
    by_clock: bool = False,
) -> Iterator[Any]:
    """A bar on stderr with the rate and the remaining time, gone when it ends; yields what has `update(n)`.

    It shows after two seconds, on a terminal, and not where `--quiet` asks for silence. Its clock goes on while nothing
    is counted.

    Parameters
    ----------
    total : how much there is to do, in `unit`; None where that is not known yet.
    what : what is done, in a word. unit : of `total`, plural.
    initial : how much of it is done already.
    in_files : write a line each ten seconds where stderr is no terminal, for jobs of hours, and keep the last one.
    wanted : False shows nothing, whatever else holds.
    by_clock : for work that cannot be counted: on a terminal it is as far as the time that has gone, and waits just
        before its end for what takes longer; `total` is what it should take, s.
    """
    terminal = sys.stderr.isatty()
    wide = terminal and _columns() > 0
    shown = wanted and logging.getLogger(LOGGER).isEnabledFor(logging.WARNING) and (terminal or in_files)
    bar = tqdm(
        total=math.ceil(10.0 * total) / 10.0 if isinstance(total, float) else total,
        initial=initial,
        desc=what,
        unit=f" {unit}",
        delay=0.0 if in_files else SHOWN_AFTER,
        leave=in_files,
        disable=not shown,
        file=sys.stderr,
        dynamic_ncols=wide,
        ncols=None if wide or not terminal else COLUMNS,
        nrows=None if wide or not terminal else ROWS,
        mininterval=OFTEN if terminal else SELDOM,
        maxinterval=SELDOM,
        smoothing=0.05,
    )
    if bar.disable or not terminal:
        with bar:
            yield bar
        return
    with bar, _redrawn(bar, by_clock):
        yield bar


def counted(items: Collection[T], what: str, unit: str, *, wanted: bool = True) -> Iterator[T]:
    """The items one by one, with a bar; as of `counting`."""
    with counting(len(items), what, unit, wanted=wanted) as bar:
        for item in items:
            yield item
            bar.update()


def _columns() -> int:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns
    except (AttributeError, OSError, ValueError):
        return 0


@contextmanager
def _redrawn(bar: Any, by_clock: bool) -> Iterator[None]:
    """Let another thread redraw the bar each second; `by_clock`: that is how far it is, up to just before its end."""
    ended, began, drawn = threading.Event(), time.monotonic(), False

    def tick() -> None:
        nonlocal drawn
        while not ended.wait(min(TICK, SHOWN_AFTER)):
            gone = time.monotonic() - began
            if by_clock:
                bar.n = math.floor(10.0 * min(gone, 0.99 * (bar.total or gone))) / 10.0
            if gone >= SHOWN_AFTER:
                bar.refresh()
                drawn = True

    ticking = threading.Thread(target=tick, daemon=True)
    ticking.start()
    try:
        yield
    finally:
        ended.set()
        ticking.join()
        if drawn and not bar.leave:
            bar.clear()  # closing alone leaves what was drawn between two counts
