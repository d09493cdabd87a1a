"""Conicity from the response of the yaw rate to a known section of track, in the frequency domain."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd
from scipy import signal
from scipy.ndimage import uniform_filter1d
from scipy.optimize import least_squares
from scipy.stats import f as f_distribution

from estimators.interface import Estimate, Estimator, Missing
from estimators.signals.bands import Band, band_pass
from estimators.vehicle import lateral_roll, single_wheelset
from estimators.vehicle.creep import CREEP_FACTOR, DRY, DRY_WORKING
from estimators.vehicle.lateral_roll import followed
from estimators.vehicle.parameters import given, numbers
from estimators.wheel_rail.contact_run import SPEED, held, without_speed
from estimators.wheel_rail.known_rails import Survey, missing_rails, refine
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

WHEELSET, BOGIE = "wheelset1.rate_yaw [rad/s]", "bogie.rate_yaw [rad/s]"
SPACING = 0.2  # m
SMOOTH = 9  # Fourier coefficients over which the residual's variance is averaged
MOST, LEAST = 1.0, 0.005  # conicities that are looked for
CREEP = (0.05, 1.2)  # shares of Kalker's slope that are looked for: very low adhesion, and more than dry
SHARES = np.geomspace(*CREEP, 9)
"""Creep shares among which the conicity is averaged: nobody knows the friction of a day, all are as likely (-)."""
UNLIKELY = 1e-3  # chance below which no conicity is taken to make the response; a choice, with two recordings in view
UNLIKE = (
    "conicity withheld: no conicity and no friction explains how the yaw follows the rails (a curve, slip, changing "
    "speed, or another vehicle); use a section of steady running on straight track"
)
TYPICAL = (0.15, DRY_WORKING)  # conicity and creep share of the response with which the place is sought (-)
CANDIDATES = 13  # places of which the one with the most coherent response is taken
SCALES = 1.0 + np.linspace(-0.012, 0.012, 13)
"""Real over measured way that are tried: the wheel's radius (-)."""
ASIDE = 8.0  # m; how far the first finding may be off
COARSE = (0.06, 0.2)
"""Conicities from which the search begins; the best of their ends counts (-)."""

Response = Callable[[float, float, float, np.ndarray], np.ndarray]
"""Yaw over the slope of the rails' path and over that of the height r phi, phi their roll, from conicity, creep share,
speed (m/s) and wave numbers (rad/m, shape (m,)), shape (2, m)."""


@dataclass(frozen=True)
class Blocks:
    """Fourier coefficients of stretches of the section.

    k : wave numbers in the band, rad/m (m,). speeds : m/s (b,). turning : yaw rate over speed (b, m). slopes : those of
    `Response` times i k, (2, b, m): the turning of a bogie that follows them. The second is zero where the measured
    track has no cross level.
    """

    k: np.ndarray
    speeds: np.ndarray
    turning: np.ndarray
    slopes: np.ndarray

    @cached_property
    def inputs(self) -> int:
        """How many of the slopes are known."""
        return 2 if self.slopes[1].any() else 1

    @cached_property
    def near(self) -> tuple[list[float], np.ndarray]:
        """Speeds to half a metre a second, and which of them each block has, (b,)."""
        rounded = [float(np.round(speed * 2.0) / 2.0) for speed in self.speeds]
        found = sorted(set(rounded))
        return found, np.array([found.index(one) for one in rounded])


class Stretches:
    """Overlapping stretches of a record: they know what the rails make of them wherever the record may lie.

    Parameters
    ----------
    distance, turning, speed : see `path`. block, shortest, longest : see `ConicitySpectral`.

    Raises
    ------
    InputError : the record is shorter than two stretches.
    """

    def __init__(
        self,
        distance: np.ndarray,
        turning: np.ndarray,
        speed: np.ndarray,
        block: float,
        shortest: float,
        longest: float,
    ) -> None:
        size = round(block / SPACING)
        if len(distance) < 2 * size:
            raise InputError(
                f"the record covers {distance[-1]:.0f} m; conicity_spectral needs two blocks of {block:g} m"
            )
        self._distance, self._window, self._line = distance, np.hanning(size), np.linspace(-1.0, 1.0, size)
        self._rows = np.arange(0, len(distance) - size + 1, size // 2)[:, None] + np.arange(size)
        k = 2.0 * np.pi * np.fft.rfftfreq(size, SPACING)
        self._band = (k >= 2.0 * np.pi / longest) & (k <= 2.0 * np.pi / shortest)
        self._k, self._speeds = k[self._band], speed[self._rows].mean(axis=1)
        self._turning = self._coefficients(turning)

    def at(self, survey: Survey, offset: float, scale: float) -> Blocks:
        """Where the record begins at `offset` m and its way is `scale` times what it says."""
        places = offset + scale * self._distance
        slopes = np.zeros((2, *self._turning.shape), dtype=complex)
        for row, values in zip(slopes, (survey.centre, survey.height), strict=True):
            if values.any():
                row[:] = -(self._k**2) * self._coefficients(np.interp(places, survey.s, values))
        return Blocks(self._k, self._speeds, self._turning, slopes)

    def _coefficients(self, values: np.ndarray) -> np.ndarray:
        parts = values[self._rows]
        parts -= parts.mean(axis=1, keepdims=True)
        slope = np.einsum("bn,n->b", parts, self._line) / np.sum(self._line**2)
        parts -= slope[:, None] * self._line
        parts *= self._window
        return np.fft.rfft(parts, axis=1)[:, self._band]


class ConicitySpectral(Estimator, frozen=True):
    """Conicity from a yaw gyro, the speed and the measured track.

    Least squares on Fourier coefficients: yaw rate = response (conicity, creep) times the measured track. The use of
    "frequency analysis of output signals along a known section of track" is what Ward et al. (2011), section 4.4,
    propose as a way out. It takes a yaw gyro on the wheelset or, on a half vehicle, on the bogie, and the wheel's
    speed; where the record lies on the track is found by the yaw rate itself. One conicity for the whole section. The
    creep share is averaged over, and where no response fits, the conicity is withheld.
    """

    block: float = quantity(200.0, unit="m", source="illustrative: several memories of the hunting motion", gt=50.0)
    shortest: float = quantity(6.0, unit="m", source="illustrative: below Klingel's waves of worn wheels", gt=2.0)
    longest: float = quantity(60.0, unit="m", source="illustrative: the gyro's drift stays below", gt=10.0)
    model_error: float = quantity(0.1, unit="- of the conicity", source="trial on other tracks and vehicles", ge=0.0)
    model_floor: float = quantity(0.01, unit="-", source="trial on other tracks and vehicles", ge=0.0)

    bogie_error: float = quantity(0.3, unit="- of the conicity", source="trial with the half vehicle", ge=0.0)

    requires: ClassVar[tuple[str, ...]] = (SPEED,)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the response of the yaw gyro that is there needs."""
        if WHEELSET in measurements and BOGIE not in measurements:
            return single_wheelset.NEEDED
        return () if _channel(measurements) == WHEELSET else lateral_roll.NEEDED

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there; a stated speed source stands for the tachometer."""
        gyro = () if {WHEELSET, BOGIE} & set(measurements) else (f"a yaw gyro, '{WHEELSET}' or '{BOGIE}': add it",)
        missing = super().missing(measurements) + missing_rails(measurements) + Missing(others=gyro)
        return without_speed(missing, measurements)

    def estimate(self, measurements: Measurements) -> Estimate:
        """One conicity, stated at every second of the record.

        Raises
        ------
        InputError : a channel, the track or a vehicle parameter is missing, or the record is shorter than two blocks.
        """
        self.need(measurements)
        channel = _channel(measurements)
        if channel is None:
            if BOGIE in measurements:
                numbers(measurements.vehicle, lateral_roll.NEEDED)
            raise InputError(f"conicity_spectral needs channel '{WHEELSET}' or '{BOGIE}' of a known vehicle; add it")
        respond = response(measurements.vehicle, channel)
        distance, turning, speed = path(measurements, channel)
        survey = Survey(measurements)
        typical = float(np.median(speed))
        stretches = Stretches(distance, turning, speed, self.block, self.shortest, self.longest)
        candidates = find(distance, turning, survey, lambda k: respond(*TYPICAL, typical, k)[0])[:CANDIDATES]
        start, rough = min(candidates, key=lambda one: incoherent(stretches.at(survey, *one)))

        def without(offset: float, scale: float) -> float:
            return incoherent(stretches.at(survey, offset, rough * scale))

        offset, scale = refine(without, start)
        scale *= rough
        first = self._fit(stretches.at(survey, offset, scale), respond, None)
        offset += float(first.x[2])
        blocks = stretches.at(survey, offset, scale)
        deviation = _deviation(blocks, respond, np.array([*first.x[:2], 0.0]))
        solution = self._fit(blocks, respond, deviation)
        offset += float(solution.x[2])
        blocks = stretches.at(survey, offset, scale)
        misfit = Misfit.of(blocks, _predicted(blocks, respond, np.array([*solution.x[:2], 0.0])))
        conicity, spread, creep = averaged(blocks, respond, misfit, float(solution.x[0]))
        share = self.bogie_error if channel == BOGIE else self.model_error
        fits = misfit.chance >= UNLIKELY or misfit.wrong <= share
        honest = np.sqrt(spread**2 + (share * conicity) ** 2 + self.model_floor**2)
        time = np.arange(measurements.time(channel)[0], measurements.time(channel)[-1], 1.0)
        told = (conicity, honest, 1.0) if fits else (np.nan, np.nan, 0.0)
        names = ("conicity [-]", "conicity_std [-]", "valid [-]")
        series = pd.DataFrame({"time [s]": time, **dict(zip(names, told, strict=True))})
        about: dict[str, Any] = {
            "offset [m]": offset,
            "way_scale [-]": scale,
            "creep_share [-]": creep,
            "response_error [-]": misfit.wrong,
        }
        about |= {"filter_std [-]": spread, "channel": channel, "blocks [-]": len(blocks.speeds)}
        about["warnings"] = [] if fits else [UNLIKE]
        return Estimate(self.name, series, {"settings": self.model_dump(mode="json"), **about})

    def _fit(self, blocks: Blocks, respond: Response, deviation: np.ndarray | None) -> Any:
        """Logarithms of conicity and creep share, and how far ahead the record really lies (m); residuals over
        `deviation` (m,), or else over the measured size.
        """
        scale = np.sqrt(np.mean(np.abs(blocks.turning) ** 2, axis=0)) if deviation is None else deviation

        def residual(x: np.ndarray) -> np.ndarray:
            return _residual(blocks, respond, x, scale)

        bounds = [[np.log(LEAST), np.log(CREEP[0]), -ASIDE], [np.log(MOST), np.log(CREEP[1]), ASIDE]]
        begin = np.log(DRY)
        ends = [
            least_squares(residual, [np.log(one), begin, place], bounds=bounds, x_scale=[0.1, 0.1, 0.5])
            for one in COARSE
            for place in ((0.0,) if deviation is not None else (0.0, 2.5))
        ]
        return min(ends, key=lambda one: one.cost)


def response(vehicle: Mapping[str, Any], channel: str) -> Response:
    """What turns the rails' slope into the yaw of the body whose gyro it is."""
    if channel == BOGIE:
        angles = float(vehicle["design_contact_angle_rate"]) / float(vehicle["design_conicity"])

        def bogie(conicity: float, creep: float, speed: float, k: np.ndarray) -> np.ndarray:
            contact = {"design_conicity": conicity, "design_contact_angle_rate": angles * conicity}
            return np.stack(followed({**vehicle, **contact, CREEP_FACTOR: creep / DRY}, speed, k)[:2])

        return bogie
    nominal = single_wheelset.wheelset_model(vehicle, 1.0)

    def wheelset(conicity: float, creep: float, speed: float, k: np.ndarray) -> np.ndarray:
        own = nominal.numbers
        model = nominal._replace(numbers=own._replace(f11=creep * own.f11, f22=creep * own.f22))
        a, b = single_wheelset.linear(model, conicity, speed)
        s = 1j * k * speed
        dynamic = s[:, None, None] * np.eye(len(a)) - a
        force = b[:, 0] + s[:, None] * b[:, 1]
        by_path = np.linalg.solve(dynamic, force[:, :, None])[:, single_wheelset.YAW, 0] / (1j * k)
        return np.stack([by_path, np.zeros(len(k))])

    return wheelset


def path(measurements: Measurements, channel: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance since the start (m), yaw rate over speed (1/m) and speed (m/s) on a uniform grid of distance."""
    time, rate = measurements.time(channel), measurements[channel]
    good = np.isfinite(rate)
    speed = held(measurements, time)
    speed = np.where(np.isfinite(speed), speed, speed[np.isfinite(speed)][0])
    gone = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    distance = np.arange(0.0, gone[-1], SPACING)
    turned = np.interp(time, time[good], rate[good]) / np.maximum(speed, 1.0)
    return distance, np.interp(distance, gone, turned), np.interp(distance, gone, speed)


def find(
    distance: np.ndarray, turning: np.ndarray, survey: Survey, gain: Callable[[np.ndarray], np.ndarray]
) -> list[tuple[float, float]]:
    """Distances at which the record may begin (m) with the scale of its way (-): where its turning is most like the
    rails' curvature through a typical response (`gain` of the wave number), the likeliest first; one for each scale.

    Raises
    ------
    InputError : the way is longer than the measured track.
    """
    grid = np.arange(survey.s[0], survey.s[-1], SPACING)
    slow = Band(15.0, 60.0)
    bent = np.gradient(np.gradient(np.interp(grid, survey.s, survey.centre), SPACING), SPACING)
    k = 2.0 * np.pi * np.fft.rfftfreq(len(bent), SPACING)
    k[0] = k[1]
    rails = np.nan_to_num(band_pass(np.fft.irfft(np.fft.rfft(bent) * gain(k), len(bent)), SPACING, slow))
    candidates: list[tuple[float, float, float]] = []
    for scale in SCALES:
        distances = np.arange(0.0, scale * distance[-1], SPACING)
        if len(distances) > len(grid):
            continue
        own = np.nan_to_num(band_pass(np.interp(distances, scale * distance, turning), SPACING, slow))
        agreement = signal.correlate(rails, own, "valid", "fft")
        size = signal.correlate(rails**2, np.ones(len(own)), "valid", "fft") * float(own @ own)
        likeness = agreement / np.sqrt(np.maximum(size, 1e-3 * size.max()))
        candidates.append((float(likeness.max()), float(grid[int(likeness.argmax())]), float(scale)))
    if not candidates:
        raise InputError(
            f"the record covers {distance[-1]:.0f} m, the measured track {grid[-1]:.0f} m; "
            "give the track of the whole way"
        )
    return [(place, scale) for _, place, scale in sorted(candidates, reverse=True)]


def averaged(blocks: Blocks, respond: Response, misfit: "Misfit", start: float) -> tuple[float, float, float]:
    """Conicity, its standard deviation, and the creep share, by the evidence of each of `SHARES`.

    A soft contact on a steep cone answers much like a stiff one on a shallow cone: the best pair alone says nothing of
    the others that do as well. Where the response is off by more than chance, the evidence counts for so much less
    (quasi-likelihood, Wedderburn 1974).

    Parameters
    ----------
    start : logarithm of a conicity near the best.
    """
    trust = max(misfit.dispersion, 1.0)
    found = []
    for creep in np.log(SHARES[::-1]):

        def residual(x: np.ndarray, creep: float = float(creep)) -> np.ndarray:
            return _residual(blocks, respond, np.array([x[0], creep, 0.0]), misfit.deviation)

        best = least_squares(residual, [start], bounds=(np.log(LEAST), np.log(MOST)), x_scale=0.1)
        start = float(best.x[0])
        found.append((best.cost / trust, np.exp(start), np.exp(start) / float(np.linalg.norm(best.jac)) * trust**0.5))
    cost, conicity, spread = np.array(found).T
    weight = np.exp(cost.min() - cost)
    weight /= weight.sum()
    mean = float(weight @ conicity)
    variance = float(weight @ (spread**2 + (conicity - mean) ** 2))
    return mean, float(np.sqrt(variance)), float(np.exp(weight @ np.log(SHARES[::-1])))


class Misfit(NamedTuple):
    """How a fitted response does beside the best one at each wave number.

    A free response takes one complex number for each of q slopes from the b blocks at each of the m wave numbers. What
    it explains more than the fit has 2 m q degrees of freedom, what it leaves 2 m (b - q), where the fit is right.

    Attributes
    ----------
    deviation : of real and imaginary part of what no response explains, shape (m,).
    dispersion : mean square of what the free response explains more, 1 by chance (F statistic).
    chance : how likely the dispersion is so large where the response is right (F test).
    wrong : rms of the fitted response's error over the response, beyond chance (-).
    """

    deviation: np.ndarray
    dispersion: float
    chance: float
    wrong: float

    @staticmethod
    def of(blocks: Blocks, predicted: np.ndarray) -> "Misfit":
        count, waves = blocks.turning.shape
        q, free = blocks.inputs, max(count - blocks.inputs, 1)
        left = np.sum(np.abs(_left(blocks)) ** 2, axis=0)
        more = np.sum(np.abs(blocks.turning - predicted) ** 2, axis=0) - left
        size = uniform_filter1d(left, SMOOTH) / free
        dispersion = max(float(np.mean(more / size)) / q, 0.0)
        power = np.sum(np.abs(blocks.turning) ** 2, axis=0)
        wrong = float(np.sqrt(max(np.mean((more - q * size) / power), 0.0)))
        chance = float(f_distribution.sf(dispersion, 2 * waves * q, 2 * waves * free))
        return Misfit(np.sqrt(size / 2.0), dispersion, chance, wrong)


def _left(blocks: Blocks) -> np.ndarray:
    """Turning that no response to the slopes explains, whatever it is at each wave number, shape (b, m)."""
    inputs = np.moveaxis(blocks.slopes[: blocks.inputs], 0, 2).swapaxes(0, 1)  # (m, b, inputs)
    turning = blocks.turning.T[:, :, None]
    free = np.linalg.pinv(inputs) @ turning
    return (turning - inputs @ free)[:, :, 0].T


def incoherent(blocks: Blocks) -> float:
    """Share of the turning that no response to the slope explains, whatever it is at each wave number (-)."""
    left, power = (np.sum(np.abs(one) ** 2, axis=0) for one in (_left(blocks), blocks.turning))
    return float(np.mean(left / power))


def _channel(measurements: Measurements) -> str | None:
    """The yaw gyro whose response is known."""
    if WHEELSET in measurements and single_wheelset.fits(measurements.vehicle):
        return WHEELSET
    return BOGIE if BOGIE in measurements and given(measurements.vehicle, lateral_roll.NEEDED) else None


def _predicted(blocks: Blocks, respond: Response, x: np.ndarray) -> np.ndarray:
    """Turning of every block (b, m); one response serves blocks of about the same speed."""
    conicity, creep = np.exp(x[:2])
    near, which = blocks.near
    known = np.stack([respond(conicity, creep, speed, blocks.k) for speed in near]) * np.exp(1j * blocks.k * x[2])
    found = known[which, 0] * blocks.slopes[0]
    for number in range(1, blocks.inputs):
        found += known[which, number] * blocks.slopes[number]
    return found


def _residual(blocks: Blocks, respond: Response, x: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    wrong = (blocks.turning - _predicted(blocks, respond, x)) / deviation
    return np.concatenate([wrong.real.ravel(), wrong.imag.ravel()])


def _deviation(blocks: Blocks, respond: Response, x: np.ndarray) -> np.ndarray:
    """Standard deviation of each part (real, imaginary) of what the fit leaves, smoothed over wave numbers (m,)."""
    left = np.abs(blocks.turning - _predicted(blocks, respond, x)) ** 2
    return np.sqrt(uniform_filter1d(left.mean(axis=0), SMOOTH) / 2.0)
