"""What a logger does to samples: its clock, its packets, the order of bytes, the unit."""

import math

import numpy as np
import pydantic

from railsim.spec import Spec, quantity

_SCENARIO = "chosen by the scenario; not known in the field"
_WORD = 16  # bits, of a sensor's usual word; a longer one has twice as many
_ROUNDED = 1.01  # - by which ranges and resolutions of data sheets are rounded


class LoggerErrors(Spec, frozen=True):
    """Errors between a sensor and its file; every default is a sound logger. None of them is on the data sheet.

    The stamps stay even in the sensor's rate. A clock that is slow by `clock_scale` takes its samples (1 + s) steps
    apart: oscillators inside micromechanical sensors are off by 1 % and more (MPU-6050 product specification: 1 % at
    25 degrees C), quartz by some 1e-5. Samples that would lie after the end of the run are lost (NaN).

    A packet is `packet` rows of all channels of the sensor. One that is written twice moves all that follows back by as
    many rows, and the last rows fall away; one that is overtaken changes places with the next.
    """

    clock_scale: float = quantity(0.0, unit="-, sampling steps over stated ones, minus 1", source=_SCENARIO, gt=-0.1)
    clock_jitter: float = quantity(0.0, unit="s, standard deviation of the instants", source=_SCENARIO, ge=0)
    packet: int = quantity(32, unit="rows", source="illustrative", ge=1)
    repeated: float = quantity(0.0, unit="- of the packets are written twice", source=_SCENARIO, ge=0, le=1)
    reordered: float = quantity(0.0, unit="- of the packets are overtaken by the next", source=_SCENARIO, ge=0, le=1)
    bytes_reversed: bool = quantity(False, unit="whether words are read in the wrong byte order", source=_SCENARIO)
    unit_scale: float = quantity(1.0, unit="- written over true value: 0.102 for g in place of m/s2", source=_SCENARIO)

    @pydantic.field_validator("clock_scale")
    @classmethod
    def _some_clock(cls, value: float) -> float:
        if value > 0.1:
            raise ValueError("a clock is not off by more than 10 %")
        return value

    @property
    def moves_instants(self) -> bool:
        """Whether samples are taken at other instants than the stamps say."""
        return bool(self.clock_scale or self.clock_jitter)

    def instants(self, count: int, rate: float, rng: np.random.Generator) -> np.ndarray | None:
        """Times of `count` samples at `rate` Hz after the first stamp, s, shape (count,); None for those stated."""
        if not self.moves_instants:
            return None
        stamps = np.arange(count) / rate
        scatter = self.clock_jitter * rng.standard_normal(count) if self.clock_jitter else 0.0
        return np.maximum(stamps * (1.0 + self.clock_scale) + scatter, 0.0)

    def rows(self, count: int, rng: np.random.Generator) -> np.ndarray | None:
        """Which of `count` rows is written in each place, shape (count,); None where each has its own."""
        if not (self.repeated or self.reordered):
            return None
        packets = np.array_split(np.arange(count), range(self.packet, count, self.packet))
        again, overtaken = rng.uniform(size=(2, len(packets)))
        at = 0
        while at < len(packets) - 1:
            if overtaken[at] < self.reordered:
                packets[at], packets[at + 1] = packets[at + 1], packets[at]
                at += 1
            at += 1
        written = [part for part, one in zip(packets, again, strict=True) for _ in range(1 + (one < self.repeated))]
        return np.concatenate(written)[:count]

    def write(self, samples: np.ndarray, resolution: float, largest: float | None) -> np.ndarray:
        """Samples as they stand in the file.

        Parameters
        ----------
        samples : unit of the channel, shape (n,).
        resolution : of the sensor, unit of the channel; a sensor without one writes no whole numbers, whose bytes could
            be reversed.
        largest : range of the sensor, unit of the channel.
        """
        if self.bytes_reversed and resolution:
            samples = reversed_bytes(samples, resolution, word(resolution, largest))
        return samples * self.unit_scale if self.unit_scale != 1.0 else samples


def word(resolution: float, largest: float | None) -> int:
    """Bits of the word that holds a range in steps of the resolution: 16 or 32."""
    held = 2 ** (_WORD - 1) * _ROUNDED
    return _WORD if largest is not None and largest / resolution < held else 2 * _WORD


def reversed_bytes(samples: np.ndarray, resolution: float, bits: int) -> np.ndarray:
    """Whole numbers of `resolution`, their bytes read in the opposite order, shape (n,); lost samples stay lost."""
    top = 2 ** (bits - 1)
    lost = ~np.isfinite(samples)
    counts = np.clip(np.rint(np.where(lost, 0.0, samples) / resolution), -top, top - 1)
    turned = counts.astype(f"<i{bits // 8}").byteswap().astype(float) * resolution
    return np.where(lost, math.nan, turned)
