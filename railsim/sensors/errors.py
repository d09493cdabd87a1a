"""What stands between a true quantity and a sample: filter, latency, scale, bias, noise, range and resolution."""

import math
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
import pydantic
from scipy.signal import butter, lfilter, lfilter_zi, sosfilt, sosfilt_zi
from scipy.spatial.transform import Rotation

from railsim.sensors.logger import LoggerErrors
from railsim.spec import Spec, quantity

_SHEET = "data sheet of the sensor"
_SCENARIO = "chosen by the scenario; not known in the field"


class SensorErrors(Spec, frozen=True):
    """Error model of one sensor; every default is an ideal sensor. "channel" is the unit of the measured channel.

    The chain is: mount, element (rectification, overload), anti-aliasing filter, latency and sampling, scale, bias,
    drift, warming, noise, resolution, range. Noise is white up to half the sample rate, as a digital output shows it.
    Rectification r is the quadratic term of the element (K2 of IEEE Std 1293-1998): vibration adds r times its mean
    square to the bias, even where the filter takes the vibration out. An element that is overloaded clips before the
    filter, so a short impact leaves a step in the integral. Drift is a first-order Gauss-Markov process (IEEE Std
    952-1997, "exponentially correlated noise"; its Allan deviation peaks at 0.62 of its standard deviation at 1.89
    correlation times). Random values that a specimen has for good (bias, scale, mounting) are drawn once a run.
    What its logger does wrong (`LoggerErrors`) comes last, but for the clock, which is where samples are taken.
    """

    range: float | None = quantity(None, unit="channel", source=_SHEET, gt=0)
    resolution: float = quantity(0.0, unit="channel", source=_SHEET, ge=0)
    noise_density: float = quantity(0.0, unit="channel/sqrt(Hz), one-sided", source=_SHEET, ge=0)
    bias: float = quantity(0.0, unit="channel", source=_SCENARIO)
    bias_std: float = quantity(0.0, unit="channel", source=_SHEET, ge=0)
    bias_instability: float = quantity(0.0, unit="channel, standard deviation of the drift", source=_SHEET, ge=0)
    bias_correlation_time: float = quantity(100.0, unit="s", source="illustrative", gt=0)
    scale_error: float = quantity(0.0, unit="-", source=_SCENARIO, gt=-1)
    scale_error_std: float = quantity(0.0, unit="-", source=_SHEET, ge=0)
    misalignment: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), unit="rad, rotation vector of the sensor in body axes", source=_SCENARIO
    )
    misalignment_std: float = quantity(0.0, unit="rad, each component", source=_SHEET, ge=0, le=0.3)
    bandwidth: float | None = quantity(None, unit="Hz, -3 dB", source=_SHEET, gt=0)
    bandwidth_order: int = quantity(2, unit="order of the Butterworth low-pass", source=_SHEET, ge=1, le=8)
    latency: float = quantity(0.0, unit="s", source=_SHEET, ge=0)
    drift_rate: float = quantity(0.0, unit="channel/s", source=_SCENARIO)
    resonance: float | None = quantity(None, unit="Hz, of the sensor on its mount", source=_SCENARIO, gt=0)
    resonance_damping: float = quantity(0.05, unit="- of critical", source=_SCENARIO, gt=0)
    cross_talk: float = quantity(0.0, unit="- of the next axis", source=_SCENARIO)
    rectification: float = quantity(0.0, unit="1/channel, of the signal squared", source=_SHEET)
    overload: float | None = quantity(None, unit="channel, at which the element clips", source=_SHEET, gt=0)
    temperature_bias: float = quantity(0.0, unit="channel/K", source=_SHEET)
    warming: float = quantity(0.0, unit="K, from the start to long after", source=_SCENARIO)
    warming_time: float = quantity(600.0, unit="s, time constant", source=_SCENARIO, gt=0)
    logger: LoggerErrors = quantity(LoggerErrors(), unit="-", source=_SCENARIO)

    hidden: ClassVar[frozenset[str]] = frozenset(
        {"bias", "scale_error", "misalignment", "drift_rate", "resonance", "resonance_damping", "cross_talk"}
        | {"warming", "warming_time", "logger"}
    )

    @pydantic.model_serializer(mode="wrap")
    def _without_sound_logger(self, dump: pydantic.SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A logger without errors is not written, as in files from before there was one."""
        values: dict[str, Any] = dump(self)
        if self.logger == LoggerErrors():
            values.pop("logger", None)
        return values

    def data_sheet(self) -> dict[str, Any]:
        """The fields that are known in the field, by name."""
        return self.model_dump(mode="json", exclude=set(self.hidden))

    def apply(
        self,
        signal: np.ndarray,
        rate: float,
        step: int,
        rng: np.random.Generator,
        instants: np.ndarray | None = None,
    ) -> np.ndarray:
        """Samples of `signal`, shape (n,), given at `rate` Hz; every `step`-th is taken; shape (ceil(n / step),).

        `instants`: s after the first, shape (ceil(n / step),), at which samples are taken instead (see `LoggerErrors`).
        """
        ready = self.filter(self.element(self.shake(signal, rate)), rate)
        if instants is None:
            samples = sample(ready, step, self.latency * rate)
        else:
            samples = sample_at(ready, (instants - self.latency) * rate)
        return self.digitise(self.disturb(samples, rate / step, rng))

    def shake(self, signal: np.ndarray, rate: float) -> np.ndarray:
        """Through the mount's resonance 1 / (1 + 2 z s / w + s^2 / w^2), at rest at the first value.

        By the bilinear transform, exact at the resonance itself; one above 0.45 of the rate does not show.
        """
        if self.resonance is None or self.resonance >= 0.45 * rate:
            return signal
        warped = 1.0 / math.tan(math.pi * self.resonance / rate)
        damped = 2.0 * self.resonance_damping * warped
        a = np.array([1.0 + damped + warped**2, 2.0 - 2.0 * warped**2, 1.0 - damped + warped**2])
        b = np.array([1.0, 2.0, 1.0])
        return lfilter(b / a[0], a / a[0], signal, zi=lfilter_zi(b / a[0], a / a[0]) * signal[0])[0]

    def element(self, signal: np.ndarray) -> np.ndarray:
        """Through the sensing element: its quadratic term, and clipping where it is overloaded."""
        if self.rectification:
            signal = signal + self.rectification * signal**2
        return signal if self.overload is None else np.clip(signal, -self.overload, self.overload)

    def filter(self, signal: np.ndarray, rate: float) -> np.ndarray:
        """Causal Butterworth low-pass, at rest at the first value; passes all where the signal holds nothing above."""
        if self.bandwidth is None or self.bandwidth >= rate / 2:
            return signal
        sections, settled = _butterworth(self.bandwidth_order, self.bandwidth, rate)
        return sosfilt(sections, signal, zi=settled * signal[0])[0]

    def disturb(self, samples: np.ndarray, rate: float, rng: np.random.Generator) -> np.ndarray:
        """Scale, bias, drift and noise; each has a random stream of its own, so changing one leaves the others."""
        specimen, drift, noise = rng.spawn(3)
        bias = self.bias + self.bias_std * specimen.standard_normal()
        scale = self.scale_error + self.scale_error_std * specimen.standard_normal()
        samples = samples * (1 + scale) + bias
        if self.drift_rate:
            samples += self.drift_rate * np.arange(samples.size) / rate
        if self.temperature_bias and self.warming:
            warmer = -self.warming * np.expm1(-np.arange(samples.size) / (rate * self.warming_time))
            samples += self.temperature_bias * warmer
        if self.bias_instability:
            samples += gauss_markov(samples.size, rate, self.bias_instability, self.bias_correlation_time, drift)
        if self.noise_density:
            samples += self.noise_density * math.sqrt(rate / 2) * noise.standard_normal(samples.size)
        return samples

    def digitise(self, samples: np.ndarray) -> np.ndarray:
        """Round to the resolution, then saturate at the range."""
        if self.resolution:
            samples = np.round(samples / self.resolution) * self.resolution
        return samples if self.range is None else np.clip(samples, -self.range, self.range)

    def mounting(self, rng: np.random.Generator) -> np.ndarray:
        """Axes of the sensor as columns in body axes, shape (3, 3): stated misalignment plus this run's draw."""
        angles = np.array(self.misalignment) + self.misalignment_std * rng.standard_normal(3)
        return Rotation.from_rotvec(angles).as_matrix()


@lru_cache(64)
def _butterworth(order: int, bandwidth: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Sections of a digital low-pass, and their state at rest at one."""
    sections = np.asarray(butter(order, bandwidth, fs=rate, output="sos"))
    return sections, np.asarray(sosfilt_zi(sections))


def low_pass(omega: np.ndarray, corner: float, order: int) -> np.ndarray:
    """Response of the Butterworth low-pass of a data sheet to angular frequencies [rad/s], of their shape; corner [Hz].

    Source: Butterworth (1930), On the theory of filter amplifiers.
    """
    poles = np.exp(1j * np.pi * (2.0 * np.arange(order) + order + 1.0) / (2.0 * order))
    return np.prod(-poles / (1j * omega[..., None] / (2.0 * np.pi * corner) - poles), axis=-1)


def sample(signal: np.ndarray, step: int, delay: float) -> np.ndarray:
    """Every `step`-th value of `signal` as it was `delay` samples before; before the start it had its first value.

    A fraction of a sample is interpolated by Lagrange's polynomial through six neighbours.
    """
    whole = math.floor(delay)
    fraction = delay - whole
    at = np.arange(0, signal.size, step) - whole
    if fraction < 1e-9:
        return signal[np.maximum(at, 0)]
    nodes = np.arange(-3, 3)
    total = np.zeros(at.size)
    for node in nodes:
        others = nodes[nodes != node]
        weight = float(np.prod((-fraction - others) / (node - others)))
        total += weight * signal[np.clip(at + node, 0, signal.size - 1)]
    return total


def sample_at(signal: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values of `signal` at fractional `places` in samples, shape (k,); before the start the first, after the end NaN.

    By Lagrange's polynomial through six neighbours.
    """
    last = signal.size - 1
    inside = np.clip(places, 0.0, last)
    whole = np.floor(inside).astype(int)
    fraction = inside - whole
    nodes = np.arange(-2, 4)
    total = np.zeros(places.size)
    for node in nodes:
        weight = np.prod([(fraction - other) / (node - other) for other in nodes if other != node], axis=0)
        total += weight * signal[np.clip(whole + node, 0, last)]
    return np.where(places > last + 1e-9, math.nan, total)


def gauss_markov(count: int, rate: float, std: float, correlation_time: float, rng: np.random.Generator) -> np.ndarray:
    """A stationary first-order Gauss-Markov process of `count` samples at `rate` Hz (IEEE Std 952-1997)."""
    decay = math.exp(-1 / (rate * correlation_time))
    drive = std * math.sqrt(-math.expm1(-2 / (rate * correlation_time))) * rng.standard_normal(count)
    start = std * rng.standard_normal()
    return lfilter([1.0], [1.0, -decay], drive, zi=[decay * start])[0]
