"""Both measured laboratory sets through the inference: tables, and pictures of what was missing."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from experiments.inference.curve import Curve, curve, whitened_power
from experiments.inference.fitting import fit
from experiments.inference.model import Coordinate, Effect, Hypothesis
from experiments.inference.policy import Policy
from experiments.inference.priors import LogNormal
from experiments.inference.problem import Problem
from experiments.inference.search import infer
from experiments.inference.systems import balls, double_pendulum, pendulum
from experiments.inference.verdict import Verdict
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


def predicted_powers(folder: Path, told: dict[str, Told]) -> dict[str, tuple[float, float]]:
    """Whitened power of the records that were not learned from: without friction, and with the friction of the others.

    W and friction are held at the means over the four others; the encoder's zero, its noise and the states of the
    windows are fitted, and no latent error is allowed.
    """
    dry = next(effect for effect in pendulum.LIBRARY.effects if effect.name == "dry friction")
    found = [
        row.fit.x for name in LEARNED for row in told[name].verdict.rows if row.fit.hypothesis.name == "dry friction"
    ]
    if not found:
        raise InputError("no record named dry friction; there is nothing to predict with")
    pull, _, _, friction = np.mean(found, axis=0)
    held = (Coordinate("log W", "1/s2", float(pull), KNOWN),)
    known = replace(dry, faults=held, own=(Coordinate("log dry", "rad/s2", float(friction), KNOWN),), starts=())
    powers = {}
    for name in PREDICTED:
        _, angle = pendulum.read_pendulum(folder / PENDULUM.format(name))
        system = pendulum.Pendulum(angle)
        powers[name] = (_power(system, Effect("known", "known", faults=held)), _power(system, known))
    return powers


def _power(system: pendulum.Pendulum, effect: Effect) -> float:
    """Whitened power with noise and states alone as sources of error."""
    quiet = tuple(replace(one, prior=LogNormal(NOTHING, KNOWN)) if one.place else one for one in system.levels)
    problem = Problem(pendulum.Pendulum(system.angle, levels=quiet), Hypothesis((effect,)), Policy())
    found = fit(problem, effect.begins(system.starts()[0], system.coordinates)[-1])
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
