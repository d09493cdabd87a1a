"""Separating: which further sensor, or the same run at another speed, would tell the classes of an `ambiguous` verdict
apart, by the same finite signatures, whitening and freedom of the nuisances as the plan.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from experiments.discrepancy.fit.fitting import Fit, Problem, starting_fit
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.result.planning import nominal_problem
from experiments.discrepancy.screen.projection import Projection
from experiments.discrepancy.select.decide import ENOUGH, IN_SET
from experiments.discrepancy.workflow import Findings
from experiments.inference.railway.further import further_sensors
from railsim.effects.interface import Effect
from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.sensors.interface import Sensor
from railsim.speed import Constant

LONGEST = 40.0  # s of run that are planned with
SPEEDS = (0.8, 1.2)  # of the nominal speed
RIVALS = 3  # classes that are told apart


@dataclass(frozen=True)
class Option:
    """A further sensor or another run.

    Attributes
    ----------
    label : in words. nats : evidence expected between the two classes that stay closest, nuisances free to follow.
    """

    label: str
    nats: float

    def plain(self) -> dict[str, Any]:
        """For the verdict."""
        return {"with": self.label, "nats": round(self.nats, 1), "separates": self.nats >= ENOUGH}


def separating(findings: Findings, progress: Progress) -> list[Option]:
    """The recording's own sensors first, then what would help, the best first; empty where there are no two classes."""
    rivals = rivals_of(findings)
    if len(rivals) < 2:
        return []
    evidence = findings.problem.evidence
    own = evidence.scenario.but(sensors=evidence.sensors, duration=min(LONGEST, evidence.duration))
    extra = further_sensors(own)
    progress(f"which of {len(extra)} further sensors or {len(SPEEDS)} speeds would tell {len(rivals)} classes apart")
    found = _with_sensors(own, extra, rivals, progress)
    base, others = found[0], found[1:]
    for scenario, label in _other_runs(own):
        with suppress(InputError):
            others.append(Option(label, closest_evidence(nominal_problem(scenario, progress), rivals)))
    return [base, *sorted(others, key=lambda one: -one.nats)]


def rivals_of(findings: Findings) -> list[tuple[Effect, ...]]:
    """The effects of the best hypothesis of each class that cannot be ruled out, as they were fitted."""
    found: dict[frozenset[str], tuple[Effect, ...]] = {}
    for one in findings.decision.judged:
        if one.probability >= IN_SET:
            found.setdefault(one.hypothesis.classes, one.hypothesis.fit.effects)
    return list(found.values())[:RIVALS]


def _with_sensors(
    own: Scenario, extra: Sequence[Sensor], rivals: Sequence[tuple[Effect, ...]], progress: Progress
) -> list:
    """Expected evidence with the sensors that there are, and with each further one, from one run of all together."""
    taken: list[Sensor] = []
    names = {name for sensor in own.sensors for name in sensor.channels()}
    for sensor in extra:
        if not names & set(sensor.channels()):
            taken.append(sensor)
            names |= set(sensor.channels())
    problem = nominal_problem(own.but(sensors=(*own.sensors, *taken)), progress)
    changes = [_change(problem, effects) for effects in rivals]
    base = {name for sensor in own.sensors for name in sensor.channels()}
    found = [Option("the sensors that there are", closest_evidence(with_channels(problem, base), rivals, changes))]
    for sensor in taken:
        label = f"{sensor.kind} {sensor.name} ({', '.join(name.split('.')[1] for name in sensor.channels())})"
        found.append(
            Option(label, closest_evidence(with_channels(problem, base | set(sensor.channels())), rivals, changes))
        )
    return found


def _other_runs(own: Scenario) -> Iterator[tuple[Scenario, str]]:
    """The same sensors at other speeds."""
    if isinstance(own.speed, Constant):
        for factor in SPEEDS:
            with suppress(InputError):
                speed = factor * own.speed.speed
                slower = own.but(speed=own.speed.but(speed=speed), duration=own.duration / max(1.0, factor))
                slower.check()
                yield slower, f"the same sensors at {speed:.1f} m/s"


def with_channels(problem: Problem, channels: set[str]) -> Problem:
    """The problem as if the other channels were lost."""
    kept = np.array([name in channels for name in problem.evidence.channels])
    measured = np.where(kept, problem.measured, np.nan)
    passed = problem.bank.propagated if problem.bank else None
    return problem.but(measured=measured).with_covariance(problem.measured, passed)


def _change(problem: Problem, effects: Sequence[Effect]) -> np.ndarray:
    """(k, f, c) of the effects beside the nominal model."""
    z = np.zeros(len(problem.forward.nuisances))
    plain = problem.stacked(problem.forward.predict(z))
    return problem.stacked(problem.forward.predict(z, effects)) - plain


def closest_evidence(
    problem: Problem, rivals: Sequence[tuple[Effect, ...]], changes: Sequence[np.ndarray] | None = None
) -> float:
    """Evidence [nats] between the two classes that stay closest: what of one's signature neither nuisances nor a
    signature of the other, scaled, can imitate; the lesser of both ways round.
    """
    fit: Fit = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    projection = Projection(problem.differentiated(fit), problem.train, problem.forward.bounds)
    changes = changes or [_change(problem, effects) for effects in rivals]
    own = [(WEIGHT * problem.whitened(one)[problem.train]).ravel() for one in changes]
    cleaned = [projection.cleaned(one) for one in own]
    shared = np.array([[float(a @ b) for b in cleaned] for a in own])
    return min(
        min(unexplained_nats(shared, a, b), unexplained_nats(shared, b, a)) for a, b in combinations(range(len(own)), 2)
    )


def unexplained_nats(shared: np.ndarray, a: int, b: int) -> float:
    """Nats of a that b cannot imitate, from the precision (n, n) that signatures share, nuisances free to follow."""
    along = float(shared[a, b]) ** 2 / max(float(shared[b, b]), 1e-12)
    return 0.5 * max(0.0, float(shared[a, a]) - along)
