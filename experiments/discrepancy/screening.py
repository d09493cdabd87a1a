"""Screening: which effects, at a finite size and with the nuisances free to follow, take most of the residual away.

Three statistics, whose best are taken together: the gain of a finite signature without its best sections, its whole
gain, and the likeness of the residual's spectrum to the effect's. Signatures come from the bank; those of effects
with a place or a time of their own are run for this recording.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.candidates import DISTANCES, Candidate
from experiments.discrepancy.fitting import WEIGHT, Fit, Problem, normal_equations
from experiments.discrepancy.parallel import in_parallel
from experiments.discrepancy.scores import TOLERATED, Shares, at_bound, logarithmic
from railsim.errors import InputError

RANGE = (0.3, 2.5)  # of the signature's size that may be scaled linearly
PHASES_TRIED = 24
PLACES_TRIED = np.arange(-7.5, 7.6, 0.25)  # m
DROPPED = 3  # sections whose gain does not count
SHORTLIST = (5, 4, 2)  # effects that each statistic contributes


@dataclass(frozen=True)
class Screened:
    """One signature against the residual.

    Attributes
    ----------
    tried : the numbers that were run. values : the same, scaled as it fits best. z : where the nuisances go with it.
    gain : of the logarithm of the posterior on training frames [nats]. robust : without its best sections. likeness :
    cosine between the spectra of residual and signature. size, detect : distance of the first number from absence,
    and the gain that is expected of it there [nats].
    """

    candidate: Candidate
    tried: dict[str, float]
    values: dict[str, float]
    z: np.ndarray
    gain: float
    robust: float
    likeness: float
    size: float
    detect: float


class Projection:
    """Linear model of all that is fitted so far, over some frames: what of a signature it cannot take.

    Numbers at the edge of their tolerance are held there, or come back if the signature lets them.
    """

    def __init__(self, fit: Fit, frames: np.ndarray) -> None:
        shares = Shares(fit.candidates)
        normal, gradient = normal_equations(fit.jacobian, fit.residual, frames)
        matrix, downhill, self.at = shares.scaled(normal, gradient, fit.z, fit.shares)
        n, m = len(fit.z), len(fit.shares)
        scale = np.concatenate([np.ones(n), np.full(m, 0.5 / TOLERATED)]).astype(np.float32)
        flat = (np.float32(WEIGHT) * fit.jacobian[:, frames]).reshape(n + m, -1)
        self.flat = flat * scale[:, None]
        self.frames = frames
        self.residual = (WEIGHT * fit.residual[frames]).astype(np.float32).ravel()
        self.bound = at_bound(self.at)
        self._sets: list[tuple[np.ndarray, np.ndarray, float]] = []
        for held in [self.bound, np.zeros_like(self.bound)] if self.bound.any() else [self.bound]:
            inverse = np.zeros_like(matrix)
            free = np.flatnonzero(~held)
            inverse[np.ix_(free, free)] = np.linalg.inv(matrix[np.ix_(free, free)])
            own = (inverse @ downhill).astype(np.float32)
            self._sets.append((inverse.astype(np.float32), own, 0.5 * float(downhill @ own)))

    def cleaned(self, signature: np.ndarray) -> np.ndarray:
        """What of a signature (n,) the numbers cannot take."""
        return signature - (self._sets[0][0] @ (self.flat @ signature)) @ self.flat

    def judge(self, signatures: np.ndarray) -> "Judgement":
        """The best of some signatures (p, n), scaled as it is best, the numbers following.

        With d = J r - x / std^2, M = J J^T + 1 / std^2: gain(a) = d M^-1 d / 2 + a s (r - J^T M^-1 d) - a^2 (s s - s
        J^T M^-1 J s) / 2; what the numbers could gain by themselves is no gain.
        """
        along = (self.flat @ signatures.T).T
        across = signatures @ self.residual
        size = np.einsum("pn,pn->p", signatures, signatures)
        best = (-np.inf, 0, 1.0, np.zeros(0), 0.0)
        for inverse, own, relief in self._sets:
            follow = along @ inverse
            power = np.maximum(size - np.einsum("pi,pi->p", along, follow), 1e-9)
            slope = across - along @ own
            scale = np.clip(slope / power, *RANGE)
            gain = relief - self._sets[0][2] + scale * slope - 0.5 * scale**2 * power
            move = own - scale[:, None] * follow
            gain[(self.bound & (move * self.at > 1e-9)).any(axis=1)] = -np.inf
            top = int(np.argmax(gain))
            if gain[top] > best[0]:
                best = float(gain[top]), top, float(scale[top]), move[top], float(power[top])
        gain, which, factor, moved, left = best
        taken = np.float32(factor) * signatures[which] + moved.astype(np.float32) @ self.flat
        return Judgement(which, factor, gain, moved, taken, left)


@dataclass(frozen=True)
class Judgement:
    """Which signature at which scale, gain [nats], move of the numbers, what leaves the residual (n,), power left."""

    which: int
    scale: float
    gain: float
    move: np.ndarray
    taken: np.ndarray
    power: float


def screen(
    problem: Problem, fit: Fit, found: Sequence[Candidate], tell: Callable[[str], None] = lambda text: None
) -> list[Screened]:
    """All candidates at all of their sizes (of what turns with a wheel at the best phase).

    Raises
    ------
    InputError : the nominal model does not run.
    """
    if problem.bank is None:
        raise ValueError("give the problem a bank first")
    projection = Projection(fit, problem.train)
    banked = [(one, values) for one in found if not one.local for values in one.sizes()]
    problem.bank.fill(banked, tell)
    judged = []
    for one, values in banked:
        signature = problem.bank.signature(one, values)
        if signature is not None:
            turned = list(_turned(problem, one, values, signature))
            judged.append(_judge(problem, fit, projection, one, turned))
    return judged + _local(problem, fit, projection, [one for one in found if one.local])


def _turned(
    problem: Problem, candidate: Candidate, values: dict[str, float], signature: np.ndarray
) -> Iterator[tuple[dict[str, float], np.ndarray]]:
    """The signature; of what turns with a wheel at all phases, of what is short at places around it."""
    forward = problem.forward
    speed = forward.alignment.scale * np.interp(problem.frames.middles, *forward.evidence.speed[:2])
    if candidate.phases:
        name, aside = (
            candidate.phases[0],
            2.0 * np.pi * np.arange(PHASES_TRIED) / PHASES_TRIED - values[candidate.phases[0]],
        )
        metres = float(getattr(forward.evidence.scenario.vehicle, "wheel_radius", 0.5))
    elif candidate.short:
        name, aside, metres = next(one for one in DISTANCES if one in values), PLACES_TRIED, 1.0
    else:
        yield values, signature
        return
    free = candidate.parameters[name]
    for change in aside:
        late = change * metres / speed
        phase = np.exp(-2j * np.pi * problem.frames.frequencies * late[:, None])
        at = float(np.clip(values[name] + change, free.low, free.high))
        yield {**values, name: at}, signature * phase[..., None].astype(np.complex64)


def _local(problem: Problem, fit: Fit, projection: Projection, found: Sequence[Candidate]) -> list[Screened]:
    """What has a place or a time: run at its middle size where the residual is loud, then there at its other sizes."""

    def run(job: tuple[Candidate, dict[str, float]]) -> Screened | None:
        one, values = job
        try:
            prediction = problem.forward.predict(fit.z, (*fit.effects, one.build(values)))
        except InputError:
            return None
        change = problem.stacked(prediction) - fit.stacked
        if not np.isfinite(change).all():
            return None
        return _judge(problem, fit, projection, one, list(_turned(problem, one, values, change)))

    first = [(one, values) for one in found for values in one.variants_of(next(iter(one.sizes())))]
    judged = [one for one in in_parallel(run, first) if one is not None]
    best = {one.candidate.label: one for one in sorted(judged, key=lambda one: one.robust)}
    more = []
    for one in best.values():
        if one.gain > 0.0:
            free = one.candidate.parameters
            where = {name: value for name, value in one.tried.items() if free[name].absent is None}
            more += [(one.candidate, {**values, **where}) for values in list(one.candidate.sizes())[1:]]
    return judged + [one for one in in_parallel(run, more) if one is not None]


def best_of(screened: Sequence[Screened]) -> list[Screened]:
    """The best size of each variant, best first."""
    best: dict[str, Screened] = {}
    for one in screened:
        if one.candidate.label not in best or one.robust > best[one.candidate.label].robust:
            best[one.candidate.label] = one
    return sorted(best.values(), key=lambda one: -one.robust)


def _judge(
    problem: Problem,
    fit: Fit,
    projection: Projection,
    candidate: Candidate,
    turned: Sequence[tuple[dict[str, float], np.ndarray]],
) -> Screened:
    """The best of the phases of one size."""
    signatures = [problem.whitened(change).astype(np.float32) for _, change in turned]
    rows = np.stack([(np.float32(WEIGHT) * one[projection.frames]).ravel() for one in signatures])
    found = projection.judge(rows)
    values, signature = turned[found.which][0], signatures[found.which]
    left = projection.residual - found.taken
    frames = 0.5 * (projection.residual**2 - left**2).reshape(int(projection.frames.sum()), -1).sum(axis=1)
    loudest = np.sort(frames)[::-1][:DROPPED]
    robust = found.gain - (0.0 if candidate.speaks_in_places else float(np.clip(loudest, 0.0, None).sum()))
    n = len(fit.z)
    return Screened(
        candidate,
        values,
        _scaled(candidate, values, found.scale),
        np.clip(fit.z + found.move[:n], -TOLERATED, TOLERATED),
        found.gain,
        robust,
        _likeness(problem, fit.residual, signature),
        _size(candidate, values),
        0.5 * found.power,
    )


def _scaled(candidate: Candidate, values: dict[str, float], scale: float) -> dict[str, float]:
    """The numbers that say how large it is, by a factor from where they say that it is absent."""
    moved = dict(values)
    for name, one in candidate.parameters.items():
        if one.absent is not None and not logarithmic(name, one):
            moved[name] = float(np.clip(one.absent + scale * (values[name] - one.absent), one.low, one.high))
    return moved


def _size(candidate: Candidate, values: dict[str, float]) -> float:
    sized = [(name, one.absent) for name, one in candidate.parameters.items() if one.absent is not None]
    return values[sized[0][0]] - sized[0][1] if sized else 0.0


def _likeness(problem: Problem, residual: np.ndarray, signature: np.ndarray) -> float:
    """Cosine of the excess spectra by channel and frequency."""
    excess = np.clip((residual[problem.train] ** 2).mean(axis=0) - 1.0, 0.0, None)
    own = (signature[problem.train] ** 2).mean(axis=0)
    size = float(np.linalg.norm(excess) * np.linalg.norm(own))
    return float(np.sum(excess * own)) / size if size > 0.0 else 0.0


def shortlist(screened: Sequence[Screened]) -> list[Screened]:
    """The best by each statistic together; one variant of an effect counts once a statistic."""
    best = best_of(screened)
    orders = (
        best,
        sorted(best, key=lambda one: -one.gain),
        sorted((one for one in best if one.gain > 0.0), key=lambda one: -one.likeness),
    )
    chosen: dict[str, Screened] = {}
    for order, count in zip(orders, SHORTLIST, strict=True):
        names: list[str] = []
        for one in order:
            if one.candidate.name not in names and len(names) < count:
                names.append(one.candidate.name)
                chosen.setdefault(one.candidate.label, one)
    return sorted(chosen.values(), key=lambda one: -one.gain)
