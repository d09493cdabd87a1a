"""Fit: maximum of the posterior of the nuisances, and of effects' numbers, by Gauss-Newton steps.

Derivatives come from the bank of the nominal scenario and learn from every run of the model (Broyden 1965), so that a
fit converges without a run for each; where they decide, they are made anew (`linearised`).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import Forward, Prediction
from experiments.discrepancy.baseline.frames import Frames, stack
from experiments.discrepancy.baseline.noise import (
    PERTURBED,
    SEED,
    Whitener,
    covariance_of,
    noise_level,
    perturbed_tracks,
    propagated_track_error,
    whitener,
)
from experiments.discrepancy.baseline.parallel import in_parallel
from experiments.discrepancy.fit.bank import Bank
from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.changes import Changes
from experiments.discrepancy.fit.journal import Journal, key_of
from experiments.discrepancy.fit.products import WEIGHT, added, normal_equations
from experiments.discrepancy.fit.recent import Recent
from experiments.discrepancy.fit.scores import Shares, bounded_step
from experiments.discrepancy.progress import Progress, silent
from railsim.effects.interface import Effect
from railsim.errors import InputError

SHORTENED = (1.0, 0.4, 0.1)  # shares of a step that are tried
MOST_STEPS = 12
SLOW = 0.003  # of what all steps brought together, that the last one must bring to go on
FRESH = 1  # times that a fit that is held up goes on with the derivatives with which it began
LEEWAY = 3.0  # times what a step is expected to bring, that all further ones may
CONVERGED = 0.3  # nats that a step must be expected to bring
SHARE_SCALE = 0.2  # of an effect's number, beside one standard deviation of a nuisance, in the secant condition
SHOWN = 1.0  # information of the data on a nuisance, in that of its prior, from which its column is made again


@dataclass(frozen=True)
class Problem:
    """Measured coefficients, how to predict them, and the noise.

    Attributes
    ----------
    measured : (k, f, c). train, test : (k,) masks of frames. bank : derivatives and signatures at the nominal scenario.
    level : (c,) of the sensors' noise over their data sheets, in power. white : noise at the last point that it was
    made for. journal : keeps fits that are done, so that a case that was stopped goes on. changes : by screened effects
    so far.
    """

    forward: Forward
    frames: Frames
    measured: np.ndarray
    train: np.ndarray
    test: np.ndarray
    bank: Bank | None = None
    level: np.ndarray | None = None
    white: Whitener | None = None
    journal: Journal | None = None
    recent: Recent = field(default_factory=Recent, compare=False)
    changes: Changes = field(default_factory=Changes, compare=False)

    @property
    def evidence(self) -> Evidence:
        """What was measured."""
        return self.forward.evidence

    @cached_property
    def informed(self) -> np.ndarray:
        """(n,) share of what is known of each nuisance that the training frames would say, at the nominal scenario; one
        where there is no bank.
        """
        if self.bank is None:
            return np.ones(len(self.forward.nuisances))
        size = np.array([np.sum((WEIGHT * one[self.train]) ** 2) for one in self.bank_jacobian])
        return size / (1.0 + size)

    @cached_property
    def bank_jacobian(self) -> np.ndarray:
        """(n, k, f, 2 c) whitened derivatives of the bank; raises where there is none."""
        if self.bank is None:
            raise ValueError("give the problem a bank first")
        return self.whitened_columns(self.bank.columns)

    def but(self, **changes: Any) -> "Problem":
        """A copy with some parts changed."""
        return replace(self, **changes)

    def stacked(self, prediction: Prediction) -> np.ndarray:
        """(k, f, c) of a prediction."""
        return stack(self.frames, self.evidence.channels, prediction, self.evidence.rates)

    def whitened(self, coefficients: np.ndarray) -> np.ndarray:
        """(k, f, 2 c) in standard deviations of the noise; raises where no noise was stated yet."""
        if self.white is None:
            raise ValueError("state the noise first")
        return self.white(coefficients)

    def whitened_columns(self, columns: np.ndarray) -> np.ndarray:
        """(n, k, f, 2 c) of the derivatives (n, k, f, c) of coefficients."""
        k, f, c = columns.shape[1:]
        found = np.empty((len(columns), k, f, 2 * c), np.float32)

        def fill(number: int) -> None:
            found[number] = self.whitened(columns[number])

        in_parallel(fill, range(len(columns)))
        return found

    def jacobian(self, fit: "Fit") -> np.ndarray:
        """(nuisances + m, k, f, 2 c) whitened derivatives of a fit; raises where no noise was stated yet."""
        if fit.jacobian is not None:
            return fit.jacobian
        if self.white is None:
            raise ValueError("state the noise first")
        return self.recent.of(self.white, fit.columns, lambda: self.whitened_columns(fit.columns))

    def differentiated(self, fit: "Fit") -> "Fit":
        """The fit with its whitened derivatives."""
        return replace(fit, jacobian=self.jacobian(fit))

    def with_noise(self, z: np.ndarray, effects: Sequence[Effect] = (), runs: int = PERTURBED) -> "Problem":
        """The problem with its noise propagated through the model at z by so many runs on perturbed tracks."""
        return self.noise_at(z, effects, runs)[0]

    def noise_at(self, z: np.ndarray, effects: Sequence[Effect], runs: int) -> tuple["Problem", np.ndarray]:
        """The same, and the coefficients (k, f, c) that the model predicts there."""
        base = self.forward.predict(z, effects)
        tracks = perturbed_tracks(self.evidence, SEED, runs)
        passed = propagated_track_error(self.forward, self.frames, z, effects, base, tracks)
        stacked = self.stacked(base)
        return self.with_covariance(stacked, passed), stacked

    def with_level(self, stacked: np.ndarray) -> "Problem":
        """The problem with the sensors' noise levels read from what predicted coefficients (k, f, c) leave."""
        if self.white is None:
            raise ValueError("state the noise first")
        return self.but(level=noise_level(self.evidence, self.frames, self.white, self.measured - stacked, self.level))

    def with_covariance(self, predicted: np.ndarray, passed: np.ndarray | None) -> "Problem":
        """The problem with the noise of predicted coefficients (k, f, c) and a propagated track error (k, f, c, c)."""
        covariance = covariance_of(self.evidence, self.frames, predicted, passed, self.level)
        return self.but(white=whitener(covariance, self.measured))


@dataclass(frozen=True)
class Fit:
    """A point with its residual and derivatives.

    Attributes
    ----------
    z : scores of the nuisances. candidates : effects that are fitted beside them. shares : (m,) place of each of their
    free numbers between its bounds. effects : the same, built. residual : (k, f, 2 c), whitened. stacked : (k, f, c)
    predicted coefficients. columns : (nuisances + m, k, f, c) their derivatives by z and shares. jacobian : the same,
    whitened, while it is being fitted (`Problem.jacobian` in any case).
    """

    z: np.ndarray
    candidates: tuple[Candidate, ...]
    shares: np.ndarray
    effects: tuple[Effect, ...]
    residual: np.ndarray
    stacked: np.ndarray
    columns: np.ndarray
    jacobian: np.ndarray | None = None

    def cost(self, frames: np.ndarray) -> float:
        """Negative logarithm of the posterior over some frames, but for constants."""
        return cost(self.residual, self.z, frames) - Shares(self.candidates).log_prior(self.shares)

    def rewhitened(self, problem: Problem) -> "Fit":
        """The same point under another statement of the noise."""
        residual = problem.whitened(problem.measured - self.stacked)
        return replace(self, residual=residual, jacobian=None)


def cost(residual: np.ndarray, z: np.ndarray, frames: np.ndarray) -> float:
    """Half the sum of squares over some frames, plus the nuisances' prior."""
    return 0.5 * float(np.sum((WEIGHT * residual[frames]) ** 2)) + 0.5 * float(z @ z)


def lost_within(problem: Problem, fit: Fit) -> float:
    """Nats that a fit loses by the quadratic model there if all nuisances must stay where nothing is looked for."""
    shares = Shares(fit.candidates)
    normal, gradient = normal_equations(problem.jacobian(fit), fit.residual, problem.train)
    matrix, downhill, at = shares.scaled(normal, gradient, fit.z, fit.shares)
    usual = np.array([one.strained for one in problem.forward.nuisances])
    within = np.clip(problem.forward.bounds, -usual, usual)
    begun = np.concatenate([np.clip(fit.z, *within), at[len(fit.z) :]])
    move = bounded_step(matrix, downhill - matrix @ (begun - at), begun, 1.0, within) - at
    return max(0.0, float(0.5 * move @ matrix @ move - downhill @ move))


def starting_fit(problem: Problem, z: np.ndarray) -> Fit:
    """Nuisances alone at z, with the bank's derivatives.

    Raises
    ------
    InputError : the model does not run there.
    """
    if problem.bank is None:
        raise ValueError("give the problem a bank first")
    return _at(problem, (), z, np.zeros(0), problem.bank.columns, problem.bank_jacobian)


def with_bank(problem: Problem, fit: Fit) -> Fit:
    """Nuisances alone at the same point, with the bank's derivatives."""
    if problem.bank is None:
        raise ValueError("give the problem a bank first")
    return replace(fit, columns=problem.bank.columns, jacobian=None)


def moved_to(problem: Problem, fit: Fit) -> Fit:
    """The same point under another statement of the noise or another creep law.

    Raises
    ------
    InputError : the model does not run there.
    """
    return _at(problem, fit.candidates, fit.z, fit.shares, fit.columns, None)


def without_effects(problem: Problem, fit: Fit) -> Fit:
    """The nuisances' part of a fit with its whitened derivatives; residual and prediction stay those of the whole."""
    n = len(fit.z)
    jacobian, columns = problem.jacobian(fit)[:n], fit.columns[:n]
    return replace(fit, candidates=(), shares=np.zeros(0), effects=(), columns=columns, jacobian=jacobian)


def at_values(problem: Problem, fit: Fit, values: Sequence[dict[str, float]]) -> Fit:
    """A fit's nuisances and derivatives with other numbers of its effects.

    Raises
    ------
    InputError : the model does not run there.
    """
    return _at(problem, fit.candidates, fit.z, Shares(fit.candidates).of(values), fit.columns, None)


def restarted(problem: Problem, fit: Fit, z: np.ndarray) -> Fit:
    """Nuisances alone at z, with the derivatives of another fit."""
    n = len(fit.z)
    return _at(problem, (), z, np.zeros(0), fit.columns[:n], problem.jacobian(fit)[:n])


def with_candidates(
    problem: Problem, start: Fit, candidates: tuple[Candidate, ...], values: Sequence[tuple[np.ndarray, np.ndarray]]
) -> Fit:
    """The best of some starting points (z, shares), nuisances' derivatives from another fit, the effects' own by runs.

    Raises
    ------
    InputError : the model runs at none of them.
    """
    numbers = [number for pair in values for number in pair]
    return _kept(problem, "begun", start, candidates, numbers, lambda: _begun(problem, start, candidates, values))


def _begun(
    problem: Problem, start: Fit, candidates: tuple[Candidate, ...], values: Sequence[tuple[np.ndarray, np.ndarray]]
) -> Fit:
    n = len(start.z)
    columns, jacobian = start.columns[:n], problem.jacobian(start)[:n]

    def there(pair: tuple[np.ndarray, np.ndarray]) -> Fit | InputError:
        try:
            return _at(problem, candidates, *pair, columns, jacobian)
        except InputError as error:
            return error

    tried = in_parallel(there, values)
    found = [one for one in tried if isinstance(one, Fit)]
    if not found:
        raise next((one for one in tried if isinstance(one, InputError)), InputError("no starting point"))
    best = min(found, key=lambda one: one.cost(problem.train))
    return _with_columns(problem, best, best)


def linearised(problem: Problem, fit: Fit, alike: float = 0.0) -> Fit:
    """The fit with derivatives made anew at its own point, where the data say anything about a number: by a run each,
    but for those by the sensors' errors. `alike`: only those by nuisances that do the same as one of the effects, by
    that cosine at least, and by the effects.
    """
    numbers = (np.array(alike),) if alike else ()
    return _kept(problem, "linearised", fit, fit.candidates, numbers, lambda: _linearised(problem, fit, alike))


def _linearised(problem: Problem, fit: Fit, alike: float) -> Fit:
    forward = problem.forward
    setup, truth = forward.run(fit.z, fit.effects)
    jacobian = problem.jacobian(fit)
    shown = np.array([np.sum((WEIGHT * one[problem.train]) ** 2) >= SHOWN for one in jacobian])
    if alike:
        normal, _ = normal_equations(jacobian, fit.residual, problem.train)
        n, size = len(fit.z), np.sqrt(np.maximum(np.diag(normal), SHOWN))
        shown[:n] &= np.abs(normal[:n, n:] / size[:n, None] / size[n:]).max(axis=1, initial=0.0) >= alike

    def column(number: int) -> np.ndarray:
        if not shown[number]:
            return fit.columns[number]
        step = forward.nuisances[number].step(float(fit.z[number]))
        moved = fit.z.copy()
        moved[number] += step
        if forward.nuisances[number].of_sensor:
            prediction = forward.observe(setup, truth, moved)
        else:
            prediction = forward.predict(moved, fit.effects)
        return ((problem.stacked(prediction) - fit.stacked) / step).astype(np.complex64)

    columns = np.concatenate([np.stack(in_parallel(column, range(len(fit.z)))), effect_columns(problem, fit)])
    return replace(fit, columns=columns, jacobian=problem.whitened_columns(columns))


def improved(problem: Problem, fit: Fit, progress: Progress = silent, level: float = math.inf) -> Fit:
    """The fit's maximum of the posterior on training frames; given up where its cost will not come down to `level`."""
    numbers = () if math.isinf(level) else (np.array(level),)
    fit = _kept(problem, "improved", fit, fit.candidates, numbers, lambda: _improved(problem, fit, level))
    progress(
        f"fitted {', '.join(one.label for one in fit.candidates) or 'nuisances'}: cost {fit.cost(problem.train):.0f}"
    )
    return fit


def _improved(problem: Problem, fit: Fit, level: float) -> Fit:
    begun, fresh, here = fit, FRESH, fit
    for _ in range(MOST_STEPS):
        moved, expected = _step(problem, fit, level)
        gain = fit.cost(problem.train) - moved.cost(problem.train)
        if gain <= 0.0 and expected > CONVERGED and fresh and not _same_place(moved, here):
            try:
                here = fit = _with_columns(problem, moved, begun)
            except InputError:  # at the edge of what runs: as good as it gets
                break
            fresh -= 1
            continue
        fit = moved
        if gain < max(CONVERGED, SLOW * (begun.cost(problem.train) - fit.cost(problem.train))):
            break
    return fit


def _same_place(one: Fit, other: Fit) -> bool:
    return np.array_equal(one.z, other.z) and np.array_equal(one.shares, other.shares)


def _with_columns(problem: Problem, fit: Fit, begun: Fit) -> Fit:
    """The fit with the derivatives by the nuisances with which it began, and its effects' own by runs: where a step
    fails that they promise, what long steps have taught them is wrong.
    """
    n = len(fit.z)
    own = effect_columns(problem, fit)
    return replace(
        fit,
        columns=np.concatenate([begun.columns[:n], own]),
        jacobian=np.concatenate([problem.jacobian(begun)[:n], problem.whitened_columns(own)]),
    )


def _kept(
    problem: Problem,
    what: str,
    start: Fit,
    candidates: tuple[Candidate, ...],
    numbers: Sequence[np.ndarray],
    make: Callable[[], Fit],
) -> Fit:
    """A fit from the journal, or made and put there; the key holds all that it depends on within a case."""
    if problem.journal is None or problem.white is None:
        return make()
    forward = problem.forward
    labels = [one.label for one in (*start.candidates, *candidates)]
    where = repr((what, forward.engine, forward.law, forward.registration, labels))
    own = (start.z, start.shares, start.residual, start.columns, problem.white.inverse)

    def arrays() -> dict[str, np.ndarray]:
        before = forward.meter.spent
        fit = make()
        names = ("z", "shares", "residual", "stacked", "columns", "jacobian")
        kept = {name: getattr(fit, name) for name in names if getattr(fit, name) is not None}
        return kept | {"runs": np.array(forward.meter.spent - before)}

    before = forward.meter.spent
    found = problem.journal.kept(key_of(where, *own, *numbers), arrays)
    runs = float(found.pop("runs"))
    if forward.meter.spent == before:  # found there: it counts as if it had been made now
        forward.meter.add(runs)
    return Fit(candidates=candidates, effects=Shares(candidates).effects(found["shares"]), **found)


def _step(problem: Problem, fit: Fit, level: float) -> tuple[Fit, float]:
    """After one step (the same point where none helps, with what was learnt), and the gain that was expected: none
    where even `LEEWAY` times what is expected would not do.
    """
    shares = Shares(fit.candidates)
    jacobian = problem.jacobian(fit)
    normal, gradient = normal_equations(jacobian, fit.residual, problem.train)
    matrix, downhill, at = shares.scaled(normal, gradient, fit.z, fit.shares)
    n = len(fit.z)
    expected = 0.0
    for number, share in enumerate(SHORTENED):
        target = bounded_step(matrix, downhill, at, share, problem.forward.bounds)
        step = target - at
        if not number:
            expected = float(downhill @ step - 0.5 * step @ matrix @ step)
            if expected < 0.1 * CONVERGED:
                return fit, expected
            if fit.cost(problem.train) - LEEWAY * expected > level:
                return fit, 0.0
        z, there = target[:n], shares.unscaled(target[n:])
        try:
            found = _at(problem, fit.candidates, z, there, fit.columns, jacobian)
        except InputError:
            continue
        fit = broyden_update(problem, fit, found)
        jacobian = problem.jacobian(fit)
        found = replace(found, columns=fit.columns, jacobian=jacobian)
        if found.cost(problem.train) < fit.cost(problem.train):
            return found, expected
        if share < 1.0 and number and expected < 10.0 * CONVERGED:
            break
    return fit, expected


def broyden_update(problem: Problem, old: Fit, new: Fit) -> Fit:
    """The old point with derivatives that would have predicted the new one (Broyden's good update).

    What was missed is laid on the numbers of which the recording says something: a nuisance that nothing shows would
    else be given a say, and drift.
    """
    move = np.concatenate([new.z - old.z, new.shares - old.shares])
    along = np.concatenate([problem.informed, np.full(len(old.shares), SHARE_SCALE**-2)]) * move
    length = float(along @ move)
    if length < 1e-4:
        return old
    missed = new.stacked - old.stacked - np.tensordot(move.astype(np.float32), old.columns, axes=1)
    white = problem.whitened(missed).astype(np.float32)
    factors = (along / length).astype(np.float32)
    columns = added(old.columns, factors, missed.astype(np.complex64))
    return replace(old, columns=columns, jacobian=added(problem.jacobian(old), factors, white))


def _at(
    problem: Problem,
    candidates: tuple[Candidate, ...],
    z: np.ndarray,
    shares: np.ndarray,
    columns: np.ndarray,
    jacobian: np.ndarray | None,
) -> Fit:
    effects = Shares(candidates).effects(shares)
    stacked = problem.stacked(problem.forward.predict(z, effects))
    residual = problem.whitened(problem.measured - stacked)
    if not np.isfinite(residual).all():
        raise InputError("the run leaves the rails")
    return Fit(z, candidates, shares, effects, residual, stacked, columns, jacobian)


def effect_columns(problem: Problem, fit: Fit) -> np.ndarray:
    """(m, k, f, c) derivative of the predicted coefficients by the shares."""
    numbers = Shares(fit.candidates)
    steps = numbers.steps(fit.shares)

    def column(number: int) -> np.ndarray:
        size = steps[number]
        reason = InputError("no derivative")
        for step in (-size, size) if fit.shares[number] > 0.5 else (size, -size):
            moved = fit.shares.copy()
            moved[number] = np.clip(moved[number] + step, 0.0, 1.0)
            if moved[number] == fit.shares[number]:
                continue  # at a bound
            try:
                prediction = problem.forward.predict(fit.z, numbers.effects(moved))
            except InputError as error:
                reason = error
                continue
            return ((problem.stacked(prediction) - fit.stacked) / (moved[number] - fit.shares[number])).astype(
                np.complex64
            )
        raise reason

    own = in_parallel(column, range(len(fit.shares)))
    return np.stack(own) if own else np.zeros((0, *fit.stacked.shape), np.complex64)
