"""Search for the travel time, then track it: compiled loop of `speed_refined`, for records and for `step`."""

from typing import NamedTuple, Self

import numpy as np

from estimators.filters.kalman import correct
from estimators.signals.correlation import recompute, runner_up, slide_both
from estimators.speed.delay import REACH, UNKNOWNS, mismatch, travel_time
from estimators.speed.inverse_filter import InverseFilter, advance
from estimators.speed.motion_models import Motion, correct_models, covariance, mean, predict, start
from railsim.compiled import as_written, kernel

COLUMNS = ("speed [m/s]", "speed_std [m/s]", "acceleration [m/s2]", "correlation [-]", "valid [-]")
SLOW = 3.0  # s; a measured longitudinal acceleration that has stayed that long may be gravity and bias alone
SHORT = 0.5  # s; averaging that takes the bogie's own shaking out of it
QUIET = 0.05  # m/s2; change of it above what shaking leaves, below that of any manoeuvre
COARSE = 2e-3  # s; error of the coarse travel time, a quarter of its usual grid
STILL = (
    1.4  # mean power over that of the sensors' noise, below which no tracking begins; noise alone stays 2 sigma below
)
# The next three were chosen while inspection's case of a noisy pitch gyro was mended; no physics gives them.
FAST = 8.0  # so much sooner than `memory` is a sudden noise seen
LEAST = 0.02  # share of the slopes that is taken for signal, however large the noise
ONE_WAY = 0.5  # correlation in the wrong direction over that in the right one, above which there is no direction
BURST = 4.0  # more than so many times the noise's power counts as so much: a jerk is no movement


class Limits(NamedTuple):
    """Numbers that stay the same during a run; the fields of `SpeedRefined` in the units of the loop."""

    rate: float
    stride: int  # samples from one measurement to the next
    wheelbase: float
    delay: float
    slowest: float
    fastest: float
    threshold: float
    ambiguity: float
    floor: float  # least power, (m/s2)^2
    lost: float
    model_error: float  # share of the signals' power
    smoothing_factor: float  # share of the averages that a new value takes
    window_smoothing_factor: float  # the same of averages as long as the search's window
    repeat: float  # measurements that tell as much as one independent one
    first: int  # smallest lag of the search, in strides
    spread: np.ndarray  # variances of the inverse's errors, shape (6,)
    noise_slope: np.ndarray  # see `speed.noise_slopes`, shape (lags, 8)
    late: int  # `delay` in samples
    first_acceleration: float  # m/s2; standard deviation when tracking begins
    noise: float  # (m/s2)^2; power of the sensors' noise in each wheelset's signal
    cruise: float  # (m/s2)^2 s; how well a cruising train keeps its speed; 0: nothing to be told from


class Level(NamedTuple):
    """Averages while tracking, each of shape (1,), so that a kernel can change it; powers in (m/s2)^2.

    Attributes
    ----------
    mismatch : square of the mismatch.
    calm : the same without outbursts.
    power : of the signals.
    slope : square of the mismatch's slope in speed.
    slope_weight : weight of the values in `slope`, 1 once it has settled.
    window_mismatch, window_power : over the search's window.
    recent : square of the mismatch of late.
    """

    mismatch: np.ndarray
    calm: np.ndarray
    power: np.ndarray
    slope: np.ndarray
    slope_weight: np.ndarray
    window_mismatch: np.ndarray
    window_power: np.ndarray
    recent: np.ndarray

    @classmethod
    def new(cls) -> Self:
        """Zeros."""
        return cls(*(np.zeros(1) for _ in cls._fields))


class Tracking(NamedTuple):
    """State of a run.

    Attributes
    ----------
    signals : last C samples of S, D, P, Q, each twice, shape (4, 2 C).
    good : number of usable samples in a row up to each, shape (2 C,).
    gained : integral of the measured longitudinal acceleration (m/s), shape (2 C,).
    search : every `stride`-th sample of both wheelsets over the window, each twice, and of `gained`, shape (3, 2 N).
    covered : 1 where these can be used, shape (N,).
    sums : running correlation of the search by lag, trailing wheelset after leading one.
    reverse : the same, leading wheelset after trailing one.
    power : sums of the search's squares and of `covered`, shape (3,).
    x, P : mean and covariance after the last measurement, shapes (8,) and (8, 8); the second unknown is the
        acceleration less the measured one.
    level : averages while tracking.
    still : mean power, bursts cut off, in (m/s2)^2; 1 at standstill; shape (2,).
    push : last longitudinal acceleration, its integral, its slow average (NaN: none so far), shape (3,).
    counts : samples so far, measurements so far, tracking, good samples in a row, shape (4,).
    """

    inverse_filter: InverseFilter
    motion: Motion
    signals: np.ndarray
    good: np.ndarray
    gained: np.ndarray
    search: np.ndarray
    covered: np.ndarray
    sums: np.ndarray
    reverse: np.ndarray
    power: np.ndarray
    x: np.ndarray
    P: np.ndarray
    level: Level
    still: np.ndarray
    push: np.ndarray
    counts: np.ndarray

    @classmethod
    def new(cls, filters: InverseFilter, motion: Motion, limits: Limits, window: float) -> Self:
        """State before the first sample; `window` of the search in s."""
        longest = limits.wheelbase / limits.slowest * limits.rate
        capacity = int(np.ceil(1.2 * longest)) + 2 * limits.stride + limits.late + 4 * REACH
        last = int(np.ceil(longest / limits.stride))
        size = max(round(window * limits.rate / limits.stride), 2 * last)
        return cls(
            filters,
            motion,
            np.zeros((4, 2 * capacity)),
            np.zeros(2 * capacity),
            np.zeros(2 * capacity),
            np.zeros((3, 2 * size)),
            np.zeros(size),
            np.zeros(last - limits.first + 2),
            np.zeros(last - limits.first + 2),
            np.zeros(3),
            np.zeros(UNKNOWNS),
            np.zeros((UNKNOWNS, UNKNOWNS)),
            Level.new(),
            np.array([BURST * limits.noise, 0.0]),
            np.array([0.0, 0.0, np.nan]),
            np.zeros(4, dtype=np.int64),
        )


@as_written
def run(s: Tracking, c: Limits, a: np.ndarray, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Rows of `COLUMNS` for new samples of vertical acceleration, pitch rate, longitudinal acceleration."""
    rows = np.empty((len(a), 5))
    out = np.empty(4)
    size = s.signals.shape[1] // 2
    for i in range(len(a)):
        good = advance(s.inverse_filter, a[i], q[i], out)
        s.counts[3] = s.counts[3] + 1 if good else 0
        p = s.counts[0] % size
        for row in range(4):
            s.signals[row, p] = s.signals[row, p + size] = out[row] if good else 0.0
        s.good[p] = s.good[p + size] = s.counts[3]
        _push(s, c, p, u[i])
        if good:
            _stand(s, c, out)
        if s.counts[0] % c.stride == 0:
            _measure(s, c, p + size, out, good)
        _report(s, c, p + size, rows[i])
        s.counts[0] += 1
    return rows


@kernel
def _stand(s: Tracking, c: Limits, out: np.ndarray) -> None:
    """Whether the wheelsets move no more than the sensors' noise. The search then forgets, so that what was before a
    stop (and the jerk that ends it) is not taken for a travel time; tracking that holds goes on.
    """
    power = min(out[0] * out[0] + out[1] * out[1], BURST * c.noise)
    s.still[0] += (power - s.still[0]) * c.smoothing_factor / c.stride
    if s.still[0] > STILL * c.noise:
        s.still[1] = 0.0
    elif s.still[1] == 0.0:
        s.still[1] = 1.0
        s.search[:] = 0.0
        s.covered[:] = 0.0
        s.sums[:] = 0.0
        s.reverse[:] = 0.0
        s.power[:] = 0.0


@kernel
def _push(s: Tracking, c: Limits, p: int, u: float) -> None:
    """Integrate the measured longitudinal acceleration; a lost sample repeats the last one."""
    if np.isfinite(u):
        s.push[1] += (s.push[0] + u) / 2 / c.rate
        s.push[0] = u
        s.push[2] = s.push[2] + (u - s.push[2]) / (SLOW * c.rate) if np.isfinite(s.push[2]) else u
    else:
        s.push[1] += s.push[0] / c.rate
    size = len(s.gained) // 2
    s.gained[p] = s.gained[p + size] = s.push[1]


@as_written
def _measure(s: Tracking, c: Limits, newest: int, out: np.ndarray, good: bool) -> None:
    """Search with the newest sample (not at standstill), go on tracking, begin or end it."""
    correlation, lag = 0.0, 0.0
    if s.still[1] == 0.0:
        at = s.counts[1] % len(s.covered)
        s.search[2, at] = s.gained[newest - c.late]
        correlation, lag = _search(s, c, out[0] + out[1] if good else 0.0, out[0] - out[1] if good else 0.0, good)
        if correlation > c.threshold and not _follows(s, c, lag, correlation):
            correlation = 0.0
    if s.counts[2]:
        _follow(s, c, newest - REACH)
        if not _holds(s, c, correlation):
            s.counts[2] = 0
    if not s.counts[2] and correlation > c.threshold and _alone(s, c):
        _start_tracking(s, c, correlation, lag)


@as_written
def _search(s: Tracking, c: Limits, x: float, y: float, good: bool) -> tuple[float, float]:
    """Normalised peak of the running correlation (0: none) and its lag in s."""
    n = s.counts[1]
    size = len(s.covered)
    p = n % size
    s.power[0] += x * x - s.search[0, p] ** 2
    s.power[1] += y * y - s.search[1, p] ** 2
    s.power[2] += (1.0 if good else 0.0) - s.covered[p]
    s.covered[p] = 1.0 if good else 0.0
    slide_both(s.search[0], s.search[1], x, y, n, c.first, s.sums, s.reverse)
    if n % (8 * size) == 8 * size - 1:
        recompute(s.search[0], s.search[1], n, c.first, s.sums)
        recompute(s.search[1], s.search[0], n, c.first, s.reverse)
        s.power[0] = np.sum(s.search[0, :size] ** 2)
        s.power[1] = np.sum(s.search[1, :size] ** 2)
    s.counts[1] = n + 1
    k = int(np.argmax(s.sums))
    if k == 0 or k == len(s.sums) - 1 or s.power[2] < 0.5 * size:
        return 0.0, 0.0
    power = np.sqrt(max(s.power[0] * s.power[1], 0.0))
    if power < c.floor * s.power[2]:
        return 0.0, 0.0
    before, peak, after = s.sums[k - 1], s.sums[k], s.sums[k + 1]
    lag = c.first + k + (before - after) / 2 / (before - 2 * peak + after)
    return peak / power / max(1 - lag / s.power[2], 0.2), lag * c.stride / c.rate


@kernel
def _alone(s: Tracking, c: Limits) -> bool:
    """Whether the peak of the search stands out."""
    k = int(np.argmax(s.sums))
    return s.sums[k] > c.ambiguity * runner_up(s.sums, k)


@as_written
def _follows(s: Tracking, c: Limits, lag: float, correlation: float) -> bool:
    """Whether the trailing wheelset follows the leading one, and not as much the other way round.

    Noise of one of the two sensors alone is in both wheelsets' signals at once: it correlates in both directions alike.
    """
    delay = round(lag * c.rate / c.stride)
    total = s.reverse[delay - c.first]
    power = np.sqrt(max(s.power[0] * s.power[1], 1e-300))
    return total / power / max(1 - delay / s.power[2], 0.2) < ONE_WAY * correlation


@as_written
def _since(s: Tracking, c: Limits) -> tuple[float, float]:
    """Mean age (s) of the signals in the search, by their power, and what speed the accelerometer measured since."""
    size = len(s.covered)
    total, age, gain = 1e-300, 0.0, 0.0
    last = s.search[2, (s.counts[1] - 1) % size]
    for i in range(size):
        weight = s.search[0, i] ** 2 + s.search[1, i] ** 2
        total += weight
        age += weight * ((s.counts[1] - 1 - i) % size)
        gain += weight * (last - s.search[2, i])
    return age / total * c.stride / c.rate, gain / total


@as_written
def _start_tracking(s: Tracking, c: Limits, correlation: float, lag: float) -> None:
    speed, bias, doubt = c.wheelbase / lag, 0.0, 0.0
    if c.cruise > 0 and s.P[1, 1] > 0:
        age, gain = _since(s, c)
        bias = min(max(s.x[1], -2 * c.first_acceleration), 2 * c.first_acceleration)
        doubt = min(np.sqrt(s.P[1, 1]), c.first_acceleration) * age
        speed = max(speed + gain + bias * age, c.slowest)
    s.x[:] = 0.0
    s.x[0], s.x[1] = speed, bias
    variance = np.zeros(UNKNOWNS)
    variance[0] = (speed * max(0.02, COARSE / lag)) ** 2 + min(doubt, speed * c.lost / 2) ** 2
    variance[1] = c.first_acceleration**2
    variance[2:] = c.spread
    s.P[:] = np.diag(variance)
    start(s.motion, s.x, variance)
    s.level.power[0] = np.sqrt(s.power[0] * s.power[1]) / s.power[2]
    s.level.calm[0] = 1e-3 * s.level.power[0]
    s.level.mismatch[0] = 2 * max(1 - correlation, 0.02) * s.level.power[0]
    s.level.slope[0] = s.level.slope_weight[0] = s.level.recent[0] = 0.0
    s.level.window_mismatch[0], s.level.window_power[0] = s.level.mismatch[0], s.level.power[0]
    s.counts[2] = 1


@as_written
def _follow(s: Tracking, c: Limits, now: int) -> None:
    """One step of the motion models and, where the signals are sound, one measurement at sample `now`."""
    predict(s.motion, c.stride / c.rate, s.gained[now - c.late] - s.gained[now - c.late - c.stride])
    models = len(s.motion.weight)
    errors, slopes, noise_slope = np.zeros(models), np.zeros((models, UNKNOWNS)), np.zeros((models, UNKNOWNS))
    power, error, steep, blind = 0.0, 0.0, 0.0, 0.0
    usable = s.good[now + REACH] > 2 * REACH
    for j in range(models):
        x = _total(s, c, now, s.motion.x[j])
        back = now - travel_time(c.wheelbase, x[0], x[1]) * c.rate
        if not usable or x[0] < 0.5 * c.slowest or back < REACH + 1 or back > now - 1:
            usable = False
            break
        usable = s.good[int(back) + REACH + 1] > 2 * REACH + 1
        errors[j], strength = mismatch(s.signals, now, c.rate, c.wheelbase, x, slopes[j])
        blind += s.motion.weight[j] * _noise_slope(c, x, noise_slope[j])
        steep += s.motion.weight[j] * slopes[j, 0] ** 2
        power += s.motion.weight[j] * strength
        error += s.motion.weight[j] * errors[j]
    _cruise(s, c, now)
    if usable and _average(s.level, c, power, error * error, steep):
        v = s.level
        noise = max(v.calm[0], v.mismatch[0] / 3, v.recent[0] / 3, c.model_error * v.power[0])
        real = 1 - blind * v.calm[0] * v.slope_weight[0] / max(v.slope[0], 1e-300)
        correct_models(s.motion, errors, slopes, noise * c.repeat, noise_slope * v.calm[0], min(max(real, LEAST), 1.0))
    s.x[:] = mean(s.motion)
    s.P[:] = covariance(s.motion, s.x)


@as_written
def _average(v: Level, c: Limits, power: float, square: float, steep: float) -> bool:
    """Take a mismatch, squared, into the averages; False where the signals are too weak for one."""
    v.power[0] += c.smoothing_factor * (power - v.power[0])
    if v.power[0] <= 0.01 * c.floor:
        return False
    v.mismatch[0] += c.smoothing_factor * (square - v.mismatch[0])
    v.calm[0] += c.smoothing_factor * (min(square, 4 * v.calm[0]) - v.calm[0])
    v.slope[0] += c.smoothing_factor * (steep - v.slope[0])
    v.slope_weight[0] += c.smoothing_factor * (1 - v.slope_weight[0])
    v.window_mismatch[0] += c.window_smoothing_factor * (square - v.window_mismatch[0])
    v.window_power[0] += c.window_smoothing_factor * (power - v.window_power[0])
    v.recent[0] += min(FAST * c.smoothing_factor, 1.0) * (square - v.recent[0])
    return True


@as_written
def _cruise(s: Tracking, c: Limits, now: int) -> None:
    """While the measured longitudinal acceleration is steady, the first model takes the speed for constant."""
    short = min(int(SHORT * c.rate), len(s.gained) // 4)
    mean_push = (s.gained[now - c.late] - s.gained[now - c.late - short]) * c.rate / short
    if c.cruise == 0 or not abs(mean_push - s.push[2]) < QUIET:
        return
    error = -mean_push - s.motion.x[0, 1]
    gain = s.motion.P[0, :, 1].copy()
    S = gain[1] + c.cruise * c.rate / c.stride
    correct(s.motion.x[0], s.motion.P[0], gain, S, error)
    s.motion.weight[0] *= np.exp(-min(error * error / (2 * S), 20.0))
    s.motion.weight[:] /= s.motion.weight.sum()


@as_written
def _total(s: Tracking, c: Limits, now: int, x: np.ndarray) -> np.ndarray:
    """The unknowns with the whole acceleration over the travel time instead of what the measured one leaves."""
    whole = x.copy()
    span = c.rate * c.wheelbase / max(x[0], 0.5 * c.slowest)
    past = min(max(int(span), 1), len(s.gained) // 2 - 2 * c.stride - c.late - 2 * REACH)
    whole[1] += (s.gained[now - c.late] - s.gained[now - c.late - past]) * c.rate / past
    return whole


@as_written
def _noise_slope(c: Limits, x: np.ndarray, out: np.ndarray) -> float:
    """Row of the table of `speed.noise_slopes` for the travel time at `x`, its first column turned into speed and
    acceleration; returns the slope in speed, squared, that noise alone gives for a mismatch of power 1.
    """
    lag = travel_time(c.wheelbase, x[0], x[1])
    index = min(lag * c.rate, len(c.noise_slope) - 2.0)
    k = int(index)
    row = c.noise_slope[k] + (index - k) * (c.noise_slope[k + 1] - c.noise_slope[k])
    ahead = max(x[0] - x[1] * lag, 0.1)
    out[0] = -row[0] * lag / ahead
    out[1] = row[0] * lag * lag / (2 * ahead)
    out[2:] = row[1:7]
    return row[7] * (lag / ahead) ** 2


@kernel
def _holds(s: Tracking, c: Limits, correlation: float) -> bool:
    """Whether the tracking is sound: in range, certain, and explaining as much as the best lag of the search, both over
    the search's window: of noise that has just begun the search would else remember better times.
    """
    quality = 1 - s.level.window_mismatch[0] / (2 * s.level.window_power[0] + 1e-300)
    in_range = c.slowest < s.x[0] < c.fastest
    certain = s.P[0, 0] < (c.lost * s.x[0]) ** 2
    return in_range and certain and quality > c.threshold / 2 and quality > correlation - 0.2


@kernel
def _report(s: Tracking, c: Limits, newest: int, row: np.ndarray) -> None:
    """The state carried on from the middle of the filters' delay to now."""
    if not s.counts[2]:
        row[:] = np.nan
        row[3] = row[4] = 0.0
        return
    behind = c.late + s.counts[0] % c.stride + REACH
    ahead = behind / c.rate
    recent = s.gained[newest] - s.gained[newest - behind]
    variance = s.P[0, 0] + 2 * ahead * s.P[0, 1] + ahead**2 * s.P[1, 1]
    row[0] = s.x[0] + ahead * s.x[1] + recent
    row[1] = np.sqrt(max(variance, 0.0))
    row[2] = s.x[1] + recent / ahead
    row[3] = 1 - s.level.mismatch[0] / (2 * s.level.power[0] + 1e-300)
    row[4] = 1.0
