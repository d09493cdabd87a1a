"""True half cars in ten settings that the inference is not told of; healthy ones have small errors of their own.

The motion is integrated by another scheme than that of the model (Runge and Kutta, 0.5 ms; in the setting `integrator`
Euler's semi-implicit one, 1.25 ms), and by its own equations, which know laws that no model here has.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np

from experiments.discrepancy.systems.half_car import (
    BUILD,
    CHANNELS,
    FORCES,
    FRONT,
    REAR,
    SHEET,
    TONES,
    WANDERS,
    Record,
    dip,
    patch,
)  # fmt: skip
from experiments.discrepancy.systems.half_car_kernel import FRICTION_RATE, GRID, PROGRESSION, SQUARE_RATE, heights

SETTINGS = ("home", "build off its sheet", "survey quiet", "survey loud", "survey unstated", "rough and fast", "laden",
            "100 Hz", "noise twice", "integrator")  # fmt: skip
FAMILIES = ("soft spring", "weak damper", "friction", "stop", "gain", "delay", "tone", "dip", "third body")
LAWS = ("hysteresis", "fading damper", "flexible axle", "one-sided damper", "square damper", "distorted", "dropout")
"""Foreign ones: the last two are of a sensor."""

DURATION = 16.0  # s, of a record where nothing else is said
REST = 4.0  # s of motion before the record
TAIL = 0.5  # s after it, so that delays have something to take
SURVEY = 2e-4  # m, as stated
ROUGH = 64e-6  # m3 at 0.1 1/m; slope of the road's spectrum -2, flat below 0.02 1/m
HYSTERESIS = 0.004  # m, over which it builds up
FADING = 7.0  # s

_compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy")


@_compiled
def _suspension(q, d, e, hysteresis, t):
    """Force [N]; q: spring, damper, one-sided, square, friction, gap, stop, hysteresis, fading."""
    rate = e + q[2] * abs(e) + q[3] * e * abs(e) / SQUARE_RATE
    force = q[0] * d + q[1] * (1.0 + q[8] * np.sin(2.0 * np.pi * t / FADING)) * rate
    force += q[4] * e / (abs(e) + FRICTION_RATE) + q[7] / HYSTERESIS * hysteresis
    if abs(d) > q[5]:
        force += q[6] * (d - np.sign(d) * q[5])
    return force


@_compiled
def _slope(c, q, y, roads, t, dy, out):
    """Slopes of the state: body, pitch, axles, third body, absorbers on both axles (7 places, 7 rates), hystereses.

    c: mass, inertia, axles, tyres, tyre damping, front, rear, third mass, its spring and damper, tone's frequency and
    two amplitudes and place, absorbers' masses, springs and dampers, progression.
    """
    z, v = y[:7], y[7:14]
    d = (z[0] - c[7] * z[1] - z[2], z[0] + c[8] * z[1] - z[3])
    e = (v[0] - c[7] * v[1] - v[2], v[0] + c[8] * v[1] - v[3])
    for i in range(2):
        opposed = 1.0 if y[14 + i] * e[i] > 0.0 else 0.0
        dy[14 + i] = e[i] - abs(e[i]) * y[14 + i] / HYSTERESIS * opposed
    s1, s2 = _suspension(q[0], d[0], e[0], y[14], t), _suspension(q[1], d[1], e[1], y[15], t)
    third = c[10] * (z[4] - z[0] - 0.5 * z[1]) + c[11] * (v[4] - v[0] - 0.5 * v[1])
    angle = 2.0 * np.pi * c[12] * t
    tone = c[13] * np.cos(angle) + c[14] * np.sin(angle)
    axle = np.zeros(2)
    for i in range(2):
        x = z[2 + i] - roads[i]
        tyre = c[4 + i] * (x + PROGRESSION * c[22] * x * x) + c[6] * (v[2 + i] - roads[2 + i])
        hung = c[18 + i] * (z[5 + i] - z[2 + i]) + c[20 + i] * (v[5 + i] - v[2 + i])
        dy[12 + i] = -hung / c[16 + i] if c[16 + i] > 0.0 else 0.0
        axle[i] = ((s1 if i == 0 else s2) - tyre + hung + (tone if c[15] == 1.0 + i else 0.0)) / c[2 + i]
    dy[:7] = v
    dy[7] = (third - s1 - s2 + (tone if c[15] == 0.0 else 0.0)) / c[0]
    dy[8] = (c[7] * s1 - c[8] * s2 + 0.5 * third) / c[1]
    dy[9], dy[10], dy[11] = axle[0], axle[1], -third / c[9] if c[9] > 0.0 else 0.0
    out[0], out[1], out[2], out[3], out[4] = axle[0], axle[1], dy[7] - c[7] * dy[8], dy[7] + c[8] * dy[8], d[0]


@_compiled
def _integrate(c, q, r1, r2, h, lead, sub, runge, out):
    """Means over `sub` steps of the channels; r1, r2: heights each half step."""
    y, now, roads = np.zeros(16), np.zeros(5), np.zeros(4)
    k = np.zeros((5, 16))
    y[2], y[3], y[0], y[1] = (
        r1[1],
        r2[1],
        (c[8] * r1[1] + c[7] * r2[1]) / (c[7] + c[8]),
        (r2[1] - r1[1]) / (c[7] + c[8]),
    )
    y[4], y[5], y[6] = y[0] + 0.5 * y[1], y[2], y[3]
    for i in range(lead + out.shape[1] * sub):
        t = (i - lead) * h
        for stage in range(4):
            part = (0.0, 0.5, 0.5, 1.0)[stage]
            at = 1 + 2 * i + int(2.0 * part)
            roads[0], roads[1] = r1[at], r2[at]
            roads[2], roads[3] = (r1[at + 1] - r1[at - 1]) / h, (r2[at + 1] - r2[at - 1]) / h
            _slope(c, q, y + part * h * k[stage], roads, t + part * h, k[stage + 1], now)
            if i >= lead and stage == (2 if runge else 0):
                out[:, (i - lead) // sub] += now / sub
            if not runge:
                break
        if runge:
            y += h / 6.0 * (k[1] + 2.0 * (k[2] + k[3]) + k[4])
        else:
            y[7:] += h * k[1, 7:]
            y[:7] += h * y[7:14]


@dataclass
class Car:
    """A true car and its ride; `sizes`: true values of the model's coordinates, `own` ones included, by name."""

    rng: np.random.Generator
    setting: str
    c: np.ndarray = field(default_factory=lambda: np.zeros(23))
    q: np.ndarray = field(default_factory=lambda: np.zeros((2, 9)))
    gain: np.ndarray = field(default_factory=lambda: np.ones(5))
    delay: np.ndarray = field(default_factory=lambda: np.zeros(5))
    extra: list[tuple[float, float, float]] = field(default_factory=list)
    sensor: tuple[str, int, float] | None = None
    sizes: dict[str, float] = field(default_factory=dict)
    duration: float = DURATION


@dataclass(frozen=True)
class Case:
    """A record and its truth: names of effects in the library, their families, the place of a foreign law."""

    record: Record
    setting: str
    effects: tuple[str, ...]
    families: tuple[str, ...]
    place: str | None
    sizes: dict[str, float]


def healthy_car(rng: np.random.Generator, setting: str) -> Car:
    """A build about its sheet, with a little of what no model has."""
    car = Car(rng, setting)
    logs = {}
    for name, (_, spread) in BUILD.items():
        logs[name] = spread * rng.standard_normal()
        if setting == "build off its sheet":
            logs[name] = 1.5 * logs[name] + 0.03 * rng.choice([-1, 1]) * (name != "tyre damping")
    if setting == "laden":
        logs["mass"] = 0.22 + 0.05 * rng.standard_normal()
    build = {name: value * np.exp(logs[name]) for name, (value, _) in BUILD.items()}
    moved = 0.05 * rng.standard_normal()
    order = ("mass", "inertia", "front axle", "rear axle", "front tyre", "rear tyre", "tyre damping")
    car.c[:7], car.c[7:9] = [build[name] for name in order], (FRONT + moved, REAR - moved)
    car.c[22] = 0.05 * rng.standard_normal()
    for i, end in enumerate(("front", "rear")):
        small = (rng.uniform(-0.08, 0.08), 0.0, abs(rng.normal(0.0, 2.0)))
        car.q[i] = (build[f"{end} spring"], build[f"{end} damper"], *small, 1.0, 0.0, 0.0, 0.0)
    car.gain, car.delay = np.exp(0.01 * rng.standard_normal(5)), 2e-4 * rng.standard_normal(5)
    return car


def _part(family: str, column: int, low: float, high: float) -> Callable[[Car], str]:
    def change(car: Car) -> str:
        i = int(car.rng.integers(2))
        end = ("front", "rear")[i]
        size = car.rng.uniform(low, high)
        if column == 4:
            car.q[i, column] += size
            return f"{end} friction"
        car.q[i, column] *= 1.0 - size
        return f"{'soft' if column == 0 else 'weak'} {end} {family.split()[1]}"

    return change


def _stop(car: Car) -> str:
    i = int(car.rng.integers(2))
    gap = car.rng.uniform(0.004, 0.010) * (1.8 if car.setting == "rough and fast" else 1.0)
    car.q[i, 5], car.q[i, 6] = gap, car.rng.uniform(25e3, 80e3)
    car.sizes |= {"log gap": float(np.log(gap)), "log stop": float(np.log(car.q[i, 6]))}
    return f"{('front', 'rear')[i]} stop"


def _gain(car: Car) -> str:
    i = int(car.rng.integers(5))
    car.gain[i] *= np.exp(car.rng.choice([-1, 1]) * car.rng.uniform(0.05, 0.25))
    return f"gain of {CHANNELS[i]}"


def _delay(car: Car) -> str:
    i = int(car.rng.integers(5))
    car.delay[i] += car.rng.uniform(1.5e-3, 8e-3)
    return f"delay of {CHANNELS[i]}"


def _tone(car: Car) -> str:
    i, size, phase = int(car.rng.integers(3)), car.rng.uniform(15.0, 60.0), car.rng.uniform(0.0, 2.0 * np.pi)
    car.c[12:16] = car.rng.uniform(5.0, 30.0), size * np.cos(phase), size * np.sin(phase), i
    # the tone's clock runs from `TAIL` before the record, the model's from its start
    turned = complex(car.c[13], -car.c[14]) * np.exp(2j * np.pi * car.c[12] * TAIL)
    car.sizes |= {"log frequency": float(np.log(car.c[12])), "in phase": turned.real, "across": -turned.imag}
    return f"tone at {TONES[i]}"


def _dip(car: Car) -> str:
    time, sign = car.rng.uniform(0.1, 0.9) * car.duration, car.rng.choice([-1, 1])
    depth, length = car.rng.uniform(0.0015, 0.006), car.rng.uniform(0.4, 1.0)
    car.extra.append((time, sign * depth, length))
    car.sizes |= {"depth": sign * depth, "log length": float(np.log(length))}
    return "dip" if sign > 0 else "bump"


def _third(car: Car) -> str:
    mass, own, ratio = car.rng.uniform(15.0, 70.0), car.rng.uniform(3.5, 10.0), car.rng.uniform(0.02, 0.1)
    turn = 2.0 * np.pi * own
    car.c[9:12] = mass, mass * turn**2, 2.0 * ratio * turn * mass
    names = ("log third mass", "log own frequency", "log damping ratio")
    car.sizes |= {name: float(np.log(value)) for name, value in zip(names, (mass, own, ratio), strict=True)}
    return "third body"


_CHANGES: dict[str, Callable[[Car], str]] = {
    "soft spring": _part("soft spring", 0, 0.12, 0.4), "weak damper": _part("weak damper", 1, 0.25, 0.7),
    "friction": _part("friction", 4, 15.0, 120.0), "stop": _stop, "gain": _gain, "delay": _delay, "tone": _tone,
    "dip": _dip, "third body": _third,
}  # fmt: skip


def _foreign(car: Car, law: str) -> str:
    """Changes a car by a law from outside the library; gives its place."""
    rng = car.rng
    i, channel = int(rng.integers(2)), int(rng.integers(5))
    if law in ("distorted", "dropout"):
        car.sensor = (law, channel, rng.uniform(0.05, 0.2) if law == "distorted" else rng.uniform(0.3, 0.8))
        return CHANNELS[channel]
    if law == "flexible axle":
        mass, turn = rng.uniform(3.0, 8.0), 2.0 * np.pi * rng.uniform(20.0, 40.0)
        car.c[16 + i], car.c[18 + i], car.c[20 + i] = mass, mass * turn**2, 0.06 * mass * turn
        return FORCES[2 + i]
    if law == "hysteresis":
        car.q[i, 7] = rng.uniform(40.0, 150.0)
    elif law == "fading damper":
        car.q[i, 8] = rng.uniform(0.4, 0.8)
    elif law == "one-sided damper":
        car.q[i, 2] = rng.choice([-1, 1]) * rng.uniform(0.4, 0.7)
    else:
        car.q[i, 3] = rng.uniform(1500.0, 6000.0) * SQUARE_RATE / car.q[i, 1]
    return FORCES[i]


def make(
    rng: np.random.Generator, kind: str = "null", setting: str = "home", family: str = "", duration: float = DURATION
) -> Case:
    """A case of `duration` [s]. `kind` : "null", "effect", "pair" or "foreign"; `family` : of the effect, or the
    foreign law ("" = drawn).
    """
    car, effects, families, place = healthy_car(rng, setting), (), (), None
    car.duration = duration
    if kind == "effect":
        families = (family or str(rng.choice(FAMILIES)),)
    elif kind == "pair":
        families = tuple(str(one) for one in rng.choice(FAMILIES, 2, replace=False))
    elif kind == "foreign":
        place = _foreign(car, family or str(rng.choice(LAWS)))
    effects = tuple(_CHANGES[one](car) for one in families)
    record = _measured(car)
    return Case(record, setting, effects, families, place, car.sizes | _sizes(car))


def _sizes(car: Car) -> dict[str, float]:
    """True values of the coordinates that effects change."""
    found = {}
    for i, end in enumerate(("front", "rear")):
        for column, part in enumerate(("spring", "damper")):
            found[f"log {end} {part}"] = float(np.log(car.q[i, column] / BUILD[f"{end} {part}"][0]))
        found[f"{end} friction"] = float(car.q[i, 4])
    for i, channel in enumerate(CHANNELS):
        found |= {f"gain {channel}": float(np.log(car.gain[i])), f"delay {channel}": float(car.delay[i])}
    return found


def rough_road(rng: np.random.Generator, size: int, times: float) -> np.ndarray:
    """(size,) heights [m]."""
    waves = np.fft.rfftfreq(size, GRID)
    power = ROUGH * times * (np.maximum(waves, 0.02) / 0.1) ** -2
    draws = rng.standard_normal(len(waves)) + 1j * rng.standard_normal(len(waves))
    lines = np.sqrt(power * size / GRID) / 2.0 * draws
    lines[0] = 0.0
    return np.fft.irfft(lines, size)


def _survey(rng: np.random.Generator, setting: str) -> tuple[float, float | None]:
    """True error of the survey and the stated one [m]."""
    if setting == "survey unstated":
        return float(np.exp(rng.uniform(np.log(6e-5), np.log(6e-4)))), None
    return {"survey quiet": 0.3, "survey loud": 3.0}.get(setting, 1.0) * SURVEY, SURVEY


def _measured(car: Car) -> Record:
    """The car's ride over a new road, as its sensors give it."""
    rng, setting = car.rng, car.setting
    speed, times = (28.0, 3.0) if setting == "rough and fast" else (20.0, 1.0)
    rate = 100.0 if setting == "100 Hz" else 200.0
    first = speed * REST + 10.0
    size = round((speed * (REST + car.duration + TAIL) + 40.0) / GRID)
    road = rough_road(rng, size, times)
    along = np.arange(size) * GRID
    true = road + sum((dip(along - first - speed * t, depth, length) for t, depth, length in car.extra), np.zeros(size))
    seen = ride(car, patch(true), speed, rate, first)
    noise = SHEET * rng.uniform(0.8, 1.25, 5) * (2.0 if setting == "noise twice" else 1.0)
    error, stated = _survey(rng, setting)
    seen = _spoiled(car, seen) + noise[:, None] * rng.standard_normal(seen.shape)
    return Record(seen, rate, speed, road + error * rng.standard_normal(size), first, stated)


def ride(car: Car, road: np.ndarray, speed: float, rate: float, first: float) -> np.ndarray:
    """(channels, samples) with gains and delays."""
    runge = car.setting != "integrator"
    sub = round(1.0 / rate / (5e-4 if runge else 1.25e-3))
    h, samples = 1.0 / rate / sub, round(car.duration * rate)
    after, lead = round(TAIL * rate), round(REST / h)
    before = round(TAIL * rate)
    time = (np.arange(2 * (lead + (samples + after) * sub) + 4) - 1) * 0.5 * h - REST
    wander = (
        0.03
        * car.rng.standard_normal(WANDERS)
        @ np.sin(np.arange(1, WANDERS + 1)[:, None] * np.pi * time / car.duration)
    )
    place = first + 0.05 * car.rng.standard_normal() + speed * (1.0 + 1e-3 * car.rng.standard_normal()) * time + wander
    rows = np.zeros((2, len(time)))
    heights(road, place, rows[0])
    heights(road, place - car.c[7] - car.c[8], rows[1])
    out = np.zeros((5, samples + before + after))
    _integrate(car.c, car.q, rows[0], rows[1], h, lead - before * sub, sub, runge, out)
    turn = np.exp(-2j * np.pi * car.delay[:, None] * np.fft.rfftfreq(out.shape[1], 1.0 / rate))
    return car.gain[:, None] * np.fft.irfft(np.fft.rfft(out) * turn, out.shape[1])[:, before : before + samples]


def _spoiled(car: Car, seen: np.ndarray) -> np.ndarray:
    """With what a foreign sensor does."""
    if car.sensor is None:
        return seen
    kind, channel, size = car.sensor
    spoiled, samples = seen.copy(), seen.shape[1]
    if kind == "distorted":
        spoiled[channel] += size * seen[channel] ** 2 / seen[channel].std()
    else:
        first = int(car.rng.uniform(0.1, 0.5) * samples)
        spoiled[channel, first : first + int(car.rng.uniform(0.2, 0.4) * samples)] *= 1.0 - size
    return spoiled
