"""Single wrong samples."""

from typing import ClassVar

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._outliers import fitted, peaks, significance, step_pattern
from railsim.quality._signals import NORMAL, Whitened, chance, whitened
from railsim.quality.interface import ChannelCheck, Finding
from railsim.quality.repairs import Fill
from railsim.spec import quantity

_MOST = 10  # outliers that are fitted together

_APART = 16  # samples: more than two outliers in that many are a transient, which is real


class Spikes(ChannelCheck, frozen=True):
    """Additive outliers of the autoregressive model that are large beside the channel's own movement."""

    size: float = quantity(5.0, unit="robust standard deviations", source="illustrative", gt=0)
    clean: float = quantity(4.0, unit="mean square of innovations that remain", source="1 without outlier", gt=1)

    rest: float = quantity(0.01, unit="- of their mean square with the outlier", source="illustrative", gt=0, lt=1)

    stage: ClassVar[int] = 4

    def channel(self, measured: Measurements, name: str) -> Finding | None:
        """One finding for a channel with all its spikes."""
        values, time = measured[name], measured.time(name)
        white = whitened(values, measured.rate(name))
        if white is None:
            return None
        deviate = significance(white, white.filter)
        stepped = significance(white, step_pattern(white.filter))
        least = self.size * NORMAL * float(np.nanmedian(np.abs(values - np.nanmedian(values))))
        sizes_at: dict[int, float] = {}
        samples = peaks(deviate, chance(values.size, len(measured)), 0)
        for group in _groups(samples, white.filter.size):
            if np.max(np.abs(deviate[group])) > np.max(np.abs(stepped[group])):
                sizes = self._pursued(white, group)
                sizes_at |= {at: size for at, size in sizes.items() if abs(size) > least}
        if not sizes_at:
            return None
        samples = np.array(sorted(sizes_at))
        highest = max(abs(size) for size in sizes_at.values())
        return Finding(
            "spikes",
            name,
            float(time[samples[0]]),
            float(time[samples[-1]]),
            f"{samples.size} single samples, up to {highest:.3g} off",
            "check the cable and the logger's bus; the samples are interpolated",
            repair=Fill(),
            samples=samples,
        )

    def _pursued(self, white: Whitened, group: list[int]) -> dict[int, float]:
        """Outliers and their sizes, the largest first, until the innovations are clean; none where they never are."""
        samples: list[int] = []
        window = slice(max(0, group[0] - 4), group[-1] + white.filter.size)
        left = white.innovations.copy()
        for _ in range(_MOST):
            reach = left[window.start : window.stop]
            match = np.correlate(np.concatenate([reach, np.zeros(white.filter.size - 1)]), white.filter, mode="valid")
            samples = sorted({*samples, window.start + int(np.argmax(np.abs(match)))})
            before, after, sizes = fitted(white, white.filter, samples, window)
            if len(samples) > 2 + (samples[-1] - samples[0]) // _APART:
                break
            if after < max(self.clean, self.rest * before):
                return {at: float(size * white.scale[at]) for at, size in zip(samples, sizes, strict=True)}
            left = white.innovations.copy()
            for at, size in zip(samples, sizes, strict=True):
                part = white.filter[: left.size - at]
                left[at : at + part.size] -= size * part
        return {}


def _groups(samples: list[int], apart: int) -> list[list[int]]:
    """Places that lie closer together than `apart`."""
    groups: list[list[int]] = []
    for at in samples:
        if groups and at - groups[-1][-1] < apart:
            groups[-1].append(at)
        else:
            groups.append([at])
    return groups
