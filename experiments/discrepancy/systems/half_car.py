"""A half car over a random road that is known from a survey with errors: bounce, pitch, two axles, five channels.

Channels: accelerations of both axles and of the body over them, and the travel of the front suspension. All suspension
laws, tyres and sensors are coordinates with healthy priors, and so is the alignment of the record with the road.
Frames of 2 s; the covariances are stationary, nonlinear suspensions linearised statistically over the predicted run.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import fft
from scipy.signal import lfilter

from experiments.discrepancy.core.frames import Frames
from experiments.discrepancy.core.model import Coordinate, Effect, Level, OneByOne
from experiments.discrepancy.core.priors import HalfNormal, LogNormal, Prior
from experiments.discrepancy.systems.half_car_kernel import GRID, OUTPUTS, many

CHANNELS = ("front axle acceleration", "rear axle acceleration", "front body acceleration", "rear body acceleration",
            "front travel")  # fmt: skip
SHEET = np.array([0.15, 0.15, 0.02, 0.02, 1e-4])  # m/s2 and m; noise of the sensors as their sheets state it
FORCES = ("front suspension", "rear suspension", "front axle", "rear axle", "body")
LATENT = (
    *((f"{part} force {place}", place) for part in ("spring", "damper") for place in FORCES[:2]),
    *((f"force {place}", place) for place in FORCES[2:]),
    *((f"white force {place}", place) for place in FORCES),
)
"""Names and places of latent forces, relative to the forces of springs and dampers, or to all that acts at a place."""
BUILD = {
    "mass": (500.0, 0.10), "inertia": (600.0, 0.10), "front axle": (40.0, 0.03), "rear axle": (40.0, 0.03),
    "front spring": (18e3, 0.05), "rear spring": (16e3, 0.05), "front damper": (1200.0, 0.10),
    "rear damper": (1100.0, 0.10), "front tyre": (180e3, 0.05), "rear tyre": (180e3, 0.05),
    "tyre damping": (100.0, 0.5),
}  # fmt: skip
"""Sheet of the build [kg, kg m2, N/m, N s/m] and sd of the log, in the order of the kernel's parameters."""
FRONT, REAR = 1.2, 1.4  # m, from the axles to the centre of mass
WANDERS = 3  # slow sines of the position along the road
STEP = 1.25e-3  # s, at most, of the integration
LEAD = 2.0  # s of motion before the record
STATED = 3e-4  # m; error of a survey that states none
FINER = 4  # times as fine are the steps that the predictions are corrected by
PAIRS = 3  # of roads on both sides of the mean, over which the predictions are averaged
RELAXATION = 12.0  # 1/s; of a spring behind a damper (Maxwell 1867), between bounce and axles
WIDE = 0.5  # of a law that nobody wrote down: half of the force of a spring, or of a damper at the middle rates
PARAMETERS = 35
TONES = ("body", "front axle", "rear axle")  # where one may act, in the order of the kernel

_build = tuple(Coordinate(f"log {name}", "-", 0.0, spread) for name, (_, spread) in BUILD.items())
COORDINATES = (
    *_build, Coordinate("centre of mass", "m", 0.0, 0.05),
    Coordinate("offset", "m", 0.0, 0.05), Coordinate("speed", "-", 0.0, 1e-3),
    *(Coordinate(f"wander {k + 1}", "m", 0.0, 0.03) for k in range(WANDERS)),
    *(Coordinate(f"gain {name}", "-", 0.0, 0.01) for name in CHANNELS),
    *(Coordinate(f"{end} friction", "N", 0.0, 3.0) for end in ("front", "rear")),
    *(Coordinate(f"delay {name}", "s", 0.0, 4e-4) for name in CHANNELS),
    *(Coordinate(f"{end} one-sidedness", "-", 0.0, 0.05) for end in ("front", "rear")),
    *(Coordinate(f"{end} square part", "-", 0.0, 0.05) for end in ("front", "rear")),
    Coordinate("tyre progression", "-", 0.0, 0.05),
    *(Coordinate(f"{end} relaxing spring", "N/m", 0.0, 800.0) for end in ("front", "rear")),
    *(Coordinate(f"log {end} relaxation", "-", 0.0, 1.0) for end in ("front", "rear")),
)  # fmt: skip
INDEX = {one.name: index for index, one in enumerate(COORDINATES)}
COUNT = len(COORDINATES)

SCALES = {
    "spring force front suspension": 0.0041, "spring force rear suspension": 0.0042,
    "damper force front suspension": 0.0040, "damper force rear suspension": 0.0039, "force front axle": 0.0044,
    "force rear axle": 0.0043, "force body": 0.0038, "white force front suspension": 0.0049,
    "white force rear suspension": 0.0050, "white force front axle": 0.0093, "white force rear axle": 0.0082,
    "white force body": 0.0052, "reading front axle acceleration": 0.0045, "reading rear axle acceleration": 0.0043,
    "reading front body acceleration": 0.0044, "reading rear body acceleration": 0.0040, "reading front travel": 0.0043,
}  # fmt: skip
"""Of healthy half-normal levels, relative to what acts or is read there: learned from 16 healthy records of all
settings (`half_car_benchmark.learn`, which begins at 0.01).
"""


def unwritten(place: str) -> tuple[Coordinate, ...]:
    """Wide priors of what follows the motion at a place, where nobody wrote down what acts or is read there."""
    if place in CHANNELS:
        return Coordinate(f"gain {place}", "-", 0.0, 0.12), Coordinate(f"delay {place}", "s", 0.0, 2.5e-3)
    if not place.endswith("suspension"):
        return ()
    end = place.split()[0]
    names = (f"log {end} spring", f"log {end} damper", f"{end} one-sidedness", f"{end} square part")
    spring = Coordinate(f"{end} relaxing spring", "N/m", 0.0, WIDE * BUILD[f"{end} spring"][0])
    return *(Coordinate(name, "-", 0.0, WIDE) for name in names), Coordinate(f"{end} friction", "N", 0.0, 40.0), spring


@dataclass(frozen=True, eq=False)
class Record:
    """What is measured and what is known: `seen` (channels, samples) at `rate` [Hz] and `speed` [m/s] from `first` [m]
    along `road`, surveyed heights each `GRID` [m] with a stated error `survey` [m] (None = not stated).
    """

    seen: np.ndarray
    rate: float
    speed: float
    road: np.ndarray
    first: float
    survey: float | None


def patch(road: np.ndarray) -> np.ndarray:
    """Heights as a tyre's contact of three points feels them."""
    return np.convolve(road, np.ones(3) / 3.0, "same")


def dip(apart: np.ndarray, depth: float, length: float) -> np.ndarray:
    """Heights of a round dip [m] at places `apart` [m] from its middle, `length` to each side."""
    apart = apart / length
    return np.where(np.abs(apart) < 1.0, -0.5 * depth * (1.0 + np.cos(np.pi * apart)), 0.0)


@dataclass(frozen=True, eq=False)
class Surveyed:
    """A road given its survey: `heights` [m] with an error of white noise `error` [m]. Its mean is Wiener's (1949), by
    the survey's own spectrum in thirds of an octave.
    """

    heights: np.ndarray
    error: float

    @cached_property
    def _level(self) -> np.ndarray:
        """The line from end to end: without it no end of the road is a step."""
        return np.linspace(self.heights[0], self.heights[-1], len(self.heights))

    @cached_property
    def waves(self) -> np.ndarray:
        """[1/m] of the lines."""
        return fft.rfftfreq(len(self.heights), GRID)

    @cached_property
    def lines(self) -> np.ndarray:
        """Spectrum of the survey."""
        return np.asarray(fft.rfft(self.heights - self._level))

    @cached_property
    def _bands(self) -> tuple[np.ndarray, np.ndarray]:
        """Logs of middles of thirds of an octave, and share of the true road in the survey's power there."""
        power = np.abs(self.lines[1:]) ** 2
        band = np.floor(3.0 * np.log2(self.waves[1:] / self.waves[1])).astype(int)
        kept = np.unique(band)
        means = np.array([power[band == one].mean() for one in kept])
        middles = np.array([np.log(self.waves[1:][band == one]).mean() for one in kept])
        return middles, np.clip(1.0 - len(self.heights) * self.error**2 / means, 0.0, 1.0)

    def share(self, waves: np.ndarray) -> np.ndarray:
        """Of the true road in the survey's power, which is also what is left of the error's: at waves [1/m]."""
        return np.interp(np.log(np.maximum(waves, 1e-9)), *self._bands)

    @cached_property
    def mean(self) -> np.ndarray:
        """Heights [m]."""
        if self.error == 0.0:
            return self.heights
        return self._level + np.asarray(fft.irfft(self.lines * self.share(self.waves), len(self.heights)))

    def sides(self, pairs: int) -> list[np.ndarray]:
        """Roads on both sides of the mean, as far off as its error lets them be; phases by the golden ratio."""
        size = self.error * np.sqrt(self.share(self.waves) * len(self.heights))
        number, ratio = np.arange(len(self.waves)), 0.5 * (np.sqrt(5.0) - 1.0)
        found = []
        for pair in range(1, pairs + 1):
            turn = np.exp(2j * np.pi * (ratio * number * (number + pair) % 1.0))
            error = np.asarray(fft.irfft(size * turn, len(self.heights)))
            found += [self.mean + error, self.mean - error]
        return found


@dataclass(frozen=True)
class Transfers:
    """At the bins of the frames: `forces` (F, channels, places) by a force at each place, `road` (F, channels) by the
    road under the front axle, `spectra` (F, OUTPUTS) mean squares of the predicted outputs, `parts` (F, 4) those of the
    forces of both springs and both dampers.
    """

    forces: np.ndarray
    road: np.ndarray
    spectra: np.ndarray
    parts: np.ndarray


@dataclass(frozen=True, eq=False)
class HalfCar(OneByOne):
    """A record of a half car. `scales` of the healthy levels by name; `survey_level` [of the stated error] by which the
    road is taken as its mean given the survey, None = as surveyed; `offset` (F, frames, channels) of the predictions.
    """

    record: Record
    scales: dict[str, float] = field(default_factory=lambda: dict(SCALES))
    coordinates: tuple[Coordinate, ...] = COORDINATES
    survey_level: float | None = None
    offset: np.ndarray | None = None

    @property
    def levels(self) -> tuple[Level, ...]:
        """Sensors, survey, latent forces and readings."""
        return self.healthy_levels()

    def healthy_levels(self) -> tuple[Level, ...]:
        """With half-normal latent ones."""
        survey: Prior = LogNormal(1.0, 0.5 if self.record.survey else 1.2)
        return (
            *(Level(f"noise {name}", "sensor", LogNormal(1.0, 0.3)) for name in CHANNELS),
            Level("survey", "input", survey),
            *(Level(n, "force", HalfNormal(self.scales[n]), place, unwritten(place)) for n, place in LATENT),
            *(
                Level(f"reading {n}", "reading", HalfNormal(self.scales[f"reading {n}"]), n, unwritten(n))
                for n in CHANNELS
            ),
        )

    @cached_property
    def frames(self) -> Frames:
        """Of the record."""
        return Frames(self.record.seen.shape[1], self.record.rate, high=min(50.0, 0.4 * self.record.rate))

    @property
    def duration(self) -> float:
        """Of the record [s]."""
        return self.record.seen.shape[1] / self.record.rate

    @cached_property
    def seen(self) -> np.ndarray:
        """(F, frames, channels) of the record."""
        return self.frames.analyse(self.record.seen)

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """The record's frames."""
        return (self.seen,)

    @cached_property
    def known(self) -> Surveyed:
        """The road given its survey."""
        error = (self.record.survey or STATED) * (self.survey_level or 0.0)
        return Surveyed(self.record.road, error)

    @cached_property
    def road(self) -> np.ndarray:
        """Mean heights as the contacts feel them."""
        return patch(self.known.mean)

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> "HalfCar":
        """With the road's mean given the survey, finer steps, and nonlinear forces as their mean over its error."""
        here = replace(self, survey_level=1.0 if psi is None else float(np.exp(psi[5])), offset=None)
        here.__dict__.update({key: getattr(self, key) for key in ("frames", "seen", "_kept")})
        coarse, fine = (here.run(x[None], effects, finer)[0, : len(CHANNELS)] for finer in (1, FINER))
        sides = here.known.sides(PAIRS)
        around = [here.run(x[None], effects, 1, patch(side))[0, : len(CHANNELS)] for side in sides]
        shift = fine - coarse + np.mean(around, axis=0) - coarse
        object.__setattr__(here, "offset", here.frames.analyse(shift))
        return here

    def errors(
        self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray, count: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, ...]:
        """(count, F, frames, channels): stationary ones, what other roads do that the survey allows just as well, and
        the step's: as large as a run in the coarse one lies off.
        """
        sizes = np.exp(2.0 * psi)
        sizes[5] = 0.0
        lines = self._lines(np.tensordot(sizes, self.covariances(x, effects)[0], 1))
        error = np.exp(psi[5]) * (self.record.survey or STATED) * np.sqrt(self.known.share(self.known.waves))
        coarse, fine = (self.run(x[None], effects, finer)[0, : len(CHANNELS)] for finer in (1, FINER))
        found, size = [], len(self.record.road)
        for _ in range(count):
            turned = rng.standard_normal((*lines.shape[:2], 2)) @ (1.0, 1j)
            still = np.asarray(fft.irfft(np.einsum("fcd,fd->cf", lines, turned), self.frames.samples))
            moved = np.asarray(fft.irfft(fft.rfft(rng.standard_normal(size)) * error, size))
            ridden = self.run(x[None], effects, 1, patch(self.known.mean + moved))[0, : len(CHANNELS)] - coarse
            found.append(still + ridden + rng.standard_normal() * (fine - coarse))
        return (self.frames.analyse(np.array(found)),)

    def _lines(self, covariance: np.ndarray) -> np.ndarray:
        """(lines, channels, channels): roots of the covariances (F, channels, channels) at all lines of a record."""
        samples = self.frames.samples
        whole, flat = fft.rfftfreq(samples, 1.0 / self.record.rate), covariance.reshape(len(covariance), -1)
        places, columns = self.frames.frequencies, flat.shape[1]
        real, imag = (np.stack([np.interp(whole, places, part[:, k]) for k in range(columns)], axis=1)
                      for part in (np.real(flat), np.imag(flat)))  # fmt: skip
        lines = real + 1j * imag
        return np.linalg.cholesky(lines.reshape(-1, *covariance.shape[1:])) * np.sqrt(0.5 * samples)

    def starts(self) -> np.ndarray:
        """A grid of start and speed: no step of a search crosses a cycle of the road."""
        offsets, speeds = np.meshgrid(np.arange(-0.18, 0.181, 0.03), np.arange(-2.4e-3, 2.41e-3, 6e-4), indexing="ij")
        points = np.zeros((offsets.size, COUNT))
        points[:, INDEX["offset"]], points[:, INDEX["speed"]] = offsets.ravel(), speeds.ravel()
        return points

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(points, F, frames, channels)."""
        found = self.frames.analyse(self.run(points, effects)[:, : len(CHANNELS)])
        return (found if self.offset is None else found + self.offset,)

    def run(
        self, points: np.ndarray, effects: tuple[Effect, ...], finer: int = 1, road: np.ndarray | None = None
    ) -> np.ndarray:
        """(points, OUTPUTS, samples), channels as their sensors give them; over another `road` where it is given."""
        samples, rate = self.record.seen.shape[1], self.record.rate
        sub = math.ceil(1.0 / rate / STEP - 1e-9) * finer
        step = 1.0 / rate / sub
        lead = round(LEAD / step)
        moved, back = _different(points)
        roads, which = self._roads(self.road if road is None else road, moved, effects)
        out = np.zeros((len(moved), OUTPUTS, samples))
        many(physical(moved, effects), roads, which, self._places(moved, sub, lead), FRONT + REAR, step, lead, sub, out)
        out = out if len(out) == len(points) else out[back]
        gains, delays = (points[:, INDEX[f"{kind} {CHANNELS[0]}"] :][:, : len(CHANNELS)] for kind in ("gain", "delay"))
        different, which = np.unique(delays, axis=0, return_inverse=True)
        turn = np.exp(-2j * np.pi * different[..., None] * fft.rfftfreq(samples, 1.0 / rate))
        turn = turn if len(turn) == 1 else turn[which.ravel()]
        out[:, : len(CHANNELS)] = np.asarray(fft.irfft(np.asarray(fft.rfft(out[:, : len(CHANNELS)])) * turn, samples))
        out[:, : len(CHANNELS)] *= np.exp(gains)[..., None]
        return out

    def _places(self, points: np.ndarray, sub: int, lead: int) -> np.ndarray:
        """(points, time) of the front axle along the road [m]."""
        rows = np.empty((len(points), 2 + WANDERS))
        rows[:, 0] = self.record.first + points[:, INDEX["offset"]]
        rows[:, 1] = self.record.speed * (1.0 + points[:, INDEX["speed"]])
        rows[:, 2:] = points[:, INDEX["wander 1"] :][:, :WANDERS]
        return rows @ self._shapes(sub, lead)

    def _shapes(self, sub: int, lead: int) -> np.ndarray:
        """(2 + WANDERS, time): one, time and the slow sines, at the middles of the steps."""
        kept = self._kept.get(sub)
        if kept is None:
            samples, rate = self.record.seen.shape[1], self.record.rate
            time = (np.arange(lead + samples * sub + 2) - lead - 0.5) / rate / sub
            waves = np.sin(np.arange(1, WANDERS + 1)[:, None] * np.pi * time / self.duration)
            kept = self._kept[sub] = np.stack([np.ones_like(time), time, *waves])
        return kept

    @cached_property
    def _kept(self) -> dict[int, np.ndarray]:
        return {}

    def _roads(
        self, road: np.ndarray, points: np.ndarray, effects: tuple[Effect, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Different roads, and which of them each point has."""
        roads, column = road[None], COUNT
        which = np.zeros(len(points), np.int64)
        for effect in effects:
            if effect.family == "dip":
                at = self.record.first + self.record.speed * points[:, column]
                along, rows = np.arange(len(road)) * GRID, points[:, column + 1 : column + 3]
                shapes = [dip(along - s, depth, np.exp(log)) for s, (depth, log) in zip(at, rows, strict=True)]
                roads = (roads[which] if len(roads) > 1 else roads) + np.stack([patch(one) for one in shapes])
                which = np.arange(len(points))
            column += len(effect.own)
        return roads, which

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(levels, F, channels, channels)."""
        found, count = self.transfers(x, effects), len(CHANNELS)
        power = found.spectra[:, [5, 6, 7, 8]]
        power = np.concatenate([power, power[:, :1] + power[:, 1:2]], axis=1)
        acts = np.concatenate([found.parts, power[:, 2:], np.broadcast_to(power.mean(axis=0), power.shape)], axis=1)
        along = found.forces[:, :, [FORCES.index(place) for _, place in LATENT]]
        forces = np.einsum("fp,fcp,fdp->pfcd", acts, along, np.conj(along))
        road = self.survey()[:, None, None] * found.road[:, :, None] * np.conj(found.road[:, None, :])
        parts = np.zeros((len(self.levels), len(self.frames.frequencies), count, count), complex)
        for channel in range(count):
            parts[channel, :, channel, channel] = SHEET[channel] ** 2
            parts[6 + len(LATENT) + channel, :, channel, channel] = found.spectra[:, channel]
        parts[5], parts[6 : 6 + len(LATENT)] = road, forces
        parts[:, :, range(count), range(count)] += 1e-12 * SHEET**2
        return (parts,)

    def survey(self) -> np.ndarray:
        """(F,) mean square of the survey's error under an axle, in a frame [m2]."""
        f, speed = self.frames.frequencies, self.record.speed
        contact = (1.0 + 2.0 * np.cos(2.0 * np.pi * f * GRID / speed)) / 3.0
        mean = np.sinc(f / self.record.rate)
        left = self.known.share(f / speed)
        return (self.record.survey or STATED) ** 2 * GRID / speed * self.record.rate * (contact * mean) ** 2 * left

    def transfers(self, x: np.ndarray, effects: tuple[Effect, ...]) -> Transfers:
        """Of small motions about the run at x."""
        out, p = self.run(x[None], effects)[0], physical(x[None], effects)[0]
        s = 2j * np.pi * self.frames.frequencies
        laws = [np.linalg.lstsq(out[[d, e]].T, rest, rcond=None)[0] for rest, d, e in self._rests(p, out)]
        response, acts, seen = _linear(p, s, laws)
        gains = np.exp(x[INDEX[f"gain {CHANNELS[0]}"] :][: len(CHANNELS)])
        turn = gains * np.exp(-s[:, None] * x[INDEX[f"delay {CHANNELS[0]}"] :][: len(CHANNELS)])
        forces = turn[..., None] * (seen @ response) @ acts
        under = np.exp(-s * (FRONT + REAR) / self.record.speed)[:, None]
        road = (p[8] + s * p[10])[:, None] * forces[:, :, 2] + (p[9] + s * p[10])[:, None] * under * forces[:, :, 3]
        spectra = np.mean(np.abs(self.frames.analyse(out)) ** 2, axis=1)
        shapes = [law[part] ** 2 / np.abs(s) ** (2 - 2 * part) for part in range(2) for law in laws]
        parts = np.stack([shape * spectra[:, e] for shape, e in zip(shapes, (9, 10, 9, 10), strict=True)], axis=1)
        return Transfers(forces, road, spectra, parts)

    def _rests(self, p: np.ndarray, out: np.ndarray) -> list[tuple[np.ndarray, int, int]]:
        """Force of each suspension without its relaxing spring's, and the places of its travel and rate."""
        found = []
        for k, (force, travel, rate) in enumerate(((5, 4, 9), (6, 11, 10))):
            keep = 1.0 / (1.0 + p[33 + k] / self.record.rate)
            held = lfilter([keep / self.record.rate], [1.0, -keep], out[rate])
            found.append((out[force] - p[31 + k] * held, travel, rate))
        return found


def _different(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points that move differently (gains and delays leave the motion as it is), and which of them each point is."""
    still = points.copy()
    for kind in ("gain", "delay"):
        first = INDEX[f"{kind} {CHANNELS[0]}"]
        still[:, first : first + len(CHANNELS)] = 0.0
    moved, back = np.unique(still, axis=0, return_inverse=True)
    return moved, back.ravel()


def _linear(
    p: np.ndarray, s: np.ndarray, laws: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """(F, states, states) of the states by forces on them, (states, places) of these by latent forces, and
    (F, channels, states) of the channels by the states. laws : spring and damper of each suspension.
    """
    front, rear = np.array([1.0, -p[11], -1.0, 0.0, 0.0]), np.array([1.0, p[12], 0.0, -1.0, 0.0])
    third, unit = np.array([-1.0, -0.5, 0.0, 0.0, 1.0]), np.eye(5)
    whole = (s**2)[:, None, None] * np.diag([p[0], p[1], p[2], p[3], p[19] if p[19] > 0.0 else 1.0])
    for k, (row, (spring, damper)) in enumerate(zip((front, rear), laws, strict=True)):
        impedance = spring + s * damper + p[31 + k] * s / (s + p[33 + k])
        whole = whole + impedance[:, None, None] * np.outer(row, row)
    for tyre, axle in ((p[8], 2), (p[9], 3)):
        whole = whole + (tyre + s * p[10])[:, None, None] * np.outer(unit[axle], unit[axle])
    whole = whole + (p[20] + s * p[21])[:, None, None] * np.outer(third, third)
    seen = np.zeros((len(s), len(CHANNELS), 5), complex)
    over = [unit[2], unit[3], unit[0] - p[11] * unit[1], unit[0] + p[12] * unit[1]]
    seen[:, :4], seen[:, 4] = (s**2)[:, None, None] * np.stack(over), front
    acts = np.stack([-front, -rear, unit[2], unit[3], unit[0] + 0.3 * unit[1]], axis=1)
    return np.linalg.inv(whole), acts, seen


def physical(points: np.ndarray, effects: tuple[Effect, ...]) -> np.ndarray:
    """(points, PARAMETERS) of the kernel."""
    p = np.zeros((len(points), PARAMETERS))
    p[:, : len(BUILD)] = np.array([value for value, _ in BUILD.values()]) * np.exp(points[:, : len(BUILD)])
    p[:, 11], p[:, 12] = FRONT + points[:, len(BUILD)], REAR - points[:, len(BUILD)]
    p[:, 13:15] = points[:, INDEX["front friction"] :][:, :2]
    p[:, [15, 17]] = 1.0
    p[:, 26:30] = points[:, INDEX["front one-sidedness"] :][:, :4]
    p[:, 30] = points[:, INDEX["tyre progression"]]
    p[:, 31:33] = points[:, INDEX["front relaxing spring"] :][:, :2]
    p[:, 33:35] = RELAXATION * np.exp(points[:, INDEX["log front relaxation"] :][:, :2])
    column = COUNT
    for effect in effects:
        own = points[:, column : column + len(effect.own)]
        if effect.family == "stop":
            p[:, [15, 16] if effect.place == FORCES[0] else [17, 18]] = np.exp(own)
        elif effect.family == "tone":
            p[:, 22], p[:, 23:25] = np.exp(own[:, 0]), own[:, 1:]
            p[:, 25] = TONES.index(str(effect.place))
        elif effect.family == "third body":
            turn = 2.0 * np.pi * np.exp(own[:, 1])
            p[:, 19] = np.exp(own[:, 0])
            p[:, 20], p[:, 21] = p[:, 19] * turn**2, 2.0 * np.exp(own[:, 2]) * turn * p[:, 19]
        column += len(effect.own)
    return p
