"""Words whose bytes were read in the wrong order: the other order gives a far smoother channel."""

from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._signals import limit
from railsim.quality.interface import ChannelCheck, Finding
from railsim.quality.repairs import Reread
from railsim.sensors.logger import reversed_bytes
from railsim.spec import quantity

_WORDS = (16, 32)  # bits
_WHOLE = 0.01  # steps of the resolution by which a value may miss a whole number
_FEWEST = 64  # samples


class ByteOrder(ChannelCheck, frozen=True):
    """Likelihood of the differences between samples that follow each other, read in both orders.

    The low byte of a word changes at random from sample to sample; read as the high one it makes noise over the whole
    range. Only values that are whole numbers of the data sheet's resolution (or, where none is stated, of the smallest
    step between them) have bytes to be reversed.
    """

    share: float = quantity(0.5, unit="nepers a sample", source="illustrative: differences 2.7 times as large", gt=0)

    stage: ClassVar[int] = 0

    def channel(self, measured: Measurements, name: str) -> Finding | None:
        """One finding for a channel, over the whole record."""
        values, time = measured[name], measured.time(name)
        step = limit(measured, name, "resolution") or _smallest_step(values)
        good = np.isfinite(values)
        if not step or good.sum() < _FEWEST:
            return None
        counts = values[good] / step
        if np.abs(counts - np.rint(counts)).max() > _WHOLE:
            return None
        rough = _roughness(values[good])
        for bits in _WORDS:
            if np.abs(counts).max() > 2.0 ** (bits - 1):
                continue
            smooth = _roughness(reversed_bytes(values[good], step, bits))
            if smooth > 0.0 and 0.5 * np.log(rough / smooth) > self.share:
                extent = f"{bits}-bit words are {np.sqrt(rough / smooth):.3g} times as smooth with their bytes reversed"
                return Finding(
                    "byte order",
                    name,
                    float(time[0]),
                    float(time[-1]),
                    extent,
                    "state the file's byte order where it is read; the bytes are reversed",
                    repair=Reread(float(bits), step=step),
                )
        return None


def _roughness(values: np.ndarray) -> float:
    """Mean square of the differences between samples that follow each other."""
    return float(np.mean(np.diff(values) ** 2))


def _smallest_step(values: np.ndarray) -> float:
    """Smallest difference of two values; 0 where there are not two."""
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    return float(steps.min()) if steps.size else 0.0
