"""What is missing in the model of a vehicle, given a recording: the inference over the whole library of effects."""

import math
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from experiments.discrepancy.core.held_out import Held, held_out, untouched
from experiments.discrepancy.core.model import Fit, Group, Hypothesis
from experiments.discrepancy.core.next_measurement import Saving
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import infer
from experiments.discrepancy.core.verdict import State, Verdict
from experiments.discrepancy.railway.further import further, options
from experiments.discrepancy.railway.library import Found, found_library
from experiments.discrepancy.railway.passing import SEED
from experiments.discrepancy.railway.plan import Plan, planned
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.runs import give_back
from experiments.discrepancy.railway.scales import SCALES
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.railway.unknown import Unknown, unknown_of
from experiments.discrepancy.recording.evidence import Evidence
from railsim.errors import InputError
from railsim.track.track import Track

SEARCH = 0.85  # of the time limit; the rest is for held-out sections


@dataclass(frozen=True, eq=False)
class Answer:
    """A verdict with what it stands on.

    Attributes
    ----------
    system, found : the recording as a system, and the effects that it would show. seconds : of the search.
    nominal : residuals of the nominal model, aligned with the track. held : judged by held-out sections, of the nominal
    model, of `none` and of what was stated (None: no fit was finite, or there was no time left). further : recordings
    that would tell more, where several effects stay likely. plan : what would be named, if
    there was time.
    """

    verdict: Verdict
    system: Railway
    found: Found
    seconds: float
    nominal: tuple[Group, ...]
    held: tuple[Held | None, Held | None, Held | None]
    further: tuple[Saving, ...] = ()
    plan: Plan | None = None

    @property
    def none(self) -> Fit:
        """The healthy vehicle as it fits best."""
        return next(row.fit for row in self.verdict.rows if row.fit.hypothesis.name == "none")

    @cached_property
    def best(self) -> Fit:
        """The likeliest hypothesis that says what is stated, with its residuals."""
        found = stated(self.verdict) or self.none
        if found.groups:
            return found
        problem = Problem(found.system, found.hypothesis, Policy())
        components = found.system.covariances(found.x, found.hypothesis.effects)
        return replace(found, groups=problem.groups(found.x, components))

    @property
    def track(self) -> Track:
        """That is expected, given its file and the errors that the likeliest hypothesis has."""
        system = self.best.system
        return system.simulated.track if isinstance(system, Railway) else self.system.simulated.track

    @cached_property
    def unknown(self) -> Unknown | None:
        """What the unknown that is stated is like; None where none is."""
        return unknown_of(self.best)


def stated(verdict: Verdict) -> Fit | None:
    """The likeliest hypothesis that says what the verdict states; of a set its likeliest name."""
    action, said = verdict.action, frozenset(verdict.action.families)
    for row in verdict.rows:
        state = State.of(row.fit.hypothesis)
        named = len(state.families) == 1 and state.families <= said if action.kind == "set" else state.families == said
        if named and state.unknown == action.place:
            return row.fit
    return None


def answer(
    evidence: Evidence,
    kinds: Sequence[str] | None = None,
    policy: Policy | None = None,
    limit: float = math.inf,
    say: Callable[[str], None] = lambda _: None,
    found: Found | None = None,
) -> Answer:
    """The verdict on a recording.

    Parameters
    ----------
    kinds : plug-ins of which the library is made; None takes all. limit : seconds; what was not tried is said. say :
    told what is going on. found : a library that was made before from a recording of the same kind.

    Raises
    ------
    InputError : the recording cannot be compared with a model, or the nominal model does not run.
    """
    begin, policy, record = time.monotonic(), policy or Policy(), Record(evidence)
    system = Railway(record, SCALES)
    if found is None:
        say("what each effect would show")
        found = found_library(system, kinds)
    system = Railway(record, SCALES, found.makers, kept=system.kept)
    give_back()
    say(f"{len(found.installed)} effects, {len(found.laws)} laws without a name, {record.extent}")
    most = f" of {limit:.0f} at most" if math.isfinite(limit) else ""

    def told(step: str) -> None:
        say(f"{time.monotonic() - begin:.0f} s{most}: {step}")

    verdict = infer(system, found.library, policy, SEARCH * limit - (time.monotonic() - begin), told)
    seconds = time.monotonic() - begin
    say("held-out sections")
    nominal, held = _compared(verdict, system, policy, begin, limit)
    plan = _plan(system, found) if time.monotonic() < begin + limit else None
    more = _further(verdict, system, begin + limit, say) if verdict.action.kind == "set" else ()
    return Answer(verdict, system, found, seconds, nominal, held, more, plan)


def _plan(system: Railway, found: Found) -> Plan | None:
    """What this recording would have named; None where it would show no effect."""
    with suppress(InputError):
        return planned(system, found)
    return None


def _further(verdict: Verdict, system: Railway, end: float, say: Callable[[str], None]) -> tuple[Saving, ...]:
    """What to record next, as far as there is time."""
    return tuple(further(verdict, options(system.record, system.installed), np.random.default_rng(SEED), end, say))


def _compared(
    verdict: Verdict, system: Railway, policy: Policy, begin: float, limit: float
) -> tuple[tuple[Group, ...], tuple[Held | None, Held | None, Held | None]]:
    """What the nominal model leaves, over the track and the errors of all fits; and held-out sections."""
    none = next(row.fit for row in verdict.rows if row.fit.hypothesis.name == "none")
    best, aligned = stated(verdict), system.middle
    aligned[system.alignment] = none.x[system.alignment]
    over = system.about(aligned, (), None)
    held = (
        untouched(system, aligned, policy),
        held_out(none, system, policy, begin + 0.5 * (1.0 + SEARCH) * limit),
        None if best is None or best is none else held_out(best, system, policy, begin + limit),
    )
    return Problem(over, Hypothesis(), policy).groups(aligned, over.covariances(aligned, ())), held
