"""What tells adhesion levels apart: densities and cross densities of creep forces and motions in a window, by bands.

Logarithms of densities, so that the track's level is a common shift which the classifier's weights can take out, and
complex coherences, which have none. Levels of adhesion differ in how steeply force follows creepage: that is in what
goes from creepage to lateral force and from yaw rate to yaw moment, and in how the bogie answers the track.
"""

from collections.abc import Sequence

import numpy as np

from estimators.adhesion.creep_forces import RATE, SIGNALS, Segments

SETS: dict[str, tuple[str, ...]] = {
    "wheelsets": ("wheelset1", "wheelset2", "bogie", "body"),
    "bogie": ("bogie", "body"),
}
"""Sets of sensors that have a calibration of their own: the bodies that bear them, the better set first."""

_F1, _M1, _F2, _M2, _C1, _C2, _YAW1, _YAW2, _BOGIE, _BOGIE_YAW, _BODY = range(len(SIGNALS))
_POWERS = {
    "wheelsets": tuple(range(len(SIGNALS))),
    "bogie": (_F1, _F2, _C1, _BOGIE, _BOGIE_YAW, _BODY),
}
_PAIRS = {
    "wheelsets": ((_F1, _C1), (_F2, _C2), (_M1, _YAW1), (_M2, _YAW2), (_F1, _F2), (_M1, _M2), (_F1, _M1), (_F2, _M2)),
    "bogie": (
        (_F1, _C1),
        (_F2, _C1),
        (_F1, _F2),
        (_F1, _BOGIE_YAW),
        (_F2, _BOGIE_YAW),
        (_BOGIE, _BOGIE_YAW),
        (_BOGIE, _BODY),
        (_C1, _BODY),
    ),
}
BANDS: dict[float, tuple[float, ...]] = {
    10.0: (0.6, 1.1, 1.6, 2.3, 3.2, 4.5, 6.5, 10.0),
    4.0: (0.6, 1.6, 2.6, 3.6, 4.6, 6.6, 10.0),
}
"""By length of the window, s: edges of the bands, Hz."""
SEGMENT = {10.0: 512, 4.0: 256}  # samples of a segment of Welch's method
LEAST = 1e-30  # added to densities, so that a signal of zeros has a logarithm


def names(sensors: str, window: float) -> list[str]:
    """What each feature is."""
    labels = []
    for low, high in _bands(window):
        band = f"{low:g} to {high:g} Hz"
        labels += [f"log density of {SIGNALS[i]}, {band}" for i in _POWERS[sensors]]
        for i, j in _PAIRS[sensors]:
            labels += [f"{part} coherence of {SIGNALS[i]} and {SIGNALS[j]}, {band}" for part in ("real", "imaginary")]
    return labels


def features(signals: np.ndarray, sensors: str, window: float) -> np.ndarray:
    """Features of one window.

    Parameters
    ----------
    signals : by the order of `SIGNALS`, (window * 256, 11). sensors : key of `SETS`. window : s, key of `BANDS`.
    """
    return features_of(signals, [slice(0, len(signals))], sensors, window)[0]


def features_of(signals: np.ndarray, spans: Sequence[slice], sensors: str, window: float) -> np.ndarray:
    """Features of several windows, the places `spans` in the signals, shape (spans, features); as of `features`."""
    segments = Segments(signals, SEGMENT[window], BANDS[window][-1])
    densities = (segments.density(span.start, span.stop) for span in spans)
    return np.stack([_features(segments.frequency, density, sensors, window) for density in densities])


def _features(frequency: np.ndarray, density: np.ndarray, sensors: str, window: float) -> np.ndarray:
    values: list[float] = []
    for low, high in _bands(window):
        band = density[(frequency >= low) & (frequency < high)].mean(axis=0)
        power = np.real(np.diag(band)) + LEAST
        values += [float(np.log(power[i])) for i in _POWERS[sensors]]
        for i, j in _PAIRS[sensors]:
            coherence = band[i, j] / np.sqrt(power[i] * power[j])
            values += [float(coherence.real), float(coherence.imag)]
    return np.array(values)


def windows(count: int, window: float, hop: float) -> list[slice]:
    """Places of windows in a record of `count` samples at 256 Hz."""
    length, step = round(window * RATE), max(1, round(hop * RATE))
    return [slice(start, start + length) for start in range(0, count - length + 1, step)]


def _bands(window: float) -> Sequence[tuple[float, float]]:
    edges = BANDS[window]
    return list(zip(edges[:-1], edges[1:], strict=True))
