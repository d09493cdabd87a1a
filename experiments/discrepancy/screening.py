"""Screening: which effects, at a finite size and with the nuisances free to follow, take most of the residual away.

Three statistics, whose best are taken together: the gain of a finite signature, the gain of the smallest one (the
score at the fit of the nuisances alone), and the likeness of the residual's spectrum to the effect's.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.candidates import Candidate
from experiments.discrepancy.fitting import WEIGHT, Fit, Problem, at_bound, normal_equations
from experiments.discrepancy.parallel import in_parallel
from railsim.effects.interface import Effect
from railsim.errors import InputError

RANGE = (0.3, 2.5)  # of the signature's size that may be scaled linearly
HORIZON = 21.0  # s that a signature of what acts all along is run
PROMISING = 12  # effects of which all sizes are run
DROPPED = 3  # sections whose gain does not count
SHORTLIST = (4, 3, 2)  # effects that each statistic contributes


@dataclass(frozen=True)
class Screened:
    """One signature against the residual.

    Attributes
    ----------
    gain : of the logarithm of the posterior on training frames [nats]. robust : without its best sections.
    likeness : cosine between the spectra of residual and signature. detect : gain expected if it were there [nats].
    """

    candidate: Candidate
    values: dict[str, float]
    effect: Effect
    scale: float
    gain: float
    robust: float
    likeness: float
    detect: float


@dataclass(frozen=True)
class Projection:
    """Nuisances marginalised over some frames: J, with their prior; those at their bounds stay there.

    Attributes
    ----------
    frames : (k,) mask. flat : (free nuisances, n). inverse : (J J^T + 1)^-1. residual : (n,). z : (free nuisances,).
    """

    frames: np.ndarray
    flat: np.ndarray
    inverse: np.ndarray
    residual: np.ndarray
    z: np.ndarray

    @classmethod
    def of(cls, fit: Fit, frames: np.ndarray) -> "Projection":
        """At a fit of the nuisances."""
        free = ~at_bound(fit.z)
        jacobian = fit.jacobian[free]
        normal, _ = normal_equations(jacobian, fit.residual, frames)
        flat = (WEIGHT * jacobian[:, frames]).reshape(len(jacobian), -1)
        residual = (WEIGHT * fit.residual[frames]).ravel()
        return cls(frames, flat, np.linalg.inv(normal + np.eye(len(normal))), residual, fit.z[free])

    def follow(self, signature: np.ndarray) -> np.ndarray:
        """How far the nuisances go to take a signature (n,), in standard deviations of their priors."""
        return self.inverse @ (self.flat @ signature)

    def cleaned(self, signature: np.ndarray) -> np.ndarray:
        """What of a signature the nuisances cannot take, (n,)."""
        return signature - self.follow(signature) @ self.flat


def screen(
    problem: Problem, fit: Fit, found: Sequence[Candidate], tell: Callable[[str], None] = lambda text: None
) -> list[Screened]:
    """All candidates, the best size of each, best first.

    Every variant is run at its middle size; the effects that do best then also at the others.
    """
    run = _Signatures(problem, fit)
    first = [(one, place) for one in _first_looks(found) for place in one.variants_of(next(iter(one.sizes())))]
    tell(f"signatures of {len({one.name for one in found})} effects, {len(first)} runs")
    judged = run.judge(first)
    best = _best(judged)
    promising: list[Screened] = []
    for one in best:
        if one.candidate.name not in [other.candidate.name for other in promising]:
            promising.append(one)
    more = [
        (one.candidate, {**one.values, **_sizes_only(one.candidate, values)})
        for one in promising[:PROMISING]
        for values in list(one.candidate.sizes())[1:]
    ]
    more += [
        (other, {**one.values})
        for one in promising[:PROMISING]
        if one.candidate.phases
        for other in found
        if other.name == one.candidate.name and other.label != one.candidate.label
    ]
    tell(f"other sizes of the {min(PROMISING, len(promising))} best, {len(more)} runs")
    return _best([*judged, *run.judge(more)])


def _first_looks(found: Sequence[Candidate]) -> list[Candidate]:
    """All candidates, but of what turns with one wheel only the first: where it promises nothing, others will not."""
    seen: set[str] = set()
    chosen = []
    for one in found:
        if not one.phases or one.name not in seen:
            chosen.append(one)
        seen.add(one.name)
    return chosen


def _sizes_only(candidate: Candidate, values: dict[str, float]) -> dict[str, float]:
    free = candidate.parameters
    return {name: value for name, value in values.items() if free[name].absent is not None}


def _best(judged: Sequence[Screened]) -> list[Screened]:
    """The best of each variant, best first."""
    best: dict[str, Screened] = {}
    for one in judged:
        if one.candidate.label not in best or one.robust > best[one.candidate.label].robust:
            best[one.candidate.label] = one
    return sorted(best.values(), key=lambda one: -one.robust)


class _Signatures:
    """Runs effects at the fit of the nuisances and holds their signatures against its residual."""

    def __init__(self, problem: Problem, fit: Fit) -> None:
        self._problem, self._fit = problem, fit
        self._whole = Projection.of(fit, problem.train)
        early = problem.frames.starts + problem.frames.length <= HORIZON
        self._early = Projection.of(fit, problem.train & early)
        self._base = problem.stacked(fit.prediction)
        _, self._truth = problem.forward.run(fit.z, fit.effects)
        self._short = problem.forward.but(until=HORIZON)

    def judge(self, jobs: Sequence[tuple[Candidate, dict[str, float]]]) -> list[Screened]:
        return [one for one in in_parallel(self._attempt, jobs) if one is not None]

    def _attempt(self, job: tuple[Candidate, dict[str, float]]) -> Screened | None:
        candidate, values = job
        z = self._fit.z
        forward = self._problem.forward if candidate.local else self._short
        try:
            effect = candidate.build(values)
            effects = (*self._fit.effects, effect)
            if candidate.of_sensor:
                prediction = forward.observe(forward.setup(z, effects), self._truth, z)
            else:
                prediction = forward.predict(z, effects)
        except InputError:
            return None
        whole = {name: _continued(one, self._fit.prediction[name]) for name, one in prediction.items()}
        signature = self._problem.whitened(self._problem.stacked(whole) - self._base)
        if not np.isfinite(signature).all() or not signature.any():
            return None
        projection = self._whole if candidate.local or candidate.of_sensor else self._early
        return _judge(self._problem, self._fit, projection, candidate, values, effect, signature)


def _continued(values: np.ndarray, base: np.ndarray) -> np.ndarray:
    """A prediction that ends early goes on as without the effect: what it says there is not counted."""
    return np.concatenate([values, base[len(values) :]])


def _judge(
    problem: Problem,
    fit: Fit,
    projection: Projection,
    candidate: Candidate,
    values: dict[str, float],
    effect: Effect,
    signature: np.ndarray,
) -> Screened:
    own = (WEIGHT * signature[projection.frames]).ravel()
    follow = projection.follow(own)
    cleaned = own - follow @ projection.flat
    numerator = float(cleaned @ projection.residual + follow @ projection.z)
    power = float(cleaned @ own) + 1e-12
    scale = float(np.clip(numerator / power, *RANGE))
    gain = scale * numerator - 0.5 * scale**2 * power
    per_frame = (scale * cleaned * (projection.residual - 0.5 * scale * cleaned)).reshape(projection.frames.sum(), -1)
    best = np.sort(per_frame.sum(axis=1))[::-1][:DROPPED]
    robust = gain - float(np.clip(best, 0.0, None).sum())
    return Screened(
        candidate, values, effect, scale, gain, robust, _likeness(problem, fit.residual, signature), 0.5 * power
    )


def _likeness(problem: Problem, residual: np.ndarray, signature: np.ndarray) -> float:
    """Cosine of the excess spectra by channel and frequency."""
    excess = np.clip((residual[problem.train] ** 2).mean(axis=0) - 1.0, 0.0, None)
    own = (signature[problem.train] ** 2).mean(axis=0)
    size = float(np.linalg.norm(excess) * np.linalg.norm(own))
    return float(np.sum(excess * own)) / size if size > 0.0 else 0.0


def shortlist(screened: Sequence[Screened]) -> list[Screened]:
    """The best by each statistic together; one variant of an effect counts once a statistic."""
    orders = (
        sorted(screened, key=lambda one: -one.robust),
        sorted(screened, key=lambda one: -one.gain),
        sorted((one for one in screened if one.gain > 0.0), key=lambda one: -one.likeness),
    )
    chosen: dict[str, Screened] = {}
    for order, count in zip(orders, SHORTLIST, strict=True):
        names: list[str] = []
        for one in order:
            if one.candidate.name not in names and len(names) < count:
                names.append(one.candidate.name)
                chosen.setdefault(one.candidate.label, one)
    return sorted(chosen.values(), key=lambda one: -one.robust)
