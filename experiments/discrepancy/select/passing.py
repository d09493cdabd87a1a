"""Passing: where much is left, effects are held against each other each with the noise that it passes on itself.

An effect that changes how a vehicle passes on the track makes the track file's errors loud (dry friction in the axlebox
guides: twenty times the noise that was stated for a healthy vehicle), and is then no better than any other as long as
the noise is not its own.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Fit, Problem, improved, linearised, starting_fit
from experiments.discrepancy.fit.hypothesis import Hypothesis, again, concluded, hypothesis
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.screen.screening import Screened, screen
from experiments.discrepancy.screen.spectra import Sized, by_power
from experiments.discrepancy.select.decide import ENOUGH, LARGE, held_out_gap
from experiments.discrepancy.select.refining import ROUNDS, WORTH, time_for
from experiments.discrepancy.select.stand import Stand
from experiments.discrepancy.select.starts import all_sizes, at_home
from railsim.effects.interface import Effect
from railsim.errors import InputError

NAMES = 4  # effects that are tried with the noise that they pass on
SIZES = 2  # of each
FEW = 2  # runs over perturbed tracks for each
RIVALS = 2  # fits so far that are fitted on with the noise of the likeliest


def with_passing(stand: Stand, found: Sequence[Candidate], progress: Progress) -> Stand:
    """With the effect that is likeliest with the noise that it passes on itself, where all that was fitted leaves much
    and this one takes it; all is then held against each other with that noise.
    """
    problem, null = stand.problem, stand.null
    if held_out_gap(problem, null.fit) < LARGE or held_out_gap(problem, stand.best.fit) < LARGE:
        return stand
    if not time_for(problem, "law", "effects with the noise that they pass on", progress):
        return stand
    meter = problem.forward.meter
    spent = meter.spent
    stand = _held_against(stand, found, progress)
    meter.add(spent - meter.spent)  # what is rarely needed takes no time from what always is
    return stand


def _held_against(stand: Stand, found: Sequence[Candidate], progress: Progress) -> Stand:
    problem, null = stand.problem, stand.null
    home = at_home(problem, null.fit)
    try:
        first = _likeliest(problem, home, found, null, progress)
        made = None if first is None else _fitted(problem, home, first, progress)
    except InputError as error:  # on one of the tracks that it may be
        progress(f"noise of its own: {error}")
        return stand
    if made is None:
        return stand
    problem, one = made
    most = sorted(stand.fitted, key=lambda other: -other.log_evidence)
    others = [other for other in most if other.classes != one.classes][:RIVALS]
    better = Stand(
        problem, again(problem, null, progress), [one, *(again(problem, other, progress) for other in others)]
    )
    gain = one.log_evidence - better.null.log_evidence
    progress(f"{one.label}, with the noise that it passes on: {gain:+.1f} nats")
    return better if gain > ENOUGH and better.most is one else stand


def log_likelihood(problem: Problem, residual: np.ndarray) -> np.ndarray:
    """(k,) of each frame [nats, but for a constant] by whitened residuals (k, f, 2 c) under the problem's noise."""
    if problem.white is None:
        raise ValueError("state the noise first")
    return -0.5 * ((WEIGHT * residual) ** 2).sum(axis=(1, 2)) - problem.white.log_determinant


def likelihood_of_own(problem: Problem, z: np.ndarray, effects: tuple[Effect, ...]) -> float:
    """Log likelihood of the training frames under the noise that the effects pass on at z."""
    own, stacked = problem.noise_at(z, effects, FEW)
    return float(log_likelihood(own, own.whitened(own.measured - stacked))[own.train].sum())


def _likeliest(
    problem: Problem, home: np.ndarray, found: Sequence[Candidate], null: Hypothesis, progress: Progress
) -> Sized | None:
    """Of the sizes that give the channels their power, the likeliest; None where nuisances alone are likelier."""
    base = starting_fit(problem, home)
    sizes: dict[str, list[Sized]] = {}
    for sized, gain in by_power(problem, base.stacked, found):
        if gain > 0.0:
            sizes.setdefault(sized[0].name, []).append(sized)
    tried = [sized for name in list(sizes)[:NAMES] for sized in sizes[name][:SIZES]]
    seen = _best_seen(problem, base, [candidate for candidate, _ in tried if candidate.phases])
    best, most = None, likelihood_of_own(problem, null.fit.z, ())
    for candidate, values in _with_phases(tried, seen):
        try:
            here = likelihood_of_own(problem, home, (candidate.build(values),))
        except InputError as error:
            progress(f"{candidate.label}: {error}")
            continue
        progress(f"{candidate.label} {_shown(values)}, with the noise that it passes on: {here - most:+.0f} nats")
        if here > most:
            best, most = (candidate, values), here
    return best


def _with_phases(tried: Sequence[Sized], seen: Mapping[str, Screened]) -> Iterator[Sized]:
    """The sizes with the phases at which they look best, and what looks best itself, which lies between the bank's."""
    looked: set[str] = set()
    for candidate, size in tried:
        there = seen.get(candidate.label)
        if there is None:
            yield candidate, size
            continue
        yield candidate, {**size, **{name: there.values[name] for name in candidate.phases}}
        if candidate.label not in looked:
            yield candidate, there.values
        looked.add(candidate.label)


def _shown(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in values.items())


def _best_seen(problem: Problem, base: Fit, found: Sequence[Candidate]) -> dict[str, Screened]:
    """The best signature of each candidate, by its label."""
    once = list({one.label: one for one in found}.values())
    screened = sorted(screen(problem, base, once), key=lambda one: one.gain) if once else []
    return {one.candidate.label: one for one in screened}


def _fitted(problem: Problem, home: np.ndarray, first: Sized, progress: Progress) -> tuple[Problem, Hypothesis] | None:
    """The effect fitted from the nominal build with the noise that it passes on, and again with that of the fit."""
    candidate, values = first
    problem = problem.with_noise(home, (candidate.build(values),))
    base = starting_fit(problem, home)
    one = _best_seen(problem, base, [candidate]).get(candidate.label)
    sizes = [values] if one is None else [values, one.values, *all_sizes(one)]
    made = hypothesis(problem, base, (candidate,), [(home, [each]) for each in sizes], progress)
    if made is None:
        return None
    for _ in range(ROUNDS):
        problem = problem.with_noise(made.fit.z, made.fit.effects)
        before = again(problem, made, progress)
        made = concluded(problem, improved(problem, linearised(problem, before.fit), progress))
        if made.log_evidence < before.log_evidence + WORTH:
            made = max(made, before, key=lambda each: each.log_evidence)
            break
    return problem, made
