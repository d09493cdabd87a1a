"""What errors of the track file do to the channels, through the vehicle that a hypothesis has.

Many runs of the nominal vehicle over tracks with other errors tell how its channels change together. A vehicle with
other springs answers otherwise to the same errors. So it runs over one of these tracks of each column, and the nominal
covariance is scaled by what its channels show there beside the nominal ones.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.runs import remembered
from experiments.discrepancy.railway.simulated import Simulated
from railsim.effects.interface import Setup
from railsim.errors import InputError
from railsim.track.track import Track

MOST = 24  # of these runs for a column
DRAWN = 10  # frames a channel of these runs
SEED = 20110901  # of these draws: the same for every hypothesis

Gains = tuple[Mapping[str, np.ndarray], ...]
"""Of each section: column to (F, channels), what a vehicle's channels show over what the nominal ones do."""


@dataclass(frozen=True, eq=False)
class Passing:
    """`simulated`: the record's vehicle over the track that is expected, with errors as stated."""

    record: Record
    simulated: Simulated
    last: dict[object, Gains] = field(default_factory=dict)

    @property
    def nominal(self) -> dict[str, list[np.ndarray]]:
        """(F, channels, channels) of each column and section: what white errors in that column do, as loud as stated.

        Raises
        ------
        InputError : such errors take every run off its rails.
        """
        return self._nominal[0]

    def gains(self, key: object, setup: Setup, ahead: float) -> Gains:
        """Of a vehicle that begins `ahead` [m] of the registered start; `key`: what it is remembered by. As the nominal
        one where it leaves its rails.
        """
        return remembered(self.last, key, lambda: self._gains(setup, ahead))

    def _gains(self, setup: Setup, ahead: float) -> Gains:
        tracks = (self.simulated.track, *(shaken[0] for shaken in self._shaken.values()))
        runs = self.simulated.channels([(setup.but(track=track), ahead) for track in tracks])
        own = dict(zip(self._shaken, runs[1:] - runs[0], strict=True))
        return tuple(
            {column: _gain(own[column][:, part], first[:, part]) for column, first in self._nominal[1].items()}
            for part in self.record.sections
        )

    @cached_property
    def _shaken(self) -> dict[str, list[Track]]:
        """Tracks with white errors in one column, by column."""
        rng, file, bodies = np.random.default_rng(SEED), self.record.surveyed, self.simulated.nominal.model.bodies
        begin = self.record.registration.start + max(one.position[0] for one in bodies)
        count = math.ceil(DRAWN * len(self.record.channels) / min(len(one) for one in self.record.sections))
        columns = [(kind, one) for kind in file.kinds() for one in file.columns(kind)]
        track, draws = self.simulated.track, range(min(count, MOST))
        return {one[1]: [file.shaken(track, *one, begin, rng) for _ in draws] for one in columns}

    @cached_property
    def _nominal(self) -> tuple[dict[str, list[np.ndarray]], dict[str, np.ndarray]]:
        """Of each column: `nominal`, and (F, frames, channels) of what the first draw changes."""
        tracks = [self.simulated.track, *(one for shaken in self._shaken.values() for one in shaken)]
        runs = self.simulated.channels([(self.simulated.nominal.but(track=one), 0.0) for one in tracks])
        parts = np.split(runs[1:] - runs[0], len(self._shaken)) if self._shaken else []
        changes: dict[str, np.ndarray] = dict(zip(self._shaken, parts, strict=True))
        powers = {column: self._powers(runs) for column, runs in changes.items()}
        return powers, {column: runs[0].copy() for column, runs in changes.items()}

    def _powers(self, changes: np.ndarray) -> list[np.ndarray]:
        """(F, channels, channels) of changes (runs, F, frames, channels) in each section."""
        good = changes[np.isfinite(changes).all(axis=(1, 2, 3))]
        if not len(good):
            raise InputError("track errors: as loud as stated they take the model off its rails; state smaller ones")
        parts = [good[..., part, :] for part in self.record.sections]
        return [smooth(np.einsum("rftc,rftd->fcd", one, np.conj(one)) / (one.shape[0] * one.shape[2])) for one in parts]


def smooth(power: np.ndarray) -> np.ndarray:
    """Over three neighbouring frequencies."""
    padded = np.concatenate([power[:1], power, power[-1:]])
    return 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]


def _gain(own: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """(F, channels) of what (F, frames, channels) show over what the nominal ones do: the root of the ratio of their
    powers, with the phase between them; 1 where one of them shows nothing.
    """
    powers = [smooth(np.mean(np.abs(one) ** 2, axis=1)) for one in (own, nominal)]
    between = smooth(np.mean(own * np.conj(nominal), axis=1))
    with np.errstate(all="ignore"):
        gain = np.sqrt(powers[0] / powers[1]) * between / np.abs(between)
    return np.where(np.isfinite(gain) & (gain != 0.0), gain, 1.0)
