"""Oracle of the blind benchmark: what could have been known, computed with the label open and after the verdict."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from experiments.discrepancy.fit.fitting import Fit, Problem, improved, linearised, moved_to, starting_fit
from experiments.discrepancy.fit.hypothesis import DROPPED, Hypothesis, concluded
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.progress import silent
from experiments.discrepancy.select.decide import held_out_gap
from experiments.discrepancy.select.refining import nuisances_alone
from experiments.discrepancy.workflow import Findings
from railsim.effects.interface import EFFECTS, Effect, Setup
from railsim.errors import InputError
from railsim.model import Model

ROUNDS, SETTLED = 5, 1.0  # linearisations at most, and nats that one must bring for another
SURELY = 1000.0  # nats beyond which it does not matter how much exactly: derivatives made anew take a sixth at most


def effect_of(settings: Mapping[str, Any]) -> Effect:
    """The effect of a label."""
    return EFFECTS.pick(settings["kind"]).build({name: value for name, value in settings.items() if name != "kind"})


def expected_evidence(
    problem: Problem, effects: Sequence[Effect], law: str, specimen: Mapping[str, float]
) -> list[float]:
    """Gain of the logarithm of the posterior [nats] that each true effect can be expected to bring beside the others,
    without the sections that speak loudest where the rule leaves these out; 0 where the model cannot run it.

    The nuisances are fitted, without noise, to the vehicle as it was built (`specimen`: scores by their labels; `law`:
    its creep law, under another one a brake seems to be needed) with and without the effect, and what it takes to do
    without is what it brings: a damper of 0.7 that a healthy one within its tolerance imitates brings little, however
    large its signature; worn wheels of a vehicle that was built with little conicity are like new ones with much. The
    workflow decides on this quantity with its noise on it, so an effect is detectable where it is large enough.
    """
    plain = _under(problem, law).but(journal=None)
    built = np.array([specimen.get(one.label, 0.0) for one in problem.forward.nuisances])
    found = []
    for number, effect in enumerate(effects):
        others = [*effects[:number], *effects[number + 1 :]]
        try:
            found.append(_expected(_with(plain, others), effect, built))
        except InputError:
            found.append(0.0)
    return found


def _under(problem: Problem, law: str) -> Problem:
    """The problem of a vehicle with that creep law."""
    nominal = getattr(getattr(problem.evidence.scenario.vehicle, "adhesion", None), "law", "")
    return problem.but(forward=problem.forward.but(law="" if law == nominal else law))


def _with(problem: Problem, effects: Sequence[Effect]) -> Problem:
    """The problem of a nominal scenario that has some effects."""
    evidence = problem.evidence
    scenario = evidence.scenario.but(effects=(*evidence.scenario.effects, *effects))
    return problem.but(forward=problem.forward.but(evidence=replace(evidence, scenario=scenario)))


def evidence_over_named(
    problem: Problem, named: Fit, effects: Sequence[Effect], law: str, specimen: Mapping[str, float]
) -> float:
    """Nats by which the true effects can be expected to be ahead of what was named in their place (a fit to the
    recording), when that is fitted without noise to the vehicle as it was built. Where they are few, the library does
    the same as what it does not hold, and this recording does not tell them apart.

    Raises
    ------
    InputError : the model cannot run the one or the other.
    """
    problem = _under(problem, law).but(journal=None)
    built = np.array([specimen.get(one.label, 0.0) for one in problem.forward.nuisances])
    hidden, least = _hidden(problem, effects, built)
    return _short_of(hidden, concluded(hidden, improved(hidden, moved_to(hidden, named))), effects, least)


def _expected(problem: Problem, effect: Effect, built: np.ndarray) -> float:
    hidden, least = _hidden(problem, [effect], built)
    return _short_of(hidden, nuisances_alone(hidden, np.zeros(len(built)), silent), [effect], least)


def _hidden(problem: Problem, effects: Sequence[Effect], built: np.ndarray) -> tuple[Problem, float]:
    """The problem of a noise-free recording of the vehicle as it was built, with the effects, and what the true model
    costs there.
    """
    hidden = problem.but(measured=problem.stacked(problem.forward.predict(built, tuple(effects))))
    truly = _with(hidden, effects)
    return hidden, improved(truly, starting_fit(truly, built)).cost(hidden.train) if built.any() else 0.0


def _short_of(hidden: Problem, one: Hypothesis, effects: Sequence[Effect], least: float) -> float:
    """Nats that a hypothesis, fitted on with derivatives made anew, is behind the true effects."""
    for _ in range(ROUNDS):
        if _brought(hidden, one, effects) - least > SURELY:
            break
        better = concluded(hidden, improved(hidden, linearised(hidden, one.fit)))
        if better.log_evidence < one.log_evidence + SETTLED:
            break
        one = better
    gain = _brought(hidden, one, effects) - least
    return max(0.0, gain) if np.isfinite(gain) else 0.0


def _brought(problem: Problem, one: Hypothesis, effects: Sequence[Effect]) -> float:
    """What a hypothesis costs, without the loudest sections where all effects act everywhere."""
    frames = 0.5 * ((WEIGHT * one.fit.residual[problem.train]) ** 2).sum(axis=(1, 2))
    local = any(_local(effect) for effect in effects)
    return one.fit.cost(problem.train) - (0.0 if local else float(np.sort(frames)[::-1][:DROPPED].sum()))


def _local(effect: Effect) -> bool:
    return effect.acts_on == "track" or type(effect).local()


def true_gap(findings: Findings, effects: Sequence[Effect], law: str, specimen: Mapping[str, float]) -> float:
    """Held-out gap of the true model: the true effects at their true sizes and the true creep law, with the nuisances
    fitted from the true build and from where the verdict's model has them; the better of the two.

    Raises
    ------
    InputError : the compiled engine cannot run the true model at all.
    """
    problem = findings.problem
    true = _under(_with(problem, effects), law)
    built = np.array([specimen.get(one.label, 0.0) for one in problem.forward.nuisances])
    found = []
    for z in (built, findings.final.z):
        with suppress(InputError):
            found.append(improved(true, starting_fit(true, z)))
    if not found:
        raise InputError("the true model does not run in the compiled engine")
    return held_out_gap(true, min(found, key=lambda one: one.cost(true.train)))


def acting(setup: Setup, effect: Effect) -> list[list[str]]:
    """Where an effect acts, as groups of bodies: those that an element joins, one that is changed itself; or a channel.

    Raises
    ------
    InputError : the setup has not what the effect acts on.
    """
    changed = effect.install(setup)
    if effect.acts_on == "sensor":
        return [[str(getattr(effect, name)) for name in type(effect).fields_of("channel")] or [""]]
    groups = {group[:-1] for group in _joined(setup.model) ^ _joined(changed.model)} | {
        (a.name,) for a, b in zip(changed.model.bodies, setup.model.bodies, strict=False) if repr(a) != repr(b)
    }
    if not groups or effect.acts_on in ("track", "contact", "wheel"):
        groups |= {(wheelset.body,) for wheelset in setup.model.wheelsets}
    return [list(one) for one in sorted(groups)]


def _joined(model: Model) -> set[tuple[str, ...]]:
    """Bodies that an element or a load acts on, with its law behind them (preloads and places follow from masses)."""
    linear = [(one.upper, one.lower, repr((one.name, one.stiffness, one.damping))) for one in model.elements]
    other = [(one.upper, one.lower, repr((one.axis, one.law))) for one in model.nonlinear]
    pairs = {(*sorted((upper, lower)), law) for upper, lower, law in [*linear, *other]}
    return pairs | {(one.body, repr(one)) for one in model.loads}
