"""Condition of the secondary dampers and conicity by a Rao-Blackwellised particle filter.

After Ward et al. (2011), section 4.1, with references [16] to [18] there. A particle is a set of
(C_sy, C_spsi, conicity); given that, the vehicle is linear, and a Kalman filter takes the place of sampling its state
(Doucet, Godsill and Andrieu 2000). Each particle's filter is the steady one of its parameters
(`suspension.filter_bank`).
"""

from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.suspension.base import FilterBank, Problem, Situation, SuspensionEstimator
from estimators.suspension.self_check import check
from estimators.suspension.verdicts import std_name, verdicts
from estimators.vehicle.affine import PARAMETERS
from railsim.measurements import Measurements
from railsim.spec import quantity

PARTS = 12  # in which a stretch of samples is taken at most
BISECTIONS = 12
FEWEST = 5.0  # effective particles below which it is flagged too
DEGENERATE = 0.02  # effective share of the particles below which the estimate is flagged
COLUMNS = ("effective_share [-]", "degenerate [-]", "valid [-]")


class SuspensionRbpf(SuspensionEstimator, frozen=True):
    """Lateral and yaw damping and conicity of a half vehicle, by a particle filter that runs sample by sample.

    Particles in the box of possible parameters are weighted by the likelihood of the readings. At the end of every
    stretch of 1 s (1/8 s at first) the weights are updated, in logarithms. Where the effective sample size falls below
    `resample_below` of the particles they are resampled systematically (Kitagawa 1996), and moved by the kernel of Liu
    and West (2001): theta' = a theta + (1 - a) mean + sqrt(1 - a^2) noise of the sample's covariance, a = (3 discount -
    1) / (2 discount), which keeps mean and variance. A stretch that would leave fewer than `smallest_share` of the
    particles is taken in parts: a power of its likelihood, resampling, the rest (Oudjane and Musso 2000). Between
    stretches every parameter walks at random, and with a small probability one jumps anywhere (a component fails); more
    particles jump than that, at a lower weight. The logarithm of the likelihood is multiplied by the share of
    independent samples.
    """

    particles: int = quantity(1000, unit="-", source="docs/suspension.md: more do not help", ge=10)
    seed: int = quantity(1, unit="-", source="random numbers of the particles", ge=0)
    resample_below: float = quantity(0.5, unit="- of the particles", source="usual", gt=0.0, le=1.0)
    discount: float = quantity(0.98, unit="-", source="Liu and West (2001): 0.95 to 0.99", gt=0.5, lt=1.0)
    walk: float = quantity(0.002, unit="- of the box a root second", source="illustrative", ge=0.0)
    smallest_share: float = quantity(0.2, unit="- of the particles, effective", source="illustrative", gt=0.0, lt=0.5)
    hazard: float = quantity(1e-3, unit="1/s, of a jump", source="illustrative", ge=0.0, lt=0.02)
    jumping: float = quantity(0.03, unit="- of the particles a stretch", source="illustrative", ge=0.0, le=0.5)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Run over the record.

        Raises
        ------
        InputError : a channel, the speed, the track or a parameter of the vehicle is missing.
        """
        problem = self.prepare(measurements)
        cloud = _Cloud(self, problem)
        rows = [cloud.step(first, last) for first, last in problem.stretches]
        names = [name for pair in ((one, std_name(one)) for one in PARAMETERS) for name in pair]
        series = pd.DataFrame(rows, columns=pd.Index(["time [s]", *names, *COLUMNS]))
        return checked(self, problem, series, series, cloud.warnings())


def checked(
    estimator: SuspensionEstimator, problem: Problem, series: pd.DataFrame, of: pd.DataFrame, warnings: list[str]
) -> Estimate:
    """The estimate with verdicts; where the filter's innovations are larger than it expects, it is not valid.

    Parameters
    ----------
    series : of the estimate. of : the same at the end of every stretch, where `series` has other rows.
    """
    found = check(problem, of[list(PARAMETERS)].to_numpy(dtype=float))
    held = found.holds if len(series) == len(found.holds) else found.holds[[0, -1]]
    series = series.assign(**{"valid [-]": series["valid [-]"].to_numpy() * held})
    doubt = found.doubt()
    about = {
        **report(estimator, problem, series, [*warnings, *([f"cannot tell: {doubt}"] if doubt else [])], doubt),
        "misfit over expected": None if np.isnan(found.ratio[-1]) else float(found.ratio[-1]),
    }
    return Estimate(estimator.name, series, about)


def report(
    estimator: SuspensionEstimator, problem: Problem, series: pd.DataFrame, warnings: list[str], doubt: str
) -> dict[str, Any]:
    """What about.json of the estimate holds: settings, verdicts at the end, warnings and what was left out."""
    last = series.iloc[-1]
    mean = last[list(PARAMETERS)].to_numpy(dtype=float)
    std = last[[std_name(name) for name in PARAMETERS]].to_numpy(dtype=float)
    health = problem.record.health
    return {
        **estimator.model_dump(),
        "channels": list(problem.record.channels),
        "verdicts": verdicts(mean, std, problem.nominal, doubt),
        "warnings": [*health.warnings(), *warnings],
        "left_out": health.left_out,
    }


class _Cloud:
    """The particles."""

    def __init__(self, settings: SuspensionRbpf, problem: Problem) -> None:
        self._settings, self._problem = settings, problem
        self._rng = np.random.default_rng(settings.seed)
        count = settings.particles
        strata = np.stack([self._rng.permutation(count) for _ in range(3)], axis=1)
        self._position = (strata + self._rng.random((count, 3))) / count  # in the unit cube
        self._log_weight = np.full(count, -np.log(count))
        self._filters = FilterBank(problem, count)
        self._flagged: list[float] = []
        self._rushed = False

    def step(self, first: int, last: int) -> list[float]:
        """Take a stretch of samples; a row of the series."""
        record, situation = self._problem.record, self._problem.situation(first, last)
        if situation is None:
            self._filters.reset()
        else:
            self._update(situation, first, last)
        weight = np.exp(self._log_weight)
        share = 1.0 / float(np.sum(weight**2)) / len(weight)
        degenerate = share < max(DEGENERATE, FEWEST / len(weight)) or self._rushed
        if degenerate:
            self._flagged.append(float(record.time[last - 1]))
        mean, std = _moments(self._parameters(), weight)
        if situation is not None:
            self._evolve((last - first) / record.rate, share)
        values = [value for pair in zip(mean, std, strict=True) for value in pair]
        return [float(record.time[last - 1]), *values, share, float(degenerate), float(situation is not None)]

    def warnings(self) -> list[str]:
        """One line where the weights degenerated."""
        if not self._flagged:
            return []
        first, last = self._flagged[0], self._flagged[-1]
        return [
            f"too few of the particles carried the weight at {len(self._flagged)} times between {first:.1f} and "
            f"{last:.1f} s (column 'degenerate [-]'); the standard deviations are too small there"
        ]

    def _parameters(self) -> np.ndarray:
        return self._problem.low + self._position * (self._problem.high - self._problem.low)

    def _update(self, situation: Situation, first: int, last: int) -> None:
        """Weights by a stretch of samples: in several parts where it tells so much that few particles would be left."""
        before, left, self._rushed = self._filters.state.copy(), 1.0, False
        for part in range(PARTS):
            packed = self._problem.table(situation).at(self._parameters())
            log_likelihood = self._filters.run(
                situation, self._problem.system(situation)[3], packed, first, last, again=part > 0
            )
            log_likelihood = np.where(np.isfinite(log_likelihood), log_likelihood, -np.inf) * self._problem.trust
            share = _largest_share(self._log_weight, log_likelihood, left, self._settings.smallest_share)
            self._rushed = share < left and part == PARTS - 1
            self._weigh(
                (left if self._rushed else share) * np.where(np.isfinite(log_likelihood), log_likelihood, -1e300)
            )
            left -= share
            if left <= 0.0 or self._rushed:
                return
            self._filters.state = before
            self._resample()
            before = self._filters.state.copy()
            self._position = _folded(self._position)

    def _weigh(self, log_likelihood: np.ndarray) -> None:
        total = self._log_weight + log_likelihood
        if not np.isfinite(total).any():
            total = np.zeros(len(total))
        total = total - total.max()
        self._log_weight = total - np.log(np.sum(np.exp(total)))

    def _evolve(self, seconds: float, share: float) -> None:
        settings, count = self._settings, len(self._position)
        if share < settings.resample_below:
            self._resample()
        self._position = self._position + settings.walk * np.sqrt(seconds) * self._rng.standard_normal((count, 3))
        jumping = self._rng.random(count) < settings.jumping
        chosen = self._rng.integers(3, size=count)
        anywhere = self._rng.random(count)
        if settings.hazard > 0.0 and settings.jumping > 0.0:
            self._position[jumping, chosen[jumping]] = anywhere[jumping]
            odds = settings.hazard * seconds
            self._log_weight += np.where(
                jumping, np.log(odds / settings.jumping), np.log((1.0 - odds) / (1.0 - settings.jumping))
            )
            self._weigh(np.zeros(count))
        self._position = _folded(self._position)

    def _resample(self) -> None:
        count, weight = len(self._position), np.exp(self._log_weight)
        mean = weight @ self._position
        spread = (self._position - mean).T @ ((self._position - mean) * weight[:, None])
        points = (self._rng.random() + np.arange(count)) / count
        ancestors = np.minimum(np.searchsorted(np.cumsum(weight), points), count - 1)
        self._filters.select(ancestors)
        keep = (3.0 * self._settings.discount - 1.0) / (2.0 * self._settings.discount)
        root = np.linalg.cholesky(spread + 1e-12 * np.eye(3))
        noise = self._rng.standard_normal((count, 3)) @ root.T
        self._position = keep * self._position[ancestors] + (1.0 - keep) * mean + np.sqrt(1.0 - keep**2) * noise
        self._log_weight = np.full(count, -np.log(count))


def _largest_share(log_weight: np.ndarray, log_likelihood: np.ndarray, left: float, least: float) -> float:
    """Largest share of `log_likelihood`, at most `left`, that leaves an effective share of `least` of the particles."""

    def effective(share: float) -> float:
        total = log_weight + share * np.where(np.isfinite(log_likelihood), log_likelihood, -1e300)
        weight = np.exp(total - total.max())
        return float(weight.sum() ** 2 / np.sum(weight**2) / len(weight))

    if effective(left) >= least:
        return left
    low, high = 0.0, left
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if effective(middle) >= least else (low, middle)
    return low


def _moments(values: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    mean = weight @ values
    return mean, np.sqrt(weight @ (values - mean) ** 2)


def _folded(position: np.ndarray) -> np.ndarray:
    """Back into the unit cube, as by mirrors at its walls."""
    return 1.0 - np.abs(1.0 - np.mod(position, 2.0))
