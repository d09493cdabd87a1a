"""Verdicts on simulated vehicles whose truth is hidden, in twelve settings: healthy ones, effects, pairs, and effects
that the library is denied. Runs by Exudyn, part of them with FASTSIM; builds and sensors off their sheets.
"""

import json
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discrepancy.core.counting import Rows, dealt, judged, share
from experiments.discrepancy.core.counting import score as counted
from experiments.discrepancy.core.verdict import Row, State
from experiments.discrepancy.railway.answer import Answer, answer
from experiments.discrepancy.railway.cases import as_measured
from experiments.discrepancy.railway.runs import one_thread_each
from experiments.discrepancy.railway.settings import settings
from experiments.discrepancy.railway.specimens import build_specimen, drawn_effect
from experiments.discrepancy.railway.statement import STATUS, status
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.effects.interface import EFFECTS
from railsim.effects.interface import Effect as Plugin
from railsim.errors import InputError
from railsim.files import replace_file
from railsim.measurements import Measurements
from railsim.scenario import Scenario

NAME = "vehicle"  # of the files
KINDS = ("null", "effect", "null", "withheld", "null", "effect", "null", "pair", "null", "effect")
"""Of ten cases in a row; each goes on to the next setting after ten."""
OUTSIDE = ("withheld", "foreign")  # kinds of cases whose effect the library does not hold
STRENGTH = (0.5, 2.0)  # of a foreign law's forces, times as its file says
TRIES = 20  # draws of a case, until one can be run
SHOWN = 12  # hypotheses of a table that are kept

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Case:
    """A recording, what the inference is told of it, and what is true."""

    kind: str
    setting: str
    told: Scenario
    recorded: Measurements
    effects: tuple[Plugin, ...]

    @property
    def families(self) -> tuple[str, ...]:
        """What a right verdict names."""
        return tuple(type(one).equivalence() for one in self.effects)

    @property
    def local(self) -> bool:
        """Whether one of the effects acts at a place or a time."""
        return any(type(one).local() for one in self.effects)


def case_of(seed: int, index: int, laws: Sequence[Plugin] = ()) -> Case:
    """A case, always the same. laws : from outside the library, which every second withheld effect then is.

    Raises
    ------
    InputError : no draw could be run.
    """
    kind, name = dealt(index, KINDS, tuple(settings()))
    setting, rng = settings()[name], np.random.default_rng([seed, index])
    told = setting.nominal
    kind = "foreign" if laws and kind == "withheld" and index // len(KINDS) % 2 else kind
    for _ in range(TRIES):
        effects = _hidden(told, kind, laws, rng)
        try:
            true = build_specimen(told, effects, rng, setting.payload)
            return Case(kind, name, told, as_measured(true, told, stated=setting.stated), effects)
        except InputError:  # an effect that this vehicle cannot have, or a run that leaves the rails
            continue
    raise InputError(f"case {index}: no draw could be run; take another seed")


def _hidden(told: Scenario, kind: str, laws: Sequence[Plugin], rng: np.random.Generator) -> tuple[Plugin, ...]:
    """What is hidden in a case."""
    if kind == "foreign":
        return (laws[int(rng.integers(len(laws)))].but(scale=float(rng.uniform(*STRENGTH))),)
    return tuple(drawn_effect(told, rng) for _ in range({"null": 0, "pair": 2}.get(kind, 1)))


def run_benchmark(
    folder: Path, seed: int, indices: Iterable[int], say: Say, limit: float, laws: Sequence[Plugin] = ()
) -> None:
    """Answer the cases that `folder` does not hold yet, a file each. limit : seconds of a verdict. laws : of `case_of`.

    Raises
    ------
    InputError : a case cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for index in indices:
        path = folder / f"{NAME}_{seed}_{index:04d}.json"
        if path.exists():
            continue
        case, begin = case_of(seed, index, laws), (time.monotonic(), time.process_time())
        row: dict[str, Any] = {"kind": case.kind, "setting": case.setting, "families": case.families}
        row["effects"] = [one.settings() for one in case.effects]
        try:
            row |= answered(case, asked(case, limit))
        except (InputError, np.linalg.LinAlgError) as error:
            nothing = {"table": [], "own": None, "stated": 0.0, "leads": False, "covered": {}}
            row |= {"said": f"refused: {error}", "judged": "no answer"} | nothing
        spent = {"seconds": time.monotonic() - begin[0], "cpu": time.process_time() - begin[1]}
        row |= {"seed": seed, "index": index, **spent}
        replace_file(path, (json.dumps(row, indent=1) + "\n").encode())
        say(f"{index} {case.kind} {case.setting} {' + '.join(case.families)}: {row['said']} ({row['judged']})")


def asked(case: Case, limit: float) -> Answer:
    """The answer to a case, of a library that does not hold what is withheld."""
    denied = case.families if case.kind == "withheld" else ()
    kinds = [name for name, one in EFFECTS.classes().items() if one.equivalence() not in denied]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return one_thread_each(answer)(evidence_of(case.recorded, case.told), kinds, limit=limit)


def answered(case: Case, found: Answer) -> dict[str, Any]:
    """Truth, statement and the best hypotheses of a case."""
    verdict, said = found.verdict, status(found)
    names = [_name(found, one) for one in case.effects]
    alone = (row for row in verdict.rows if _known(row))
    own = next((row for row in alone if row.fit.hypothesis.families == frozenset(case.families)), None)
    state, probability = max(verdict.posterior().items(), key=lambda one: one[1])
    action = verdict.action if said in STATUS.values() else None
    return {
        "said": str(action) if action else said,
        "judged": judged(case.kind, case.families, None, action) if action else said,
        "local": case.local, "shown": None not in names,
        "table": [[r.fit.hypothesis.name, round(r.evidence, 2), round(r.posterior, 4)] for r in verdict.rows[:SHOWN]],
        "own": own.evidence if own and case.effects else None, "stated": probability,
        "leads": state == State(frozenset(case.families)) if case.kind not in OUTSIDE else state.unknown is not None,
        "covered": covered(case, found, names),
        "held": [None if one is None else [one.power, one.gap] for one in found.held],
        "not_tried": len(verdict.not_tried),
    }  # fmt: skip


def _known(row: Row) -> bool:
    return bool(row.fit.hypothesis.effects) and row.fit.hypothesis.place is None


def _name(found: Answer, true: Plugin) -> str | None:
    """The name of a true effect in the library; None where its channels do not show it."""
    held = {one.name for one in found.found.library.effects}
    for name, one in found.found.installed.items():
        if name in held and one.plugin is type(true) and all(getattr(true, k) == v for k, v in one.choices.items()):
            return name
    return None


def covered(case: Case, found: Answer, names: list[str | None]) -> dict[str, float]:
    """Normalised errors of the sizes of the true effects, in the hypothesis that has just these."""
    row = next((one for one in found.verdict.rows if _known(one)
                and sorted(e.name for e in one.fit.hypothesis.effects) == sorted(map(str, names))), None)  # fmt: skip
    if row is None:
        return {}
    fit, spreads, errors = row.fit, np.sqrt(np.diag(np.linalg.inv(row.fit.precision))), {}
    for effect, places in zip(fit.hypothesis.effects, fit.hypothesis.places(found.system.coordinates), strict=True):
        true = case.effects[names.index(effect.name)]
        values = [getattr(true, name) for name in found.found.installed[effect.name].fields]
        if effect.name in found.found.twins:
            values = [found.found.twins[effect.name].value(values[0])]
        for place, value, field in zip(places, values, found.found.installed[effect.name].fields, strict=True):
            off = fit.x[place] - value
            if type(true).role(field) == "distance":  # of any of those that come again
                off -= sum(round(off / apart) * apart for apart in _spacings(true))
            errors[f"{effect.family}: {field}"] = float(off / spreads[place])
    return errors


def _spacings(true: Plugin) -> list[float]:
    return [getattr(true, name) for name in true.fields_of("spacing")]


def score(rows: Rows) -> list[list[Any]]:
    """Rows of the table: those of every benchmark, false alarms, and by setting."""
    found = counted(rows, tuple(settings()))
    nulls, hidden = ([row for row in rows if (row["kind"] == "null") is null] for null in (True, False))
    named = ("wrong", "half", "right", "in a set")
    found.append(share("healthy vehicles that are accused", [row["judged"] == "wrong" for row in nulls]))
    for name in settings():
        here = [row for row in hidden if row["setting"] == name and row["kind"] == "effect" and row.get("shown")]
        found.append(share(f"effects that show: right: {name}", [row["judged"] == "right" for row in here]))
    local = [row for row in hidden if row["kind"] == "effect" and row.get("local")]
    found.append(share("effects at a place or a time: a name", [row["judged"] in named for row in local]))
    found.append(share("no answer, or undecided", [row["judged"] in ("no answer", "undecided") for row in rows]))
    return found
