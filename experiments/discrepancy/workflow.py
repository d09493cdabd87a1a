"""The workflow from a recording to a decision: align, locate, screen, fit, decide, add until only noise is left."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.alignment import align
from experiments.discrepancy.candidates import Context, candidates
from experiments.discrepancy.decide import Decision, Judged, decide
from experiments.discrepancy.empirical import fit_empirical
from experiments.discrepancy.evidence import Evidence
from experiments.discrepancy.fitting import Fit, Problem, fit_nuisances
from experiments.discrepancy.forward import Forward, continued
from experiments.discrepancy.frames import frames_of, held_out, stack
from experiments.discrepancy.hypothesis import Hypothesis, Tell
from experiments.discrepancy.latent import LatentForce, latent_forces
from experiments.discrepancy.locate import Located, locate
from experiments.discrepancy.screening import Screened, screen
from experiments.discrepancy.selection import select
from railsim.errors import InputError

FIRST_RUNS = 3  # on perturbed tracks, for the noise of the first fit
SPOTS = 3  # loudest sections where local effects are tried


@dataclass(frozen=True)
class Findings:
    """All that the workflow has found out.

    Attributes
    ----------
    null : fit of the nuisances alone. added : effects in the order in which they were found. latent : missing forces of
    the null, or for an `unknown` of what is left. empirical : the tabulated law in place of a name.
    """

    problem: Problem
    null: Fit
    located: Located
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    added: tuple[Judged, ...]
    latent: tuple[LatentForce, ...]
    empirical: Hypothesis | None
    decision: Decision

    @property
    def final(self) -> Fit:
        """The fit of the model that is handed over."""
        if self.empirical is not None:
            return self.empirical.fit
        return self.added[-1].hypothesis.fit if self.decision.best else self.null


def investigate(
    evidence: Evidence,
    tell: Tell,
    only: Sequence[str] | None = None,
    rounds: int = 2,
    withheld: Sequence[str] = (),
    always: bool = False,
) -> Findings:
    """Stages 0 to 6.

    Parameters
    ----------
    only : names of effects to consider; None = the whole library. rounds : linearisations of the nuisance fit.
    withheld : classes of effects to do without. always : run the signatures, for the detectable sizes, even where
    nothing asks for an effect; the verdict is the same.

    Raises
    ------
    InputError : nothing moves, or the track file does not belong to the recording.
    """
    problem = prepare(evidence, tell)
    null = fit_nuisances(problem, rounds=rounds, tell=tell)
    problem = problem.with_noise(null.z)
    null = fit_nuisances(problem, null.z, rounds=1, columns=null.columns, tell=tell)
    located = locate(problem, null)
    tell(f"{len(located.significant)} of {len(located.cells)} cells significant, {len(located.surprising)} strained")
    context = context_of(problem, located)
    chosen = [one for one in candidates(context) if only is None or one.name in only]
    chosen = [one for one in chosen if one.equivalence not in withheld]
    if not located.worth_looking:
        screened = tuple(screen(problem, null, chosen, tell)) if always else ()
        return Findings(problem, null, located, screened, (), (), (), None, decide(problem, null, located, []))
    found = select(problem, null, located, chosen, tell)
    problem, null = found.problem, found.null
    latent = tuple(latent_forces(problem, null))
    unknown = found.decision.status == "unknown"
    empirical = fit_empirical(problem, null, context, latent, tell) if unknown else None
    added = found.added if found.decision.best else ()
    return Findings(problem, null, located, found.screened, found.judged, added, latent, empirical, found.decision)


def context_of(problem: Problem, located: Located) -> Context:
    """Where and when the run was, and its loudest sections."""
    time, speed, _ = problem.evidence.speed
    alignment = problem.forward.alignment
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    middles = problem.frames.middles
    s = alignment.start + alignment.scale * np.interp(middles, time, way)
    loudest: list[int] = []
    for number in np.argsort(-located.strip):
        if len(loudest) < SPOTS and all(abs(number - other) > 2 for other in loudest):
            loudest.append(int(number))
    return Context(
        tuple(name.split(" [")[0] for name in problem.evidence.channels),
        (float(s[0]), float(s[-1])),
        (float(middles[0]), float(middles[-1])),
        tuple((float(s[number]), float(middles[number])) for number in loudest),
    )


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
    return problem.with_noise(np.zeros(len(forward.nuisances)), runs=FIRST_RUNS)
