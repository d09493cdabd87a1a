"""Recordings in which no effect is looked for: how well what was found in another one predicts them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.discrepancy.core.fitting import fit
from experiments.discrepancy.core.held_out import Held, Known, held_out, untouched
from experiments.discrepancy.core.model import Fit
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import healthy_fit
from experiments.discrepancy.railway.answer import Answer
from experiments.discrepancy.railway.further import carried
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.scales import SCALES
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import GivenTrack, gather
from railsim.errors import InputError
from railsim.scenario import Scenario


@dataclass(frozen=True)
class Elsewhere:
    """A recording by name, its mean speed [m/s] and length [s]; on its held-out sections what the nominal model leaves,
    the model with tolerances, and the model as stated (None: no fit was finite).
    """

    name: str
    speed: float
    duration: float
    held: tuple[Held, Held | None, Held | None]

    def plain(self) -> dict[str, Any]:
        """For the verdict."""
        names = ("before", "nuisance_only", "after")
        gap = {n: None if one is None else round(one.gap, 3) for n, one in zip(names, self.held, strict=True)}
        return {"recording": self.name, "speed": round(self.speed, 3), "duration": self.duration, "gap": gap}


def records(paths: Sequence[str], scenario: Scenario, track: GivenTrack) -> dict[str, Record]:
    """Recordings by name, laid on the track; what is wrong with one is said before anything is fitted.

    Raises
    ------
    InputError : a recording cannot be compared with a model.
    """
    found = {}
    for path in paths:
        try:
            found[path] = Record(gather(path, scenario, track))
            _ = found[path].registration, found[path].channels
        except InputError as error:
            raise InputError(f"--held-out {path}: {error}") from None
    return found


def elsewhere(answer: Answer, others: dict[str, Record], say: Callable[[str], None]) -> list[Elsewhere]:
    """How well what was found predicts other recordings. A fit to two thirds of each finds where the run lies on the
    track; vehicle, sensors and effects are as known from the first recording, with what it left open.
    """
    found = []
    for name, record in others.items():
        say(f"{name}: laid beside what was found")
        system, policy = Railway(record, SCALES, answer.found.makers), Policy()
        healthy, _ = Known.after(carried(answer.none, system))
        none = healthy_fit(healthy, policy)
        aligned = system.middle
        aligned[system.alignment] = none.x[system.alignment]
        alone = held_out(none, healthy, policy)
        same = answer.best.hypothesis == answer.none.hypothesis
        after = alone if same else _stated(answer.best, none, system, policy)
        held = (untouched(system, aligned, policy), alone, after)
        found.append(Elsewhere(name, float(np.mean(record.speed[1])), record.duration, held))
    return found


def _stated(best: Fit, none: Fit, system: Railway, policy: Policy) -> Held | None:
    """Of what was stated, from where `none` lies on the track."""
    known, hypothesis = Known.after(carried(best, system))
    begin = np.array([one.mean for one in hypothesis.coordinates(known.coordinates)])
    begin[system.alignment] = none.x[system.alignment]
    again = fit(Problem(known, hypothesis, policy), begin)
    return None if again is None else held_out(again, known, policy)
