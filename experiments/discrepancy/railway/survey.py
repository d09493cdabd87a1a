"""The track given its file: a file is the track plus errors, so its energy is too large (errors in variables).

Of each column: the mean of the track given the file and the level of its errors, and the share of their power that
the file leaves open (Wiener 1949, by the file's own spectrum).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from experiments.discrepancy.railway.smoothed import BENT, shortest, told
from railsim.track.ends import continued
from railsim.track.survey import TrackErrors, error_of
from railsim.track.track import Track

KINDS = ("vertical", "cross_level", "lateral", "gauge")
"""Of errors that the channels see, as `TrackErrors` calls them."""
HIDDEN = ", hidden"  # of names of errors
SHOWN = 0.1  # share of the track in the file's power from which the file shows it
STEPS, SETTLED, LONGEST = 60, 1e-3, 2.0  # of the spectrum's fit: at most so many, until so small, logs at most
SWELLING = 5.0  # m in which errors swell to their size
OVERRUN = 50.0  # m by which the file is continued at its ends


@dataclass(frozen=True)
class Surveyed:
    """A track file, the stated standard deviations of its errors, and whether it is itself an expected track: an
    estimate's errors are what it leaves open, so nothing is taken off it.
    """

    track: Track
    errors: TrackErrors
    estimated: bool = False
    kept: dict[tuple[float, int], np.ndarray] = field(default_factory=dict, compare=False)  # shares by level and values

    def kinds(self) -> tuple[str, ...]:
        """Kinds of errors that the file has."""
        return tuple(kind for kind in KINDS if getattr(self.errors, f"{kind}_std") > 0.0 and self._columns(kind, 1.0))

    def expected(self, levels: dict[str, float]) -> Track:
        """Mean of the track, each kind's errors `levels` times as large as stated."""
        columns = dict(self.track.columns())
        for kind in self.kinds():
            for name, deviation in self._columns(kind, levels[kind]):
                line = _line(columns[name])
                rest = columns[name] - line
                columns[name] = line + _filtered(rest, self._share(rest, deviation))
        return continued(Track(self.track.s, columns, self.track.name), OVERRUN)

    def columns(self, kind: str) -> tuple[str, ...]:
        """Of the file that a kind of errors is in."""
        return tuple(name for name, _ in self._columns(kind, 1.0))

    def shares(self, source: str, level: float, waves: np.ndarray) -> dict[str, np.ndarray]:
        """Of each column of a source's kind: the share of the power of its errors that the file leaves open, (F,) at
        wave numbers [1/m] (F,), where the file shows the track, or (`source` ending in HIDDEN) where nothing but the
        slope of its spectrum tells of it; errors `level` times as loud as stated.
        """
        hidden, kind, found = source.endswith(HIDDEN), source.removesuffix(HIDDEN), {}
        for name, deviation in self._columns(kind, level):
            values = self.track.columns()[name]
            share = self._share(values - _line(values), deviation)
            known = np.fft.rfftfreq(len(values), float(np.mean(np.diff(self.track.s))))
            found[name] = np.interp(waves, known, np.where((share < SHOWN) == hidden, share, 0.0))
        return found

    def shortest(self) -> dict[str, float]:
        """Of each column that was smoothed: the shortest wave that the file tells of [m]. Cant is smooth by design."""
        found, length = {}, len(self.track.s) * float(np.mean(np.diff(self.track.s)))
        for kind in () if self.estimated else self.kinds():
            for name, deviation in self._columns(kind, 1.0):
                values = self.track.columns()[name]
                power = np.abs(np.fft.rfft(values - _line(values))[1:]) ** 2 / len(values)
                line = None if name == "cant" else shortest(told(power, deviation**2))
                if line is not None:
                    found[name] = length / line
        return found

    def shaken(self, track: Track, kind: str, column: str, begin: float, rng: np.random.Generator) -> Track:
        """A track that `expected` gave, with white errors in one column, as loud as stated, from `begin` [m] on: the
        vehicle starts where it can stand.
        """
        columns = dict(track.columns())
        deviation = dict(self._columns(kind, 1.0))[column]
        error = deviation * rng.standard_normal(len(track.s)) * np.clip((track.s - begin) / SWELLING, 0.0, 1.0)
        columns[column] = columns[column] + error
        return Track(track.s, columns, track.name)

    def _columns(self, kind: str, level: float) -> list[tuple[str, float]]:
        one = TrackErrors(**{f"{kind}_std": getattr(self.errors, f"{kind}_std")})
        found = [(name, level * error_of(one, name)) for name in self.track.columns()]
        return [(name, deviation) for name, deviation in found if deviation > 0.0]

    def _share(self, values: np.ndarray, deviation: float) -> np.ndarray:
        """Of each wave number: the track's share of the file's power."""
        if self.estimated:
            return np.ones(len(values) // 2 + 1)
        key = deviation, hash(values.tobytes())
        if key not in self.kept:
            power = np.abs(np.fft.rfft(values)) ** 2 / len(values)
            track = spectrum(power[1:], deviation**2)
            self.kept[key] = np.concatenate([[1.0], track / (track + deviation**2)])
        return self.kept[key]


def sources(kinds: Sequence[str]) -> tuple[str, ...]:
    """Kinds of errors, of each what the file shows and what it hides: two levels, for nobody knows how a track goes on
    below the errors of its file.
    """
    return tuple(kind + part for kind in kinds for part in ("", HIDDEN))


def spectrum(power: np.ndarray, error: float) -> np.ndarray:
    """(lines,) mean power of a track of which `power` was seen with white errors of mean power `error`, lines evenly
    from the first wave number on.

    A broken line in logs, a knot an octave, of the greatest likelihood of independent lines (Whittle 1953, Ark. Mat. 2)
    with its bends held by their prior: where the errors hide the track it goes on as a power of the wave number.
    """
    octave = np.log2(np.arange(1, len(power) + 1))
    knots = np.arange(np.ceil(octave[-1]) + 1.0)
    basis = np.stack([np.interp(octave, knots, one) for one in np.eye(len(knots))], axis=1)
    bend = np.diff(np.eye(len(knots)), 2, axis=0) / BENT
    held = bend.T @ bend + 1e-9 * np.eye(len(knots))
    logs = np.log(np.maximum(basis.T @ power / basis.sum(axis=0), 1e-12 * power.max() + 1e-300))
    for _ in range(STEPS):
        track = np.exp(basis @ logs)
        share = track / (track + error)
        slope = basis.T @ (share * (power / (track + error) - 1.0)) - held @ logs
        step = np.linalg.solve((basis * share[:, None] ** 2).T @ basis + held, slope)
        logs = logs + np.clip(step, -LONGEST, LONGEST)
        if np.abs(step).max() < SETTLED:
            break
    return np.exp(basis @ logs)


def _line(values: np.ndarray) -> np.ndarray:
    return np.linspace(values[0], values[-1], values.size)


def _filtered(values: np.ndarray, share: np.ndarray) -> np.ndarray:
    return np.fft.irfft(np.fft.rfft(values) * share, len(values))
