"""Both measured laboratory sets through the inference: tables, and pictures of what was missing."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from experiments.discrepancy.core.curve import Curve, curve, whitened_power
from experiments.discrepancy.core.fitting import fit
from experiments.discrepancy.core.model import Coordinate, Effect, Hypothesis
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import LogNormal
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import infer
from experiments.discrepancy.core.verdict import Verdict
from experiments.discrepancy.systems import balls, double_pendulum, pendulum
from experiments.reporting.text import table
from railsim.errors import InputError

DROPS = "ball_drops.csv"
PENDULUM = "single_pendulum_{}.csv"
DOUBLE = "double_pendulum_identify_{}.csv"
LEARNED = ("identify_1", "identify_2", "identify_3", "identify_4")
PREDICTED = ("validate_1", "validate_2")
DOUBLES = range(1, 7)
SHOWN = 3  # hypotheses of a row
NOTHING = 1e-6  # a level that does not count
KNOWN = 1e-3  # sd of what is held
ENCODER = 5e-5  # rad; noise of the encoder, as every record's fit has it

Say = Callable[[str], None]


@dataclass(frozen=True)
class Told:
    """A record's verdicts: with the whole library, and with one that does not know what is missing."""

    name: str
    verdict: Verdict
    withheld: Verdict
    value: str
    law: Curve | None = None


def fall(folder: Path, say: Say) -> Iterator[Told]:
    """All balls with one camera."""
    drops = balls.read_drops(folder / DROPS)
    say(f"{len(drops)} balls, three rounds each")
    known = balls.infer_together(drops)
    say("drag withheld")
    withheld = balls.infer_together(drops, balls.LIBRARY.without("drag"), healthy=known.levels)
    for name, verdict in known.verdicts.items():
        yield Told(name, verdict, withheld.verdicts[name], _coefficient(verdict))


def _coefficient(verdict: Verdict) -> str:
    """Drag coefficient of the quadratic law with its 90 % interval."""
    row = next(row for row in verdict.rows if row.fit.hypothesis.name == "quadratic drag")
    spread = float(np.sqrt(np.linalg.inv(row.fit.precision)[-1, -1]))
    value = float(row.fit.x[-1])
    low, high = np.exp(value - 1.645 * spread), np.exp(value + 1.645 * spread)
    return f"drag coefficient {np.exp(value):.2f} ({low:.2f} to {high:.2f})"


def swing(folder: Path, say: Say) -> Iterator[Told]:
    """Every record of the single pendulum."""
    unknowing = pendulum.LIBRARY.without(*pendulum.FRICTIONS)
    for name in (*LEARNED, *PREDICTED):
        _, angle = pendulum.read_pendulum(folder / PENDULUM.format(name))
        system = pendulum.Pendulum(angle)
        say(f"pendulum {name}")
        known, withheld = infer(system, pendulum.LIBRARY), infer(system, unknowing)
        yield Told(name, known, withheld, _friction(known), _law(system, withheld))


def swing_double(folder: Path, say: Say) -> Iterator[Told]:
    """Every record of the double pendulum."""
    library = double_pendulum.LIBRARY
    for number in DOUBLES:
        angles = double_pendulum.read_double_pendulum(folder / DOUBLE.format(number))
        system = double_pendulum.DoublePendulum(angles)
        say(f"double pendulum {number}")
        unknowing = library.without("dry friction", "viscous friction")
        yield Told(f"identify_{number}", infer(system, library), infer(system, unknowing), "")


SETS: dict[str, Callable[[Path, Say], Iterator[Told]]] = {
    "balls": fall, "pendulum": swing, "double_pendulum": swing_double
}  # fmt: skip


def _friction(verdict: Verdict) -> str:
    """Dry friction with its 90 % interval, in the best hypothesis that has it."""
    for row in verdict.rows:
        names = [effect.name for effect in row.fit.hypothesis.effects]
        if "dry friction" in names:
            place = 3 + names.index("dry friction")
            spread = float(np.sqrt(np.linalg.inv(row.fit.precision)[place, place]))
            low, value, high = np.exp(row.fit.x[place] + 1.645 * spread * np.array([-1.0, 0.0, 1.0]))
            return f"dry friction {value:.3f} rad/s2 ({low:.3f} to {high:.3f})"
    return ""


def _law(system: pendulum.Pendulum, verdict: Verdict) -> Curve | None:
    """Curve of the law of the rate where that is what is missing."""
    place = "law of the rate"
    row = next((row for row in verdict.rows if row.fit.hypothesis.place == place), None)
    if row is None:
        return None
    largest = float(np.abs(np.diff(system.angle)).max()) / system.step
    states = np.linspace(-largest, largest, 81)
    cross = system.law(row.fit.x, row.fit.hypothesis.effects, place, states)
    level = [one.name for one in system.levels].index(place)
    own = (pendulum.TORQUE * np.exp(row.fit.x[0])) ** 2 * np.ones(len(states))
    return curve(row.fit, level, states, cross, own)


def predicted_powers(
    folder: Path, families: Collection[str] = pendulum.FRICTIONS
) -> dict[str, tuple[float, float]]:  # fmt: skip
    """Whitened power of the records that were not learned from: without friction, and with the friction of the others:
    one or two of `families`, those that speak for the others most.

    W and friction are held at what the four others say together; the encoder's zero, its noise and the states of the
    windows are fitted, and no latent error is allowed.
    """
    others = [pendulum.Pendulum(_angle(folder, name)) for name in LEARNED]
    frictions = [one for one in pendulum.LIBRARY.effects if one.family in families]
    choices = [(one,) for one in frictions] + list(combinations(frictions, 2))
    _, pull, known = max((_learned(others, one) for one in choices), key=lambda one: one[0])
    held = replace(known[0], faults=(Coordinate("log W", "1/s2", pull, KNOWN),))
    powers = {}
    for name in PREDICTED:
        system = pendulum.Pendulum(_angle(folder, name))
        bare = Effect("known", "known", faults=held.faults)
        powers[name] = (_power(system, (bare,)), _power(system, (held, *known[1:])))
    return powers


def _angle(folder: Path, name: str) -> np.ndarray:
    return pendulum.read_pendulum(folder / PENDULUM.format(name))[1]


def _learned(
    systems: Sequence[pendulum.Pendulum], effects: tuple[Effect, ...]
) -> tuple[float, float, tuple[Effect, ...]]:
    """Evidence of frictions over some records; log W, and the frictions at what all records say of them together: the
    product of their posteriors, with the prior once.
    """
    problem = Problem(systems[0], Hypothesis(effects), Policy())
    shared = np.array([0, *range(len(systems[0].coordinates), len(problem.means))])
    prior = np.diag(problem.spreads[shared] ** -2.0)
    precision, pulled, evidence = prior, prior @ problem.means[shared], 0.0
    for system in systems:
        found = fit(replace(problem, system=system), _begin(system, effects))
        if found is None:
            return -np.inf, 0.0, effects
        own = np.linalg.inv(np.linalg.inv(found.precision)[np.ix_(shared, shared)]) - prior
        told = own @ found.x[shared] + prior @ (found.x - problem.means)[shared]
        precision, pulled, evidence = precision + own, pulled + told, evidence + found.evidence
    pull, *sizes = np.linalg.solve(precision, pulled).tolist()
    known = tuple(replace(one, own=(replace(one.own[0], mean=size, spread=KNOWN),), starts=())
                  for one, size in zip(effects, sizes, strict=True))  # fmt: skip
    return evidence, pull, known


def _begin(system: pendulum.Pendulum, effects: tuple[Effect, ...]) -> np.ndarray:
    x = system.starts()[0]
    for effect in effects:
        x = effect.begins(x, system.coordinates)[-1]
    return x


def _power(system: pendulum.Pendulum, effects: tuple[Effect, ...]) -> float:
    """Whitened power with noise and states alone as sources of error."""
    quiet = tuple(replace(one, prior=LogNormal(NOTHING, KNOWN)) if one.place else one for one in system.levels)
    problem = Problem(pendulum.Pendulum(system.angle, levels=quiet), Hypothesis(effects), Policy())
    found = fit(problem, _begin(system, effects))
    if found is None:
        raise InputError("a record cannot be predicted: its motion is not finite")
    noise = np.log(ENCODER) * np.ones(1)
    return whitened_power(found.groups, np.concatenate([noise, found.psi[1:]]))


def page(told: list[Told]) -> str:
    """One row a record."""
    rows = [
        [
            one.name,
            str(one.verdict.action),
            _best(one.verdict),
            one.value,
            str(one.withheld.action),
            _best(one.withheld),
        ]
        for one in told
    ]
    titles = ["record", "verdict", "evidence over none [nats], posterior", "size", "withheld", "evidence, posterior"]
    return table(titles, rows)


def _best(verdict: Verdict) -> str:
    parts = (f"{row.fit.hypothesis.name} {row.evidence:+.1f}, {row.posterior:.2f}" for row in verdict.rows[:SHOWN])
    return "; ".join(parts)
