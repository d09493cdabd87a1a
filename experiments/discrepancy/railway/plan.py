"""Plan: before anyone records, which effects this vehicle, track, speed and sensor set can show and tell apart."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from experiments.discrepancy.core.levels import middles, sums
from experiments.discrepancy.core.model import Coordinate, Effect, Hypothesis, Predicted
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem, whitened
from experiments.discrepancy.core.verdict import log_prior
from experiments.discrepancy.railway.cases import as_measured
from experiments.discrepancy.railway.library import Found, found_library
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.scales import SCALES
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.effects.interface import Parameter
from railsim.errors import InputError
from railsim.scenario import Scenario

LEAST, MOST = 0.1, 1000.0  # nats, of the picture
SIZES = np.geomspace(1e-3, 30.0, 400)  # of the default size, that are tried


@dataclass(frozen=True)
class Planned:
    """An effect: the number that says its size, the smallest one that would be named (None: none) and its unit."""

    label: str
    number: str
    size: float | None
    unit: str


@dataclass(frozen=True)
class Plan:
    """What could be seen. apart : (n, n) nats by which each effect (rows), at its default size, is told from each other
    one of any size, tolerances free to follow; on the diagonal from a healthy vehicle. unseen : effects that these
    channels would not show, and why.
    """

    effects: tuple[Planned, ...]
    apart: np.ndarray
    unseen: tuple[str, ...]

    def confusable(self) -> list[tuple[str, str, float]]:
        """Effects that are seen, the other one that each would be taken for, and the nats that tell them apart, worst
        first: fewer than from where one name costs less than a set of both.
        """
        labels, losses = [one.label for one in self.effects], Policy().losses
        least = math.log((losses.wrong - losses.extra) / losses.extra)
        pairs = [
            (labels[i], labels[j], float(self.apart[i, j]))
            for i, j in np.argwhere(self.apart < least)
            if i != j and self.apart[i, i] > least
        ]
        return sorted(pairs, key=lambda one: one[2])

    def sizes(self) -> dict[str, float]:
        """Of effects, the smallest size that would be named; without those that would be at no size."""
        return {one.label.partition(" (")[0]: one.size for one in self.effects if one.size is not None}

    def plain(self) -> dict[str, Any]:
        """As JSON holds it."""
        sizes = [
            {"effect": one.label, "name": one.number, "value": one.size, "unit": one.unit if one.size else "at no size"}
            for one in self.effects
        ]
        pairs = [{"effect": a, "taken_for": b, "nats": round(value, 2)} for a, b, value in self.confusable()]
        return {"detectable_size": sizes, "confusable": pairs, "not_shown": list(self.unseen)}


def make_plan(
    scenario: Scenario, kinds: Sequence[str] | None = None, say: Callable[[str], None] = lambda _: None
) -> Plan:
    """By the nominal vehicle, its sensors, its track and its survey's errors: what an effect changes, in units of all
    errors of a healthy vehicle, tolerances free to follow. kinds : plug-ins; None takes all.

    Raises
    ------
    InputError : no sensor that is compared, none of the effects would be shown, or the nominal model does not run.
    """
    say("a run of the nominal vehicle")
    record = Record(evidence_of(as_measured(scenario, scenario, "compiled"), scenario))
    system = Railway(record, SCALES)
    say("what each effect would show")
    found = found_library(system, kinds)
    return planned(Railway(record, SCALES, found.installed, kept=system.kept), found)


def planned(system: Railway, found: Found) -> Plan:
    """Of a recording's library. An effect is named where naming it costs less than silence, by its expected evidence
    (as of a linear size). One with a place stands in the middle of the run. Of several variants the first counts.

    Raises
    ------
    InputError : none of the effects would be shown.
    """
    space = _Space.of(system)
    shown = [(one, change) for one in _first_variants(found) if (change := _change(one, system, found)) is not None]
    if not shown:
        why = found.left_out[0] if found.left_out else "their runs fail"
        raise InputError(f"these sensors would show none of these effects ({why}); add sensors, or name other effects")
    cleaned = np.stack([space.cleaned(one, change) for one, change in shown])
    sized = [_Sized.of(one, system, found) for one, _ in shown]
    cleaned *= np.array([one.scale for one in sized])[:, None]
    effects = [one.planned(float(row @ row)) for one, row in zip(sized, cleaned, strict=True)]
    return Plan(tuple(effects), _apart(cleaned), found.left_out)


def _apart(cleaned: np.ndarray) -> np.ndarray:
    """Half the square of each row that is left beside each other one."""
    shared = cleaned @ cleaned.T
    own = np.diag(shared)
    left = own[:, None] - shared**2 / np.maximum(own, 1e-12)
    return 0.5 * np.where(np.eye(len(own), dtype=bool), shared, np.maximum(left, 0.0))


def _first_variants(found: Found) -> list[Effect]:
    first: dict[type, Effect] = {}
    for one in (one for one in found.library.effects if one.kind == "name"):
        first.setdefault(found.installed[one.name].plugin, one)
    return list(first.values())


def _change(effect: Effect, system: Railway, found: Found) -> Predicted | None:
    """(1, F, T, C) of each section, of its default size (empty for a tolerance: by that coordinate); None where its run
    fails.
    """
    if effect.moves or not effect.own:
        return ()
    if effect.shown is not None:
        return tuple(one[:1] for one in effect.shown)
    installed = found.installed[effect.name]
    numbers = installed.plugin.parameters()
    values = [numbers[one.name].default if numbers[one.name].absent is not None else one.mean for one in effect.own]
    try:
        plugin = installed.make(np.array(values))
        shown = system.shown([(system.nominal_with(plugin), 0.0), (system.nominal, 0.0)])
    except InputError:
        return None
    change = tuple(one[:1] - one[1:] for one in shown)
    return change if all(np.isfinite(one).all() for one in change) else None


@dataclass(frozen=True)
class _Space:
    """Whitened changes by the healthy coordinates, priors beside them: `rows` (coordinates, values + coordinates) and
    their products `square`.
    """

    names: list[str]
    whiten: Callable[[Predicted], np.ndarray]
    rows: np.ndarray
    square: np.ndarray

    @classmethod
    def of(cls, system: Railway) -> "_Space":
        """About the nominal vehicle, at the levels of a healthy one."""
        x = system.middle
        problem = Problem(system.about(x, (), None), Hypothesis(), Policy())
        groups = problem.groups(x, problem.system.covariances(x, ()))
        parts, psi = sums(groups), middles(problem.levels)
        rows = np.hstack([whitened(parts, psi, problem.slopes(x, groups)), np.diag(1.0 / problem.spreads)])
        names = [one.name for one in system.coordinates]
        return cls(names, lambda change: whitened(parts, psi, change), rows, rows @ rows.T)

    def cleaned(self, effect: Effect, change: Predicted) -> np.ndarray:
        """(values + coordinates,) what of a change no healthy coordinate could do; of a tolerance per unit of it."""
        others, count = np.ones(len(self.names), bool), len(self.names)
        if change:
            whole = np.concatenate([self.whiten(change)[0], np.zeros(count)])
        else:
            moves = effect.moves or ((effect.faults[0].name, 1.0),)
            others[[self.names.index(one.name) for one in effect.faults]] = False
            moved = sum(rate * self.rows[self.names.index(name), :-count] for name, rate in moves)
            whole = np.concatenate([moved, np.zeros(count)])
        taken = np.linalg.solve(self.square[np.ix_(others, others)], self.rows[others] @ whole)
        return whole - taken @ self.rows[others]


@dataclass(frozen=True)
class _Sized:
    """How large an effect is, in default sizes: `scale` of a tolerance's coordinate for one, `value` of its number for
    so many, `fault` and `healthy` spread of sizes, and `least` nats that a name needs.
    """

    label: str
    name: str
    number: Parameter
    scale: float
    value: Callable[[float], float]
    fault: Coordinate
    healthy: float
    least: float

    @classmethod
    def of(cls, effect: Effect, system: Railway, found: Found) -> "_Sized":
        """Of an effect of the library."""
        installed, twin = found.installed[effect.name], found.twins.get(effect.name)
        numbers = installed.plugin.parameters()
        name = next(one for one in installed.fields if numbers[one].absent is not None)
        number, least = numbers[name], _odds(effect, found)
        absent = number.absent or 0.0
        if twin:
            (fault,) = (*effect.faults, *effect.own)
            healthy = next((one.spread for one in system.coordinates if one.name == fault.name), 0.0)
            scale = twin.value(number.default)
            absent_there = 0.0
            value: Callable[[float], float] = lambda size: float(getattr(twin.make(size * scale), name))  # noqa: E731
        else:
            fault = next(one for one in effect.own if one.name == name)
            healthy = next((one.spread for one in effect.healthy if one.name == name), 0.0)
            scale, absent_there = number.default - absent, absent
            value = lambda size: absent + size * (number.default - absent)  # noqa: E731
        fault = replace(fault, mean=(fault.mean - absent_there) / scale, spread=fault.spread / abs(scale))
        whole = scale if twin else 1.0
        return cls(effect.name, name, number, whole, value, fault, healthy / abs(scale), least)

    def planned(self, information: float) -> Planned:
        """With the information on one default size."""
        size = smallest_named(information, self.fault, self.healthy, self.least)
        value = None if size is None else float(f"{self.value(size):.3g}")
        within = value is not None and self.number.low <= value <= self.number.high
        return Planned(self.label, self.name, value if within else None, self.number.unit)


def _odds(effect: Effect, found: Found) -> float:
    """Nats that the data must bring until a name costs less than silence."""
    policy = Policy()
    prior = log_prior(Hypothesis((effect,)), found.library, (), policy) - math.log(policy.none)
    return math.log(policy.losses.false_alarm / policy.losses.miss) - prior


def smallest_named(information: float, fault: Coordinate, healthy: float, least: float) -> float | None:
    """The smallest size, in default sizes, whose expected evidence against `none` is `least` nats at least; None where
    none is. information : on that size. fault : its prior where it is a fault. healthy : its spread where it is none.
    """
    if information <= 0.0:
        return None
    wide, narrow = fault.spread**2 + 1.0 / information, healthy**2 + 1.0 / information
    gains = 0.5 * (SIZES**2 / narrow - (SIZES - fault.mean) ** 2 / wide + math.log(narrow / wide))
    enough = np.flatnonzero(gains >= least)
    return float(SIZES[enough[0]]) if len(enough) else None


def draw_plan(plan: Plan, path: Path) -> None:
    """What tells each effect from each other one, as a picture."""
    labels = [one.label for one in plan.effects]
    figure = Figure(figsize=(4.2 + 0.24 * len(labels), 3.6 + 0.24 * len(labels)), layout="constrained")
    panel = figure.subplots()
    image = panel.imshow(np.maximum(plan.apart, LEAST), norm=LogNorm(LEAST, MOST), cmap="viridis")
    panel.set_xticks(range(len(labels)), labels, rotation=90, fontsize=7)
    panel.set_yticks(range(len(labels)), labels, fontsize=7)
    panel.set_xlabel("may be taken for (diagonal: for a healthy vehicle)", fontsize=8)
    panel.set_ylabel("what is there, at its default size", fontsize=8)
    bar = figure.colorbar(image, ax=panel, shrink=0.7, extend="both")
    bar.set_label("nats that tell them apart (2 give odds of 7)", fontsize=7)
    bar.ax.tick_params(labelsize=7)
    figure.savefig(path, dpi=110)
