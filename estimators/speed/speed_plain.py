"""True speed as in section 5 of Ward et al. 2011: integer-lag peak of a running cross-correlation."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from estimators.signals.correlation import recompute, runner_up, slide
from estimators.speed.bogie_channels import Stepper, accelerometer_offset
from estimators.speed.inverse_filter import InverseFilter, advance, inverse_filter
from estimators.speed.wheelset_correlation import WheelsetCorrelation
from estimators.speed.wheelset_filters import chain
from estimators.vehicle.parameters import positive_numbers
from estimators.vehicle.vertical import NEEDED, NEEDED_IN_PITCH, pitch_frequency
from railsim.compiled import as_written
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

COLUMNS = ("speed [m/s]", "speed_std [m/s]", "correlation [-]", "valid [-]")


class SpeedPlain(WheelsetCorrelation, frozen=True):
    """Speed from the delay between both wheelsets, by running cross-correlation: equations (9) and (10).

    V = 2 Lb / T, with T the integer lag at the peak. The two signals are the wheelsets' vertical accelerations, band
    limited. Errors to expect: truncation of the lag to whole samples, and a delay of about half a window while the
    speed changes. Both are in the stated deviation: the latter as half of the change over the last window, which is
    what a steady acceleration makes of that delay. Where these changes are larger by their mean square over a window,
    that counts: lags jump where signals are weak.
    """

    reach: float = quantity(
        1.7,
        unit="-",
        source="upper edge over the bogie's pitch frequency; Cramer-Rao bound with MEMS noise",
        gt=0.3,
        le=5,
    )
    threshold: float = quantity(0.3, unit="-", source="normalised peak of unrelated signals stays below", ge=0, lt=1)
    ambiguity: float = quantity(1.2, unit="-", source="peak over the next one; trial on bogie_rig", ge=1)
    inverse: bool = quantity(True, unit="-", source="False: plain sums z -+ Lb theta, biased; for comparison only")

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return NEEDED if self.inverse else NEEDED_IN_PITCH

    def start(self, about: Mapping[str, Any], rate: float, forward: bool) -> Stepper:
        """Start a run; the longitudinal acceleration is not used."""
        del forward
        vehicle = about["vehicle"]
        positive_numbers(vehicle, NEEDED if self.inverse else NEEDED_IN_PITCH)
        high = self.reach * pitch_frequency(vehicle)
        filters = chain(vehicle, rate, self.low, high, self.inverse, accelerometer_offset(about))
        size = round(self.window * rate)
        first = int(filters.wheelbase / self.fastest * rate)
        last = int(np.ceil(filters.wheelbase / self.slowest * rate))
        if not 1 <= first < last < 0.8 * size:
            raise InputError(
                f"speed_plain: lags {first} to {last} do not fit a window of {size} samples; "
                "raise 'slowest' or lengthen 'window'"
            )
        state = _State(
            inverse_filter(filters, rate, self.low),
            np.zeros((2, 2 * size)),
            np.zeros(2 * size),
            np.zeros(last - first + 1),
            np.zeros(3),
            np.zeros(1, dtype=np.int64),
            np.full(size, np.nan),
            np.zeros(1),
        )
        limits = np.array([filters.wheelbase * rate, self.threshold, self.floor, self.ambiguity])
        return Stepper(COLUMNS, rate, lambda a, q, _: _run(state, first, limits, a, q))


class _State(NamedTuple):
    inverse_filter: InverseFilter
    signals: np.ndarray  # last N samples of both wheelsets, each twice, shape (2, 2 N)
    good: np.ndarray  # 1 where they can be used, shape (2 N,)
    sums: np.ndarray  # running correlation by lag
    power: np.ndarray  # sums of x^2, y^2, good over the window
    counts: np.ndarray  # number of samples so far, shape (1,)
    told: np.ndarray  # the last N speeds, those before held where there is none, m/s, shape (N,)
    changes: np.ndarray  # mean square of half of their changes over a window, (m/s)^2, shape (1,)


@as_written
def _run(state: _State, first: int, limits: np.ndarray, a: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Rows of `COLUMNS` for new samples of acceleration and pitch rate; `limits`: see `start`."""
    rows = np.empty((len(a), 4))
    out = np.empty(4)
    for i in range(len(a)):
        good = advance(state.inverse_filter, a[i], q[i], out)
        x, y = (out[0] + out[1], out[0] - out[1]) if good else (0.0, 0.0)
        _take(state, first, x, y, 1.0 if good else 0.0)
        _peak(state, first, limits, rows[i])
        _widen(state, rows[i])
    return rows


@as_written
def _take(state: _State, first: int, x: float, y: float, good: float) -> None:
    n = state.counts[0]
    size = len(state.good) // 2
    p = n % size
    state.power[0] += x * x - state.signals[0, p] ** 2
    state.power[1] += y * y - state.signals[1, p] ** 2
    state.power[2] += good - state.good[p]
    state.good[p] = good
    slide(state.signals[0], state.signals[1], x, y, n, first, state.sums)
    if n % (8 * size) == 8 * size - 1:
        recompute(state.signals[0], state.signals[1], n, first, state.sums)
        state.power[0] = np.sum(state.signals[0, :size] ** 2)
        state.power[1] = np.sum(state.signals[1, :size] ** 2)
    state.counts[0] = n + 1


@as_written
def _peak(state: _State, first: int, limits: np.ndarray, row: np.ndarray) -> None:
    """Peak of the correlation -> speed, standard deviation of the truncation, normalised peak, valid."""
    size = len(state.good) // 2
    k = int(np.argmax(state.sums))
    lag = first + k
    scale = np.sqrt(max(state.power[0] * state.power[1], 0.0)) * (size - lag) / size
    strong = scale > limits[2] ** 2 * (size - lag)
    row[2] = state.sums[k] / scale if strong else 0.0
    inside = 0 < k < len(state.sums) - 1
    covered = state.power[2] > 0.5 * size
    clear = strong and inside and covered and row[2] > limits[1]
    row[3] = 1.0 if clear and state.sums[k] > limits[3] * runner_up(state.sums, k) else 0.0
    speed = limits[0] / lag
    row[0] = speed if row[3] > 0 else np.nan
    row[1] = speed / lag / np.sqrt(12.0) if row[3] > 0 else np.nan


@as_written
def _widen(state: _State, row: np.ndarray) -> None:
    """Add half of the speed's change over a window to the standard deviation."""
    size = len(state.told)
    place = (state.counts[0] - 1) % size
    before = state.told[place]
    if row[3] > 0.0:
        state.told[place] = row[0]
        if not np.isnan(before):
            square = (row[0] - before) ** 2 / 4.0
            state.changes[0] += (square - state.changes[0]) / size
            row[1] = np.sqrt(row[1] ** 2 + max(square, state.changes[0]))
    else:
        state.told[place] = state.told[place - 1]
