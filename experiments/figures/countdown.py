"""Time that is left of many pieces of work on some processes."""

import time
from collections.abc import Callable, Mapping, Sequence


class Countdown:
    """Time that is left, by what figures cost and how fast they were in this session.

    Parameters
    ----------
    left : names of the pieces of work. known : processor time by name, s. jobs : processes. clock : seconds, for tests.
    """

    def __init__(
        self, left: Sequence[str], known: Mapping[str, float], jobs: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._left = {name: known.get(name) for name in left}
        self._jobs, self._clock = jobs, clock
        self._began: dict[str, float] = {}
        self._due = self._took = 0.0

    def cost(self, name: str) -> float:
        """Processor time, s; infinite where nobody knows, so that such a piece begins early."""
        seconds = self._left[name]
        return float("inf") if seconds is None else seconds

    def add(self, name: str, seconds: float) -> None:
        """One more piece, and its processor time, s."""
        self._left[name] = seconds

    def beforehand(self) -> str:
        """What all will take, in words."""
        return f"about {spoken(self.seconds())} on {self._jobs} processes{self._unknown()}"

    def begin(self, name: str) -> None:
        """A piece begins."""
        self._began[name] = self._clock()

    def end(self, name: str) -> float:
        """A piece has ended; returns how long it took, s."""
        took = self._clock() - self._began.pop(name)
        seconds = self._left.pop(name)
        if seconds is not None:
            self._due, self._took = self._due + seconds, self._took + took
        return took

    def seconds(self) -> float:
        """Time that is left, s: the work shared by the processes, or the longest piece where that takes longer.

        Pieces without a known cost are left out.
        """
        slower = self._took / self._due if self._due else 1.0
        rest = [max(0.0, slower * cost - self._gone(name)) for name, cost in self._left.items() if cost is not None]
        return max(sum(rest) / self._jobs, max(rest, default=0.0))

    def status(self) -> str:
        """What is going on, in words."""
        running = ", ".join(f"{name} ({self._gone(name):.0f} s)" for name in self._began)
        now = f"; now {running}" if running else ""
        return f"{len(self._left)} left, about {spoken(self.seconds())}{self._unknown()}{now}"

    def _gone(self, name: str) -> float:
        return self._clock() - self._began[name] if name in self._began else 0.0

    def _unknown(self) -> str:
        count = sum(cost is None for cost in self._left.values())
        return f" and {count} whose time is not known" if count else ""


def spoken(seconds: float) -> str:
    """Seconds or minutes in words."""
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"
