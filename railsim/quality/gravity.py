"""Vertical accelerometers whose share of gravity jumps: a gain that changes, or a zero."""

import numpy as np

from railsim.constants import GRAVITY
from railsim.measurements import Measurements
from railsim.quality._change_point import own
from railsim.quality._offsets import axis_of
from railsim.quality._signals import kind_of, whitened
from railsim.quality.companions import gain_beside
from railsim.quality.draft import tables_of

JUMP = 1.2  # m/s2 by which gravity's share never changes in service
ALIKE = 0.15  # by which the quotient of the means may differ from the gain
_BLOCK, _FEWEST = 0.25, 8  # s of a mean, and means in a stretch
_NEAR = 0.05  # s about the place by the means, in which that of the jump is sought
_BESIDE = 2.0  # s about an edge, over which the sizes of innovations are compared
_USUAL = 0.3  # of gravity, by which a piezoelectric sensor's zero may be off
_LIKE_GAIN = (0.4, 1.7)  # of the gain's logarithm, between which the change of their size speaks for a gain


def levelled(measured: Measurements) -> Measurements:
    """Vertical accelerometers without a jump of their level and back, which would ring in every band."""
    frames = tables_of(measured)
    for name in measured:
        if kind_of(measured, name) == "accelerometer" and axis_of(name) == "z":
            values, rate = _known(measured[name]), measured.rate(name)
            first, last = _jump(values, round(_BLOCK * rate))
            size = float(np.mean(values[first:last]) - np.mean(np.r_[values[:first], values[last:], values[:1]]))
            if abs(size) > JUMP:
                frames[rate][name][first:last] -= size
    return Measurements(measured.about, frames, measured.track)


def _known(values: np.ndarray) -> np.ndarray:
    """Samples, the median where they are lost: a line across a gap has the level of its ends, which may be shocks."""
    lost = np.isnan(values)
    return np.where(lost, np.median(values[~lost]) if not lost.all() else 0.0, values)


def _jump(values: np.ndarray, block: int) -> tuple[int, int]:
    """First and one past the last sample of the stretch whose mean differs most from the others', by squares."""
    count = values.size // block
    means = values[: count * block].reshape(count, block).mean(axis=1)
    total = np.concatenate([[0.0], np.cumsum(means - means.mean())])
    first, last = (one.ravel() for one in np.triu_indices(count + 1, _FEWEST))
    inside = (last - first).astype(float)
    weight = inside * (count - inside) / count
    squares = np.where(weight > 0.0, (total[last] - total[first]) ** 2 / np.maximum(weight, 1e-9), 0.0)
    best = int(np.argmax(squares))
    start, end = int(first[best]) * block, int(last[best]) * block if last[best] < count else values.size
    size = float(np.mean(values[start:end]) - np.mean(np.r_[values[:start], values[end:], values[:1]]))
    if abs(size) > JUMP:
        over = (values - float(np.mean(values[start:end])) + size / 2) / size
        start = _edge(over, start, 2 * block) if start else 0
        end = _edge(-over, end, 2 * block) if end < values.size else end
    return start, end


def _stretches(values: np.ndarray, rate: float) -> list[tuple[int, int]]:
    """The stretch of another mean; where it reaches an end of the record, the rest too: either may be the wrong one."""
    start, end = _jump(values, round(_BLOCK * rate))
    return [(start, end)] + ([(end, values.size)] if start == 0 else []) + ([(0, start)] if end == values.size else [])


def by_mean(measured: Measurements, name: str, begin: float, end: float, gain: float) -> tuple[int, int, float] | None:
    """Edges (samples) and gain of a channel whose mean jumps by about `gain` somewhere from `begin` to `end` (s)."""
    values, rate = _known(measured[name]), measured.rate(name)
    first, last = round(begin * rate), round(end * rate)
    for start, stop in _stretches(values, rate):
        outside = np.concatenate([values[:start], values[stop:]])
        if min(outside.size, stop - start) < rate or min(last, stop) <= max(first, start):
            continue
        usual, changed = float(np.mean(outside)), float(np.mean(values[start:stop]))
        if abs(changed - usual) > JUMP and abs(changed / usual / gain - 1) < ALIKE:
            return _sharpened(measured, name, start, stop, changed / usual)
    return None


def weighed(measured: Measurements) -> tuple[str, int, int, float] | None:
    """Channel, edges (samples) and gain where gravity is read as another for a while and the innovations grow or shrink
    by about as much, beside those of the other vertical accelerometers; a jump of the zero leaves them as they are.
    """
    names = [one for one in measured if kind_of(measured, one) == "accelerometer" and axis_of(one) == "z"]
    level = levelled(measured)
    for name in names:
        values, rate = _known(measured[name]), measured.rate(name)
        parts = [(first, last, *_means(values, first, last)) for first, last in _stretches(values, rate)]
        first, last, inside, outside = min(parts, key=lambda part: abs(part[3] - GRAVITY))
        if abs(inside - outside) < JUMP or abs(outside - GRAVITY) > _USUAL * GRAVITY:
            continue
        gain = inside / outside
        if gain < 0.1:
            continue
        bounds = [float(measured.time(name)[one]) if one < values.size else np.inf for one in (first, last)]
        changes = {one: _rustle(level, one, bounds) for one in names}
        others = [change for one, change in changes.items() if one != name and np.isfinite(change)]
        change = changes[name] - (float(np.median(others)) if others else 0.0)
        if _LIKE_GAIN[0] < change / np.log(gain) < _LIKE_GAIN[1]:
            return (name, *_sharpened(measured, name, first, last, gain))
    return None


def _sharpened(measured: Measurements, name: str, first: int, last: int, gain: float) -> tuple[int, int, float]:
    """Edges by the jump that the autoregressive model sees, and the gain that leaves no step of gravity at them."""
    values, rate = _known(measured[name]), measured.rate(name)
    mended = values.copy()
    mended[first:last] /= gain
    white = whitened(mended, rate)
    bounds = [first, last]
    if white is not None:
        reach, order = round(_NEAR * rate), white.filter.size
        for which, pair in enumerate(((1.0, gain), (gain, 1.0))):
            sample = bounds[which]
            if order + reach < sample < values.size - order - reach:
                tried = np.arange(sample - reach, sample + reach + 1)
                score = own(values, float(np.median(mended)), white, tried, *pair)
                bounds[which] = int(tried[np.argmax(score)])
    inside, outside = _means(values, *bounds)
    return bounds[0], bounds[1], gain_beside(measured, name, bounds[0], bounds[1], inside / outside)


def _means(values: np.ndarray, first: int, last: int) -> tuple[float, float]:
    """Within a stretch and outside it; NaN for a stretch without samples."""
    inside, outside = values[first:last], np.r_[values[:first], values[last:], values[:1]]
    return (
        float(np.mean(inside)) if inside.size else float("nan"),
        float(np.mean(outside)) if outside.size else float("nan"),
    )


def _rustle(measured: Measurements, name: str, bounds: list[float]) -> float:
    """Logarithm of the size of a channel's innovations within the bounds (s) over that outside, beside the edges."""
    white, time = whitened(measured[name], measured.rate(name)), measured.time(name)
    if white is None:
        return float("nan")
    error = np.abs(white.innovations * white.scale)
    ratios = []
    for edge in (one for one in bounds if time[0] < one < time[-1]):
        near = (np.abs(time - edge) < _BESIDE) & (error > 0.0)
        inside = (time >= bounds[0]) & (time < bounds[1])
        parts = [error[near & where] for where in (inside, ~inside)]
        if not all(part.size for part in parts):
            return float("nan")
        ratios.append(np.log(float(np.median(parts[0])) / float(np.median(parts[1]))))
    return float(np.mean(ratios)) if ratios else float("nan")


def _edge(over: np.ndarray, near: int, reach: int) -> int:
    """Sample within `reach` of `near` that parts what lies below zero from what lies above it best."""
    start = max(0, near - reach)
    score = np.concatenate([[0.0], np.cumsum(over[start : near + reach])])
    return start + int(np.argmin(score))
