"""The workflow from a recording to a decision: align, locate, screen, fit, decide."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.alignment import align
from experiments.discrepancy.candidates import Candidate, candidates
from experiments.discrepancy.decide import Decision, Judged, decide, held_out_gap, judge
from experiments.discrepancy.evidence import Evidence
from experiments.discrepancy.fitting import Fit, Problem, fit_nuisances
from experiments.discrepancy.forward import Forward, continued
from experiments.discrepancy.frames import frames_of, held_out, stack
from experiments.discrepancy.hypothesis import Hypothesis, fit_candidate, null_evidence, polish
from experiments.discrepancy.latent import LatentForce, latent_forces
from experiments.discrepancy.locate import Located, locate
from experiments.discrepancy.screening import Screened, screen, shortlist
from railsim.errors import InputError

Tell = Callable[[str], None]
MOST_FITTED = 8
WHITE = 1.03  # held-out gap from which nothing is left to explain
HOPELESS = 0.2  # of the leader's gain
MOST_POLISHED = 3
CLOSE = 60.0  # nats behind the best within which a hypothesis is polished
STILL = 5.0  # mean square signal to noise below which the track excites nothing


@dataclass(frozen=True)
class Findings:
    """All that the workflow has found out.

    Attributes
    ----------
    before : residual (k, f, 2 c) of the nominal model, aligned, nuisances at their nominal values.
    """

    problem: Problem
    before: np.ndarray
    null: Fit
    located: Located
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    latent: tuple[LatentForce, ...]
    decision: Decision


def investigate(evidence: Evidence, tell: Tell, only: Sequence[str] | None = None, rounds: int = 2) -> Findings:
    """Stages 0 to 4.

    Parameters
    ----------
    only : names of effects to consider; None = the whole library. rounds : linearisations of the nuisance fit.

    Raises
    ------
    InputError : nothing moves, or the track file does not belong to the recording.
    """
    problem = prepare(evidence, tell)
    nominal = np.zeros(len(problem.forward.nuisances))
    null = fit_nuisances(problem, nominal, rounds=rounds, tell=tell)
    problem = problem.with_noise(null.z)
    null = fit_nuisances(problem, null.z, rounds=1, columns=null.columns, tell=tell)
    before = problem.residual(problem.forward.predict(nominal))
    located = locate(problem, null)
    tell(f"{len(located.significant)} of {len(located.cells)} cells significant")
    if not located.worth_looking:
        decision = decide(problem, null, located, [])
        return Findings(problem, before, null, located, (), (), (), decision)
    chosen = [one for one in candidates() if only is None or one.name in only]
    screened = screen(problem, null, chosen, tell)
    judged = fit_all(problem, null, shortlist(screened), tell)
    decision = decide(problem, null, located, judged)
    latent = tuple(latent_forces(problem, null))
    return Findings(problem, before, null, located, tuple(screened), tuple(judged), latent, decision)


def prepare(evidence: Evidence, tell: Tell) -> Problem:
    """Aligned, cut into frames, with the noise at the nominal model."""
    alignment = align(evidence)
    tell(f"aligned: start at {alignment.start:.2f} m, speed scale {alignment.scale:.4f}")
    forward = Forward(evidence, alignment, continued(evidence.track))
    frames = frames_of(evidence.duration, min(evidence.rates.values()))
    train, test = held_out(frames)
    measured = stack(frames, evidence.channels, evidence.samples, evidence.rates)
    if not test.any() or not np.isfinite(measured[train]).any():
        raise InputError("too few whole sections of 2 s; record longer, or mend the lost samples")
    problem = Problem(forward, frames, measured, train, test)
    return problem.with_noise(np.zeros(len(forward.nuisances)))


def fit_all(problem: Problem, null: Fit, chosen: Sequence[Screened], tell: Tell) -> list[Judged]:
    """The shortlist fitted and judged."""
    reference = null_evidence(problem, null)
    fitted: list[Hypothesis] = []
    for one in chosen[:MOST_FITTED]:
        if fitted and _hopeless(one, chosen, max(fitted, key=lambda other: other.log_evidence), problem):
            continue
        starts = [(null.z, start_of(one)), (np.zeros_like(null.z), start_of(one))]
        found = fit_candidate(problem, null, one.candidate, starts, tell)
        if found is not None:
            fitted.append(found)
            tell(f"{one.candidate.label}: {found.log_evidence - reference:+.1f} nats")
    fitted.sort(key=lambda one: -one.log_evidence)
    close = [one for one in fitted[:MOST_POLISHED] if one.log_evidence > max(reference, fitted[0].log_evidence - CLOSE)]
    for number, one in enumerate(close):
        fitted[number] = polish(problem, null, one, tell)
        tell(f"{one.candidate.label}, linearised again: {fitted[number].log_evidence - reference:+.1f} nats")
    return judge(problem, null, reference, fitted)


def _hopeless(one: Screened, chosen: Sequence[Screened], best: Hypothesis, problem: Problem) -> bool:
    """Whether a hypothesis that leaves only noise is there already, and this one's signature does far less."""
    leader = max(chosen, key=lambda other: other.gain)
    return held_out_gap(problem, best.fit) < WHITE and one.gain < HOPELESS * leader.gain


def start_of(screened: Screened) -> dict[str, float]:
    """Where the fit begins: the screened size, scaled."""
    free = screened.candidate.parameters
    values = dict(screened.values)
    for name, parameter in free.items():
        if parameter.absent is not None:
            moved = parameter.absent + screened.scale * (values[name] - parameter.absent)
            values[name] = float(np.clip(moved, parameter.low, parameter.high))
    return values


def names_of(found: Sequence[Candidate]) -> list[str]:
    """Effects by name, once each."""
    return sorted({one.name for one in found})
