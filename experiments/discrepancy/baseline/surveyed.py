"""Surveyed track: what a track file says about the line beyond its own errors, and what it leaves open.

A file is the track plus errors, and a model that runs over it predicts both. At short waves, where little of the file
is track, fits then bend whatever passes less of it on (errors in variables). The expected track given the file, and
tracks as likely as any other given the file, come from its local spectra (Wiener, 1949: the share of the track in each
wave number's power).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import uniform_filter
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from railsim.track.survey import TrackErrors, error_of
from railsim.track.track import Track

WINDOW = 8.0  # m, of the local spectra
HOPS = 4  # windows that overlap at a place
NEARBY = 3  # wave numbers and places over which power is averaged
LOUD = 2.0  # times the line's own spectrum, from which a place counts for itself: a joint, a dip
UNSURE = 0.1  # share of the stated error power that always stays: so well are standard deviations known
FEWEST = 64  # rows below which a file has no spectrum
UNEVEN = 1e-3  # of the spacing, beyond which rows are not at equal distances


@dataclass(frozen=True)
class Surveyed:
    """A track file, the standard deviations of its rows' white errors, and whether it is itself an expected track: an
    estimate's errors are what it leaves open, so nothing is taken off it.
    """

    track: Track
    errors: TrackErrors
    estimated: bool = False

    @cached_property
    def expected(self) -> Track:
        """The track that the file lets one expect."""
        columns = self.track.columns()
        shares = self._shares
        found = {name: shares[name].kept(values) if name in shares else values for name, values in columns.items()}
        return Track(self.track.s, found, self.track.name)

    def drawn(self, rng: np.random.Generator) -> Track:
        """The expected track with errors of the size that it has itself."""
        columns = dict(self.expected.columns())
        for name, values in columns.items():
            deviation = error_of(self.errors, name)
            if deviation > 0.0:
                white = deviation * rng.standard_normal(values.size)
                columns[name] = values + (self._shares[name].left(white) if name in self._shares else white)
        return Track(self.track.s, columns, self.track.name)

    @cached_property
    def _shares(self) -> dict[str, "_Share"]:
        s = self.track.s
        even = np.ptp(np.diff(s)) < UNEVEN * self.track.spacing
        if self.estimated or s.size < FEWEST or not even:
            return {}
        size = min(round(WINDOW / self.track.spacing), s.size // 4)
        waves = ShortTimeFFT(hann(size, sym=False), max(1, size // HOPS), 1.0 / self.track.spacing)
        return {
            name: _Share.of(waves, values, deviation)
            for name, values in self.track.columns().items()
            if (deviation := error_of(self.errors, name)) > 0.0
        }


def as_surveyed(track: Track, errors: TrackErrors, seed: int) -> Track:
    """A track as a file would give it that has such errors; the same for the same seed."""
    rng = np.random.default_rng(seed)
    columns = {
        name: values + error_of(errors, name) * rng.standard_normal(values.size)
        for name, values in track.columns().items()
    }
    return Track(track.s, columns, track.name)


@dataclass(frozen=True)
class _Share:
    """Of each wave number at each place: the share of the track in the file's power, and that of the stated errors'
    power that the expected track still has.
    """

    waves: ShortTimeFFT
    track: np.ndarray
    open: np.ndarray

    @classmethod
    def of(cls, waves: ShortTimeFFT, values: np.ndarray, deviation: float) -> "_Share":
        power = np.abs(waves.stft(_extended(values - _line(values), waves.m_num))) ** 2
        nearby = uniform_filter(power, NEARBY, mode="nearest")
        own = deviation**2 * float(np.sum(np.asarray(waves.win) ** 2))
        usual = uniform_filter(power.mean(axis=1), NEARBY, mode="nearest")[:, None]
        ratio = np.maximum(usual, nearby / LOUD) / own
        track = np.clip(1.0 - 1.0 / np.maximum(ratio, 1.0), 0.0, 1.0)
        missing = 1.0 - ratio  # the file lacks even its own errors there: it is filtered, and says nothing
        return cls(waves, track, np.clip(np.maximum(track, missing), UNSURE, 1.0))

    def kept(self, values: np.ndarray) -> np.ndarray:
        line = _line(values)
        return line + self._filtered(values - line, self.track)

    def left(self, errors: np.ndarray) -> np.ndarray:
        return self._filtered(errors, np.sqrt(self.open))

    def _filtered(self, values: np.ndarray, share: np.ndarray) -> np.ndarray:
        size = self.waves.m_num
        longer = _extended(values, size)
        found = self.waves.istft(self.waves.stft(longer) * share, k1=longer.size)
        return np.asarray(found[size : size + values.size])


def _line(values: np.ndarray) -> np.ndarray:
    """From the first to the last."""
    return np.linspace(values[0], values[-1], values.size)


def _extended(values: np.ndarray, count: int) -> np.ndarray:
    """With so many more at each end, turned about the end's value."""
    before = 2.0 * values[0] - values[count:0:-1]
    return np.concatenate([before, values, 2.0 * values[-1] - values[-2 : -count - 2 : -1]])
