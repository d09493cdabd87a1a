"""Levels of the track's spectra, sizes of what disturbs, and parameters of the vehicle, by Whittle's likelihood (1953).

With Y the readings' Fourier coefficients at wavenumber W, their covariance S is a sum of spectra,

    S(x) = N + sum over c of exp(a_c x) P_c(u),   -log L = sum over W of log det S + Y' S^-1 Y,

N the sensors' noise, x the logarithms of all that is sought, u those among them that change the responses of the
vehicle. The largest posterior is found by Fisher scoring with Levenberg's damping (Green 1984, section 2): the slope of
-log L by x_i is tr(S^-1 S_i (1 - S^-1 Y Y')), its expected curvature tr(S^-1 S_i S^-1 S_j). Neighbouring wavenumbers
share one S. A Hann window makes neighbouring coefficients alike, so that `HANN` of them count as one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import get_window

from estimators.signals.bands import Band, stretches
from estimators.signals.windows import HANN
from estimators.speed.odometry import Odometry
from estimators.track.observations import Observation

FITTED = (2.5, 60.0)  # m; wavelengths that are looked at
CLASS = 0.2  # of the logarithm of the speed: places of like speed are looked at together
EVEN = 40.0  # m, over which the speed is averaged
MOST = 3  # classes of speed that are looked at, those with the most places
SHORTEST = 256  # steps of the grid
BINS = 60  # equal in the logarithm of the wavenumber
STEP = 1e-5  # of the logarithm of a parameter, for the slope of the spectra
FIRST, ROUNDS = 6, 40  # steps of scoring from every start, and from the best of them at most
ENOUGH = 0.02  # expected gain of the logarithm of the posterior that is no more
NEAR = 0.05  # change of the parameters' logarithms within which slopes of the spectra are kept
DAMPING = (1e-3, 1e8)  # Levenberg's factor: first, last


class Spectra(NamedTuple):
    """Averaged cross periodograms of the readings in bins.

    Attributes
    ----------
    wavenumber : rad/m, shape (b,). number : coefficients in each bin, shape (b,).
    density : one-sided, shape (b, m, m).
    classes : of the speed: each with its speed in m/s and its bins.
    """

    wavenumber: np.ndarray
    number: np.ndarray
    density: np.ndarray
    classes: tuple[tuple[float, slice], ...]


@dataclass(frozen=True)
class Problem:
    """What is sought, and the spectra that it makes.

    Attributes
    ----------
    seen : of the readings.
    noise : N, shape (b, m, m).
    exponents : a_c of each part, shape (c, x).
    parts : from u to P_c, shape (c, b, m, m).
    responding : how many of x, the last ones, are u.
    mean, spread : of x before anything was measured, shape (x,); an infinite spread for what is not known at all, 0 for
        what is fixed. Levels and sizes are Gaussian. The parameters u have Cauchy's distribution of that scale: most
        vehicles are as their data sheets say, some are far from it.
    low, high : bounds of x.
    """

    seen: Spectra
    noise: np.ndarray
    exponents: np.ndarray
    parts: Callable[[np.ndarray], np.ndarray]
    responding: int
    mean: np.ndarray
    spread: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def prior(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Minus the logarithm of the prior, its slope, and its curvature, or that of a parabola about it: Cauchy's
        prior for u has none of its own far out (Dempster, Laird and Rubin 1980).
        """
        known = (self.spread > 0.0) & np.isfinite(self.spread)
        scale = np.where(known, self.spread, 1.0)
        off = np.where(known, (x - self.mean) / scale, 0.0)
        heavy = np.arange(len(x)) >= len(x) - self.responding
        weight = np.where(heavy, 2.0 / (1.0 + off**2), 1.0) * known
        cost = np.sum(np.where(heavy, np.log1p(off**2), 0.5 * off**2))
        return float(cost), weight * off / scale, weight / scale**2

    @property
    def free(self) -> np.ndarray:
        """What is sought, shape (x,)."""
        return self.spread > 0.0

    def spectrum(self, x: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """S, shape (b, m, m)."""
        return np.einsum("c,cbml->bml", np.exp(self.exponents @ x), parts) + self.noise

    def cost(self, x: np.ndarray, parts: np.ndarray) -> float:
        """Minus the logarithm of the posterior."""
        S, size = _unit(self.spectrum(x, parts))
        misfit = np.einsum("bml,blm->b", np.linalg.inv(S), self.seen.density / size).real
        logs = np.linalg.slogdet(S)[1] + np.log(np.einsum("bmm->bm", size).real).sum(axis=1)
        return float(np.sum(self.seen.number * (logs + misfit)) / HANN) + self.prior(x)[0]

    def changes(self, u: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """Slopes of the parts by each of u, shape (u, c, b, m, m)."""
        return np.array([(self.parts(u + step) - parts) / STEP for step in STEP * np.eye(len(u))])

    def slopes(self, x: np.ndarray, parts: np.ndarray, changes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient of the cost, shape (x,), and its expected curvature, shape (x, x)."""
        S, size = _unit(self.spectrum(x, parts))
        factors = np.exp(self.exponents @ x)
        shape = parts.shape[1:]
        by = ((self.exponents * factors[:, None]).T @ parts.reshape(len(parts), -1)).reshape(-1, *shape)
        if self.responding:
            by[-self.responding :] += (factors @ changes.reshape(len(changes), len(factors), -1)).reshape(-1, *shape)
        inverse = np.linalg.inv(S)
        weighed = inverse @ (by / size)
        left = np.eye(S.shape[1]) - inverse @ (self.seen.density / size)
        number = self.seen.number / HANN
        gradient = np.einsum("xbml,blm,b->x", weighed, left, number, optimize=True).real
        pairs = weighed * np.sqrt(number)[:, None, None]
        curvature = (pairs.reshape(len(x), -1) @ np.swapaxes(pairs, 2, 3).reshape(len(x), -1).T).real
        _, slope, weight = self.prior(x)
        return gradient + slope, curvature + np.diag(weight)


class Fit(NamedTuple):
    """The largest posterior.

    Attributes
    ----------
    x : shape (x,). covariance : by the expected curvature, shape (x, x), 0 for what is fixed or at a bound.
    cost : minus the logarithm of the posterior. misfit : Y' S^-1 Y over what is expected in each bin, shape (b,).
    """

    x: np.ndarray
    covariance: np.ndarray
    cost: float
    misfit: np.ndarray


def fit(problem: Problem, starts: Sequence[np.ndarray]) -> Fit:
    """The largest posterior: a few steps from each start, then on from the best of them."""
    searches = [_Scoring(problem, start) for start in starts]
    for search in searches:
        search.run(FIRST if len(searches) > 1 else ROUNDS)
    best = min(searches, key=lambda one: one.cost)
    best.run(ROUNDS)
    return best.found()


class _Scoring:
    """Fisher scoring from one start."""

    def __init__(self, problem: Problem, start: np.ndarray) -> None:
        self.problem, self.fixed = problem, len(start) - problem.responding
        self.x = np.clip(start, problem.low, problem.high)
        self.parts, self.damping = problem.parts(self.x[self.fixed :]), DAMPING[0]
        self.cost = problem.cost(self.x, self.parts)
        self._differentiate()
        self.gradient, self.curvature = problem.slopes(self.x, self.parts, self._changes)

    def run(self, rounds: int) -> None:
        """Go on until little is left to gain."""
        for _ in range(rounds):
            free = np.flatnonzero(self._free())
            inner = self.curvature[np.ix_(free, free)]
            diagonal, gradient = np.diag(np.diag(inner)), self.gradient[free]
            settled = 0.5 * gradient @ np.linalg.solve(inner + 1e-12 * diagonal, gradient) < ENOUGH
            moved = np.abs(self.x[self.fixed :] - self._at).max(initial=0.0)
            if settled or not self._stepped(free, inner, diagonal):
                if moved == 0.0:
                    return
                moved = np.inf  # by slopes of another place; what is weakly known needs its own
            if moved > NEAR:
                self._differentiate()
            self.gradient, self.curvature = self.problem.slopes(self.x, self.parts, self._changes)

    def _differentiate(self) -> None:
        self._at = self.x[self.fixed :].copy()
        self._changes = self.problem.changes(self._at, self.parts)

    def _free(self) -> np.ndarray:
        low, high = self.x <= self.problem.low, self.x >= self.problem.high
        return self.problem.free & ~(low & (self.gradient > 0.0)) & ~(high & (self.gradient < 0.0))

    def _stepped(self, free: np.ndarray, inner: np.ndarray, diagonal: np.ndarray) -> bool:
        """Whether a step was found that lowers the cost."""
        while self.damping < DAMPING[1]:
            x = self.x.copy()
            x[free] -= np.linalg.solve(inner + self.damping * diagonal, self.gradient[free])
            x = np.clip(x, self.problem.low, self.problem.high)
            parts = self.problem.parts(x[self.fixed :])
            cost = self.problem.cost(x, parts)
            if cost < self.cost:
                self.x, self.parts, self.cost, self.damping = x, parts, cost, max(0.1 * self.damping, 1e-6)
                return True
            self.damping *= 10.0
        return False

    def found(self) -> Fit:
        """Where it stands."""
        problem, covariance = self.problem, np.zeros_like(self.curvature)
        inside = np.flatnonzero(problem.free & (self.x > problem.low) & (self.x < problem.high))
        covariance[np.ix_(inside, inside)] = np.linalg.pinv(self.curvature[np.ix_(inside, inside)])
        S, size = _unit(problem.spectrum(self.x, self.parts))
        misfit = np.einsum("bml,blm->b", np.linalg.inv(S), problem.seen.density / size).real / S.shape[1]
        return Fit(self.x, covariance, self.cost, misfit)


def _unit(S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """S for readings of variance 1, and what it was divided by; shapes (b, m, m)."""
    size = np.sqrt(np.einsum("bmm->bm", S).real)
    both = size[:, :, None] * size[:, None, :]
    return S / both, both


def chi_square(seen: Spectra, found: Fit, band: Band) -> tuple[float, float]:
    """Mean misfit in a band, 1 where the model is right, and its distance from 1 in standard deviations.

    The sum over n independent coefficients of m readings is half of a chi-square of 2 n m degrees of freedom.
    """
    length = 2.0 * np.pi / seen.wavenumber
    inside = (length > band.shortest) & (length < band.longest)
    number = float(seen.number[inside].sum())
    mean = float(np.sum(seen.number[inside] * found.misfit[inside]) / number)
    return mean, (mean - 1.0) * float(np.sqrt(seen.density.shape[1] * number / HANN))


def spectra(observations: Sequence[Observation], odometry: Odometry, where: np.ndarray) -> Spectra | None:
    """Of all stretches that all readings have, by classes of speed; None where each is too short."""
    values = np.stack([one.values for one in observations], axis=1)
    known = where & odometry.valid & np.isfinite(values).all(axis=1)
    speed = even_speed(odometry)
    usual = np.median(speed[known]) if known.any() else 1.0
    number = np.round(np.log(speed / usual) / CLASS).astype(int)
    found = []
    for one in np.unique(number[known]):
        pieces = [slice(*ends) for ends in stretches(known & (number == one)) if ends[1] - ends[0] >= SHORTEST]
        if pieces:
            found.append(_of_class(observations, values, odometry, pieces))
    if not found:
        return None
    found = sorted(found, key=lambda one: -one[1].sum())[:MOST]
    ends = np.cumsum([0, *(len(one[1]) for one in found)])
    classes = tuple((one[0], slice(int(a), int(b))) for one, a, b in zip(found, ends[:-1], ends[1:], strict=True))
    number, wavenumber, density = (np.concatenate([one[part] for one in found]) for part in (1, 2, 3))
    return Spectra(wavenumber, number, density, classes)


def even_speed(odometry: Odometry) -> np.ndarray:
    """Speed without the noise of its sensor, mean over `EVEN`, m/s, shape (n,)."""
    count = max(1, round(EVEN / odometry.spacing))
    return np.sqrt(uniform_filter1d(odometry.speed**2, count, mode="nearest"))


def _of_class(
    observations: Sequence[Observation], values: np.ndarray, odometry: Odometry, pieces: Sequence[slice]
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Mean speed, and number, wavenumber and density of the bins; readings are scaled to that speed."""
    speed = float(np.mean(np.concatenate([odometry.speed[piece] for piece in pieces])))
    power = np.array([1 if one.output.kind == "rate" else 2 for one in observations])
    edges = np.geomspace(2 * np.pi / FITTED[1], 2 * np.pi / FITTED[0], BINS + 1)
    count, middle = np.zeros(BINS), np.zeros(BINS)
    density = np.zeros((BINS, values.shape[1], values.shape[1]), dtype=complex)
    for piece in pieces:
        scaled = values[piece] * (speed / odometry.speed[piece])[:, None] ** power
        window = np.asarray(get_window("hann", len(scaled)))
        spectrum = np.fft.rfft((scaled - scaled.mean(axis=0)) * window[:, None], axis=0)
        k = 2 * np.pi * np.fft.rfftfreq(len(scaled), odometry.spacing)
        bin_of = np.searchsorted(edges, k) - 1
        inside = (bin_of >= 0) & (bin_of < BINS)
        spectrum = spectrum[inside] * np.sqrt(odometry.spacing / np.sum(window**2) / np.pi)
        np.add.at(count, bin_of[inside], 1.0)
        np.add.at(middle, bin_of[inside], k[inside])
        np.add.at(density, bin_of[inside], np.einsum("km,kl->kml", spectrum, spectrum.conj()))
    used = count > 0.0
    return speed, count[used], middle[used] / count[used], density[used] / count[used, None, None]
