"""From the paths of wheels' centres to what they roll over: bands of roughness with what is not known of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from estimators.speed.axleboxes import Axle
from estimators.track.roughness_bands import Spectra
from estimators.vehicle.wheel_on_track import WheelOnTrack, contact_filter

CLEAR = 2.0
"""Times the noise's power that a band must have to be given."""
SPARE = 1.3
"""Of the lowest frequency that is kept, so that its high-pass takes nothing."""

ROLL = 0.1
"""Share by which the mass that a wheel has in the axle's roll is not known: between rolling about the axle and about
the rails lies the square of radius over half gauge, 0.3; half of that acts on the other wheel, two deviations wide."""


class Banded(NamedTuple):
    """Bands of roughness by window, shape (sides, windows, bands); NaN beyond what speed and samples reach.

    Attributes
    ----------
    power : mean square, noise taken out, m2; may be negative where there is nothing but noise.
    std : of the rms value, m. noise : mean square of the noise, m2, that of the data sheet and what may be more.
    """

    power: np.ndarray
    std: np.ndarray
    noise: np.ndarray

    @property
    def rms(self) -> np.ndarray:
        """m."""
        return np.sqrt(np.maximum(self.power, 0.0))

    def mean(self, there: np.ndarray) -> "Banded":
        """Over the windows that count, shape (sides, bands); what is not known is taken to be the same in all."""
        kept = [one[:, there] for one in (self.power, self.std, self.noise)]
        power, noise = kept[0].mean(axis=1), kept[2].mean(axis=1)
        wide = 2.0 * np.sqrt(np.maximum(kept[0], 0.0)) * kept[1]
        return Banded(power, wide.mean(axis=1) / np.maximum(2.0 * np.sqrt(np.maximum(power, 0.0)), 1e-12), noise)

    def known(self, widest: float) -> np.ndarray:
        """Whether a value is clear of noise and its deviation at most `widest` of it."""
        return (self.power > (CLEAR - 1.0) * self.noise) & (self.std <= widest * self.rms)


class Inverse(NamedTuple):
    """How paths become roughness.

    Attributes
    ----------
    axle : whose wheels. drawn : the wheel on its track as far as it is known.
    half_length : of the contact, m, that averages short waves; 0: nothing is undone.
    lowest : frequency below which paths hold nothing, Hz. unstated : density of noise beyond the data sheet's,
        (m/s2)^2/Hz.
    """

    axle: Axle
    drawn: WheelOnTrack
    half_length: float
    lowest: float
    unstated: float

    def banded(self, paths: Spectra, speed: np.ndarray, bands: Sequence[tuple[float, float]], length: float) -> Banded:
        """Bands of wavelengths (shortest, longest), m, in windows at these speeds, m/s, shape (windows,)."""
        sides, count, _ = paths.density.shape
        shape = sides, count, len(bands)
        power, std, noise = (np.full(shape, np.nan) for _ in range(3))
        shares = np.stack([paths.share(*band) for band in bands])
        used = shares.sum(axis=0) > 0.0
        shares, wave_number = shares[:, used], paths.wave_number[used]
        counts = 2.0 * length * shares.sum(axis=1)
        for i, v in enumerate(speed):
            reached = np.array([self._reached(v, *band) for band in bands])
            if not reached.any():
                continue
            omega = 2.0 * np.pi * v * wave_number
            factor = np.abs(self.drawn.roughness_over_path(omega)) ** 2
            if self.half_length:
                factor = factor / contact_filter(1.0 / wave_number, self.half_length) ** 2
            floor = v / omega**4 / np.maximum(np.abs(self.axle.sheet.low_pass(omega)) ** 2, 0.1)
            stated = self.axle.noise**2 * factor * floor @ shares.T
            more = self.unstated * (factor * floor @ shares.T).mean(axis=0)
            unsure = self.axle.unsure(v * wave_number)
            turned = ROLL * np.abs(self.drawn.roughness_over_path(omega) - 1.0)
            across = factor.mean(axis=0) * unsure**2 + np.mean(turned**2, axis=0)
            for side in range(sides):
                lines = paths.density[side, i, used]
                draws = factor * lines @ shares.T
                mean = draws.mean(axis=0)
                clean = np.sqrt(np.maximum(draws - stated, 0.0))
                net = clean.mean(axis=0)
                mid_noise = stated.mean(axis=0)
                by_noise = np.sqrt((4.0 * net**2 * mid_noise + 2.0 * mid_noise**2) / np.maximum(counts, 1.0)) + more
                by_sensor = np.sqrt((factor.mean(axis=0) * lines * unsure**2 @ shares.T) / np.maximum(mean, 1e-30))
                other = np.sqrt(paths.density[1 - side, i, used] * across @ shares.T) if sides == 2 else 0.0 * net
                parts = [clean.std(axis=0), by_noise / np.maximum(2.0 * net, 1e-12), by_sensor * net, other]
                power[side, i] = np.where(net > 0.0, net**2, mean - mid_noise)
                std[side, i] = np.sqrt(np.sum(np.square(parts), axis=0))
                noise[side, i] = mid_noise + more
            for one in (power, std, noise):
                one[:, i, ~reached] = np.nan
        return Banded(power, std, noise)

    def _reached(self, speed: float, shortest: float, longest: float) -> bool:
        return speed / shortest <= self.axle.reach and speed / longest >= SPARE * self.lowest
