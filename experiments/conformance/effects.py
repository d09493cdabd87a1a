"""What every effect must do."""

import pickle
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, get_args

import numpy as np

from experiments.conformance.interface import Check, described, fields_with_unit_and_source
from railsim.dynamics.channels import channel_names
from railsim.dynamics.equilibrium import initial_state, state_size
from railsim.dynamics.plant import Plant, build_plant
from railsim.effects.interface import PLACES, Effect, Setup
from railsim.engines.interface import Run
from railsim.errors import InputError
from railsim.model import Model
from railsim.scenario import Scenario
from railsim.simulation import build_run, load_engine
from railsim.spec import Role
from railsim.vehicles.interface import VEHICLES

Kind = type[Effect]
BASE = {"track": "straight_erri_high", "speed": {"kind": "constant", "speed": 25.0}, "start": 60.0, "duration": 0.3}
SENSORS: list[dict[str, Any]] = [
    {"kind": "accelerometer", "name": "bogie", "body": "bogie", "axes": ["x", "y", "z"], "rate": 256},
    {"kind": "gyro", "name": "bogie", "body": "bogie", "rate": 256},
    {"kind": "displacement", "name": "primary1_left", "rate": 256},
    {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64},
]
SAME = 1e-9  # of a channel's largest value
PLACED = {
    "": (),
    "short": ("distance",),
    "stretch": ("distance", "length"),
    "pulse": ("distance time", "length duration"),
}
"""Roles of which an effect of each extent needs one field each."""


def knows_itself(kind: Kind) -> Iterable[str]:
    """It is rebuilt from its settings, and says where it acts and what it looks like."""
    effect = kind.build({})
    if kind.build(effect.model_dump(mode="json")) != effect:
        yield "is not rebuilt from its own settings"
    if kind.acts_on not in PLACES:
        yield f"acts_on '{kind.acts_on}' is none of {', '.join(PLACES)}"
    if len(kind.signature) <= 30:
        yield "signature: say in words what it looks like"
    if not kind.references:
        yield "references: name a source, with author and year"
    for title, values in (("absent", kind.absent), ("smallest", kind.smallest)):
        wrong = set(values) - set(kind.parameters())
        if wrong or not values:
            yield f"{title}: give values of its numbers with both bounds ({', '.join(kind.parameters()) or 'none yet'})"


def says_what_a_search_needs(kind: Kind) -> Iterable[str]:
    """Its fields have the roles that its kind of extent asks for, and trials within their bounds."""
    free, roles = kind.parameters(), {kind.role(field) for field in kind.model_fields}
    if unknown := roles - set(get_args(Role)):
        yield f"role {', '.join(sorted(unknown))} is none of {', '.join(get_args(Role))}"
    for wanted in PLACED.get(kind.extent, ()):
        if not any(kind.role(field) in wanted.split() for field in free):
            yield f"extent '{kind.extent}' needs a number of role {wanted.replace(' ', ' or ')}"
    if kind.weakens and "factor" not in free:
        yield "what weakens a damping needs a number 'factor'"
    for field, parameter in free.items():
        if not all(parameter.low <= value <= parameter.high for value in parameter.trials):
            yield f"trials of '{field}' leave its bounds {parameter.low:g} to {parameter.high:g}"


def every_vehicle_takes_or_refuses_it(kind: Kind) -> Iterable[str]:
    """Each vehicle either takes it or refuses it in one line that names it, whatever its size."""
    for vehicle in VEHICLES.classes():
        said = [_refusal(effect, vehicle) for effect in (kind.build({}), kind.at_smallest())]
        wrong = [text for text in said if text and (kind.build({}).kind not in text or "\n" in text)]
        if wrong:
            yield f"on '{vehicle}': '{wrong[0]}' does not name the effect in one line"
        if bool(said[0]) != bool(said[1]):
            yield f"on '{vehicle}': taken at one size and refused at another"


def takes_the_part_that_it_is_told(kind: Kind) -> Iterable[str]:
    """A bogie or a wheelset that the vehicle has not is refused in one line; of others only what belongs to it
    changes.
    """
    for vehicle in VEHICLES.classes():
        if _refusal(kind.build({}), vehicle):
            continue
        model = _nominal(vehicle).model
        bogies = [body.name for body in model.bodies if re.fullmatch(r"bogie\d*", body.name)]
        parts: dict[Role, list[str]] = {"bogie": bogies, "wheelset": [wheelset.body for wheelset in model.wheelsets]}
        for field, names in ((name, parts[role]) for role in parts for name in kind.fields_of(role)):
            for number in (one for one in get_args(kind.model_fields[field].annotation) if isinstance(one, int)):
                yield from _of_part(kind.build({field: number}), vehicle, number, names)


def _of_part(effect: Effect, vehicle: str, number: int, names: Sequence[str]) -> Iterable[str]:
    """What is wrong with an effect on one of the bodies of these names."""
    said = _refusal(effect, vehicle)
    if number > len(names):
        if effect.kind not in said or "\n" in said:
            yield f"on '{vehicle}': number {number} of {len(names)} is not refused in one line ('{said}')"
        return
    if said:
        yield f"on '{vehicle}': number {number} is refused: {said}"
        return
    before, after = _nominal(vehicle).model, _nominal(vehicle).but(effects=(effect,)).model
    others = {name for i, name in enumerate(names) if i != number - 1}
    if wrong := sorted(changed_bodies(before, after) & others):
        yield f"on '{vehicle}': number {number} changes {', '.join(wrong)}"


def changed_bodies(before: Model, after: Model) -> set[str]:
    """Bodies of elements that differ between two models, and of wheelsets whose wheels differ."""
    joints = [{e.name: (pickle.dumps(e), e) for e in (*m.elements, *m.nonlinear)} for m in (before, after)]
    found: set[str] = set()
    for name in joints[0].keys() | joints[1].keys():
        one, other = (side.get(name) for side in joints)
        if one is None or other is None or one[0] != other[0]:
            element = (other or one or ("", None))[1]
            found |= {element.upper, element.lower} if element else set()
    wheels = [{w.body: pickle.dumps(w) for w in m.wheelsets} for m in (before, after)]
    return found | {name for name, wheel in wheels[0].items() if wheels[1].get(name) != wheel}


def absent_values_change_nothing(kind: Kind) -> Iterable[str]:
    """At its absent values every vehicle that takes it moves as without it."""
    effect = kind.at_absent()
    takers = [vehicle for vehicle in VEHICLES.classes() if not _refusal(effect, vehicle)]
    for vehicle in takers if effect.acts_on != "sensor" else ():
        plain, there = _plain(vehicle), _motion(vehicle, effect)
        worst = max(_distance(there[name], plain[name]) for name in plain if name in there)
        if worst > SAME:
            yield f"on '{vehicle}': at its absent values the motion differs by {worst:.2g}"


def pure(kind: Kind) -> Iterable[str]:
    """The setup that it is given stays as it was."""
    taker = next((vehicle for vehicle in VEHICLES.classes() if not _refusal(kind.build({}), vehicle)), None)
    if taker is None:
        yield "no vehicle takes it"
        return
    setup = _nominal(taker).setup
    before = _state(setup)
    _ = kind.build({}).install(setup).model  # changes of the model are made when it is asked for
    if _state(setup) != before:
        yield "changes the setup that it is given; make another with setup.but(...)"


CHECKS: tuple[Check[Kind], ...] = (
    described,
    fields_with_unit_and_source,
    knows_itself,
    says_what_a_search_needs,
    every_vehicle_takes_or_refuses_it,
    takes_the_part_that_it_is_told,
    absent_values_change_nothing,
    pure,
)


@cache
def _nominal(vehicle: str) -> Scenario:
    """A short run of a vehicle with the sensors that it can carry."""
    bodies = [body.name for body in VEHICLES.pick(vehicle).build({}).model().bodies]
    sensors = [one for one in SENSORS if one.get("body", "bogie") in bodies]
    return Scenario.build({**BASE, "name": "conformance", "vehicle": vehicle, "sensors": sensors})


def _refusal(effect: Effect, vehicle: str) -> str:
    try:
        build_run(_nominal(vehicle).but(effects=(effect,)))
    except InputError as error:
        return str(error)
    return ""


@cache
def _steady(vehicle: str) -> np.ndarray:
    """State from which the vehicle's runs start."""
    run = build_run(_nominal(vehicle))
    return initial_state(_plant(run), run)


@cache
def _plain(vehicle: str) -> dict[str, np.ndarray]:
    """Channels of the run without effects."""
    return _motion(vehicle)


def _motion(vehicle: str, *effects: Effect) -> dict[str, np.ndarray]:
    """Channels of a run with effects."""
    run = build_run(_nominal(vehicle).but(effects=effects))
    steady = _steady(vehicle)
    if state_size(_plant(run)) == len(steady):  # to search for the same state again would take most of the time
        run = replace(run, initial=steady)
    rows = np.concatenate(list(load_engine("compiled")(run)))
    return dict(zip(channel_names(run.model), rows.T, strict=True))


def _plant(run: Run) -> Plant:
    return build_plant(run.model, run.track, run.speed)


def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max() / max(float(np.abs(b).max()), 1e-12))


def _state(setup: Setup) -> tuple[object, ...]:
    return setup.vehicle, setup.track.digest(), setup.sensors, setup.speed, setup.traction, pickle.dumps(setup.model)
