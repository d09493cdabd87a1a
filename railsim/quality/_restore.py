"""Short runs of samples that are known to be wrong, put back by the channel's own autoregressive model."""

import numpy as np
from scipy.linalg import toeplitz

from railsim.quality._signals import filled, runs, whitened

LONGEST = 24  # samples; the model has 32 taps and knows little of longer runs


def restored(values: np.ndarray, at: np.ndarray, rate: float, prediction: np.ndarray) -> np.ndarray:
    """Values with the samples `at` replaced by those that the model predicts best from both sides; shape (n,).

    Least squares on the prediction error (Janssen, Veldhuis and Vries 1986, IEEE Trans. ASSP 34, 317-330). A limited
    sample was at least as large as it was read, so that a value nearer to zero than that reading is not taken. Runs of
    more than `LONGEST` samples are lost (NaN).
    """
    wrong = np.zeros(values.size, dtype=bool)
    wrong[at] = True
    new = np.where(wrong, np.nan, values)
    apart = new - prediction
    white = whitened(apart, rate)
    if white is None:
        return new
    long = [one for one in runs(wrong) if one[1] - one[0] > LONGEST]
    known, centre = filled(apart), float(np.nanmedian(apart))
    middle = float(np.nanmedian(new))
    taps, order = white.filter, white.filter.size - 1
    near = np.convolve(wrong, np.ones(2 * order + 1), mode="same") > 0.5
    for first, last in runs(near):
        part = known[first:last] - centre
        unknown = np.flatnonzero(wrong[first:last])
        column = np.concatenate([taps, np.zeros(part.size - order - 1)])[: part.size]
        predict = toeplitz(column, np.zeros(part.size))[order:]
        fixed = part.copy()
        fixed[unknown] = 0.0
        replaced = np.linalg.lstsq(predict[:, unknown], -predict @ fixed, rcond=None)[0] + centre
        replaced += prediction[first + unknown]
        read = values[first + unknown]
        outward = np.sign(read - middle)
        new[first + unknown] = np.where((replaced - read) * outward < 0.0, read, replaced)
    for first, last in long:
        new[first:last] = np.nan
    return new
