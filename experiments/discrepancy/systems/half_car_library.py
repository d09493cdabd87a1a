"""What a half car may lack: nine families, and where the search for a tone or a dip begins."""

import math
from functools import partial
from typing import Any

import numpy as np

from experiments.discrepancy.core.model import Coordinate, Effect, Fit, Library
from experiments.discrepancy.systems.half_car import CHANNELS, FORCES, TONES, WIDE, dip

LENGTH = 0.6  # m; of the dip that is looked for
CLEAR = 1.0  # s; at the ends of a record, where none is looked for
FINER = 8  # times as many frequencies as a record has by itself: a tone is looked for between them
FOUND = 2  # dips from which a fit begins
THIRD = (2.5, 14.0)  # Hz; within two standard deviations of a third body's frequency
LEAST = 2e-4  # m; depth from which it begins at least
SMALL = 4.5e-4  # m; rms of the largest dip that fits a healthy record, over the records that levels are learned from


def _between(whole: np.ndarray, f: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(whole, columns): complex columns at other frequencies; nothing outside of the band."""
    inside = (whole >= f[0]) & (whole <= f[-1])
    parts = [np.interp(whole, f, one.real) + 1j * np.interp(whole, f, one.imag) for one in values.T]
    return np.where(inside[:, None], np.stack(parts, axis=1), 0.0)


def _inverse(base: Fit) -> np.ndarray:
    return np.linalg.inv(np.tensordot(np.exp(2.0 * base.psi), base.groups[0].components, 1))


def seek_tone(place: str, system: Any, base: Fit) -> list[tuple[float, ...]]:
    """Where what is left points most along a force at `place`: its frequency, and amplitudes by least squares."""
    along = system.transfers(base.x, base.hypothesis.effects).forces[:, :, FORCES.index(place)]
    f, samples = system.frames.frequencies, system.frames.samples
    whole, window = np.fft.rfftfreq(FINER * samples, 1.0 / system.record.rate), np.hanning(samples)
    seen = np.einsum("fc,fcd->fd", np.conj(along), _inverse(base))
    power = np.real(np.einsum("fc,fc->f", seen, along))
    spread = system.frames.synthesise(base.groups[0].residual) * window * 2.0 / window.sum()
    left = np.fft.rfft(spread, FINER * samples)
    amplitude = np.einsum("fc,cf->f", _between(whole, f, seen / power[:, None]), left)
    best = int(np.argmax(np.abs(amplitude) ** 2 * np.interp(whole, f, power)))
    size = amplitude[best]
    return [(math.log(whole[best]), size.real, -size.imag)]


def seek_third(system: Any, base: Fit) -> list[tuple[float, ...]]:
    """Own frequencies where what is left points most along a force on the body, over all frames, for two masses."""
    along = system.transfers(base.x, base.hypothesis.effects).forces[:, :, FORCES.index("body")]
    seen = np.einsum("fc,fcd->fd", np.conj(along), _inverse(base))
    power = np.real(np.einsum("fc,fc->f", seen, along))
    force = np.einsum("fc,ftc->ft", seen, base.groups[0].residual)
    ratio = np.where((system.frames.frequencies < THIRD[0]) | (system.frames.frequencies > THIRD[1]), 0.0,
                     np.mean(np.abs(force) ** 2, axis=1) / power)  # fmt: skip
    best = float(system.frames.frequencies[int(np.argmax(ratio))])
    return [(math.log(mass), math.log(best), math.log(0.05)) for mass in (20.0, 50.0)]


def seek_dip(sign: float, system: Any, base: Fit) -> list[tuple[float, ...]]:
    """Where what is left is most like the response to a dip (matched filter)."""
    f, samples, rate = system.frames.frequencies, system.frames.samples, system.record.rate
    whole, middle = np.fft.rfftfreq(samples, 1.0 / rate), 0.5 * system.duration
    apart = (np.arange(samples) / rate - middle) * system.record.speed
    road = system.transfers(base.x, base.hypothesis.effects).road
    response = _between(whole, f, road) * np.fft.rfft(dip(apart, 1.0, LENGTH))[:, None]
    inverse = _between(whole, f, _inverse(base).reshape(len(f), -1)).reshape(-1, len(CHANNELS), len(CHANNELS))
    seen = np.einsum("fcd,fd->fc", inverse, response)
    left = np.fft.rfft(system.frames.synthesise(base.groups[0].residual))
    score = np.fft.irfft(np.einsum("fc,cf->f", np.conj(seen), left), samples)
    power = 2.0 / samples * float(np.real(np.einsum("fc,fc->", np.conj(seen), response)))
    time = middle + np.fft.fftfreq(samples, 1.0 / samples) / rate
    depth, starts = sign * score / power, []
    depth[(time < CLEAR) | (time > system.duration - CLEAR)] = 0.0
    for _ in range(FOUND):
        best = int(np.argmax(depth))
        starts.append((float(time[best]), sign * max(float(depth[best]), LEAST), math.log(LENGTH)))
        depth[np.abs(time - time[best]) * system.record.speed < 2.0 * LENGTH] = 0.0
    return starts


def _suspension(end: str) -> list[Effect]:
    place = f"{end} suspension"
    stop = (Coordinate("log gap", "m", math.log(0.012), 0.4), Coordinate("log stop", "N/m", math.log(40e3), 0.6))
    return [
        Effect(f"soft {end} spring", "soft spring", (Coordinate(f"log {end} spring", "-", -0.25, 0.2),),
               starts=((-0.15,), (-0.4,)), place=place),
        Effect(f"weak {end} damper", "weak damper", (Coordinate(f"log {end} damper", "-", -0.6, 0.4),),
               starts=((-0.4,), (-0.9,)), place=place),
        Effect(f"{end} friction", "friction", (Coordinate(f"{end} friction", "N", 60.0, 40.0),),
               starts=((25.0,), (90.0,)), place=place),
        Effect(f"{end} stop", "stop", own=stop, place=place,
               starts=((math.log(0.008), math.log(40e3)), (math.log(0.014), math.log(60e3)))),
    ]  # fmt: skip


def _sensor(channel: str) -> list[Effect]:
    gain = Coordinate(f"gain {channel}", "-", 0.0, 0.12)
    delay = Coordinate(f"delay {channel}", "s", 3e-3, 2.5e-3)
    return [
        Effect(f"gain of {channel}", "gain", (gain,), place=channel),
        Effect(f"delay of {channel}", "delay", (delay,), starts=((2e-3,), (5e-3,)), place=channel),
    ]


def _tone(place: str) -> Effect:
    own = (Coordinate("log frequency", "Hz", math.log(12.0), 0.5, 1e-4), Coordinate("in phase", "N", 0.0, 40.0),
           Coordinate("across", "N", 0.0, 40.0))  # fmt: skip
    return Effect(f"tone at {place}", "tone", own=own, place=place, seek=partial(seek_tone, place))


def _dip(name: str, sign: float) -> Effect:
    time, length = Coordinate("time", "s", 8.0, 6.0, 5e-4), Coordinate("log length", "m", math.log(0.6), 0.3)
    own = (time, Coordinate("depth", "m", sign * 3e-3, 1.5e-3, 1e-5), length)
    healthy = (time, Coordinate("depth", "m", 0.0, SMALL, 1e-5), length)
    return Effect(name, "dip", own=own, seek=partial(seek_dip, sign), healthy=healthy)


def _law(end: str) -> Effect:
    faults = tuple(Coordinate(f"{end} {part}", "-", 0.0, WIDE) for part in ("one-sidedness", "square part"))
    name, starts = f"unknown: law of the {end} damper", ((0.4, 0.0), (-0.4, 0.0), (0.0, 0.4))
    return Effect(name, f"law {end}", faults, starts=starts, place=f"{end} suspension", kind="law")


def _third() -> Effect:
    own = (
        Coordinate("log third mass", "kg", math.log(40.0), 0.6),
        Coordinate("log own frequency", "Hz", math.log(6.0), 0.4),
        Coordinate("log damping ratio", "-", math.log(0.05), 0.5),
    )
    starts = tuple((math.log(20.0), math.log(f), math.log(0.05)) for f in (4.0, 6.0, 9.0))
    return Effect("third body", "third body", own=own, starts=starts, place="body", seek=seek_third)


LIBRARY = Library(
    (
        *(effect for end in ("front", "rear") for effect in _suspension(end)),
        *(effect for channel in CHANNELS for effect in _sensor(channel)),
        *(_tone(place) for place in TONES),
        _dip("dip", 1.0),
        _dip("bump", -1.0),
        _third(),
        *(_law(end) for end in ("front", "rear")),
    )
)
"""Fault priors from the limits of maintenance: springs -22 %, dampers -45 %, friction 60 N, delays of 3 ms."""
