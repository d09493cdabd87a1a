"""A channel beside what all relations of the rigid body together predict of it."""

from dataclasses import dataclass

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._balance import COARSE, balance, density, exact, whitening
from railsim.quality._rigid import Relation, relations, spectra_of, window_of

_TAPER = 1.0  # s at both ends of the record, which the band-pass needs
_OUTSIDE = 2.0  # s outside a stretch, from which on its gain can be told
_SURELY = 4.0  # deviations by which a gain outside the stretch must be off to be taken for the relations' error
_ALIKE = 0.15  # and by which at most


@dataclass(frozen=True)
class Agreement:
    """A channel and what the others leave of it, both whitened.

    Attributes
    ----------
    part, rest : over time, the channel, and the channel less its prediction, shape (n,).
    noise : variance of `part` by the channel's own noise, shape (n,).
    window : weight of each sample, 0 to 1, shape (n,).
    total : spectrum of `rest`, shape (k,).
    white : filter by which both were whitened, shape (k,). at : the frequencies' numbers, shape (k,).
    seconds : length of the record.
    rate : Hz, of `part`.
    """

    part: np.ndarray
    rest: np.ndarray
    noise: np.ndarray
    window: np.ndarray
    total: np.ndarray
    white: np.ndarray
    at: np.ndarray
    seconds: float
    rate: float = COARSE

    def faded(self, values: np.ndarray, rate: float) -> np.ndarray:
        """The channel's samples at its rate (Hz) in the record's window, shape (m,)."""
        count = round(self.seconds * rate)
        times = np.arange(self.window.size) / self.rate
        return values[:count] * np.interp(np.arange(count) / rate, times, self.window)

    def spectrum(self, faded: np.ndarray, first: int, last: int) -> np.ndarray:
        """What the samples from `first` to `last` add to the channel's spectrum, shape (k,)."""
        some = np.zeros(faded.size)
        some[first:last] = faded[first:last]
        return self.white * np.fft.rfft(some)[self.at] / faded.size

    def back(self, spectrum: np.ndarray, count: int) -> np.ndarray:
        """Product of a spectrum (k,) with that of a sample 1 at each of `count` places, shape (count,)."""
        whole = np.zeros(count // 2 + 1, dtype=complex)
        whole[self.at] = spectrum * np.conj(self.white) / 2.0
        return np.fft.irfft(whole, count)

    def gained(self, first: int, last: int, gain: float) -> np.ndarray:
        """Logarithm of the likelihood ratio of `gain` against 1 up to each sample, shape (n + 1,), the variance being
        what the gain leaves over from `first` to `last` and 1 elsewhere.
        """
        changed = self.rest - (1.0 - 1.0 / gain) * self.part
        left = self.rest**2
        left[first:last] = changed[first:last] ** 2
        square = self.window**2
        variance = max(float(left.sum()) / max(float(square.sum()), 1e-9), 1e-30)
        each = 0.5 * (self.rest**2 - changed**2) / variance - np.log(gain) * square
        return np.concatenate([[0.0], np.cumsum(2.0 * self.at.size / self.part.size * each)])

    def gain(self, values: np.ndarray, rate: float, first: int, last: int, gain: float) -> float:
        """Gain of a stretch, in samples of the channel, over that outside it; least squares without the own noise.

        What the relations leave over everywhere is no change; an outside that is too short to tell counts as sound.

        Parameters
        ----------
        values : the channel, shape (m,). rate : Hz.
        gain : a first value.
        """
        faded = self.faded(values, rate)
        inside = np.zeros(self.part.size, dtype=bool)
        inside[round(first / rate * self.rate) : round(last / rate * self.rate)] = True
        own = gain**2 * float(self.noise[inside].sum()), float(self.noise[~inside].sum())
        within = self.spectrum(faded, first, last)
        outside = self.spectrum(faded, 0, faded.size) - within
        both = np.array([within, outside])
        square = np.real(both @ both.conj().T) - np.diag(own)
        shares = np.linalg.lstsq(square, np.real(both @ self.total.conj()) - own, rcond=None)[0]
        left = float(np.sum(np.abs(self.total - shares @ both) ** 2)) / (2 * self.at.size)
        scatter = np.sqrt(left / max(square[1, 1], 1e-30))
        if (~inside).sum() > _OUTSIDE * self.rate and _SURELY * scatter < abs(shares[1]) < _ALIKE:
            return float((1.0 - shares[1]) / max(1.0 - shares[0], 1e-3))
        alone = (np.real(within @ self.total.conj()) - own[0]) / max(square[0, 0], 1e-30)
        return float(1.0 / max(1.0 - alone, 1e-3))


def agreement(measured: Measurements, name: str, first: int, last: int, gain: float) -> Agreement:
    """A channel against the prediction by all relations that it stands in, of which there has to be one.

    Each relation counts by the inverse of what it leaves over, the stretch divided by `gain`.

    Parameters
    ----------
    first, last : stretch in samples at 64 Hz.
    """
    frequency, spectra = spectra_of(measured, _TAPER)
    seconds = float(round((frequency.size - 1) / (frequency[-1] - frequency[0])))
    mine = [one for one in relations(measured, frequency, spectra) if exact(one) and name in one.weights]
    total, weights = np.zeros(frequency.size), {}
    for relation in mine:
        alone = balance(relation, measured, frequency, spectra, seconds, _TAPER)
        rest = alone.total.copy()
        rest[first:last] -= (1.0 - 1.0 / gain) * alone.parts[name][first:last]
        expected = float(np.sum([np.sum(noise) for noise in alone.noise.values()]))
        worse = max(1.0, float(rest @ rest) / max(expected, 1e-30))
        noise = sum(
            np.abs(w) ** 2 * density(measured, other) ** 2 for other, w in relation.weights.items() if other != name
        )
        share = np.abs(relation.weights[name]) ** 2 / (worse * np.maximum(noise, 1e-30))
        total = total + share
        for other, weight in relation.weights.items():
            weights[other] = weights.get(other, 0.0) + share * weight / relation.weights[name]
    both = Relation({other: weight / total for other, weight in weights.items()})
    balanced = balance(both, measured, frequency, spectra, seconds, _TAPER)
    window = window_of(measured, list(spectra), seconds, _TAPER)[: balanced.total.size]
    at = np.rint(frequency * seconds).astype(int)
    white = whitening(both, measured, frequency)
    spectrum = white * sum(weight * spectra[other] for other, weight in both.weights.items())
    return Agreement(balanced.parts[name], balanced.total, balanced.noise[name], window, spectrum, white, at, seconds)
