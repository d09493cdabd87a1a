"""Elsewhere: recordings that took no part, at other speeds perhaps, run with the model as it was, with nuisances only
and with the effect; only what differs from run to run (start, speed, biases, a wheel's angle) is found anew.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import Forward, forward_over
from experiments.discrepancy.baseline.frames import frames_of, held_out, stack
from experiments.discrepancy.baseline.parallel import in_parallel
from experiments.discrepancy.baseline.registration import register
from experiments.discrepancy.fit.fitting import Problem, cost
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.result.adding import Gaps
from experiments.discrepancy.select.decide import rms
from experiments.discrepancy.workflow import Findings
from railsim.effects.interface import Effect
from railsim.errors import InputError

OF_THE_RUN = ("start", "speed", "bias")  # nuisances that differ from run to run
STEP = 0.3  # standard deviations, of the derivatives' differences
ROUNDS = 4
CONVERGED = 0.3  # nats
SHORTENED = (1.0, 0.4, 0.1)
ANGLES = 16  # of a wheel that are tried


@dataclass(frozen=True)
class Elsewhere:
    """A recording that took no part.

    Attributes
    ----------
    speed : median [m/s]. duration : s. gaps : on its held-out sections, of all channels together.
    """

    name: str
    speed: float
    duration: float
    gaps: Gaps

    def plain(self) -> dict[str, Any]:
        """For the verdict."""
        return {"recording": self.name, "speed": round(self.speed, 3), "duration": self.duration} | {
            "gap": self.gaps.plain()
        }


def run_elsewhere(name: str, evidence: Evidence, findings: Findings, progress: Progress) -> Elsewhere:
    """Gaps of a further recording.

    Raises
    ------
    InputError : the recording does not follow the track, or the model does not run there.
    """
    problem = problem_of(evidence, findings)
    null, final = findings.null.fit, findings.final
    own = problem.forward.but(law="")  # the model as it was has its own creep law
    nominal = problem.stacked(own.predict(np.zeros(len(own.nuisances))))
    alone = settled(problem, _moved(findings, problem.forward, null.z), ())
    added = alone
    if final is not null:
        added = settled(problem, _moved(findings, problem.forward, final.z), final.effects)
    states = (nominal, alone, added)
    gaps = Gaps(*(rms(problem, problem.whitened(problem.measured - one)) for one in states))
    speed = float(np.median(evidence.speed[1]))
    found = f"gap {gaps.before:.2f}, nuisances only {gaps.nuisance_only:.2f}, after {gaps.after:.2f}"
    progress(f"{name}, {speed:.1f} m/s: {found}")
    return Elsewhere(name, speed, round(evidence.duration, 2), gaps)


def problem_of(evidence: Evidence, findings: Findings) -> Problem:
    """The recording, registered, with the noise of the model that was found."""
    forward = forward_over(evidence, register(evidence), law=findings.problem.forward.law)
    frames = frames_of(evidence.duration, min(evidence.slowest, *evidence.rates.values()))
    train, test = held_out(frames)
    measured = stack(frames, evidence.channels, evidence.samples, evidence.rates)
    if not np.isfinite(measured[test]).any():
        raise InputError("--held-out: too few whole sections of 2 s; record longer, or mend the lost samples")
    level = findings.problem.level
    if level is not None:
        known = dict(zip(findings.problem.evidence.channels, level.tolist(), strict=True))
        level = np.array([known.get(name, 1.0) for name in evidence.channels])
    problem = Problem(forward, frames, measured, train, test, level=level)
    return problem.with_noise(_moved(findings, forward, findings.final.z), findings.final.effects)


def _moved(findings: Findings, forward: Forward, z: np.ndarray) -> np.ndarray:
    """The fitted nuisances of vehicle and sensors; those of the run at nothing."""
    labels = [one.label for one in findings.problem.forward.nuisances]
    known: Mapping[str, float] = dict(zip(labels, z.tolist(), strict=True))
    return np.array([0.0 if one.kind in OF_THE_RUN else known.get(one.label, 0.0) for one in forward.nuisances])


def settled(problem: Problem, z: np.ndarray, effects: Sequence[Effect]) -> np.ndarray:
    """Coefficients (k, f, c) with what differs from run to run at its best on the training frames."""
    chosen = _turned(problem, z, effects)
    free = [place for place, one in enumerate(problem.forward.nuisances) if one.kind in OF_THE_RUN]
    predicted = problem.stacked(problem.forward.predict(z, chosen))
    worth = cost(problem.whitened(problem.measured - predicted), z[free], problem.train)
    for _ in range(ROUNDS):
        step = _step(problem, z, chosen, free, predicted)
        before = worth
        for share in SHORTENED:
            moved = z.copy()
            moved[free] += share * step
            there = problem.stacked(problem.forward.predict(moved, chosen))
            now = cost(problem.whitened(problem.measured - there), moved[free], problem.train)
            if now < worth:
                z, predicted, worth = moved, there, now
                break
        if before - worth < CONVERGED:
            break
    return predicted


def _step(
    problem: Problem, z: np.ndarray, effects: Sequence[Effect], free: Sequence[int], predicted: np.ndarray
) -> np.ndarray:
    """Gauss-Newton step of the free numbers."""
    forward = problem.forward
    setup, truth = forward.run(z, effects)

    def column(place: int) -> np.ndarray:
        moved = z.copy()
        moved[place] += STEP
        if forward.nuisances[place].of_sensor:
            prediction = forward.observe(setup, truth, moved)
        else:
            prediction = forward.predict(moved, effects)
        change = problem.whitened((problem.stacked(prediction) - predicted) / STEP)
        return (WEIGHT * change[problem.train]).ravel()

    jacobian = np.stack(in_parallel(column, free))
    left = (WEIGHT * problem.whitened(problem.measured - predicted)[problem.train]).ravel()
    matrix = jacobian @ jacobian.T + np.eye(len(free))
    return np.linalg.solve(matrix, jacobian @ left - z[free])


def _turned(problem: Problem, z: np.ndarray, effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects; those that turn with a wheel at the best of some angles, for where it stood is not known."""
    chosen = list(effects)
    for place, effect in enumerate(effects):
        names = type(effect).fields_of("phase")
        if not names:
            continue

        def worth(angle: float, place: int = place, name: str = names[0]) -> tuple[float, Effect]:
            tried = [*chosen[:place], chosen[place].but(**{name: angle}), *chosen[place + 1 :]]
            left = problem.measured - problem.stacked(problem.forward.predict(z, tried))
            return cost(problem.whitened(left), np.zeros(1), problem.train), tried[place]

        angles = np.arange(ANGLES) * 2.0 * np.pi / ANGLES
        chosen[place] = min(in_parallel(worth, angles.tolist()), key=lambda one: one[0])[1]
    return tuple(chosen)


def named(folders: Sequence[str]) -> dict[str, str]:
    """Folders by a short name that tells them apart."""
    short = [Path(one).name for one in folders]
    return dict(zip(short if len(set(short)) == len(short) else folders, folders, strict=True))
