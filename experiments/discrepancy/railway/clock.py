"""Time of the model of a recording with stops: it passes slow stretches no slower than frames are compared.

At a standstill creep forces ask for steps that are many times finer, and no frame there is looked at. The model goes
the same way at the same places, in less time.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

SHORTEST = 0.05  # s that a stretch takes at least
FAR = 1e9  # s


@dataclass(frozen=True, eq=False)
class Clock:
    """`stretches` (n, 3): begin and end of each slow stretch, and the time in which the model passes it [s]."""

    stretches: np.ndarray
    slow: float

    @classmethod
    def of(cls, time: np.ndarray, speed: np.ndarray, slow: float) -> "Clock":
        """For a speed [m/s] over time [s]; a stretch lasts as long as the speed is below `slow`."""
        over = np.diff((speed < slow).astype(int)) != 0
        share = (slow - speed[:-1])[over] / np.diff(speed)[over]
        crossings = time[:-1][over] + share * np.diff(time)[over]
        edges, rows = np.concatenate([time[:1], crossings, time[-1:]]), []
        for begin, end in pairwise(edges):
            if np.interp(0.5 * (begin + end), time, speed) < slow:
                taken = max(_way(time, speed, begin, end) / slow, SHORTEST)
                rows += [(begin, end, taken)] if taken < end - begin else []
        return cls(np.array(rows).reshape(-1, 3), slow)

    def model(self, time: np.ndarray) -> np.ndarray:
        """Of the model [s], at times of the recording [s]."""
        ends = self.stretches[:, :2].ravel()
        lengths = np.diff(np.concatenate([[0.0], ends, [FAR]]))
        lengths[1:-1:2] = self.stretches[:, 2]
        return np.interp(time, np.concatenate([[0.0], ends, [FAR]]), np.concatenate([[0.0], np.cumsum(lengths)]))

    def profile(self, time: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Time of the model and speed there, over the same places as `speed` over `time`."""
        knots = np.unique(np.concatenate([time, self.stretches[:, :2].ravel()]))
        fast = np.interp(knots, time, speed)
        for begin, end, taken in self.stretches:
            fast[(knots >= begin) & (knots <= end)] = max(_way(time, speed, begin, end) / taken, self.slow)
        return self.model(knots), fast


def _way(time: np.ndarray, speed: np.ndarray, begin: float, end: float) -> float:
    """Between two times [m]."""
    knots = np.concatenate([[begin], time[(time > begin) & (time < end)], [end]])
    return float(np.trapezoid(np.interp(knots, time, speed), knots))
