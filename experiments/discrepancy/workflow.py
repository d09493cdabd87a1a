"""The workflow from a recording to a decision: register, locate, screen, fit, decide, add until only noise is left."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import forward_over
from experiments.discrepancy.baseline.frames import frames_of, held_out, stack
from experiments.discrepancy.baseline.parallel import one_thread_each
from experiments.discrepancy.baseline.registration import register
from experiments.discrepancy.fit.bank import open_bank
from experiments.discrepancy.fit.candidates import Candidate, Context, candidates
from experiments.discrepancy.fit.fitting import Fit, Problem, with_bank
from experiments.discrepancy.fit.hypothesis import Hypothesis, again
from experiments.discrepancy.fit.journal import Journal
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.screen.latent import LatentForce, latent_forces
from experiments.discrepancy.screen.locate import Located, locate
from experiments.discrepancy.screen.places import tones
from experiments.discrepancy.screen.screening import Screened
from experiments.discrepancy.select.decide import ENOUGH, LARGE, Decision, Judged, contested, excess, held_out_gap
from experiments.discrepancy.select.refining import nuisances_alone, other_laws, polished, with_noise_of
from experiments.discrepancy.select.selection import select
from railsim.errors import InputError

EXPLAINED = 0.5  # of what nuisances alone leave, that another creep law must take to be the one
SPOTS = 3  # loudest sections where local effects are tried


@dataclass(frozen=True)
class Findings:
    """All that the workflow has found out.

    Attributes
    ----------
    null : nuisances alone. judged : all hypotheses, the most probable first. latent : missing forces of the null, or
    for an `unknown` of what is left. empirical : the tabulated law in place of a name. not_tried : for want of time.
    """

    problem: Problem
    null: Hypothesis
    located: Located
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    latent: tuple[LatentForce, ...]
    empirical: Hypothesis | None
    decision: Decision
    not_tried: tuple[str, ...] = ()

    @property
    def final(self) -> Fit:
        """The fit of the model that is handed over."""
        if self.empirical is not None:
            return self.empirical.fit
        best = self.decision.best
        return best.hypothesis.fit if best else self.null.fit


@one_thread_each
def investigate(
    evidence: Evidence,
    progress: Progress,
    only: Sequence[str] | None = None,
    withheld: Sequence[str] = (),
    journal: Journal | None = None,
) -> Findings:
    """Stages 0 to 6.

    Parameters
    ----------
    only : names of effects to consider; None = the whole library. withheld : classes of effects to do without.
    journal : keeps what is done.

    Raises
    ------
    InputError : nothing moves, or the track file does not belong to the recording.
    """

    def allowed(one: Candidate) -> bool:
        return (only is None or one.name in only) and one.equivalence not in withheld

    problem = prepare(evidence, progress).but(journal=journal)
    null = nuisances_alone(problem, np.zeros(len(problem.forward.nuisances)), progress)
    problem, null = _settled(problem, null, progress)
    located = locate(problem, null.fit)
    if located.worth_looking:
        problem, null = _better_law(problem, null, progress)
    located = locate(problem, null.fit)
    if located.worth_looking and held_out_gap(problem, null.fit) < LARGE:  # else bent to explain what is no nuisance
        problem, null = _passed_on(problem, polished(problem, null, progress), progress)
        located = locate(problem, null.fit)
    progress(
        f"{len(located.significant)} of {len(located.cells)} cells significant, {len(located.surprising)} strained"
    )
    context = replace(context_of(problem, located), tones=tones(problem, null.fit))
    progress("tones: " + (", ".join(f"{one:.2f} Hz" for one, _ in context.tones) or "none"))
    found = select(problem, null, located, [one for one in candidates(context) if allowed(one)], progress)
    problem, null, decision = found.problem, found.null, found.decision
    latent, empirical = (), None
    if decision.status != "none" or found.tabled is not None:
        latent = tuple(latent_forces(problem, null.fit))
    if found.tabled is not None:
        law, where = found.tabled
        decision = contested(problem, decision, null, law)
        empirical = law if decision.status == "unknown" else None
        latent = (where, *(one for one in latent if one.place != where.place)) if empirical else latent
    return Findings(problem, null, located, found.screened, found.judged, latent, empirical, decision, found.not_tried)


def _settled(problem: Problem, null: Hypothesis, progress: Progress) -> tuple[Problem, Hypothesis]:
    """Nuisances alone, fitted on with the sensors' noise levels and the model's share of the noise read from them."""
    problem = problem.with_level(null.fit.stacked)
    problem = problem.with_covariance(null.fit.stacked, problem.bank.propagated if problem.bank else None)
    return problem, again(problem, null, progress)


def _passed_on(problem: Problem, null: Hypothesis, progress: Progress) -> tuple[Problem, Hypothesis]:
    """With the track's errors as the nuisances that were found pass them on: stiffer springs pass on more of the short
    waves than nominal ones.
    """
    passed_on = with_noise_of(problem, null, progress)
    if passed_on is None:
        return problem, null
    return passed_on, again(passed_on, null, progress)


def _better_law(problem: Problem, null: Hypothesis, progress: Progress) -> tuple[Problem, Hypothesis]:
    """With another creep law, where the nuisances alone explain the recording better with it: which law holds is one
    of them, and another law than the nominal is no effect.
    """
    for name in other_laws(problem):
        changed = problem.but(forward=problem.forward.but(law=name))
        try:
            alone = nuisances_alone(changed, np.zeros(len(null.fit.z)), progress, null.fit.cost(problem.train))
            if alone.log_evidence > null.log_evidence + max(ENOUGH, EXPLAINED * excess(problem, null)):
                progress(f"creep law {name}: {alone.log_evidence - null.log_evidence:+.1f} nats")
                changed = changed.but(bank=problem.bank.under(name, progress) if problem.bank else None)
                return _settled(changed, replace(alone, fit=with_bank(changed, alone.fit)), progress)
        except InputError as error:
            progress(f"creep law {name}: {error}")
    return problem, null


def context_of(problem: Problem, located: Located) -> Context:
    """Where and when the run was, and its loudest sections."""
    time, speed, _ = problem.evidence.speed
    registration = problem.forward.registration
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    middles = problem.frames.middles
    s = registration.start + registration.scale * np.interp(middles, time, way)
    loudest: list[int] = []
    for number in np.argsort(-located.strip):
        if len(loudest) < SPOTS and all(abs(number - other) > 2 for other in loudest):
            loudest.append(int(number))
    return Context(
        tuple(name.split(" [")[0] for name in problem.evidence.channels),
        (float(s[0]), float(s[-1])),
        (float(middles[0]), float(middles[-1])),
        tuple((float(s[number]), float(middles[number])) for number in loudest),
        wheel_radius=float(getattr(problem.evidence.scenario.vehicle, "wheel_radius", 0.5)),
        wheelsets=max(Context.wheelsets, len(problem.evidence.scenario.model.wheelsets)),
    )


def prepare(evidence: Evidence, progress: Progress) -> Problem:
    """Registered to the track, cut into frames, with the noise at the nominal model."""
    registration = register(evidence)
    progress(f"registered: start at {registration.start:.2f} m, speed scale {registration.scale:.4f}")
    forward = forward_over(evidence, registration)
    frames = frames_of(evidence.duration, min(evidence.slowest, *evidence.rates.values()))
    train, test = held_out(frames)
    measured = stack(frames, evidence.channels, evidence.samples, evidence.rates)
    if not np.isfinite(measured[test]).any() or not np.isfinite(measured[train]).any():
        raise InputError("too few whole sections of 2 s; record longer, or mend the lost samples")
    bank = open_bank(evidence, registration, frames, progress)
    problem = Problem(forward, frames, measured, train, test, bank)
    nominal = problem.stacked(forward.predict(np.zeros(len(forward.nuisances))))
    return problem.with_covariance(nominal, bank.propagated)
