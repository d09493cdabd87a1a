"""Likelihood of a record's spectra, window by window along the line, and the stiffness of the track that fits best.

Each window has three unknowns: the logarithm of the track's stiffness, level and slope of its roughness. All windows
have in common the shape of the roughness' spectrum over the wave number, piecewise linear in logarithms with a prior
that keeps it smooth, and what data sheets leave open (`stiffness_model.Common`). A spectrum P of expectation E has the
density exp(-P / E) / E (Whittle 1953). Fisher scoring finds the most probable values. The inverse of Fisher's matrix
with the priors is their covariance. Unknowns of different windows meet only in the common ones, so that the matrix is
solved by its Schur complement.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from estimators.track.stiffness_model import SPREAD, Common, Springs, acceleration_over_roughness
from estimators.track.stiffness_windows import INFORMATION, Windows

OWN = 3
"""Unknowns of a window: logarithms of stiffness and of the roughness' level, and its slope."""
CENTRE, WIDE = np.log(80e6), 1.5
"""Prior of the logarithm of the record's usual stiffness: 18 to 360 MN/m hold two thirds, 4 to 1600 MN/m 95 %."""
SPREADS = np.array([0.6, 4.0, 0.7])
"""Prior of a window's own unknowns about the record's: stiffness within a factor of 1.8."""
KNOTS = 3.0
"""Knots of the common shape an octave."""
BEND = 0.3
"""Prior of the second differences of the common shape at its knots: 1.3 dB each third of an octave."""
FALLS, FALLS_STD = -3.5, 0.8
"""Exponent of the roughness' power over the wave number: ISO 3095's limit has -3, ERRI B176 -4."""
LEVEL_STD = 10.0
"""Prior of the common shape's level."""
ROUNDS, FIRST_ROUNDS, OWN_ROUNDS, HALVINGS = 40, 6, 4, 8
LONGEST = 0.7
"""Of a step in the logarithm of the stiffness."""
STARTS = np.log(np.geomspace(20e6, 500e6, 7))
SETTLED = 1e-3
RIGID = 1e15
"""N/m; rails that do not give."""
BANDS = 8
"""Of a window's bins, in which its misfit is judged."""


@dataclass(frozen=True)
class State:
    """Unknowns: `own` (windows, OWN) of each window, the logarithm of the `usual` stiffness, those of what is `common`
    over what is expected, and the `shape` at its knots.
    """

    own: np.ndarray
    usual: float
    common: np.ndarray
    shape: np.ndarray

    def moved(self, own: np.ndarray, others: np.ndarray) -> "State":
        """With these steps, the second one in the order usual, common, shape."""
        n = 1 + len(self.common)
        return State(self.own + own, self.usual + float(others[0]), self.common + others[1:n], self.shape + others[n:])


class Normal(NamedTuple):
    """Fisher's matrix and the gradient of w windows with c other unknowns: usual stiffness, common values, shape.

    Attributes
    ----------
    blocks : of the windows, shape (w, OWN, OWN). between : shape (w, OWN, c). corner : shape (c, c).
    to_own : gradient, shape (w, OWN). to_common : shape (c,).
    """

    blocks: np.ndarray
    between: np.ndarray
    corner: np.ndarray
    to_own: np.ndarray
    to_common: np.ndarray

    def solved(self) -> tuple[np.ndarray, np.ndarray]:
        """Steps of the own unknowns (w, OWN) and of the others (c,)."""
        across = np.linalg.solve(self.blocks, self.between)
        alone = np.linalg.solve(self.blocks, self.to_own[..., None])[..., 0]
        schur = self.corner - np.tensordot(self.between, across, axes=([0, 1], [0, 1]))
        others = np.linalg.solve(schur, self.to_common - np.tensordot(across, self.to_own, axes=([0, 1], [0, 1])))
        return alone - across @ others, others

    def covariance(self) -> np.ndarray:
        """Of the windows' logarithms of stiffness, shape (w, w)."""
        inverse = np.linalg.inv(self.blocks)
        across = inverse @ self.between
        schur = self.corner - np.tensordot(self.between, across, axes=([0, 1], [0, 1]))
        return np.diag(inverse[:, 0, 0]) + across[:, 0] @ np.linalg.solve(schur, across[:, 0].T)


class Likelihood:
    """Of windows, with the vehicle and the track that are expected; `gives`: whether the rails give way at all."""

    def __init__(self, windows: Windows, expected: Common, springs: Springs, gives: bool = True) -> None:
        self.windows, self.expected, self.springs, self.gives = windows, expected, springs, gives
        used = windows.wave_number[windows.used.any(axis=0)]
        low, high = np.log(used[0]), np.log(used[-1])
        self.log_k = np.log(windows.wave_number) - 0.5 * (low + high)
        count = max(3, int(np.ceil(KNOTS * (high - low) / np.log(2.0))) + 1)
        self.knots = np.linspace(low, high, count)
        self.hats = np.stack(
            [np.interp(self.log_k, self.knots - 0.5 * (low + high), one) for one in np.eye(count)], axis=1
        )
        differences = np.diff(np.eye(count), 2, axis=0) / BEND
        ends = (np.eye(count)[-1] - np.eye(count)[0]) / (high - low) / FALLS_STD
        self.smooth = (
            np.full((count, count), (count * LEVEL_STD) ** -2.0) + differences.T @ differences + np.outer(ends, ends)
        )
        self.open = np.array(SPREAD)

    def start(self, log_stiffness: float) -> State:
        """All windows with one stiffness, and roughness of their power."""
        w = self.windows
        count, bins = w.power.shape
        own = np.column_stack([np.full(count, log_stiffness), np.zeros((count, 2))])
        state = State(own, log_stiffness, np.zeros(len(self.open)), np.zeros(self.hats.shape[1]))
        ratio = np.where(w.used, w.power / self.density(state), np.nan)
        some = np.flatnonzero(w.used.any(axis=0))
        level = np.log(np.maximum([np.nanmedian(ratio[:, i]) for i in some], 1e-30))
        return replace(state, shape=np.linalg.lstsq(self.hats[some], level, rcond=None)[0])

    def values(self, common: np.ndarray) -> Common:
        """The common values of logarithms over what is expected."""
        return Common(*(float(one) for one in np.array(self.expected) * np.exp(common)))

    def signal(self, state: State) -> np.ndarray:
        """Density of what roughness makes, (m/s2)^2 m, shape (windows, bins)."""
        stiffness = np.exp(state.own[:, :1]) if self.gives else np.full((len(state.own), 1), RIGID)
        gain = acceleration_over_roughness(self.windows.omega, stiffness, self.values(state.common), self.springs)
        log_roughness = state.own[:, 1:2] + (state.own[:, 2:3] + FALLS) * self.log_k + self.hats @ state.shape
        return self.windows.low_pass * gain * np.exp(np.clip(log_roughness, -90.0, 30.0))

    def density(self, state: State) -> np.ndarray:
        """With the noise."""
        return self.signal(state) + self.values(state.common).noise * self.windows.speed[:, None]

    def mean(self, state: State) -> np.ndarray:
        """Expectation of the windows' power."""
        return self.windows.smeared(self.density(state))

    def by_window(self, state: State) -> np.ndarray:
        """Minus the logarithm of the posterior that each window has by itself, shape (windows,)."""
        w, mean = self.windows, self.mean(state)
        misfit = INFORMATION * np.sum(np.where(w.used, np.log(mean) + w.power / mean, 0.0), axis=1)
        return misfit + 0.5 * np.sum(self._standard(state) ** 2, axis=1)

    def objective(self, state: State) -> float:
        """Minus the logarithm of the posterior."""
        usual = ((state.usual - CENTRE) / WIDE) ** 2
        others = usual + np.sum((state.common / self.open) ** 2) + state.shape @ self.smooth @ state.shape
        return float(np.sum(self.by_window(state)) + 0.5 * others)

    def _standard(self, state: State) -> np.ndarray:
        return (state.own - [state.usual, 0.0, 0.0]) / SPREADS

    def _by_own(self, state: State, signal: np.ndarray) -> np.ndarray:
        """Derivatives of the density by the own unknowns, shape (windows, OWN, bins)."""
        step = 1e-4
        moved = self.signal(replace(state, own=state.own + np.array([step, 0.0, 0.0])))
        return np.stack([(moved - signal) / step, signal, signal * self.log_k], axis=1)

    def _by_common(self, state: State, signal: np.ndarray) -> np.ndarray:
        """Derivatives by the common values and by the shape, shape (windows, c - 1, bins)."""
        step, density = 1e-4, self.density(state)
        values = []
        for i in range(len(self.open)):
            common = state.common.copy()
            common[i] += step
            values.append((self.density(replace(state, common=common)) - density) / step)
        return np.concatenate([np.stack(values, axis=1), signal[:, None, :] * self.hats.T], axis=1)

    def normal(self, state: State) -> Normal:
        """Fisher's matrix and gradient."""
        w, signal, mean = self.windows, self.signal(state), self.mean(state)
        weight = np.where(w.used, INFORMATION, 0.0)
        residual = weight * (w.power / mean - 1.0)
        own = w.smeared(self._by_own(state, signal)) / mean[:, None]
        others = w.smeared(self._by_common(state, signal)) / mean[:, None]
        weighted = own * weight[:, None]
        n, off = 1 + len(self.open), self._standard(state) / SPREADS
        between = np.pad(weighted @ others.transpose(0, 2, 1), ((0, 0), (0, 0), (1, 0)))
        between[:, 0, 0] = -1.0 / SPREADS[0] ** 2
        corner = np.pad(np.sum((others * weight[:, None]) @ others.transpose(0, 2, 1), axis=0), (1, 0))
        corner[0, 0] = len(own) / SPREADS[0] ** 2 + 1.0 / WIDE**2
        corner[1:n, 1:n] += np.diag(1.0 / self.open**2)
        corner[n:, n:] += self.smooth
        to_own = np.sum(own * residual[:, None], axis=2) - off
        to_common = np.pad(np.sum(others * residual[:, None], axis=(0, 2)), (1, 0))
        to_common[0] = np.sum(off[:, 0]) - (state.usual - CENTRE) / WIDE**2
        to_common[1:n] -= state.common / self.open**2
        to_common[n:] -= self.smooth @ state.shape
        blocks = weighted @ own.transpose(0, 2, 1) + np.diag(1.0 / SPREADS**2)
        return Normal(blocks, between, corner, to_own, to_common)

    def climb(self, state: State, rounds: int = ROUNDS) -> State:
        """Fisher scoring, with steps halved while the objective does not fall."""
        value = self.objective(state)
        for _ in range(rounds):
            own, others = self.normal(state).solved()
            share = min(1.0, LONGEST / max(float(np.abs(own[:, 0]).max()), 1e-9))
            for _ in range(HALVINGS):
                moved = state.moved(share * own, share * others)
                new = self.objective(moved)
                if new < value:
                    break
                share *= 0.5
            else:
                return state
            settled = value - new < SETTLED
            state, value = moved, new
            if settled:
                break
        return state

    def elsewhere(self, state: State) -> State:
        """Each window at the one of `STARTS`, or where it is, that fits it best with its own level and slope."""
        w = self.windows
        weight = np.where(w.used, INFORMATION, 0.0)
        best, chosen = self.by_window(state), state.own.copy()
        for start in STARTS:
            own = state.own.copy()
            own[:, 0] = start
            moved = replace(state, own=own)
            for _ in range(OWN_ROUNDS):
                mean = self.mean(moved)
                by = w.smeared(self._by_own(moved, self.signal(moved))) / mean[:, None]
                blocks = (by * weight[:, None]) @ by.transpose(0, 2, 1) + np.diag(1.0 / SPREADS**2)
                to_own = np.sum(by * (weight * (w.power / mean - 1.0))[:, None], axis=2)
                to_own -= self._standard(moved) / SPREADS
                step = np.linalg.solve(blocks, to_own[..., None])[..., 0]
                moved = replace(moved, own=moved.own + np.clip(step, -LONGEST, LONGEST))
            value = self.by_window(moved)
            better = value < best
            best[better], chosen[better] = value[better], moved.own[better]
        return replace(state, own=chosen)

    def fit(self) -> State:
        """The most probable state, from several starts."""
        if not self.gives:
            return self.climb(self.start(CENTRE))
        begun = [self.climb(self.start(one), FIRST_ROUNDS) for one in STARTS]
        return self.climb(self.elsewhere(self.climb(min(begun, key=self.objective))))

    def bends(self, state: State) -> np.ndarray:
        """Second differences of the common shape over what the prior lets expect, one each inner knot."""
        return np.diff(state.shape, 2) / BEND

    def misfit(self, state: State) -> np.ndarray:
        """Chi-square over degrees of freedom of each window: how far bands of its bins lie from what is expected."""
        w, mean = self.windows, self.mean(state)
        found = np.ones(len(mean))
        for i, used in enumerate(w.used):
            parts = [one for one in np.array_split(np.flatnonzero(used), BANDS) if one.size]
            if len(parts) > OWN:
                off = [np.sum(w.power[i, one] / mean[i, one] - 1.0) ** 2 * INFORMATION / one.size for one in parts]
                found[i] = sum(off) / (len(parts) - OWN)
        return found
