"""Vehicles as built, with an effect that is drawn from the library, or from laws outside it: what a benchmark hides."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import numpy as np

from experiments.discrepancy.railway.build import named, vehicle_at
from experiments.discrepancy.railway.creep_law import with_fastsim
from experiments.discrepancy.railway.tolerances import tolerances
from railsim.effects.interface import EFFECTS, Effect, Parameter
from railsim.effects.payload import Payload
from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.sensors.interface import Sensor
from railsim.settings import load_yaml

FASTSIM = 0.3  # of the vehicles with that creep law in place of the nominal one
MOST_ODD = 1.9  # standard deviations of a healthy specimen's parameters
STATED_WRONG = (0.8, 1.25)  # true over stated sensor noise
AWAY = 20.0  # m between a local effect and the ends of the run
SOON, LATE = 2.0, 3.0  # s between an effect that begins and the record's beginning and end
MOST_VARIANTS = 12  # of an effect that is not of a channel
WHEELSETS = 2  # whose wheels may have an effect
MEASURED = ("accelerometer", "gyro", "displacement")  # sensors whose channels may have an effect


def read_laws(path: Path | str) -> list[Effect]:
    """Effects of a YAML list of settings.

    Raises
    ------
    InputError : no such file, or what is in it is no list of effects.
    """
    try:
        found = load_yaml(Path(path).read_text(encoding="utf-8"), "it")
        return [_effect_of(settings) for settings in found]
    except (OSError, UnicodeDecodeError, KeyError, TypeError, InputError) as error:
        raise InputError(f"--laws {path}: {error}; give a YAML list of effects' settings") from None


def _effect_of(settings: dict[str, Any]) -> Effect:
    return EFFECTS.pick(settings["kind"]).build({name: value for name, value in settings.items() if name != "kind"})


def drawn_effect(nominal: Scenario, rng: np.random.Generator) -> Effect:
    """An effect that a verdict may name, each as likely as any other; variant, size, place and phase at random."""
    kinds = {name: one for name, one in EFFECTS.classes().items() if one.named and not one.by_registration}
    kind = kinds[str(rng.choice(sorted(kinds)))]
    variants = _variants(kind, nominal)
    chosen = variants[int(rng.integers(len(variants)))]
    fixed = {*chosen, *kind.held()} - {*kind.fields_of("phase")}
    free = {name: one for name, one in kind.parameters().items() if name not in fixed}
    return kind.build(chosen | {name: _drawn(one, nominal, rng) for name, one in free.items()})


def _variants(kind: type[Effect], nominal: Scenario) -> list[dict[str, Any]]:
    """Choices of channel, wheelset and side; of a bogie none, for an effect is of all."""
    options: dict[str, Sequence[Any]] = {}
    for name, field in kind.model_fields.items():
        role, values = kind.role(name), _choices(field.annotation)
        if role == "channel":
            values = _channels(nominal)
        if role == "wheelset":
            values = [one for one in values if not isinstance(one, int) or one <= WHEELSETS]
        if role != "bogie" and (len(values) > 1 or role == "channel"):
            options[name] = values
    found = [dict(zip(options, one, strict=True)) for one in itertools.product(*options.values())]
    return found if kind.fields_of("channel") else found[:MOST_VARIANTS]


def _choices(annotation: Any) -> tuple[Any, ...]:
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    return (False, True) if annotation is bool else ()


def _channels(nominal: Scenario) -> tuple[str, ...]:
    measured = (sensor for sensor in nominal.sensors if sensor.kind in MEASURED)
    return tuple(name.split(" [")[0] for sensor in measured for name in sensor.channels())


def _drawn(one: Parameter, nominal: Scenario, rng: np.random.Generator) -> float:
    """A number: a size between the smallest worth naming and its bound, in logs; a place, time or phase anywhere."""
    if one.absent is not None:
        usual = one.default if one.smallest is None else one.smallest
        near, sign = abs(usual - one.absent), 1.0 if usual >= one.absent else -1.0
        far = abs((one.high if sign > 0.0 else one.low) - one.absent)
        size = rng.uniform(np.log(max(near, 1e-12)), np.log(max(far, near, 1e-12)))
        return one.absent + sign * float(np.exp(size))
    limits = {
        "distance": (nominal.start + AWAY, nominal.start + (nominal.distance or 0.0) - AWAY),
        "time": (SOON, nominal.duration - LATE),
    }.get(one.role)
    if limits is not None:
        return float(rng.uniform(max(limits[0], one.low), min(limits[1], one.high)))
    return float(rng.uniform(one.low, one.high))


def build_specimen(
    nominal: Scenario, effects: Sequence[Effect], rng: np.random.Generator, payload: tuple[float, float] | None = None
) -> Scenario:
    """A vehicle as built, with effects. Its numbers lie within their tolerances; the creep law is the nominal one or
    FASTSIM; sensors have their own noise, and the run begins up to 1 m later. payload : from and to [kg].

    Raises
    ------
    InputError : this vehicle cannot have such an effect.
    """
    odd = {
        named(one): one.spread * float(np.clip(rng.standard_normal(), -MOST_ODD, MOST_ODD))
        for one in tolerances(nominal.vehicle)
        if one.built
    }
    vehicle = vehicle_at(nominal.vehicle, odd)
    if rng.random() < FASTSIM:
        vehicle = with_fastsim(vehicle) or vehicle
    load = [Payload.build({"mass": float(rng.uniform(*payload))})] if payload else []
    sensors = tuple(_as_delivered(sensor, rng) for sensor in nominal.sensors)
    start, seed = nominal.start + float(rng.uniform(0.0, 1.0)), int(rng.integers(2**31))
    true = nominal.but(vehicle=vehicle, sensors=sensors, effects=(*load, *effects), start=start, seed=seed)
    return Scenario.build(true.values())


def _as_delivered(sensor: Sensor, rng: np.random.Generator) -> Sensor:
    """With the noise that it has."""
    density = sensor.errors.noise_density
    if density <= 0.0:
        return sensor
    return sensor.but(errors=sensor.errors.but(noise_density=density * float(rng.uniform(*STATED_WRONG))))
