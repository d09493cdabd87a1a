"""What the other channels of a recording say of one: a linear prediction, and levels and gains beside it."""

import numpy as np
from scipy.signal import lfilter

from railsim.measurements import Measurements
from railsim.quality._signals import filled, kind_of, whitened

LAGS = 4  # samples before and after, by which a derivative is formed up to a third of half the rate
_PASSES = 2
_TIMES = 3
_RIDGE = 1e-9  # of the largest


def predicted(measured: Measurements, name: str, values: np.ndarray, sound: np.ndarray) -> np.ndarray:
    """Prediction of `values` from the inertial channels and transducers of the same rate, means apart, shape (n,).

    Least squares over each channel's present, past and next samples, errors made white by their own autoregressive
    model: a rigid body's accelerometers, gyros and transducers say nearly the same in several ways.

    Parameters
    ----------
    values : the channel, without what is known to be wrong of its level or gain, NaN where lost, shape (n,).
    sound : which of its samples are to be fitted to, shape (n,).
    """
    rate = measured.rate(name)
    others = [
        other
        for other in measured
        if other != name
        and measured.rate(other) == rate
        and kind_of(measured, other) in ("accelerometer", "gyro", "displacement")
        and np.isfinite(measured[other]).mean() > 0.5
        and np.nanstd(measured[other]) > 0.0
    ]
    if not others or sound.sum() < 200:
        return np.zeros(values.size)
    known = np.where(sound, values, np.nan)
    shifted, lost = [], ~sound
    for companion in others:
        gone = np.isnan(measured[companion])
        lost = lost | (np.convolve(gone, np.ones(2 * LAGS + 1), mode="same") > 0.5)
        seen = filled(measured[companion])
        padded = np.pad((seen - seen.mean()) / seen.std(), LAGS, mode="edge")
        shifted += [padded[at : at + values.size] for at in range(2 * LAGS + 1)]
    columns = np.array(shifted)
    prediction = np.zeros(values.size)
    for _ in range(_PASSES):
        white = whitened(known - prediction, rate)
        if white is None:
            return prediction
        order = white.filter.size
        used = np.convolve(lost, np.ones(order))[: values.size] < 0.5
        used[:order] = False
        target = filled(known) - np.nanmean(known)
        left = np.asarray(lfilter(white.filter, [1.0], columns))[:, used] / white.scale[used]
        right = np.asarray(lfilter(white.filter, [1.0], target))[used] / white.scale[used]
        square = left @ left.T
        square[np.diag_indices_from(square)] += _RIDGE * float(square.diagonal().max())
        prediction = np.linalg.solve(square, left @ right) @ columns
    return prediction


def sized(values: np.ndarray, rate: float, first: int, last: int, size: float) -> float:
    """Size of an offset in `values[first:last]`, by generalised least squares over the whole record.

    The channel's autoregressive model is fitted anew to what is left without the offset: with it the model takes the
    offset for slow movement of the vehicle.

    Parameters
    ----------
    values : samples, NaN where lost, shape (n,).
    rate : of the samples, Hz.
    size : a first value, unit of the channel.
    """
    inside = np.zeros(values.size)
    inside[first:last] = 1.0
    for _ in range(_TIMES):
        white = whitened(values - size * inside, rate)
        if white is None:
            return size
        known = white.innovations != 0.0
        patterns = [lfilter(white.filter, [1.0], one) for one in (inside, np.ones(values.size))]
        regressors = (np.column_stack(patterns) / white.scale[:, None])[known]
        size += float(np.linalg.lstsq(regressors, white.innovations[known], rcond=None)[0][0])
    return size


def sized_beside(measured: Measurements, name: str, first: int, last: int, size: float) -> float:
    """Size of an offset in samples `first` to `last` of a channel as `sized` finds it in what the other channels do not
    predict of it: two accelerometers of one body move alike, and their difference hardly moves.

    Parameters
    ----------
    size : a first value, unit of the channel.
    """
    values, rate = measured[name], measured.rate(name)
    for _ in range(_TIMES):
        level = values.copy()
        level[first:last] -= size
        apart = values - predicted(measured, name, level, np.isfinite(values))
        size = sized(apart, rate, first, last, size)
    return size


def gain_beside(measured: Measurements, name: str, first: int, last: int, gain: float) -> float:
    """Gain of a stretch of a channel that has a mean level (gravity), from a first value: once divided by it, what the
    other channels do not predict of the channel must have no step.
    """
    values, rate = measured[name], measured.rate(name)
    for _ in range(_TIMES):
        mended = values.copy()
        mended[first:last] /= gain
        step = sized(mended - predicted(measured, name, mended, np.isfinite(values)), rate, first, last, 0.0)
        gain *= 1.0 + step / float(np.nanmean(np.r_[mended[:first], mended[last:]]))
    return gain
